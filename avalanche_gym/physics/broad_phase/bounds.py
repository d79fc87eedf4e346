"""Axis-aligned boxes that hold a body through the whole step."""

from __future__ import annotations

import math

from ..jit import kernel
from ..maths import mat3, quat, vec3
from ..memory import height_field_of
from ..model import (
    BOX,
    CAPSULE,
    CYLINDER,
    HEIGHT_FIELD,
    PLANE,
    SMOOTH_FIELD,
)

UNBOUNDED = (math.inf, math.inf, math.inf)


@kernel
def collider_box(header, collider, center, rotation):
    """Bounds (low, high) [m] of a collider; its body's principal frame is at ``center`` with ``rotation`` (9)."""
    middle = vec3.add(center, mat3.apply(rotation, vec3.load(collider.position)))
    own = rotation
    q = collider.orientation
    if q[1] != 0.0 or q[2] != 0.0 or q[3] != 0.0:
        own = mat3.multiply(rotation, quat.to_matrix(quat.load(collider.orientation)))
    shape = collider.shape
    if shape == PLANE:
        return vec3.neg(UNBOUNDED), UNBOUNDED
    if shape == HEIGHT_FIELD or shape == SMOOTH_FIELD:
        # Solid below without a bottom: a column from minus infinity up to the highest sample.
        field = height_field_of(header, collider.data)
        half = (0.5 * field.extent[0], 0.5 * field.extent[1], 0.0)
        reach = _extent(own, half)
        up = mat3.column(own, 2)
        top = vec3.scale(field.highest, up)
        low = vec3.sub(vec3.add(middle, top), reach)
        high = vec3.add(vec3.add(middle, top), reach)
        return (
            (_open(low[0], up[0]), _open(low[1], up[1]), _open(low[2], up[2])),
            (_open_above(high[0], up[0]), _open_above(high[1], up[1]), _open_above(high[2], up[2])),
        )
    if shape == BOX:
        reach = _extent(own, vec3.load(collider.size))
    elif shape == CAPSULE or shape == CYLINDER:
        axis = vec3.scale(collider.size[1], mat3.column(own, 2))
        radius = collider.size[0]
        reach = (abs(axis[0]) + radius, abs(axis[1]) + radius, abs(axis[2]) + radius)
    else:
        reach = (collider.radius, collider.radius, collider.radius)
    return vec3.sub(middle, reach), vec3.add(middle, reach)


@kernel
def _open(low, up):
    """The solid goes down without end, along minus ``up``."""
    return -math.inf if up > 0.0 else low


@kernel
def _open_above(high, up):
    return math.inf if up < 0.0 else high


@kernel
def _extent(rotation, half):
    """Half extents along the world axes of a box of half extents ``half``."""
    return (
        abs(rotation[0]) * half[0] + abs(rotation[1]) * half[1] + abs(rotation[2]) * half[2],
        abs(rotation[3]) * half[0] + abs(rotation[4]) * half[1] + abs(rotation[5]) * half[2],
        abs(rotation[6]) * half[0] + abs(rotation[7]) * half[1] + abs(rotation[8]) * half[2],
    )


@kernel
def swept_box(header, colliders, body, start, end, turned, slack, box):
    """Write the bounds of a body over a step, widened by ``slack`` [m], into box[0:6].

    ``start`` and ``end`` are its states; ``turned`` [rad] bounds its rotation. A body that turns is given the room of
    the arc that its farthest point describes, at most the sphere that holds it.
    """
    rotation = quat.to_matrix(quat.load(start.orientation))
    center = vec3.load(start.center)
    low = UNBOUNDED
    high = vec3.neg(UNBOUNDED)
    for index in range(body.first_collider, body.first_collider + body.num_colliders):
        collider_low, collider_high = collider_box(header, colliders[index], center, rotation)
        low = vec3.min_(low, collider_low)
        high = vec3.max_(high, collider_high)
    moved = vec3.sub(vec3.load(end.center), center)
    if turned > 0.0:
        reach = turned * body.radius
        sphere = (body.radius, body.radius, body.radius)
        room = (reach, reach, reach)
        low = vec3.max_(vec3.sub(low, room), vec3.sub(center, sphere))
        high = vec3.min_(vec3.add(high, room), vec3.add(center, sphere))
    for axis in range(3):
        box[axis] = low[axis] + min(moved[axis], 0.0) - slack
        box[3 + axis] = high[axis] + max(moved[axis], 0.0) + slack
