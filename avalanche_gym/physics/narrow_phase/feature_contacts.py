"""Listed edges and vertices of a terrain (terrain_features.py) against a sphere, a capsule and a box.

The normal of every contact is that of a feature of the terrain whose normal cone holds it, exactly; the part of the
box must be its extreme one against that normal. There a part counts as extreme too if it misses by at most ``TILT``,
because a box that rests flat on a ridge needs both ends of its support, and round-off tilts it. In the same way an edge
of the body that lies almost flat on a face needs both ends of what it shares with it, or the contact would jump from
one end to the other as it rocks: where it crosses the border of the face with a normal up to ``TILT`` outside of the
cone, it has a contact there, along the normal of the face.

Where a box has sunk into an edge or a vertex, several pairs of features pass these tests; the one with the least
depth is the way out (the separating-axis rule). A feature beyond the centre is left to the vertices of the box. No way
out is longer than that of the whole feature through the nearest face: a small solid that lies on a large box is not in
it as far as from there to an edge of the box.
"""

from __future__ import annotations

import math

from ..jit import kernel
from ..maths import mat3, vec3
from ..model import BOX, SPHERE
from .edge_crossings import crossing, may_cross
from .terrain_candidates import EDGE_PLACE, POINT, TERRAIN_VERTEX, VERTEX_PLACE, add_candidate, feature_of
from .terrain_features import (
    TILT,
    can_turn_to,
    in_edge_cone,
    in_vertex_cone,
    star_depth,
)
from .terrain_shape import (
    CENTER_ROW,
    CORNER_ROW,
    FIRST_FEATURE_ROW,
    axes_of,
    axis_of,
    get,
    margin_of,
    radius_of,
)
from .triangle import REGION_SLACK

# Faces of a box are the parts 0 to 5 against a vertex of the terrain, its edges and corners this one.
EDGE_PART = 6


@kernel
def _rounded(scratch, row, count):
    """An edge or a vertex of the terrain against a sphere or the ends of a capsule; a vertex against its side too."""
    start = get(scratch, row, 1)
    is_vertex = scratch[row, 0] > 0.0
    center = get(scratch, CENTER_ROW, 0)
    half_length = scratch[CENTER_ROW, 5]
    radius = radius_of(scratch)
    reach = radius + margin_of(scratch)
    axis = axis_of(scratch, 2)
    ends = 2 if half_length > 0.0 else 1
    for end in range(ends + 1):
        # The ends, then the point of the core's line over the vertex.
        along = half_length * (2.0 * end - 1.0)
        if end == ends:
            if not is_vertex or half_length == 0.0:
                break
            along = vec3.dot(vec3.sub(start, center), axis)
            if abs(along) >= half_length:
                break
        p = vec3.add_scaled(center, along, axis)
        foot = start
        if not is_vertex:
            e = get(scratch, row, 4)
            length = scratch[row, 7]
            t = vec3.dot(vec3.sub(p, start), e)
            if abs(t - 0.5 * length) > (0.5 + REGION_SLACK) * length:
                continue
            foot = vec3.add_scaled(start, t, e)
        d = vec3.sub(p, foot)
        square = vec3.norm_squared(d)
        if square == 0.0 or square > reach * reach:
            continue
        distance = math.sqrt(square)
        d = vec3.scale(1.0 / distance, d)
        feature = feature_of(POINT, 4 * end, EDGE_PLACE, int(scratch[row + 2, 3]))
        if end == ends:
            feature = feature_of(TERRAIN_VERTEX, 0, VERTEX_PLACE, int(scratch[row, 7]))
        elif is_vertex:
            feature = feature_of(POINT, 4 * end, VERTEX_PLACE, int(scratch[row, 7]))
        if end < ends and half_length > 0.0 and vec3.dot(d, axis) * along > TILT * half_length:
            # The end of a capsule owns only what lies beyond it.
            continue
        gap = distance - radius
        in_cone = in_edge_cone(scratch, row, d)
        if is_vertex:
            in_cone = in_vertex_cone(scratch, row, d, can_turn_to(scratch, gap, REGION_SLACK))
        if in_cone:
            count = add_candidate(scratch, count, vec3.add_scaled(foot, 0.5 * gap, d), d, gap, feature)
    return count


