"""A curve of a body against the smooth surface of a height field: axis of a capsule, edge, rim of a cylinder.

It touches where its distance from the surface is locally the least: n . p'(t) = 0, with the normal n at the foot of
p(t). Sign changes between ``STATIONS`` points along it are seeds; each is followed to round-off by the method of false
position (Illinois: Dowell and Jarratt 1971). Where the slopes and curvatures at two stations say that a straight edge
may rise and fall between them, quarters of the interval are looked at. A minimum that no sign change shows is missed:
its depth is below that of the bump of the surface within one spacing. The ends of a curve are vertices or balls.

All these points belong to the body, so none of the contacts forbids what is allowed, whatever was missed elsewhere.
"""

from __future__ import annotations

import math

from ..jit import kernel
from ..maths import vec3
from .smooth_balls import POINTS_IN_CELL
from .smooth_candidates import FLAT_SLOPE, add_touch, numbered
from .smooth_surface import jet, normal_of, signed_distance
from .terrain_shape import margin_of

# Most intervals between the seeds along a curve; there are POINTS_IN_CELL of them a cell if that is less.
STATIONS = 32
# Slope along a curve at which it is taken to be at its lowest, and most steps towards that.
SLOPE_TOLERANCE = 1e-14
MOST_STEPS = 50

LINE, CIRCLE = 0, 1


@kernel
def _on_curve(kind, center, u, v, t):
    """Point of a curve and unit tangent: a line center + t u, or a circle center + cos(t) u + sin(t) v."""
    if kind == LINE:
        return vec3.add_scaled(center, t, u), u
    cosine, sine = math.cos(t), math.sin(t)
    point = vec3.add_scaled(vec3.add_scaled(center, cosine, u), sine, v)
    return point, vec3.normalize(vec3.add_scaled(vec3.scale(-sine, u), cosine, v))


@kernel
def _distance_at(patch, c, kind, center, u, v, t):
    """Point of a curve, its distance from the solid, the normal there, and the slope of the distance along it."""
    p, tangent = _on_curve(kind, center, u, v, t)
    x, y = min(max(p[0], patch[0]), patch[6]), min(max(p[1], patch[1]), patch[7])
    distance, normal = signed_distance(patch, c, p, x, y)
    return p, distance, normal, vec3.dot(normal, tangent)


@kernel
def _lowest_point(patch, c, kind, center, u, v, low, high, half, wide, radius, feature, scratch, count):
    """Follow the slope of the distance along a curve to its zero in [low, high]; add the contact there.

    An end where the slope has the wrong sign is moved out by ``wide``, within -half ... half, and only then:
    beyond may be another zero.
    """
    _, _, _, slope_low = _distance_at(patch, c, kind, center, u, v, low)
    if wide > 0.0 and not slope_low < -FLAT_SLOPE:
        low = max(low - wide, -half)
        _, _, _, slope_low = _distance_at(patch, c, kind, center, u, v, low)
    _, _, _, slope_high = _distance_at(patch, c, kind, center, u, v, high)
    if wide > 0.0 and not slope_high > FLAT_SLOPE:
        high = min(high + wide, half)
        _, _, _, slope_high = _distance_at(patch, c, kind, center, u, v, high)
    if not (slope_low < -FLAT_SLOPE and slope_high > FLAT_SLOPE):
        return count
    kept = 0
    for _ in range(MOST_STEPS):
        t = (low * slope_high - high * slope_low) / (slope_high - slope_low)
        p, distance, normal, slope = _distance_at(patch, c, kind, center, u, v, t)
        if abs(slope) <= SLOPE_TOLERANCE or not low < t < high:
            return add_touch(scratch, count, p, radius, distance, normal, numbered(feature, False))
        # An end that is kept twice counts half.
        if slope < 0.0:
            low, slope_low = t, slope
            if kept == 1:
                slope_high *= 0.5
            kept = 1
        else:
            high, slope_high = t, slope
            if kept == -1:
                slope_low *= 0.5
            kept = -1
    return count


