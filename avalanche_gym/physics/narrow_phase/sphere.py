"""Sphere against sphere, capsule and box, in closed form; and the contact between two rounded cores.

A sphere is a point with a radius around it, a capsule a segment with one. Their contacts follow from the closest points
of the cores: the normal joins them, the gap is their distance less the radii.
"""

from __future__ import annotations

import math

import numpy as np

from ..jit import kernel
from ..maths import mat3, vec3
from .manifold import emit
from .segment import clamp

# Cores closer than this fraction of the pair's size touch: the direction between them is then round-off, and the normal
# is taken from the shapes instead.
CORES_TOUCH = 1e-14

# The feature of a pair that has one contact at most; the same wherever it lies, so that a rolling sphere keeps its
# impulse.
ONLY = 0


@kernel
def emit_round(origin, core_a, radius_a, core_b, radius_b, touch, fallback, margin, feature, contacts, count):
    """The contact between two balls around two points; return the new count.

    ``core_a``, ``core_b`` [m] relative to ``origin``; if they lie within ``touch`` [m], ``fallback`` is the normal.
    """
    offset = vec3.sub(core_b, core_a)
    distance = math.sqrt(vec3.norm_squared(offset))
    gap = distance - radius_a - radius_b
    if gap > margin:
        return count
    normal = fallback
    if distance > touch:
        normal = vec3.scale(1.0 / distance, offset)
    position = vec3.add(origin, vec3.add_scaled(core_a, radius_a + 0.5 * gap, normal))
    return emit(contacts, count, position, normal, gap, feature)


@kernel
def emit_ball(position, radius, rotation, distance, outward, margin, contacts, count):
    """The one contact of a ball whose centre is ``distance`` [m] outside of a solid; return the new count.

    ``outward``: unit, in the frame of the solid, turned by ``rotation``; the normal goes from the ball to the solid.
    """
    gap = distance - radius
    if gap > margin:
        return count
    normal = vec3.neg(mat3.apply(rotation, outward))
    return emit(contacts, count, vec3.add_scaled(position, radius + 0.5 * gap, normal), normal, gap, np.int64(ONLY))


@kernel
def sphere_sphere(position_a, rotation_a, size_a, position_b, rotation_b, size_b, margin, contacts, count):
    """One contact; concentric spheres part along z."""
    offset = vec3.sub(position_b, position_a)
    return emit_round(
        position_a,
        vec3.ZERO,
        size_a[0],
        offset,
        size_b[0],
        0.0,
        (0.0, 0.0, 1.0),
        margin,
        np.int64(ONLY),
        contacts,
        count,
    )


@kernel
def sphere_capsule(position_a, rotation_a, size_a, position_b, rotation_b, size_b, margin, contacts, count):
    """One contact; a centre on the capsule's axis parts across it."""
    center = vec3.sub(position_b, position_a)
    axis = mat3.column(rotation_b, 2)
    nearest = vec3.add_scaled(center, clamp(-vec3.dot(center, axis), size_b[1]), axis)
    across, _ = vec3.tangents(axis)
    touch = CORES_TOUCH * (size_b[0] + size_b[1])
    return emit_round(
        position_a, vec3.ZERO, size_a[0], nearest, size_b[0], touch, across, margin, np.int64(ONLY), contacts, count
    )


@kernel
def nearest_in_box(point, half):
    """The point of a box about the origin that is closest to ``point``."""
    return (clamp(point[0], half[0]), clamp(point[1], half[1]), clamp(point[2], half[2]))


@kernel
def shallowest_face(depth_x, depth_y, depth_z):
    """The axis with the smallest of three depths; the first one of a tie."""
    axis = 0
    if depth_y < depth_x:
        axis = 1
    if depth_z < min(depth_x, depth_y):
        axis = 2
    return axis


@kernel
def axis_vector(axis, point):
    """The unit vector along a coordinate axis, on the side where ``point`` lies."""
    return (
        math.copysign(1.0, point[0]) if axis == 0 else 0.0,
        math.copysign(1.0, point[1]) if axis == 1 else 0.0,
        math.copysign(1.0, point[2]) if axis == 2 else 0.0,
    )


@kernel
def point_box(point, half):
    """Signed distance [m] of a point from a box about the origin, and the unit gradient (outward).

    Inside, the nearest face decides; the first one of a tie.
    """
    outside = vec3.sub(point, nearest_in_box(point, half))
    distance = math.sqrt(vec3.norm_squared(outside))
    if distance > CORES_TOUCH * (half[0] + half[1] + half[2]):
        return distance, vec3.scale(1.0 / distance, outside)
    depth = (half[0] - abs(point[0]), half[1] - abs(point[1]), half[2] - abs(point[2]))
    axis = shallowest_face(depth[0], depth[1], depth[2])
    return -depth[axis], axis_vector(axis, point)


@kernel
def sphere_box(position_a, rotation_a, size_a, position_b, rotation_b, size_b, margin, contacts, count):
    """One contact; a centre inside the box leaves through the nearest face."""
    center = mat3.apply_transposed(rotation_b, vec3.sub(position_a, position_b))
    distance, outward = point_box(center, size_b)
    return emit_ball(position_a, size_a[0], rotation_b, distance, outward, margin, contacts, count)
