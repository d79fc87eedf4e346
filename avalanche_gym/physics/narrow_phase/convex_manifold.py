"""Contacts of two solids along a known normal: what flat faces, caps and straight lines have in common.

One flat face that looks along the normal is the reference. The other solid's part that faces it is projected on its
plane along the normal, and the common part of both is described by its extreme points:

* polygon on polygon: the clipped polygon (polytope.py);
* polygon on cap: corners of the polygon on the cap, points where its sides cross the rim, points of the rim over the
  polygon;
* cap on cap: points of each rim on the other cap, and where the rims cross;
* line (capsule, lying cylinder, edge of a box) on polygon or cap: the ends of the common stretch.

Two parallel lines get a contact at both ends of their common stretch. What has none of these gets the closest pair
alone. Everything is in the frame of solid a; emit_rows brings it to the world.
"""

from __future__ import annotations

import math

import numpy as np

from ..jit import kernel
from ..maths import mat3, vec3
from ..model import CYLINDER, SPHERE
from .cylinder import CLEARLY_LOWER, FLAT_CAP, STANDING, rim_direction
from .manifold import emit
from .polytope import (
    AS_CLOSE,
    FACE_ALIGNED,
    FIRST_BUFFER,
    FIRST_SIDE,
    FLUSH,
    REFERENCE_BIAS,
    ROW_FEATURES,
    append,
    clip,
    emit_rows,
    measure,
    project,
)
from .reduction import HEIGHT, X, Y
from .segment import stretch_ends
from .solid import facing, frame_of_face, load_face, straight_line

# Rows of the polygon that others are tested against.
REFERENCE_ROWS = 160

# Faces of one solid that features can tell apart; more faces share numbers, which only the warm start would notice.
FACES = 256

PAIR_FEATURE = 2 * FACES * FACES * ROW_FEATURES
FIRST_END_FEATURE = PAIR_FEATURE + 1

# A common stretch of two lines shorter than this fraction of the pair's size has no two ends.
SHORTEST_STRETCH = 1e-3

# An end stands for the closest pair only if its own normal is the same within this angle [rad]; round-off at rest is
# less.
SAME_NORMAL = 1e-7

# Instead of the feature of the closest pair: it has not been looked for.
UNKNOWN = -1

# Steps of Newton's method that bring two rims, tilted by at most acos(FACE_ALIGNED), to their crossing.
MOST_CORRECTIONS = 10

# Features of the points of a polygon and a rim.
CORNER, CROSSING, RIM = 0, 64, 256

# Sine of the angle between a line and what it lies on, or along, up to which its ends get contacts.
LINE_SLOPE = 0.05


@kernel
def _side(scratch, first, count, k):
    """Unit outward normal and offset of side k of a counter-clockwise polygon; an infinite offset: it has no length."""
    i = first + k
    j = first + (k + 1) % count
    dx, dy = scratch[j, X] - scratch[i, X], scratch[j, Y] - scratch[i, Y]
    length = math.sqrt(dx * dx + dy * dy)
    if length == 0.0:
        return 1.0, 0.0, math.inf
    nx, ny = dy / length, -dx / length
    return nx, ny, nx * scratch[i, X] + ny * scratch[i, Y]


@kernel
def _orientation(scratch, first, count):
    """1.0 if a polygon is counter-clockwise, -1.0 if not."""
    area = 0.0
    for k in range(count):
        i = first + k
        j = first + (k + 1) % count
        area += scratch[i, X] * scratch[j, Y] - scratch[j, X] * scratch[i, Y]
    return 1.0 if area >= 0.0 else -1.0


@kernel
def _inside_polygon(scratch, first, count, turn, x, y, tolerance):
    """Whether a point lies on a convex polygon; ``turn`` from _orientation."""
    for k in range(count):
        nx, ny, offset = _side(scratch, first, count, k)
        if turn * (nx * x + ny * y - offset) > tolerance and offset < math.inf:
            return False
    return True


@kernel
def _clip_polygon(scratch, count, reference, sides, tolerance):
    """Clip the polygon at FIRST_BUFFER by the sides of the counter-clockwise one at ``reference``."""
    first = np.int64(FIRST_BUFFER)
    for k in range(sides):
        nx, ny, offset = _side(scratch, reference, sides, k)
        if offset < math.inf:
            first, count = clip(scratch, first, count, nx, ny, offset, tolerance, FIRST_SIDE + k)
    return first, count


