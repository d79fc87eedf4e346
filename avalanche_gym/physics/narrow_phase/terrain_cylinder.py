"""A cylinder against the edges and vertices of a terrain that stick out.

Which part of a cylinder meets an edge with unit direction e follows from where its axis a points:

* *its side*, across the edge: the normal is e x a, and both lines must cross;
* *a cap*, flat on the edge: the normal is that of the cap, and the contacts are where the edge crosses the rim;
* *both rims*, where the cylinder lies along the edge: each end has the normal from the edge to its centre;
* *one rim* otherwise. With the normal d(angle) in the edge's cone and the cylinder's support point q against it, the
  gap is s(angle) = d . (q - start), and s' = d' . (q - start) because q is a support point. The normal is where s' goes
  from positive to negative: the closest points where both are apart, the least depth where they overlap by less than
  the rim's radius of curvature. If it does not, the largest gap is that of a face.

A vertex has the normal of the cylinder's surface next to it, if that lies in the vertex's cone.
"""

from __future__ import annotations

import math

from ..jit import kernel
from ..maths import vec3
from .cylinder import point_cylinder
from .terrain_candidates import (
    CROSSING,
    EDGE_PLACE,
    POINT,
    TERRAIN_VERTEX,
    VERTEX_PLACE,
    add_candidate,
    feature_of,
)
from .terrain_features import TILT, can_turn_to, counts_there, in_edge_cone, in_vertex_cone, into_edge_cone, meet_along
from .terrain_shape import CENTER_ROW, FIRST_FEATURE_ROW, axis_of, get, in_frame, margin_of, put_core, set_girth
from .triangle import REGION_SLACK

# Parts of a cylinder against vertices of the terrain: its caps are 0 and 1.
SIDE_PART, RIM_PART = 2, 3
# Parts in crossings with edges: where an edge enters and leaves a cap (0 to 3), then the side.
SIDE_CROSSING = 4

# Widest angle [rad] of a normal from the middle of an edge's cone.
WIDEST = 1.5707
# Bisection, or better, down to round-off of an angle.
MOST_HALVINGS = 60
SAME_ANGLE = 1e-14
# A support point is a whole side or cap, and not one of the rim, if the normal is this close to one across or along
# the axis, as a cosine.
WHOLE = 1e-9


@kernel
def put_cylinder(size, position_a, rotation_a, position_b, rotation_b, margin, scratch):
    """Describe a cylinder (radius, half length) in the scratch table; return its place in the terrain's frame."""
    center, axes = in_frame(position_a, rotation_a, position_b, rotation_b)
    put_core(center, axes, (size[0], size[0], size[1]), 0.0, margin, scratch)
    set_girth(size[0], scratch)
    return center, axes


@kernel
def _within(t, length):
    return abs(t - 0.5 * length) <= (0.5 + REGION_SLACK) * length


@kernel
def _rim_point(center, axis, radius, half_length, d):
    """The point of the cylinder farthest against d, of a rim if it is one point; and the end, 0 at -z."""
    along = vec3.dot(d, axis)
    end = 0 if along > 0.0 else 1
    across = vec3.add_scaled(d, -along, axis)
    length = math.sqrt(vec3.norm_squared(across))
    q = vec3.add_scaled(center, -half_length if end == 0 else half_length, axis)
    if length > 0.0:
        q = vec3.add_scaled(q, -radius / length, across)
    return q, end


@kernel
def _is_way_out(scratch, row, foot, gap):
    """Whether a part is no deeper in an edge than the whole edge is in the cylinder, by the nearest surface: a small
    solid on a wide cap is not in its side.
    """
    if gap >= 0.0:
        return True
    r = vec3.sub(foot, get(scratch, CENTER_ROW, 0))
    local = (vec3.dot(r, axis_of(scratch, 0)), vec3.dot(r, axis_of(scratch, 1)), vec3.dot(r, axis_of(scratch, 2)))
    distance, _ = point_cylinder(local, scratch[CENTER_ROW, 3], scratch[CENTER_ROW, 5])
    return -gap <= max(-distance, 0.0) + scratch[row, 7]


@kernel
def _put_point(scratch, row, q, d, end, count):
    """The contact of point q of the cylinder with an edge along d, if it lies beside the edge and in its cone."""
    start = get(scratch, row, 1)
    e = get(scratch, row, 4)
    r = vec3.sub(q, start)
    t = vec3.dot(r, e)
    gap = vec3.dot(r, d)
    foot = vec3.add_scaled(start, t, e)
    beyond = vec3.dot(vec3.sub(get(scratch, CENTER_ROW, 0), foot), d)
    if (
        gap > margin_of(scratch)
        or beyond <= 0.0
        or not _within(t, scratch[row, 7])
        or not in_edge_cone(scratch, row, d)
        or not _is_way_out(scratch, row, foot, gap)
    ):
        return count
    feature = feature_of(POINT, end, EDGE_PLACE, int(scratch[row + 2, 3]))
    return add_candidate(scratch, count, vec3.add_scaled(foot, 0.5 * gap, d), d, gap, feature)


