"""Edges of two boxes: where they cross, and where they lie side by side."""

from __future__ import annotations

import math

from ..jit import kernel
from ..maths import mat3, vec3
from .box_distance import edge_center
from .box_faces import PAIR_FEATURES
from .manifold import emit
from .polytope import AS_CLOSE
from .segment import closest_parameters, stretch_ends
from .sphere import point_box

# Closest pairs nearer than this fraction of the pair's size have no direction; the separating axis gives the normal.
PAIR_TOUCHES = 1e-12

# Sine of the angle between edges, and between edge and normal, up to which edges count as side by side.
SIDE_BY_SIDE = 0.05

# Features beyond those of closest pairs: the ends of edges side by side.
END_FEATURES = PAIR_FEATURES + 4096


@kernel
def side_by_side(position_a, rotation_a, half_a, rotation_b, half_b, r, normal, margin, contacts, count):
    """Contacts at both ends of the common stretch of two nearly parallel edges; the new count and the smaller gap.

    Each end is a corner of one box, whose contact with the other box has its own exact normal and gap. No contact and
    an infinite gap if there are no such edges. ``r``: centre of b seen from a.
    """
    least = math.inf
    touch = PAIR_TOUCHES * (half_a[0] + half_a[1] + half_a[2] + half_b[0] + half_b[1] + half_b[2])
    local_a = mat3.apply_transposed(rotation_a, normal)
    local_b = mat3.apply_transposed(rotation_b, normal)
    for pair in range(9):
        i, j = pair // 3, pair % 3
        axis_a = mat3.column(rotation_a, i)
        axis_b = mat3.column(rotation_b, j)
        cosine = vec3.dot(axis_a, axis_b)
        if max(abs(local_a[i]), abs(local_b[j]), math.sqrt(max(0.0, 1.0 - cosine * cosine))) < SIDE_BY_SIDE:
            center_a = mat3.apply(rotation_a, edge_center(half_a, local_a, i))
            center_b = vec3.sub(r, mat3.apply(rotation_b, edge_center(half_b, local_b, j)))
            lower, upper = stretch_ends(vec3.dot(axis_a, vec3.sub(center_b, center_a)), half_a[i], cosine, half_b[j])
            for end in range(2):
                limit = upper if end == 1 else lower
                if abs(limit) < half_a[i]:
                    side = half_b[j] if (end == 1) == (cosine > 0.0) else -half_b[j]
                    point = vec3.add_scaled(center_b, side, axis_b)
                    gap, outward = point_box(mat3.apply_transposed(rotation_a, point), half_a)
                    direction = mat3.apply(rotation_a, outward)
                    point = vec3.add_scaled(point, -0.5 * gap, direction)
                else:
                    point = vec3.add_scaled(center_a, limit, axis_a)
                    gap, outward = point_box(mat3.apply_transposed(rotation_b, vec3.sub(point, r)), half_b)
                    direction = vec3.neg(mat3.apply(rotation_b, outward))
                    point = vec3.add_scaled(point, 0.5 * gap, direction)
                if lower < upper and gap <= margin:
                    least = min(least, gap)
                    if gap <= touch:
                        direction = normal
                    count = emit(
                        contacts, count, vec3.add(position_a, point), direction, gap, END_FEATURES + pair * 2 + end
                    )
    return count, least


@kernel
def edge_crossing(rotation_a, half_a, rotation_b, half_b, r, pair, sense_of):
    """Normal, signed gap and points (seen from a's centre) of the supporting edges i, j of pair = 3 i + j.

    The last value tells whether the lines are closest within both edges. ``sense_of``: the normal's half space.
    """
    i, j = pair // 3, pair % 3
    axis_a, axis_b = mat3.column(rotation_a, i), mat3.column(rotation_b, j)
    normal = vec3.normalize(vec3.cross(axis_a, axis_b))
    if vec3.dot(normal, sense_of) < 0.0:
        normal = vec3.neg(normal)
    center_a = mat3.apply(rotation_a, edge_center(half_a, mat3.apply_transposed(rotation_a, normal), i))
    center_b = mat3.apply(rotation_b, edge_center(half_b, mat3.apply_transposed(rotation_b, normal), j))
    center_b = vec3.sub(r, center_b)
    between = vec3.sub(center_b, center_a)
    s, t = closest_parameters(between, axis_a, half_a[i], axis_b, half_b[j])
    point_a, point_b = vec3.add_scaled(center_a, s, axis_a), vec3.add_scaled(center_b, t, axis_b)
    gap = vec3.dot(normal, between)
    # Within both edges the connecting vector is the normal times the gap; at an end it is longer.
    slip = vec3.add_scaled(vec3.sub(point_b, point_a), -gap, normal)
    size = half_a[i] + half_b[j]
    crosses = vec3.norm_squared(slip) <= (AS_CLOSE * size) ** 2
    return normal, gap, point_a, point_b, crosses