@kernel
def _rim_crossings(x0, y0, x1, y1, radius):
    """Fractions of the way from one point to another where a circle about the origin is crossed; NaN if it is not."""
    dx, dy = x1 - x0, y1 - y0
    a = dx * dx + dy * dy
    half_b = x0 * dx + y0 * dy
    cross = x0 * dy - y0 * dx
    # b^2 / 4 - a c, without its cancellation.
    discriminant = a * radius * radius - cross * cross
    if discriminant < 0.0 or a == 0.0:
        return math.nan, math.nan
    root = math.sqrt(discriminant)
    return (-half_b - root) / a, (-half_b + root) / a


@kernel
def _add(scratch, rows, x, y, height, feature):
    """Add a point of the common part, over (x, y) of the reference face; return the new number of rows."""
    rows = append(scratch, FIRST_BUFFER, rows, x, y, 0.0, feature)
    scratch[FIRST_BUFFER + rows - 1, HEIGHT] = height
    return rows


@kernel
def _polygon_on_cap(scratch, count, radius, local, tolerance):
    """Common part of a cap (the reference, about the origin of its frame) and the projected polygon at REFERENCE_ROWS.

    Points go to FIRST_BUFFER on; returns how many. ``local``: the normal in the frame, which is the cylinder's own.
    """
    first = REFERENCE_ROWS
    turn = _orientation(scratch, first, count)
    rows = 0
    # The polygon's plane over the cap: height = h0 + hx x + hy y, from three well spread corners.
    i, j, k = first, first + count // 3, first + (2 * count) // 3
    ax, ay, az = (scratch[j, X] - scratch[i, X], scratch[j, Y] - scratch[i, Y], scratch[j, HEIGHT] - scratch[i, HEIGHT])
    bx, by, bz = (scratch[k, X] - scratch[i, X], scratch[k, Y] - scratch[i, Y], scratch[k, HEIGHT] - scratch[i, HEIGHT])
    area = ax * by - ay * bx
    for corner in range(count):
        row = first + corner
        x, y, height = scratch[row, X], scratch[row, Y], scratch[row, HEIGHT]
        if x * x + y * y <= (radius + tolerance) ** 2:
            rows = _add(scratch, rows, x, y, height, CORNER + corner)
        following = first + (corner + 1) % count
        dx, dy = scratch[following, X] - x, scratch[following, Y] - y
        enters, leaves = _rim_crossings(x, y, scratch[following, X], scratch[following, Y], radius)
        shortest = tolerance / (abs(dx) + abs(dy) + tolerance)
        for crossing in range(2):
            t = enters if crossing == 0 else leaves
            if shortest < t < 1.0 - shortest:
                along = height + t * (scratch[following, HEIGHT] - height)
                rows = _add(scratch, rows, x + t * dx, y + t * dy, along, CROSSING + 2 * corner + crossing)
    if abs(area) <= tolerance * tolerance:
        return rows
    hx = (az * by - bz * ay) / area
    hy = (bz * ax - az * bx) / area
    lowest = math.inf
    for k in range(5):
        x, y, feature, tilt = rim_direction(local, k)
        x, y = radius * x, radius * y
        height = scratch[first, HEIGHT] + hx * (x - scratch[first, X]) + hy * (y - scratch[first, Y])
        if k < 4 or (tilt <= FLAT_CAP and height < lowest - CLEARLY_LOWER * radius):
            lowest = min(lowest, height)
            if _inside_polygon(scratch, first, count, turn, x, y, -tolerance):
                rows = _add(scratch, rows, x, y, height, RIM + feature)
    return rows