@kernel
def _both_rims(scratch, row, radius, half_length, count):
    """A cylinder along an edge: a contact at each end."""
    start = get(scratch, row, 1)
    e = get(scratch, row, 4)
    center = get(scratch, CENTER_ROW, 0)
    axis = axis_of(scratch, 2)
    for end in range(2):
        middle = vec3.add_scaled(center, half_length if end == 1 else -half_length, axis)
        d = vec3.sub(middle, start)
        d = vec3.add_scaled(d, -vec3.dot(d, e), e)
        length = math.sqrt(vec3.norm_squared(d))
        if length > 0.0:
            d = vec3.scale(1.0 / length, d)
            across = vec3.add_scaled(d, -vec3.dot(d, axis), axis)
            q = vec3.add_scaled(middle, -radius / math.sqrt(vec3.norm_squared(across)), across)
            count = _put_point(scratch, row, q, d, end, count)
    return count


@kernel
def _side(scratch, row, radius, half_length, count):
    """The side across an edge; the new count, and whether they touch."""
    start = get(scratch, row, 1)
    e = get(scratch, row, 4)
    axis = axis_of(scratch, 2)
    center = get(scratch, CENTER_ROW, 0)
    d = vec3.cross(e, axis)
    sine_squared = vec3.norm_squared(d)
    d = vec3.scale(math.copysign(1.0, vec3.dot(d, get(scratch, row + 2, 0))) / math.sqrt(sine_squared), d)
    inside, d = into_edge_cone(scratch, row, d)
    if not inside:
        return count, False
    t, u, gap = meet_along(vec3.sub(center, start), e, axis, d)
    gap -= radius
    if gap > margin_of(scratch):
        return count, False
    foot = vec3.add_scaled(start, t, e)
    if (
        abs(u) > (1.0 + REGION_SLACK) * half_length
        or not counts_there(scratch, row, t, gap)
        or vec3.dot(vec3.sub(center, foot), d) <= 0.0
        or not _is_way_out(scratch, row, foot, gap)
    ):
        return count, False
    feature = feature_of(CROSSING, SIDE_CROSSING, EDGE_PLACE, int(scratch[row + 2, 3]))
    return add_candidate(scratch, count, vec3.add_scaled(foot, 0.5 * gap, d), d, gap, feature), True


@kernel
def _cap(scratch, row, radius, half_length, count):
    """An edge across a cap that lies flat on it; the new count, and whether the edge is in reach of the cap."""
    start = get(scratch, row, 1)
    e = get(scratch, row, 4)
    axis = axis_of(scratch, 2)
    center = get(scratch, CENTER_ROW, 0)
    slope = vec3.dot(e, axis)
    d = vec3.normalize(vec3.add_scaled(axis, -slope, e))
    sense = math.copysign(1.0, vec3.dot(d, get(scratch, row + 2, 0)))
    inside, d = into_edge_cone(scratch, row, vec3.scale(sense, d))
    if not inside:
        return count, False
    # The edge seen along the axis, from the middle of the cap that looks at it.
    middle = vec3.add_scaled(center, -sense * half_length, axis)
    r = vec3.sub(start, middle)
    height = vec3.dot(r, axis)
    across = vec3.add_scaled(r, -height, axis)
    b = vec3.dot(across, e)
    stretch = 1.0 - slope * slope
    room = b * b - stretch * (vec3.norm_squared(across) - radius * radius)
    if room <= 0.0:
        return count, False
    end = 0 if sense > 0.0 else 1
    for crossing in range(2):
        t = (-b + (math.sqrt(room) if crossing == 1 else -math.sqrt(room))) / stretch
        gap = -(height + t * slope) * sense / math.sqrt(stretch)
        if gap <= margin_of(scratch) and gap > -half_length and _within(t, scratch[row, 7]):
            feature = feature_of(CROSSING, 2 * end + crossing, EDGE_PLACE, int(scratch[row + 2, 3]))
            foot = vec3.add_scaled(start, t, e)
            count = add_candidate(scratch, count, vec3.add_scaled(foot, 0.5 * gap, d), d, gap, feature)
    return count, True


@kernel
def _limits(scratch, row, x, y):
    """Least and largest angle [rad] of the edge's cone about x, towards y."""
    low = -WIDEST
    high = WIDEST
    for face in range(2):
        m = get(scratch, row + 1, 3 * face)
        rate = vec3.dot(m, y)
        bound = math.atan2(-vec3.dot(m, x) * math.copysign(1.0, rate), abs(rate))
        if rate > 0.0:
            high = min(high, bound)
        elif rate < 0.0:
            low = max(low, bound)
    return low, high


