"""The distance of two boxes that are apart, exact, by the features that can be closest.

Closest points lie on a vertex of one box and anywhere on the other, or inside two crossing edges. The first kind is 16
clamped points. Of the second, for each of the 9 pairs of directions only the supporting edges along their common normal
can be closest.
"""

from __future__ import annotations

import math

import numpy as np

from ..jit import kernel
from ..maths import mat3, vec3
from .segment import closest_parameters
from .sphere import nearest_in_box

# Codes of the closest pair: 0 to 7 a corner of b, 8 to 15 a corner of a, from here on edges i, j: 16 + 3 i + j.
EDGE_PAIR = 16

# Edges whose cross product is shorter count as parallel; then a vertex is as close, within this fraction of the size.
PARALLEL_EDGES = 1e-10


@kernel
def corner(half, number):
    """Corner of a box about the origin; bits 1, 2, 4 of its number for +x, +y, +z."""
    return (
        half[0] if number & 1 else -half[0],
        half[1] if number & 2 else -half[1],
        half[2] if number & 4 else -half[2],
    )


@kernel
def edge_center(half, direction, axis):
    """Middle of the edge along ``axis`` that lies furthest in a direction, in the box frame."""
    return (
        0.0 if axis == 0 else math.copysign(half[0], direction[0]),
        0.0 if axis == 1 else math.copysign(half[1], direction[1]),
        0.0 if axis == 2 else math.copysign(half[2], direction[2]),
    )


@kernel
def _corners_to_box(offset, rotation, half, other_half, best, code, first_code):
    """Try the corners of a box placed by (offset, rotation) in the frame of another one; squared distance and code."""
    for number in range(8):
        point = vec3.add(offset, mat3.apply(rotation, corner(half, number)))
        distance_squared = vec3.norm_squared(vec3.sub(point, nearest_in_box(point, other_half)))
        if distance_squared < best:
            best, code = distance_squared, first_code + number
    return best, code


@kernel
def _edges(offset, rotation, half_a, half_b, i, j):
    """Closest points (in the frame of a) of the supporting edges i and j, and whether they are inside both."""
    axis_a = vec3.along(i)
    axis_b = mat3.column(rotation, j)
    normal = vec3.cross(axis_a, axis_b)
    if vec3.norm_squared(normal) <= PARALLEL_EDGES * PARALLEL_EDGES:
        return offset, offset, False
    if vec3.dot(normal, offset) < 0.0:
        normal = vec3.neg(normal)
    center_a = edge_center(half_a, normal, i)
    support_b = edge_center(half_b, mat3.apply_transposed(rotation, normal), j)
    center_b = vec3.sub(offset, mat3.apply(rotation, support_b))
    between = vec3.sub(center_b, center_a)
    if vec3.dot(normal, between) <= 0.0:
        return offset, offset, False
    s, t = closest_parameters(between, axis_a, half_a[i], axis_b, half_b[j])
    return vec3.add_scaled(center_a, s, axis_a), vec3.add_scaled(center_b, t, axis_b), True


@kernel
def separated_boxes(offset, rotation, half_a, half_b):
    """Closest points of two boxes that don't overlap, both in the frame of a, and the code of the pair.

    ``offset``, ``rotation``: b in the frame of a.
    """
    back = mat3.transpose(rotation)
    offset_back = vec3.neg(mat3.apply(back, offset))
    best, code = _corners_to_box(offset, rotation, half_b, half_a, math.inf, np.int64(0), np.int64(0))
    best, code = _corners_to_box(offset_back, back, half_a, half_b, best, code, np.int64(8))
    for pair in range(9):
        point_a, point_b, valid = _edges(offset, rotation, half_a, half_b, pair // 3, pair % 3)
        if valid:
            distance_squared = vec3.norm_squared(vec3.sub(point_b, point_a))
            if distance_squared < best:
                best, code = distance_squared, EDGE_PAIR + pair
    if code >= EDGE_PAIR:
        point_a, point_b, _ = _edges(offset, rotation, half_a, half_b, (code - EDGE_PAIR) // 3, (code - EDGE_PAIR) % 3)
        return point_a, point_b, code
    if code >= 8:
        point_a = corner(half_a, code - 8)
        local = vec3.add(offset_back, mat3.apply(back, point_a))
        return point_a, vec3.add(offset, mat3.apply(rotation, nearest_in_box(local, half_b))), code
    point_b = vec3.add(offset, mat3.apply(rotation, corner(half_b, code)))
    return nearest_in_box(point_b, half_a), point_b, code