@kernel
def _add_rim_crossings(scratch, rows, radius, other_radius, normal, center, axis, tolerance):
    """Add the points of a rim (the reference) that lie, along the normal, on the rim of another cap; new number of
    rows.

    Parallel rims are two circles. Tilted a little, the other one is an ellipse, and the angle is corrected by Newton's
    method.
    """
    t = center[2] / normal[2]
    cx, cy = center[0] - t * normal[0], center[1] - t * normal[1]
    apart_squared = cx * cx + cy * cy
    if apart_squared <= tolerance * tolerance:
        return rows
    apart = math.sqrt(apart_squared)
    cosine = 0.5 * (apart_squared + radius * radius - other_radius * other_radius) / (apart * radius)
    if abs(cosine) >= 1.0:
        return rows
    facing_rate = vec3.dot(normal, axis)
    for k in range(2):
        angle = math.atan2(cy, cx) + (math.acos(cosine) if k == 0 else -math.acos(cosine))
        point = center
        miss = math.inf
        for _ in range(MOST_CORRECTIONS):
            rim = (radius * math.cos(angle), radius * math.sin(angle), 0.0)
            t = vec3.dot(vec3.sub(center, rim), axis) / facing_rate
            point = vec3.add_scaled(rim, t, normal)
            beyond = vec3.sub(point, center)
            miss = vec3.norm_squared(beyond) - other_radius * other_radius
            if abs(miss) <= tolerance * other_radius:
                break
            # Along the rim, point moves by its tangent, sheared along the normal so that it stays on the other cap.
            tangent = (-rim[1], rim[0], 0.0)
            tangent = vec3.add_scaled(tangent, -vec3.dot(tangent, axis) / facing_rate, normal)
            slope = 2.0 * vec3.dot(beyond, tangent)
            if slope == 0.0:
                break
            angle -= miss / slope
        if abs(miss) <= tolerance * other_radius:
            rows = _add(scratch, rows, radius * math.cos(angle), radius * math.sin(angle), point[2], CROSSING + k)
    return rows


@kernel
def _cap_on_cap(scratch, radius, other, normal, local, center, axis, tolerance):
    """Common part of a cap (the reference, about the origin of its frame) and another solid's cap that faces it.

    ``center``, ``axis``: of the other cap in the frame; ``normal``: the contact normal in the frame; ``local``: against
    it, in the other cylinder's own frame, which ``other`` = (solid, position, rotation) places in the reference's
    frame.
    """
    rows = 0
    other_radius = other[0][1][0]
    lowest = math.inf
    for k in range(5):
        x, y, feature, tilt = rim_direction(local, k)
        rim = (other_radius * x, other_radius * y, 0.0)
        point = vec3.add(center, mat3.apply(other[2], rim))
        t = point[2] / normal[2]
        x, y = point[0] - t * normal[0], point[1] - t * normal[1]
        if k < 4 or (tilt <= FLAT_CAP and point[2] < lowest - CLEARLY_LOWER * other_radius):
            lowest = min(lowest, point[2])
            if x * x + y * y <= (radius + tolerance) ** 2:
                rows = _add(scratch, rows, x, y, point[2], RIM + feature)
    facing_rate = vec3.dot(normal, axis)
    for k in range(4):
        x = radius * (1.0 if k == 0 else (-1.0 if k == 1 else 0.0))
        y = radius * (1.0 if k == 2 else (-1.0 if k == 3 else 0.0))
        t = vec3.dot(vec3.sub(center, (x, y, 0.0)), axis) / facing_rate
        point = vec3.add_scaled((x, y, 0.0), t, normal)
        if vec3.norm_squared(vec3.sub(point, center)) < (other_radius - tolerance) ** 2:
            rows = _add(scratch, rows, x, y, point[2], CORNER + k)
    if abs(axis[2]) >= FACE_ALIGNED:
        rows = _add_rim_crossings(scratch, rows, radius, other_radius, normal, center, axis, tolerance)
    return rows


@kernel
def _line_on_face(scratch, start, end, sides, radius, tolerance):
    """Rows of both ends of a projected line's part over the polygon at REFERENCE_ROWS, or over a cap (``sides`` 0)."""
    low, high = 0.0, 1.0
    dx, dy, dz = end[0] - start[0], end[1] - start[1], end[2] - start[2]
    if sides == 0:
        enters, leaves = _rim_crossings(start[0], start[1], end[0], end[1], radius)
        low, high = max(low, enters), min(high, leaves)
        if not leaves >= enters:
            return 0
    else:
        turn = _orientation(scratch, REFERENCE_ROWS, sides)
        for k in range(sides):
            nx, ny, offset = _side(scratch, REFERENCE_ROWS, sides, k)
            if offset < math.inf:
                beyond = turn * (nx * start[0] + ny * start[1] - offset)
                rate = turn * (nx * dx + ny * dy)
                # Along a side, the tolerance decides; across it, the crossing does.
                if abs(rate) <= tolerance:
                    if beyond > tolerance:
                        return 0
                elif rate > 0.0:
                    high = min(high, -beyond / rate)
                else:
                    low = max(low, -beyond / rate)
    rows = 0
    if low <= high:
        rows = _add(scratch, rows, start[0] + low * dx, start[1] + low * dy, start[2] + low * dz, CORNER)
    if low < high:
        rows = _add(scratch, rows, start[0] + high * dx, start[1] + high * dy, start[2] + high * dz, CORNER + 1)
    return rows


