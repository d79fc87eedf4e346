"""Points, balls and lines of a body against the smooth surface of a height field: candidates of contacts.

A *ball* (radius 0: a vertex) touches at the points of the surface that are locally the nearest to its centre. One
search from below the centre finds the only one if the surface does not bend as sharply as the ball within its reach,

    2 reach max(|z_xx|, |z_yy|) + |z_xy|) < 1,

which the second differences of the coefficients prove: then D (smooth_surface.py) is convex wherever a contact could
be. Otherwise the searches start from every local minimum of D on a lattice of ``LATTICE`` points across the reach; what
is finer than that lattice can be missed. A centre below the surface leaves by the shortest way.

A *curve* of the body (the axis of a capsule, an edge, the rim of a cylinder) touches where its distance from the
surface is locally the least: n . p'(t) = 0, with the normal n at the foot of p(t). Sign changes between ``STATIONS``
points along it are seeds; each is followed to round-off by the method of false position (Illinois: Dowell and Jarratt
1971). Where the slopes and curvatures at two stations say that a straight edge may rise and fall between them, quarters
of the interval are looked at. A minimum that no sign change shows is missed: its depth is below that of the bump of the
surface within one spacing. The ends of a curve are vertices or balls.

All these points belong to the body, so none of the contacts forbids what is allowed, whatever was missed elsewhere.
"""

from __future__ import annotations

import math

from ..jit import kernel
from ..maths import vec3
from .smooth_surface import height, jet, locate, normal_of, signed_distance
from .terrain_candidates import FACE_PLACE, POINT, VERTEX_PLACE, add_candidate, feature_of, is_on
from .terrain_shape import CENTER_ROW, FIRST_FREE_ROW, margin_of, rank_by_motion, set_scale, stand_still

# Most points of a lattice of seeds along x and y; 28^2 heights fill the free rows of the scratch table.
LATTICE = 28
# A lattice has this many points in a cell, and in the reach.
POINTS_IN_CELL = 2.0
POINTS_IN_REACH = 4.0
# Most intervals between the seeds along a curve; there are POINTS_IN_CELL of them a cell if that is less.
STATIONS = 32
# A slope along a curve below this is none: it lies on the surface, and its ends hold it.
# Where the normal turns by less than that within reach, the ground is flat.
FLAT_SLOPE = 1e-9
# Slope along a curve at which it is taken to be at its lowest, and most steps towards that.
SLOPE_TOLERANCE = 1e-14
MOST_STEPS = 50

LINE, CIRCLE = 0, 1

# The kind of place of a contact with flat ground; all others are of FACE_PLACE.
FLAT_PLACE = VERTEX_PLACE

# Normals of contacts of one part are ordered along this direction, which is aligned with nothing in particular.
GENERIC_DIRECTION = (0.2391, 0.5137, 0.8240)


@kernel
def prepare_scratch(scratch, margin, scale):
    """What terrain_candidates.py asks of the scratch table: margin and size of the shape [m]."""
    scratch[CENTER_ROW, 7] = margin
    set_scale(scale, scratch)
    rank_by_motion(margin, scratch)
    stand_still(margin, scratch)


@kernel
def number_alike(scratch, count):
    """Turn the candidates' numbers of parts, from numbered, into features: where one part touches in several places,
    these are numbered in the order of their normals.
    """
    for i in range(count):
        rank = 0
        part, flat = int(scratch[i, 7]) >> 1, int(scratch[i, 7]) & 1
        for j in range(count):
            if int(scratch[j, 7]) >> 1 == part and j != i:
                ahead = 0.0
                for k in range(3):
                    ahead += GENERIC_DIRECTION[k] * (scratch[j, 3 + k] - scratch[i, 3 + k])
                if ahead > 0.0 or (ahead == 0.0 and j < i):
                    rank += 1
        scratch[FIRST_FREE_ROW + i, 0] = feature_of(POINT, part, FLAT_PLACE if flat == 1 else FACE_PLACE, rank)
    for i in range(count):
        scratch[i, 7] = scratch[FIRST_FREE_ROW + i, 0]


@kernel
def numbered(part, flat):
    """What a candidate holds in place of its feature: the number of the part, and whether the ground is flat there."""
    return 2 * part + (1 if flat else 0)


@kernel
def is_on_flat(feature):
    """Whether a contact with a smooth field has a normal that does not depend on its place."""
    return is_on(feature, FLAT_PLACE)


@kernel
def bounds_around(patch, c, p, reach):
    """Highest coefficient [m] of the cells within ``reach`` of p, and a bound of the second derivatives [1/m]."""
    first_column, _ = locate(p[0] - reach - patch[0], patch[4], patch[8])
    last_column, _ = locate(p[0] + reach - patch[0], patch[4], patch[8])
    first_row, _ = locate(p[1] - reach - patch[1], patch[5], patch[9])
    last_row, _ = locate(p[1] + reach - patch[1], patch[5], patch[9])
    highest = -math.inf
    along_x = along_y = across = 0.0
    # The second differences that weigh in a cell (row, column) are those about the coefficients row ... row + 3.
    for row in range(first_row, last_row + 4):
        for column in range(first_column, last_column + 4):
            here = c[row, column]
            highest = max(highest, here)
            if column < last_column + 2:
                along_x = max(along_x, abs(here - 2.0 * c[row, column + 1] + c[row, column + 2]))
            if row < last_row + 2:
                along_y = max(along_y, abs(here - 2.0 * c[row + 1, column] + c[row + 2, column]))
            if row < last_row + 3 and column < last_column + 3:
                across = max(across, abs(here - c[row + 1, column] - c[row, column + 1] + c[row + 1, column + 1]))
    bend = max(along_x * patch[4] * patch[4], along_y * patch[5] * patch[5]) + across * patch[4] * patch[5]
    return highest, bend


