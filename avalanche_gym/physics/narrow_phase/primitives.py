"""Which function tests which pair of shapes."""

from __future__ import annotations

from ..jit import kernel
from ..model import BOX, CAPSULE, PLANE, SPHERE
from .box import box_box
from .capsule import capsule_box, capsule_capsule
from .plane import box_plane, capsule_plane, sphere_plane
from .sphere import sphere_box, sphere_capsule, sphere_sphere


@kernel
def collide_primitives(
    shape_a,
    position_a,
    rotation_a,
    size_a,
    shape_b,
    position_b,
    rotation_b,
    size_b,
    margin,
    contacts,
    count,
    scratch,
):
    """Append the contacts closer than ``margin`` [m] of two shapes, shape_a <= shape_b; return the new count.

    Positions [m] in the world, rotations from the shape's frame to the world, sizes as in model.COLLIDER. ``scratch``:
    float64 (polytope.SCRATCH_SHAPE), one a thread. A pair without a function has no contacts.
    """
    if shape_b == PLANE:
        if shape_a == SPHERE:
            return sphere_plane(
                position_a, rotation_a, size_a, position_b, rotation_b, size_b, margin, contacts, count
            )
        if shape_a == CAPSULE:
            return capsule_plane(
                position_a, rotation_a, size_a, position_b, rotation_b, size_b, margin, contacts, count
            )
        if shape_a == BOX:
            return box_plane(
                position_a, rotation_a, size_a, position_b, rotation_b, size_b, margin, contacts, count
            )
    elif shape_a == SPHERE:
        if shape_b == SPHERE:
            return sphere_sphere(
                position_a, rotation_a, size_a, position_b, rotation_b, size_b, margin, contacts, count
            )
        if shape_b == CAPSULE:
            return sphere_capsule(
                position_a, rotation_a, size_a, position_b, rotation_b, size_b, margin, contacts, count
            )
        if shape_b == BOX:
            return sphere_box(
                position_a, rotation_a, size_a, position_b, rotation_b, size_b, margin, contacts, count
            )
    elif shape_a == CAPSULE:
        if shape_b == CAPSULE:
            return capsule_capsule(
                position_a, rotation_a, size_a, position_b, rotation_b, size_b, margin, contacts, count
            )
        if shape_b == BOX:
            return capsule_box(
                position_a, rotation_a, size_a, position_b, rotation_b, size_b, margin, contacts, count
            )
    elif shape_a == BOX and shape_b == BOX:
        return box_box(
            position_a, rotation_a, size_a, position_b, rotation_b, size_b, margin, contacts, count, scratch
        )
    return count