@kernel
def _into_frame(point, origin, u, v, w):
    """Coordinates of a point in a frame."""
    point = vec3.sub(point, origin)
    return (vec3.dot(u, point), vec3.dot(v, point), vec3.dot(w, point))


@kernel
def _project_point(point, normal):
    """Along the normal on the plane of the frame; the height stays."""
    t = point[2] / normal[2]
    return (point[0] - t * normal[0], point[1] - t * normal[1], point[2])


@kernel
def face_contacts(
    a,
    b,
    points,
    faces,
    corners,
    normal,
    gap,
    point,
    closest,
    size,
    margin,
    position,
    rotation,
    contacts,
    count,
    scratch,
):
    """Contacts of a flat face; the new count, and whether they describe the pair completely.

    They don't if no face is aligned with the normal, or if nothing over it is as close as ``gap``: then other
    features are closest. If they are known (``closest``: their feature, ``point``: the one on b), they are added.
    ``position``, ``rotation``: of a in the world; everything else is in the frame of a.
    """
    face_a, cosine_a = facing(a, faces, normal)
    face_b, cosine_b = facing(b, faces, vec3.neg(normal))
    if max(cosine_a, cosine_b) < FACE_ALIGNED or a[0][0] == SPHERE:
        return count, False
    by_a = cosine_b <= cosine_a + REFERENCE_BIAS
    # A cap is the reference of any face it stands on.
    if by_a and a[0][0] != CYLINDER and b[0][0] == CYLINDER and cosine_b >= STANDING:
        by_a = False
    elif not by_a and b[0][0] != CYLINDER and a[0][0] == CYLINDER and cosine_a >= STANDING:
        by_a = True
    tolerance = FLUSH * size
    if by_a:
        reference, face, other, sense = a, face_a, b, 1.0
        point = vec3.add_scaled(point, -gap, normal)
    else:
        reference, face, other, sense = b, face_b, a, -1.0
    origin, u, v, w = frame_of_face(reference, points, faces, corners, face)
    outward = vec3.scale(sense, normal)
    in_frame = (vec3.dot(u, outward), vec3.dot(v, outward), vec3.dot(w, outward))
    slope_u, slope_v = in_frame[0] / in_frame[2], in_frame[1] / in_frame[2]
    against = vec3.neg(outward)
    incident, cosine = facing(other, faces, vec3.neg(w))
    if other[0][0] == CYLINDER:
        incident, cosine = facing(other, faces, against)
    is_cap = reference[0][0] == CYLINDER
    radius = reference[0][1][0]
    sides = 0
    if not is_cap:
        sides = load_face(scratch, REFERENCE_ROWS, reference, points, faces, corners, face, origin, u, v, w)
    first = np.int64(FIRST_BUFFER)
    if other[0][0] == CYLINDER and cosine >= STANDING:
        center, _, _, axis = frame_of_face(other, points, faces, corners, incident)
        axis = (vec3.dot(u, axis), vec3.dot(v, axis), vec3.dot(w, axis))
        turned = mat3.multiply((u[0], u[1], u[2], v[0], v[1], v[2], w[0], w[1], w[2]), other[2])
        placed = (other[0], other[1], turned)
        local = mat3.apply_transposed(other[2], against)
        center = _into_frame(center, origin, u, v, w)
        rows = _cap_on_cap(scratch, radius, placed, in_frame, local, center, axis, tolerance)
    elif cosine < 0.0 or other[0][0] == CYLINDER:
        center, axis, half, line_radius = straight_line(other, against, STANDING)
        if half == 0.0:
            return count, False
        # Which of its caps looks down is round-off.
        incident = 0
        toward = against
        if other[0][0] == CYLINDER:
            toward = vec3.normalize(vec3.add_scaled(against, -vec3.dot(against, axis), axis))
        center = vec3.add_scaled(center, line_radius, toward)
        start = _into_frame(vec3.add_scaled(center, -half, axis), origin, u, v, w)
        end = _into_frame(vec3.add_scaled(center, half, axis), origin, u, v, w)
        start, end = _project_point(start, in_frame), _project_point(end, in_frame)
        rows = _line_on_face(scratch, start, end, sides, radius, tolerance)
    elif is_cap:
        rows = load_face(scratch, REFERENCE_ROWS, other, points, faces, corners, incident, origin, u, v, w)
        project(scratch, REFERENCE_ROWS, rows, slope_u, slope_v)
        local = mat3.apply_transposed(reference[2], outward)
        rows = _polygon_on_cap(scratch, rows, radius, local, tolerance)
    else:
        rows = load_face(scratch, FIRST_BUFFER, other, points, faces, corners, incident, origin, u, v, w)
        project(scratch, FIRST_BUFFER, rows, slope_u, slope_v)
        first, rows = _clip_polygon(scratch, rows, REFERENCE_ROWS, sides, tolerance)
    least = measure(scratch, first, rows, in_frame[2])
    lacks_closest = least > gap + AS_CLOSE * size
    if lacks_closest and closest == UNKNOWN:
        return count, False
    pair = ((0 if by_a else 1) * FACES + face % FACES) * FACES + incident % FACES
    feature = pair * ROW_FEATURES
    if lacks_closest:
        local = _into_frame(point, origin, u, v, w)
        rows = append(scratch, first, rows, local[0], local[1], gap, closest - feature)
    count = emit_rows(
        scratch,
        first,
        rows,
        vec3.add(position, mat3.apply(rotation, origin)),
        mat3.apply(rotation, u),
        mat3.apply(rotation, v),
        mat3.apply(rotation, normal),
        sense,
        size,
        margin,
        feature,
        contacts,
        count,
    )
    return count, True