@kernel
def _beside_corner(scratch, row, local, along, count):
    """An edge of the terrain that passes by a corner of a box: each is the nearest part of the other.

    ``local`` [m], ``along``: start and direction of the edge in the frame of the box.
    """
    length = scratch[row, 7]
    half = get(scratch, CENTER_ROW, 3)
    # Only beyond all three faces of a corner is the corner nearest.
    for axis in range(3):
        farthest = max(abs(local[axis]), abs(local[axis] + length * along[axis]))
        if farthest < half[axis] * (1.0 - REGION_SLACK):
            return count
    start = get(scratch, row, 1)
    e = get(scratch, row, 4)
    margin = margin_of(scratch)
    center = get(scratch, CENTER_ROW, 0)
    for number in range(CORNER_ROW, CORNER_ROW + 8):
        p = get(scratch, number, 0)
        t = vec3.dot(vec3.sub(p, start), e)
        foot = vec3.add_scaled(start, t, e)
        d = vec3.sub(p, foot)
        square = vec3.norm_squared(d)
        if square > margin * margin or square == 0.0 or abs(t - 0.5 * length) > (0.5 + REGION_SLACK) * length:
            continue
        beyond = True
        for axis in range(3):
            a = axis_of(scratch, axis)
            outward = math.copysign(1.0, vec3.dot(a, vec3.sub(p, center)))
            beyond &= outward * vec3.dot(a, d) <= 0.0
        gap = math.sqrt(square)
        d = vec3.scale(1.0 / gap, d)
        if beyond and in_edge_cone(scratch, row, d):
            position = vec3.add_scaled(foot, 0.5 * gap, d)
            feature = feature_of(POINT, int(scratch[number, 3]), EDGE_PLACE, int(scratch[row + 2, 3]))
            count = add_candidate(scratch, count, position, d, gap, feature)
    return count


@kernel
def _beside_box(scratch, row, x, gaps, count):
    """A vertex of the terrain outside a box, with an edge or a corner of the box nearest to it.

    x is the vertex in the frame of the box, ``gaps`` its distances from the faces.
    """
    d = vec3.ZERO
    for k in range(3):
        d = vec3.add_scaled(d, -math.copysign(max(gaps[k], 0.0), x[k]), axis_of(scratch, k))
    gap = vec3.norm(d)
    d = vec3.scale(1.0 / gap, d)
    if gap > margin_of(scratch) or not in_vertex_cone(scratch, row, d, can_turn_to(scratch, gap, REGION_SLACK)):
        return count
    feature = feature_of(TERRAIN_VERTEX, EDGE_PART, VERTEX_PLACE, int(scratch[row, 7]))
    position = vec3.add_scaled(get(scratch, row, 1), 0.5 * gap, d)
    return add_candidate(scratch, count, position, d, gap, feature)


@kernel
def _under_box(scratch, row, count):
    """A vertex of the terrain against a box: the part nearest to it, or the face through which it leaves soonest."""
    v = get(scratch, row, 1)
    half = get(scratch, CENTER_ROW, 3)
    r = vec3.sub(v, get(scratch, CENTER_ROW, 0))
    x = (vec3.dot(axis_of(scratch, 0), r), vec3.dot(axis_of(scratch, 1), r), vec3.dot(axis_of(scratch, 2), r))
    gaps = (abs(x[0]) - half[0], abs(x[1]) - half[1], abs(x[2]) - half[2])
    if max(gaps[0], gaps[1], gaps[2]) > margin_of(scratch):
        return count
    outside = 0
    for k in range(3):
        outside += gaps[k] > REGION_SLACK * half[k]
    if outside > 1:
        return _beside_box(scratch, row, x, gaps, count)
    refused = 0
    # Through a nearer face, which the cone refuses, the edges of the vertex leave the box sooner than this deep.
    limit = math.inf
    for _ in range(3):
        axis = -1
        for k in range(3):
            if not refused >> k & 1 and (axis < 0 or gaps[k] > gaps[axis] + REGION_SLACK * half[k]):
                axis = k
        refused |= 1 << axis
        side = math.copysign(1.0, x[axis])
        d = vec3.scale(-side, axis_of(scratch, axis))
        slack = can_turn_to(scratch, gaps[axis], TILT)
        if -gaps[axis] > limit:
            return count
        if (outside == 1 and gaps[axis] < 0.0) or not in_vertex_cone(scratch, row, d, slack):
            limit = min(limit, star_depth(scratch, row, d) - gaps[axis])
            continue
        part = 2 * axis + (1 if side > 0.0 else 0)
        feature = feature_of(TERRAIN_VERTEX, part, VERTEX_PLACE, int(scratch[row, 7]))
        return add_candidate(scratch, count, vec3.add_scaled(v, 0.5 * gaps[axis], d), d, gaps[axis], feature)
    return count


@kernel
def collide_features(scratch, end, shape, count):
    """Contacts of the listed features, up to row ``end``, with the shape; return the new count of candidates."""
    row = FIRST_FEATURE_ROW
    center = get(scratch, CENTER_ROW, 0)
    axes = axes_of(scratch)
    while row < end:
        spokes = int(scratch[row, 0])
        if shape != BOX:
            count = _rounded(scratch, row, count)
        elif spokes > 0:
            count = _under_box(scratch, row, count)
        if spokes == 0 and shape != SPHERE:
            local = mat3.apply_transposed(axes, vec3.sub(get(scratch, row, 1), center))
            along = mat3.apply_transposed(axes, get(scratch, row, 4))
            crossed = may_cross(scratch, row, local, along)
            if crossed > 0:
                count = crossing(scratch, row, crossed, count)
            if shape == BOX:
                count = _beside_corner(scratch, row, local, along, count)
        row += 1 + spokes if spokes > 0 else 3
    return count