@kernel
def _lattice(patch, c, p, reach, scratch):
    """Fill the free rows with squared distances [m^2] of p from the surface over a lattice; return its frame.

    The frame is (first x, first y, spacing along x, along y [m], points along x, along y).
    """
    low_x, high_x = max(p[0] - reach, patch[0]), min(p[0] + reach, patch[6])
    low_y, high_y = max(p[1] - reach, patch[1]), min(p[1] + reach, patch[7])
    points_x = min(LATTICE, 3 + int(max(POINTS_IN_CELL * (high_x - low_x) * patch[4], POINTS_IN_REACH)))
    points_y = min(LATTICE, 3 + int(max(POINTS_IN_CELL * (high_y - low_y) * patch[5], POINTS_IN_REACH)))
    step_x, step_y = (high_x - low_x) / (points_x - 1), (high_y - low_y) / (points_y - 1)
    for i in range(points_y):
        y = low_y + i * step_y
        for k in range(points_x):
            x = low_x + k * step_x
            z = height(patch, c, x, y)
            index = i * points_x + k
            square = (x - p[0]) ** 2 + (y - p[1]) ** 2 + (z - p[2]) ** 2
            scratch[FIRST_FREE_ROW + (index >> 3), index & 7] = square
    return low_x, low_y, step_x, step_y, points_x, points_y


@kernel
def _is_lowest(scratch, points_x, points_y, i, k):
    """Whether a point of the lattice is no farther than its neighbours; of equal ones the first."""
    index = i * points_x + k
    own = scratch[FIRST_FREE_ROW + (index >> 3), index & 7]
    for other_i in range(max(i - 1, 0), min(i + 2, points_y)):
        for other_k in range(max(k - 1, 0), min(k + 2, points_x)):
            other = other_i * points_x + other_k
            square = scratch[FIRST_FREE_ROW + (other >> 3), other & 7]
            if square < own or (square == own and other < index):
                return False
    return True


@kernel
def _add(scratch, count, p, radius, distance, normal, feature):
    """Append the contact of a ball about p whose centre is at ``distance`` along the normal; return the new count."""
    gap = distance - radius
    if gap > margin_of(scratch):
        return count
    # Midway between the surfaces: the ball's is at p - radius n, the other one a gap below it.
    position = vec3.add_scaled(p, -(radius + 0.5 * gap), normal)
    return add_candidate(scratch, count, position, normal, gap, feature)


@kernel
def collide_ball(patch, c, p, radius, feature, scratch, count):
    """Contacts of a ball (radius 0: a vertex) about p with the surface and its walls; return the new count."""
    reach = radius + margin_of(scratch)
    if p[0] < patch[0] - reach or p[0] > patch[6] + reach or p[1] < patch[1] - reach or p[1] > patch[7] + reach:
        return count
    highest, bend = bounds_around(patch, c, p, reach)
    if p[2] - reach > highest:
        return count
    inside = patch[0] + reach < p[0] < patch[6] - reach and patch[1] + reach < p[1] < patch[7] - reach
    feature = numbered(feature, inside and reach * bend <= FLAT_SLOPE)
    # First from below the centre; then, where that is not known to be all, from the lattice.
    x, y = min(max(p[0], patch[0]), patch[6]), min(max(p[1], patch[1]), patch[7])
    frame = (x, y, 0.0, 0.0, 0, 0)
    item = -1
    deepest, way_out = -math.inf, (0.0, 0.0, 1.0)
    while True:
        distance, normal = signed_distance(patch, c, p, x, y)
        if distance >= 0.0:
            count = _add(scratch, count, p, radius, distance, normal, feature)
        elif distance > deepest:
            deepest, way_out = distance, normal
        if item < 0:
            # The bends that were looked at lie within the reach; a centre that is deeper takes the lattice.
            if 2.0 * max(reach, -distance) * bend < 1.0 and -distance <= reach:
                break
            frame = _lattice(patch, c, p, max(reach, -distance), scratch)
        item += 1
        points = frame[4] * frame[5]
        while item < points and not _is_lowest(scratch, frame[4], frame[5], item // frame[4], item % frame[4]):
            item += 1
        if item == points:
            break
        x = frame[0] + item % frame[4] * frame[2]
        y = frame[1] + item // frame[4] * frame[3]
    if deepest > -math.inf:
        count = _add(scratch, count, p, radius, deepest, way_out, feature)
    return count


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
            return _add(scratch, count, p, radius, distance, normal, numbered(feature, False))
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
