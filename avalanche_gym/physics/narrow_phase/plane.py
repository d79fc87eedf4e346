"""Sphere, capsule and box against a plane: z = 0 of the plane's frame, solid below.

Gaps are heights over the plane; the normal, from the shape to the plane, is the plane's downward one.
"""

from __future__ import annotations

import numpy as np

from ..jit import kernel
from ..maths import mat3, vec3
from .manifold import emit
from .sphere import ONLY

# A face must look at the plane more squarely than an earlier one by this much, as a difference of cosines, to be taken
# instead: keeps the choice from flipping with round-off. Both faces share the lowest edge, so no contact is lost.
FACE_BIAS = 1e-9


@kernel
def emit_above_plane(point, radius, height, up, margin, feature, contacts, count):
    """The contact of a ball of ``radius`` (0: a vertex) whose centre is ``height`` above the plane; the new count."""
    gap = height - radius
    if gap > margin:
        return count
    down = vec3.neg(up)
    return emit(contacts, count, vec3.add_scaled(point, radius + 0.5 * gap, down), down, gap, feature)


@kernel
def sphere_plane(position_a, rotation_a, size_a, position_b, rotation_b, size_b, margin, contacts, count):
    """One contact."""
    up = mat3.column(rotation_b, 2)
    height = vec3.dot(up, vec3.sub(position_a, position_b))
    return emit_above_plane(position_a, size_a[0], height, up, margin, np.int64(ONLY), contacts, count)


@kernel
def capsule_plane(position_a, rotation_a, size_a, position_b, rotation_b, size_b, margin, contacts, count):
    """A contact below each end: feature 0 at -half_length, 1 at +half_length."""
    up = mat3.column(rotation_b, 2)
    axis = mat3.column(rotation_a, 2)
    height = vec3.dot(up, vec3.sub(position_a, position_b))
    rise = vec3.dot(up, axis)
    for end in range(2):
        along = size_a[1] if end == 1 else -size_a[1]
        point = vec3.add_scaled(position_a, along, axis)
        count = emit_above_plane(point, size_a[0], height + along * rise, up, margin, end, contacts, count)
    return count


@kernel
def box_plane(position_a, rotation_a, size_a, position_b, rotation_b, size_b, margin, contacts, count):
    """A contact below each corner of the face that looks down; the feature is the number of the corner.

    Corner bits: 1 for +x, 2 for +y, 4 for +z of the box.
    """
    up = mat3.column(rotation_b, 2)
    height = vec3.dot(up, vec3.sub(position_a, position_b))
    rise = mat3.apply_transposed(rotation_a, up)
    reach = abs(rise[0]) * size_a[0] + abs(rise[1]) * size_a[1] + abs(rise[2]) * size_a[2]
    if height - reach > margin:
        return count
    face = 0
    if abs(rise[1]) > abs(rise[0]) + FACE_BIAS:
        face = 1
    if abs(rise[2]) > max(abs(rise[0]), abs(rise[1])) + FACE_BIAS:
        face = 2
    bit = 1 << face
    lower = 0 if rise[face] > 0.0 else bit
    for corner in range(8):
        if corner & bit == lower:
            local = (
                size_a[0] if corner & 1 else -size_a[0],
                size_a[1] if corner & 2 else -size_a[1],
                size_a[2] if corner & 4 else -size_a[2],
            )
            point = vec3.add(position_a, mat3.apply(rotation_a, local))
            rises = height + vec3.dot(rise, local)
            count = emit_above_plane(point, 0.0, rises, up, margin, corner, contacts, count)
    return count
