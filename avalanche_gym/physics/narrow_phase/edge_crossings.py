"""Edges of a terrain across the edges of a box, or across the side of a capsule (feature_contacts.py).

Most pairs are far apart: a bound in the frame of the box tells which of its twelve edges an edge of the terrain may
cross at all, and only these are looked at closely.
"""

from __future__ import annotations

import math

from ..jit import kernel
from ..maths import mat3, vec3
from .terrain_candidates import CROSSING, EDGE_PLACE, add_candidate, feature_of
from .terrain_features import PARALLEL, TILT, into_edge_cone, meet_along
from .terrain_shape import CENTER_ROW, axes_of, axis_of, get, margin_of, radius_of, scale_of
from .triangle import REGION_SLACK

# Edges that overlap by less than this share of the size of the shape have not come through each other: contacts leave
# less. Larger: an edge that has come through has ways out that are none; smaller: what bears may be taken for through.
TOUCHES = 1e-6
# What may come into question at all is told with this much more room, as a share of the lengths in it; but not of edges
# parallel to a sine below the other, whose round-off counts for more.
ROUGH, ALMOST_PARALLEL = 1e-6, 1e-3


@kernel
def depth_in_box(scratch, p):
    """[m] from a point of the terrain to the nearest face of the box around it; 0 outside."""
    r = vec3.sub(p, get(scratch, CENTER_ROW, 0))
    depth = math.inf
    for axis in range(3):
        depth = min(depth, scratch[CENTER_ROW, 3 + axis] - abs(vec3.dot(axis_of(scratch, axis), r)))
    return max(depth, 0.0)


@kernel
def _sides_crossed(x, y, out, half, length, reach):
    """Which edges of a box along its third axis an edge of the terrain may cross, one bit for each of ``sides``.

    All in the frame of the box, its axes turned so that the third one is along the edges: start ``x`` [m], direction
    ``y`` and ``out`` of the edge of the terrain. Seen along the axis this is a line, y (0) and y (1), and the corners
    of a rectangle. Most edges are far off; what is near is told with more room than in ``crossing``, whose normal may
    lean by TILT besides: where it then meets is off by as much of the gap.
    """
    square = y[0] * y[0] + y[1] * y[1]
    sine = math.sqrt(square)
    outward = y[1] * out[0] - y[0] * out[1]
    if half[0] == 0.0 or sine < ALMOST_PARALLEL or abs(outward) <= ROUGH * sine * (abs(out[0]) + abs(out[1])):
        return 15
    # The normal in the plane of the rectangle, times the sine.
    d0 = math.copysign(y[1], y[1] * outward)
    d1 = math.copysign(y[0], -y[0] * outward)
    rough = ROUGH * (half[0] + half[1] + half[2] + length)
    found = 0
    for sides in range(4):
        side_0 = 2.0 * (sides & 1) - 1.0
        side_1 = (sides & 2) - 1.0
        r0 = side_0 * half[0] - x[0]
        r1 = side_1 * half[1] - x[1]
        t = r0 * y[0] + r1 * y[1]
        gap = r0 * d0 + r1 * d1
        room = rough * square + 1.01 * TILT * abs(gap)
        near = (max(side_0 * d0, side_1 * d1) <= 2.01 * TILT * sine) & (gap <= (reach + rough) * sine)
        near &= abs(t - 0.5 * length * square) <= 0.5 * length * square + room
        near &= abs(t * y[2] + x[2] * square) <= half[2] * square + room
        found |= int(near) << sides
    return found


@kernel
def _next(a):
    """The components of a vector, the first one last."""
    return (a[1], a[2], a[0])