@kernel
def _square_across(center, axis, radius, start, other_center, other_axis, other_radius):
    """Gap of two round lines along the ray from the first at ``start``, square to it, that meets the other axis.

    Also the ray's unit direction and the middle of the gap. ``start`` [m] along the first axis; a gap of infinity if
    there is no such ray.
    """
    point = vec3.add_scaled(center, start, axis)
    rate = vec3.dot(axis, other_axis)
    t = vec3.dot(axis, vec3.sub(point, other_center)) / rate
    ray = vec3.sub(vec3.add_scaled(other_center, t, other_axis), point)
    length = math.sqrt(vec3.norm_squared(ray))
    if length == 0.0:
        return math.inf, axis, point
    ray = vec3.scale(1.0 / length, ray)
    along = vec3.dot(ray, other_axis)
    gap = length - radius - other_radius / math.sqrt(1.0 - along * along)
    return gap, ray, vec3.add_scaled(point, radius + 0.5 * gap, ray)


@kernel
def line_contacts(a, b, normal, gap, size, margin, position, rotation, contacts, count):
    """Contacts at both ends of the common stretch of two parallel lines; the new count, and whether one is as close.

    Each lies on the ray that is square to the axis that ends there. Apart, that ray is its own normal.
    """
    center_a, u, length_a, radius_a = straight_line(a, normal, LINE_SLOPE)
    center_b, v, length_b, radius_b = straight_line(b, vec3.neg(normal), LINE_SLOPE)
    if length_a == 0.0 or length_b == 0.0 or vec3.norm_squared(vec3.cross(u, v)) > LINE_SLOPE * LINE_SLOPE:
        return count, False
    cosine = vec3.dot(u, v)
    lower, upper = stretch_ends(vec3.dot(u, vec3.sub(center_b, center_a)), length_a, cosine, length_b)
    if upper - lower < SHORTEST_STRETCH * size:
        return count, False
    least = math.inf
    for end in range(2):
        limit = upper if end == 1 else lower
        if abs(limit) < length_a:
            side = length_b if (end == 1) == (cosine > 0.0) else -length_b
            end_gap, ray, middle = _square_across(center_b, v, radius_b, side, center_a, u, radius_a)
            ray = vec3.neg(ray)
        else:
            end_gap, ray, middle = _square_across(center_a, u, radius_a, limit, center_b, v, radius_b)
        cosine_ray = vec3.dot(ray, normal)
        same = vec3.norm_squared(vec3.sub(ray, normal)) <= SAME_NORMAL * SAME_NORMAL
        if gap <= 0.0:
            # Overlapping, the least overlap is the measure: along its normal no depth exceeds it.
            ray = normal
            end_gap *= cosine_ray
        # Where the axes all but meet, the ray has no sense.
        if cosine_ray > FACE_ALIGNED and end_gap <= margin:
            if same:
                least = min(least, end_gap)
            middle = vec3.add(position, mat3.apply(rotation, middle))
            count = emit(contacts, count, middle, mat3.apply(rotation, ray), end_gap, FIRST_END_FEATURE + end)
    return count, least <= gap + AS_CLOSE * size
