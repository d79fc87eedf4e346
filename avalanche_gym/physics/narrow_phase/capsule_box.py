"""Capsule against box: balls on the stretch of the axis beside a face or an edge, as in capsule.py.

Only where the axis itself passes through the box is there no such ball. Then the axis of least overlap gives one normal
for all (separating axes: Gottschalk et al. 1996, sec. 5).
"""

from __future__ import annotations

import math

import numpy as np

from ..jit import kernel
from ..maths import mat3, vec3
from .capsule import AS_CLOSE, CLOSEST, LOWER_END, SHORTEST_CROSS, SHORTEST_STRETCH, STRETCH_SLOPE, UPPER_END
from .manifold import emit
from .segment import clamp, closest_parameters
from .sphere import CORES_TOUCH, point_box

# Cosine between axis and normal above which a capsule stands rather than lies, and only its closest ball touches.
STANDING = 0.5

# Advantage, relative to the pair's size, that an axis across two edges needs over one across a face.
EDGE_BIAS = 1e-9


@kernel
def _slope(center, u, half, t):
    """Half the derivative by t of the squared distance between center + t u and the box: grows with t."""
    total = 0.0
    for k in range(3):
        x = center[k] + t * u[k]
        total += u[k] * (x - clamp(x, half[k]))
    return total


@kernel
def closest_on_segment_to_box(center, u, length, half):
    """Parameter t in [-length, length] of the point center + t u that is closest to a box about the origin.

    The squared distance is convex and piecewise quadratic: its derivative is piecewise linear with kinks where the line
    crosses the planes of the six faces. Each kink narrows the bracket around the root; what remains is one linear
    piece. If a whole stretch is closest, any point of it may be returned.
    """
    low, high = -length, length
    slope_low, slope_high = _slope(center, u, half, low), _slope(center, u, half, high)
    if slope_low >= 0.0:
        return low
    if slope_high <= 0.0:
        return high
    for k in range(3):
        if u[k] != 0.0:
            for side in range(2):
                t = ((half[k] if side == 1 else -half[k]) - center[k]) / u[k]
                if low < t < high:
                    slope = _slope(center, u, half, t)
                    if slope == 0.0:
                        return t
                    if slope < 0.0:
                        low, slope_low = t, slope
                    else:
                        high, slope_high = t, slope
    return low - slope_low * (high - low) / (slope_high - slope_low)


@kernel
def clip_to_slab(lower, upper, center, slope, half):
    """The part of [lower, upper] where abs(center + t slope) <= half; empty if lower > upper."""
    if slope == 0.0:
        if abs(center) > half:
            return upper, lower - 1.0
        return lower, upper
    first = (-half - center) / slope
    second = (half - center) / slope
    return max(lower, min(first, second)), min(upper, max(first, second))


@kernel
def emit_ball_at_box(position_b, rotation_b, point, radius, distance, outward, feature, contacts, count):
    """The contact of a ball at ``point`` whose centre is ``distance`` outside of a box; return the new count.

    ``point`` [m] and ``outward`` in the box frame; the normal goes from the ball to the box.
    """
    gap = distance - radius
    middle = vec3.add_scaled(point, -(radius + 0.5 * gap), outward)
    position = vec3.add(position_b, mat3.apply(rotation_b, middle))
    return emit(contacts, count, position, vec3.neg(mat3.apply(rotation_b, outward)), gap, feature)


@kernel
def least_overlap(center, u, length, half):
    """The outward unit axis along which a segment leaves a box soonest, and the signed distance along it [m].

    The axes are the three faces and the three cross products with the edges; a face wins unless an edge is clearly
    better.
    """
    size = half[0] + half[1] + half[2] + length
    best = -math.inf
    face = 0
    for k in range(3):
        separation = abs(center[k]) - half[k] - length * abs(u[k])
        if separation > best + EDGE_BIAS * size:
            best, face = separation, k
    outward = vec3.scale(math.copysign(1.0, center[face]), vec3.along(face))
    for k in range(3):
        cross = vec3.cross(vec3.along(k), u)
        length_cross = math.sqrt(vec3.norm_squared(cross))
        if length_cross > SHORTEST_CROSS:
            axis = vec3.scale(1.0 / length_cross, cross)
            along = vec3.dot(axis, center)
            separation = abs(along) - half[0] * abs(axis[0]) - half[1] * abs(axis[1]) - half[2] * abs(axis[2])
            if separation > best + EDGE_BIAS * size:
                best, face = separation, 3 + k
                outward = vec3.scale(math.copysign(1.0, along), axis)
    return face, best, outward