@kernel
def may_cross(scratch, row, local, along):
    """Which edges of a box an edge of the terrain may cross: four bits an axis, as in ``_sides_crossed``.

    ``local`` [m], ``along``: start and direction of the edge in the frame of the core.
    """
    half = get(scratch, CENTER_ROW, 3)
    out = mat3.apply_transposed(axes_of(scratch), get(scratch, row + 2, 0))
    length = scratch[row, 7]
    reach = radius_of(scratch) + margin_of(scratch)
    crossed = 0
    for axis in range(3):
        local, along, out, half = _next(local), _next(along), _next(out), _next(half)
        if half[2] > 0.0:
            crossed |= _sides_crossed(local, along, out, half, length, reach) << 4 * axis
    return crossed


@kernel
def crossing(scratch, row, crossed, count):
    """An edge of the terrain across the edges of a box, or across the side of a capsule.

    Both edges must cross, seen along their common normal ``d = +-(e x b)``. ``crossed``: those that may, of may_cross.
    """
    start = get(scratch, row, 1)
    e = get(scratch, row, 4)
    length = scratch[row, 7]
    center = get(scratch, CENTER_ROW, 0)
    half = get(scratch, CENTER_ROW, 3)
    radius = radius_of(scratch)
    margin = margin_of(scratch)
    deepest = -math.inf if radius == 0.0 else -2.0 * radius
    best_gap = -math.inf
    best_axis = -1
    best_d = vec3.ZERO
    # What is apart, or just touches, counts whatever its direction: a ridge may lie under two edges of a box. Of what
    # has come through, first which direction of edges is the way out, then all edges of this direction.
    through = -TOUCHES * scale_of(scratch)
    for attempt in range(2):
        for axis in range(3):
            near = crossed >> 4 * axis & 15
            if near == 0 or (attempt == 1 and axis != best_axis):
                continue
            b = axis_of(scratch, axis)
            d = best_d
            if attempt == 0:
                d = vec3.cross(e, b)
                sine_squared = vec3.norm_squared(d)
                if sine_squared < PARALLEL * PARALLEL:
                    continue
                side = math.copysign(1.0, vec3.dot(d, get(scratch, row + 2, 0)))
                d = vec3.scale(side / math.sqrt(sine_squared), d)
                inside, d = into_edge_cone(scratch, row, d)
                if not inside:
                    continue
            j = (axis + 1) % 3
            k = (axis + 2) % 3
            a_j = axis_of(scratch, j)
            a_k = axis_of(scratch, k)
            slope_j = vec3.dot(a_j, d)
            slope_k = vec3.dot(a_k, d)
            for sides in range(4):
                if not near >> sides & 1:
                    continue
                side_j = 2.0 * (sides & 1) - 1.0
                side_k = (sides & 2) - 1.0
                # The edge must be on the lower side; along an axis without extent there is one side only.
                if half[j] == 0.0:
                    if sides != 0:
                        continue
                elif side_j * slope_j > TILT or side_k * slope_k > TILT:
                    continue
                q = vec3.add_scaled(vec3.add_scaled(center, side_j * half[j], a_j), side_k * half[k], a_k)
                r = vec3.sub(q, start)
                t, u, gap = meet_along(r, e, b, d)
                gap -= radius
                if gap > margin or gap < deepest:
                    continue
                if abs(t - 0.5 * length) > (0.5 + REGION_SLACK) * length or abs(u) > (1.0 + REGION_SLACK) * half[axis]:
                    continue
                foot = vec3.add_scaled(start, t, e)
                if radius == 0.0 and (
                    vec3.dot(vec3.sub(center, foot), d) <= 0.0 or -gap > depth_in_box(scratch, foot) + length
                ):
                    continue
                if (attempt == 1) == (gap < through):
                    feature = feature_of(CROSSING, 4 * axis + sides, EDGE_PLACE, int(scratch[row + 2, 3]))
                    count = add_candidate(scratch, count, vec3.add_scaled(foot, 0.5 * gap, d), d, gap, feature)
                elif attempt == 0 and gap > best_gap:
                    best_gap = gap
                    best_axis = axis
                    best_d = d
        if best_axis < 0:
            break
    return count
