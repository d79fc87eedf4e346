"""The common part of two flat things laid on one another: a polygon, a cap or a line on a polygon or a cap.

All lie in the frame of the reference face, and the other one is projected on its plane along the contact normal. The
common part is described by its extreme points, a row of the scratch array each, from FIRST_BUFFER on:

* polygon on polygon: the clipped polygon (polytope.py);
* polygon on cap: corners of the polygon on the cap, points where its sides cross the rim, points of the rim over the
  polygon;
* cap on cap: points of each rim on the other cap, and where the rims cross;
* line (capsule, lying cylinder, edge of a box) on polygon or cap: the ends of the common stretch.
"""

from __future__ import annotations

import math

import numpy as np

from ..jit import kernel
from ..maths import mat3, vec3
from .cylinder import CLEARLY_LOWER, FLAT_CAP, rim_direction
from .polytope import FACE_ALIGNED, FIRST_BUFFER, FIRST_SIDE, append, clip
from .reduction import HEIGHT, X, Y

# Rows of the polygon that others are tested against.
REFERENCE_ROWS = 160

# Steps of Newton's method that bring two rims, tilted by at most acos(FACE_ALIGNED), to their crossing.
MOST_CORRECTIONS = 10

# Features of the points of a polygon and a rim.
CORNER, CROSSING, RIM = 0, 64, 256


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
def clip_polygon(scratch, count, reference, sides, tolerance):
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
def polygon_on_cap(scratch, count, radius, local, tolerance):
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
def cap_on_cap(scratch, radius, other, normal, local, center, axis, tolerance):
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
def line_on_face(scratch, start, end, sides, radius, tolerance):
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
