"""A cylinder against the smooth surface of a height field.

As on a plane (cylinder.py), eight points fixed to a cap that stands flat, and nothing else; else the nearest points of
its rims, hilltops in front of its caps, the points of its side where the axis is nearest, and points around the rim of
a cap that stands, which turn with where it leans to: it rolls about the lowest one, and comes down on the others.
"""

from __future__ import annotations

import math

from ..jit import kernel
from ..maths import mat3, vec3
from .cylinder import FLAT_POINTS, LEVEL, STANDING
from .smooth_balls import bounds_around, collide_ball
from .smooth_candidates import number_alike, numbered, prepare_scratch
from .smooth_curves import CIRCLE, LINE, collide_curve
from .smooth_faces import collide_face
from .smooth_surface import coefficients_of, jet, normal_of, patch_of
from .terrain_candidates import emit_candidates
from .terrain_shape import get, in_frame

# Features of a cylinder: for each rim points fixed to it and those that turn with the tilt, then the lowest of a rim,
# side and caps.
RIM, SIDE, CAP = 4 * FLAT_POINTS, 4 * FLAT_POINTS + 2, 4 * FLAT_POINTS + 3
# ... and those that its rims turn to the four walls of the field.
TO_WALL = CAP + 2


@kernel
def _over_field(patch, p):
    """x and y of p, or of the point of the rim of the field nearest to it."""
    return min(max(p[0], patch[0]), patch[6]), min(max(p[1], patch[1]), patch[7])


@kernel
def _stands_flat(scratch, first, count, m):
    """Whether a cap with outward normal m lies flat on the surface with all its fixed points, candidates[first:count].

    Which point of its rim is the lowest is then up to round-off, as on a plane (cylinder.py).
    """
    flat = count - first == FLAT_POINTS
    for i in range(first, count):
        flat = flat and vec3.norm_squared(vec3.add(get(scratch, i, 3), m)) <= LEVEL * LEVEL
    return flat


@kernel
def _rim_to_walls(patch, c, o, axes, radius, end, scratch, count):
    """Contacts of a rim about o with the upright walls of a field, whose rectangle it reaches beyond."""
    for way in range(4):
        axis = way // 2
        sign = 1.0 - 2.0 * (way % 2)
        beyond = (patch[0] - o[0], o[0] - patch[6], patch[1] - o[1], o[1] - patch[7])[way]
        local = (sign * axes[axis * 3], sign * axes[axis * 3 + 1])
        length = math.sqrt(local[0] * local[0] + local[1] * local[1])
        if beyond > -radius and length > 0.0:
            out = mat3.apply(axes, (local[0] / length, local[1] / length, 0.0))
            p = vec3.add_scaled(o, radius, out)
            count = collide_ball(patch, c, p, 0.0, TO_WALL + 4 * end + way, scratch, count)
    return count


@kernel
def collide_cylinder(
    position_a, rotation_a, size_a, position_b, rotation_b, field, pool, margin, contacts, count, scratch
):
    """Append the contacts of a cylinder; arguments as in ``collide_rounded`` (smooth_field.py)."""
    center, axes = in_frame(position_a, rotation_a, position_b, rotation_b)
    patch = patch_of(field)
    c = coefficients_of(field, pool)
    radius, half = size_a[0], size_a[1]
    reach = math.sqrt(radius * radius + half * half)
    if center[2] - reach - margin > field.highest:
        return count
    prepare_scratch(scratch, margin, max(radius, half))
    highest, _ = bounds_around(patch, c, center, reach + margin)
    axis = mat3.column(axes, 2)
    u = vec3.scale(radius, mat3.column(axes, 0))
    v = vec3.scale(radius, mat3.column(axes, 1))
    across = radius * math.sqrt(max(1.0 - axis[2] * axis[2], 0.0))
    found = 0
    for end in range(2):
        m = axis if end == 1 else vec3.neg(axis)
        o = vec3.add_scaled(center, half, m)
        if o[2] - across - margin > highest:
            continue
        found = _rim_to_walls(patch, c, o, axes, radius, end, scratch, found)
        # How the cap leans against the surface below its middle.
        down = vec3.neg(normal_of(jet(patch, c, *_over_field(patch, o))))
        local = mat3.apply_transposed(axes, down)
        leans = local[0] * local[0] + local[1] * local[1] > LEVEL * LEVEL
        stands = vec3.dot(down, m) >= STANDING
        first = found
        for k in range(FLAT_POINTS if stands else 0):
            # Fixed to the cap, or turning with where it leans to, and then all but the lowest.
            angle = 2.0 * math.pi / FLAT_POINTS * k
            if leans:
                angle += math.atan2(local[1], local[0])
            if leans and k == 0:
                continue
            p = vec3.add_scaled(vec3.add_scaled(o, math.cos(angle), u), math.sin(angle), v)
            part = FLAT_POINTS * (2 * end + (1 if leans else 0)) + k
            before = found
            found = collide_ball(patch, c, p, 0.0, part, scratch, found)
            if leans and found > before:
                # It moves around the rim.
                scratch[before, 7] = numbered(part, False)
        if _stands_flat(scratch, first, found, m):
            continue
        around = 2.0 * math.pi * radius
        found = collide_curve(patch, c, CIRCLE, o, u, v, math.pi, around, 0.0, RIM + end, scratch, found)
        low, high = (o[0] - radius, o[1] - radius), (o[0] + radius, o[1] + radius)
        found = collide_face(patch, c, m, o, low, high, 0, radius, half, CAP + end, scratch, found)
    found = collide_curve(patch, c, LINE, center, axis, axis, half, 2.0 * half, radius, SIDE, scratch, found)
    number_alike(scratch, found)
    return emit_candidates(scratch, found, position_b, rotation_b, contacts, count)