@kernel
def _one_rim(scratch, row, radius, half_length, count):
    """A rim against an edge, by the angle of the normal in the edge's cone."""
    start = get(scratch, row, 1)
    e = get(scratch, row, 4)
    axis = axis_of(scratch, 2)
    center = get(scratch, CENTER_ROW, 0)
    x = get(scratch, row + 2, 0)
    x = vec3.add_scaled(x, -vec3.dot(x, e), e)
    length = math.sqrt(vec3.norm_squared(x))
    if length == 0.0:
        return count
    x = vec3.scale(1.0 / length, x)
    y = vec3.cross(e, x)
    low, high = _limits(scratch, row, x, y)
    if low >= high:
        return count
    rate_low = 0.0
    rate_high = 0.0
    angle = low
    d = x
    q = center
    end = 0
    for turn in range(MOST_HALVINGS):
        if turn == 1:
            angle = high
        elif turn > 1:
            # False position, every third time a halving: it ends early where s' is smooth, and always ends.
            angle = 0.5 * (low + high)
            if turn % 3 != 0 and rate_low > rate_high:
                angle = low + (high - low) * rate_low / (rate_low - rate_high)
        cosine = math.cos(angle)
        sine = math.sin(angle)
        d = vec3.add_scaled(vec3.scale(cosine, x), sine, y)
        q, end = _rim_point(center, axis, radius, half_length, d)
        rate = vec3.dot(vec3.sub(q, start), vec3.add_scaled(vec3.scale(-sine, x), cosine, y))
        if turn == 0:
            rate_low = rate
            if rate <= 0.0:
                return count
        elif turn == 1:
            rate_high = rate
            if rate >= 0.0:
                return count
        elif rate > 0.0:
            low, rate_low = angle, rate
        else:
            high, rate_high = angle, rate
        if turn > 1 and (high - low <= SAME_ANGLE or rate == 0.0):
            break
    along = abs(vec3.dot(d, axis))
    if along <= WHOLE or 1.0 - along <= 0.5 * WHOLE * WHOLE:
        return count
    return _put_point(scratch, row, q, d, end, count)


@kernel
def _vertex(scratch, row, radius, half_length, count):
    v = get(scratch, row, 1)
    r = vec3.sub(v, get(scratch, CENTER_ROW, 0))
    local = (vec3.dot(r, axis_of(scratch, 0)), vec3.dot(r, axis_of(scratch, 1)), vec3.dot(r, axis_of(scratch, 2)))
    gap, outward = point_cylinder(local, radius, half_length)
    if gap > margin_of(scratch):
        return count
    for attempt in range(2):
        if attempt == 1:
            # Inside, and the nearest surface is no way out: the other one.
            across = math.sqrt(local[0] * local[0] + local[1] * local[1])
            if gap > 0.0 or across == 0.0:
                break
            if outward[2] == 0.0:
                gap, outward = abs(local[2]) - half_length, (0.0, 0.0, math.copysign(1.0, local[2]))
            else:
                gap, outward = across - radius, (local[0] / across, local[1] / across, 0.0)
        d = vec3.scale(-outward[0], axis_of(scratch, 0))
        d = vec3.add_scaled(vec3.add_scaled(d, -outward[1], axis_of(scratch, 1)), -outward[2], axis_of(scratch, 2))
        on_cap = abs(outward[2]) == 1.0
        slack = can_turn_to(scratch, gap, TILT if on_cap else REGION_SLACK)
        if in_vertex_cone(scratch, row, d, slack):
            part = RIM_PART
            if on_cap:
                part = 1 if outward[2] > 0.0 else 0
            elif outward[2] == 0.0:
                part = SIDE_PART
            feature = feature_of(TERRAIN_VERTEX, part, VERTEX_PLACE, int(scratch[row, 7]))
            return add_candidate(scratch, count, vec3.add_scaled(v, 0.5 * gap, d), d, gap, feature)
    return count


@kernel
def _in_reach(scratch, row, slope, radius, half_length):
    """Whether an edge may come within the margin of the cylinder, by the ball around its middle."""
    half_edge = 0.5 * scratch[row, 7]
    axis = axis_of(scratch, 2)
    r = vec3.sub(vec3.add_scaled(get(scratch, row, 1), half_edge, get(scratch, row, 4)), get(scratch, CENTER_ROW, 0))
    along = vec3.dot(r, axis)
    margin = margin_of(scratch)
    wide = radius + margin + half_edge
    return (
        abs(along) <= half_length + margin + half_edge * slope and vec3.norm_squared(r) - along * along <= wide * wide
    )


@kernel
def cylinder_features(scratch, end, radius, half_length, count):
    """Contacts of the listed features, up to row ``end``, with a cylinder; return the new count of candidates."""
    axis = axis_of(scratch, 2)
    row = FIRST_FEATURE_ROW
    while row < end:
        spokes = int(scratch[row, 0])
        if spokes > 0:
            count = _vertex(scratch, row, radius, half_length, count)
            row += 1 + spokes
            continue
        slope = abs(vec3.dot(get(scratch, row, 4), axis))
        if not _in_reach(scratch, row, slope, radius, half_length):
            row += 3
            continue
        if 1.0 - slope <= 0.5 * TILT * TILT:
            count = _both_rims(scratch, row, radius, half_length, count)
        else:
            count, done = _side(scratch, row, radius, half_length, count)
            if not done and slope <= TILT:
                count, done = _cap(scratch, row, radius, half_length, count)
            if not done:
                count = _one_rim(scratch, row, radius, half_length, count)
        row += 3
    return count