@kernel
def _rise_under(patch, c, center, u, t):
    """First and second derivative along a line of its height over the surface below."""
    p = vec3.add_scaled(center, t, u)
    j = jet(patch, c, min(max(p[0], patch[0]), patch[6]), min(max(p[1], patch[1]), patch[7]))
    bend = j[3] * u[0] * u[0] + 2.0 * j[4] * u[0] * u[1] + j[5] * u[1] * u[1]
    return u[2] - j[1] * u[0] - j[2] * u[1], -bend


@kernel
def _between_stations(patch, c, center, u, v, low, high, feature, scratch, count):
    """The lowest point of a sharp line between two stations of which both rise or both fall."""
    span = high - low
    rise_low, bend_low = _rise_under(patch, c, center, u, low)
    rise_high, bend_high = _rise_under(patch, c, center, u, high)
    # Whether, seen from both ends, the rise goes towards zero, and from one of them beyond it.
    if rise_low * bend_low >= 0.0 or rise_high * bend_high <= 0.0:
        return count
    if rise_low * (rise_low + span * bend_low) > 0.0 and rise_high * (rise_high - span * bend_high) > 0.0:
        return count
    before = rise_low
    for quarter in range(1, 5):
        t = low + 0.25 * quarter * span
        rise, _ = _rise_under(patch, c, center, u, t)
        if before < -FLAT_SLOPE and rise > FLAT_SLOPE:
            return _lowest_point(patch, c, LINE, center, u, v, t - 0.25 * span, t, t, 0.0, 0.0, feature, scratch, count)
        before = rise
    return count


@kernel
def collide_curve(patch, c, kind, center, u, v, half, length, radius, feature, scratch, count):
    """Contacts of the inside of a curve, rounded by ``radius``, with the surface; return the new count.

    Args:
        kind, center, u, v: as in _on_curve; the curve runs over -half <= t <= half.
        length: [m] of the curve.
    """
    cell = min(patch[2], patch[3])
    intervals = 1 if kind == LINE else 16
    intervals = min(max(1 + int(POINTS_IN_CELL * length / cell), intervals), STATIONS)
    near = radius + margin_of(scratch) + length / intervals
    # Of a sharp curve in reach the foot is close below, and the slope there is sign enough: where it is not, one
    # interval more makes up for it. Under a rounded one the foot is searched for.
    pace = 2.0 * half / intervals
    wide = pace if radius == 0.0 else 0.0
    previous = 0.0
    previous_far = True
    # The last station where the distance falls, if it is level from there on: a station may lie at the lowest point.
    falls_from = math.nan
    falling_far = True
    for station in range(intervals + 2):
        # A circle goes on where it began, unless its first interval has said what there is.
        if station > intervals and (kind == LINE or falls_from != falls_from or previous < -FLAT_SLOPE):
            break
        t = half * (2.0 * station / intervals - 1.0)
        p, tangent = _on_curve(kind, center, u, v, t)
        j = jet(patch, c, min(max(p[0], patch[0]), patch[6]), min(max(p[1], patch[1]), patch[7]))
        normal = normal_of(j)
        far = (p[2] - j[0]) * normal[2] > near
        slope = vec3.dot(normal, tangent)
        if radius > 0.0 and not far:
            _, _, _, slope = _distance_at(patch, c, kind, center, u, v, t)
        if slope > FLAT_SLOPE and falls_from == falls_from and not (far and falling_far):
            count = _lowest_point(
                patch, c, kind, center, u, v, falls_from, t, half, wide, radius, feature, scratch, count
            )
        elif station > 0 and kind == LINE and radius == 0.0 and previous * slope > 0.0 and not (far and previous_far):
            count = _between_stations(patch, c, center, u, v, t - pace, t, feature, scratch, count)
        if slope < -FLAT_SLOPE:
            falls_from, falling_far = t, far
        elif slope > FLAT_SLOPE:
            falls_from = math.nan
        else:
            falling_far = falling_far and far
        previous, previous_far = slope, far
    return count
