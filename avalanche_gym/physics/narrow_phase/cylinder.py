"""Cylinder against sphere and plane, in closed form.

Lying, a cylinder touches a plane at the lowest points of both ends. Standing, it does so around the rim of its lower
cap: tilted, at the lowest point and a quarter and half a turn from it, which roll with the tilt; flat, at eight points
fixed to the cylinder, because which one is the lowest is then up to round-off. Where a body stands is what its points
are, so these must not depend on that: on facets of a floor, and on a floor that is flat to some digits only, they are
the same as on a plane.
"""

from __future__ import annotations

import math

from ..jit import kernel
from ..maths import mat3, vec3
from .plane import emit_above_plane
from .segment import clamp
from .sphere import CORES_TOUCH, emit_ball

# Cosine between axis and normal above which a cylinder counts as standing on its cap.
STANDING = 0.5

# Points around the rim of a cap that stands flat on a plane: a regular polygon, which holds 92 % of the radius. With
# four of them (71 %) a cylinder on a slope that loads one side of its cap more falls over the side of that square.
FLAT_POINTS = 8
# Sine of the tilt below which a cap stands flat. The lowest point of the rim is missed by 1 - cos(pi / FLAT_POINTS) of
# the radius times that: 3e-7 of the radius, a gap that is left alone (response/creep.py, SETTLED).
LEVEL = 4e-6

# The same between convex solids, where of all points four remain: four of the rim, which may miss the lowest by this
# fraction of the radius, so that one is added where it is lower by more than round-off.
FLAT_CAP = 1e-6

# A point of the rim is lower than a fixed one if it is so by this fraction of the radius.
CLEARLY_LOWER = 1e-10

# The lowest point of a flat cap is one of so many of its rim: a tilt of nearly nothing says in as few digits where it
# is, and what slides on it would go by those. It is too high by 1.2e-3 of the radius times the tilt at most.
RIM_POINTS = 64

# Features: the lower end of a lying cylinder or of a tilted cap (0 at -z, 1 at +z), then the other points of the rim.
TILTED_RIM, FLAT_RIM, LOWEST_OF_FLAT = 2, 16, 32


@kernel
def point_cylinder(point, radius, half_length):
    """Signed distance [m] of a point from a cylinder about the origin, and the unit gradient (outward).

    Inside, the nearer of side and cap decides; the cap in a tie.
    """
    across = math.sqrt(point[0] * point[0] + point[1] * point[1])
    radial = (1.0, 0.0, 0.0)
    if across > 0.0:
        radial = (point[0] / across, point[1] / across, 0.0)
    beyond_side = max(across - radius, 0.0)
    beyond_cap = point[2] - clamp(point[2], half_length)
    distance = math.sqrt(beyond_side * beyond_side + beyond_cap * beyond_cap)
    if distance > CORES_TOUCH * (radius + half_length):
        outward = vec3.scale(beyond_side / distance, radial)
        return distance, (outward[0], outward[1], beyond_cap / distance)
    to_side = radius - across
    to_cap = half_length - abs(point[2])
    if to_side < to_cap:
        return -to_side, radial
    return -to_cap, (0.0, 0.0, math.copysign(1.0, point[2]))


@kernel
def sphere_cylinder(position_a, rotation_a, size_a, position_b, rotation_b, size_b, margin, contacts, count):
    """One contact; a centre inside the cylinder leaves through the nearest surface."""
    center = mat3.apply_transposed(rotation_b, vec3.sub(position_a, position_b))
    distance, outward = point_cylinder(center, size_b[0], size_b[1])
    return emit_ball(position_a, size_a[0], rotation_b, distance, outward, margin, contacts, count)


@kernel
def rim_direction(local, k):
    """Direction (x, y) of point k of a rim for a unit direction in the cylinder's frame, and its feature.

    Tilted: 0 is the furthest point in that direction, the others follow in quarter turns; k = 4 there is none. Flat: 0
    to 3 are fixed, and 4 is the furthest of RIM_POINTS.
    """
    tilt = math.sqrt(local[0] * local[0] + local[1] * local[1])
    end = 1 if local[2] > 0.0 else 0
    x, y = 1.0, 0.0
    feature = end
    if k == 4:
        turn = 2.0 * math.pi / RIM_POINTS
        number = int(math.floor(math.atan2(local[1], local[0]) / turn + 0.5)) % RIM_POINTS
        x, y = math.cos(number * turn), math.sin(number * turn)
        feature = LOWEST_OF_FLAT + RIM_POINTS * end + number
    elif tilt > FLAT_CAP:
        x, y = local[0] / tilt, local[1] / tilt
        if k > 0:
            feature = TILTED_RIM + 4 * end + k
    else:
        feature = FLAT_RIM + 4 * end + k
    if k == 1:
        x, y = -y, x
    elif k == 2:
        x, y = -x, -y
    elif k == 3:
        x, y = y, -x
    return x, y, feature, tilt


@kernel
def toward_plane(radius, half_length, down, k):
    """Point k, 0 to FLAT_POINTS - 1, of the contacts with a plane, if there is one; ``down``: unit, against its normal.

    All in the cylinder's own frame.

    Returns:
        The point [m], its feature, and whether there is one.
    """
    if abs(down[2]) < STANDING:
        tilt = math.sqrt(down[0] * down[0] + down[1] * down[1])
        point = (radius * down[0] / tilt, radius * down[1] / tilt, half_length if k == 1 else -half_length)
        return point, k, k < 2
    height = math.copysign(half_length, down[2])
    if down[0] * down[0] + down[1] * down[1] <= LEVEL * LEVEL:
        angle = 2.0 * math.pi / FLAT_POINTS * k
        feature = FLAT_RIM + (FLAT_POINTS if down[2] > 0.0 else 0) + k
        return (radius * math.cos(angle), radius * math.sin(angle), height), feature, True
    x, y, feature, _ = rim_direction(down, min(k, 3))
    return (radius * x, radius * y, height), feature, k < 4


@kernel
def cylinder_plane(position_a, rotation_a, size_a, position_b, rotation_b, size_b, margin, contacts, count):
    """Up to FLAT_POINTS contacts around the rim that looks down, or one below each end of a lying cylinder."""
    up = mat3.column(rotation_b, 2)
    radius, half_length = size_a[0], size_a[1]
    height = vec3.dot(up, vec3.sub(position_a, position_b))
    down = vec3.neg(mat3.apply_transposed(rotation_a, up))
    tilt = math.sqrt(down[0] * down[0] + down[1] * down[1])
    if height - abs(down[2]) * half_length - tilt * radius > margin:
        return count
    for k in range(FLAT_POINTS):
        local, feature, exists = toward_plane(radius, half_length, down, k)
        if exists:
            above = height - vec3.dot(down, local)
            point = vec3.add(position_a, mat3.apply(rotation_a, local))
            count = emit_above_plane(point, 0.0, above, up, margin, feature, contacts, count)
    return count