@kernel
def _pierced_box(position_b, rotation_b, center, u, length, radius, half, margin, least_stretch, contacts, count):
    """Contacts of a capsule whose axis passes through a box: one normal for all."""
    axis, separation, outward = least_overlap(center, u, length, half)
    if axis >= 3:
        # The supporting edge of the box, on the side of the normal; its own direction is the one across it.
        edge = axis - 3
        middle = (
            0.0 if edge == 0 else math.copysign(half[0], outward[0]),
            0.0 if edge == 1 else math.copysign(half[1], outward[1]),
            0.0 if edge == 2 else math.copysign(half[2], outward[2]),
        )
        direction = vec3.along(edge)
        t, _ = closest_parameters(vec3.sub(middle, center), u, length, direction, half[edge])
        point = vec3.add_scaled(center, t, u)
        return emit_ball_at_box(
            position_b, rotation_b, point, radius, separation, outward, np.int64(CLOSEST), contacts, count
        )
    lower, upper = -length, length
    for k in range(3):
        if k != axis:
            lower, upper = clip_to_slab(lower, upper, center[k], u[k], half[k])
    rise = vec3.dot(outward, u)
    if abs(rise) > STANDING:
        lower = upper = lower if rise > 0.0 else upper
    elif upper - lower < least_stretch:
        lower = upper = 0.5 * (lower + upper)
    for end in range(2):
        if end == LOWER_END or upper > lower:
            point = vec3.add_scaled(center, upper if end == UPPER_END else lower, u)
            distance = vec3.dot(outward, point) - half[axis]
            if distance - radius <= margin:
                count = emit_ball_at_box(position_b, rotation_b, point, radius, distance, outward, end, contacts, count)
    return count


@kernel
def capsule_box(position_a, rotation_a, size_a, position_b, rotation_b, size_b, margin, contacts, count):
    """One contact; along a face or an edge two, and a third where the capsule crosses an edge between them."""
    radius, length = size_a[0], size_a[1]
    center = mat3.apply_transposed(rotation_b, vec3.sub(position_a, position_b))
    u = mat3.apply_transposed(rotation_b, mat3.column(rotation_a, 2))
    for k in range(3):
        if abs(center[k]) - length * abs(u[k]) - size_b[k] - radius > margin:
            return count
    size = radius + length + size_b[0] + size_b[1] + size_b[2]
    least_stretch = SHORTEST_STRETCH * size
    t = closest_on_segment_to_box(center, u, length, size_b)
    point = vec3.add_scaled(center, t, u)
    distance, outward = point_box(point, size_b)
    if distance - radius > margin:
        return count
    if distance <= CORES_TOUCH * size:
        return _pierced_box(
            position_b, rotation_b, center, u, length, radius, size_b, margin, least_stretch, contacts, count
        )
    lower, upper = -length, length
    for k in range(3):
        if abs(outward[k]) < STRETCH_SLOPE:
            lower, upper = clip_to_slab(lower, upper, center[k], u[k], size_b[k])
    closest_needed = True
    if upper - lower > least_stretch and abs(vec3.dot(outward, u)) < STANDING:
        for end in range(2):
            end_point = vec3.add_scaled(center, upper if end == UPPER_END else lower, u)
            end_distance, end_outward = point_box(end_point, size_b)
            closest_needed = closest_needed and end_distance > distance + AS_CLOSE * size
            if end_distance - radius <= margin:
                count = emit_ball_at_box(
                    position_b, rotation_b, end_point, radius, end_distance, end_outward, end, contacts, count
                )
    if closest_needed:
        count = emit_ball_at_box(
            position_b, rotation_b, point, radius, distance, outward, np.int64(CLOSEST), contacts, count
        )
    return count
