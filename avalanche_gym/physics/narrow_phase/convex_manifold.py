"""Contacts of two solids along a known normal: what flat faces, caps and straight lines have in common.

One flat face that looks along the normal is the reference. The other solid's part that faces it is projected on its plane
along the normal, and the common part of both is described by its extreme points:

* polygon on polygon: the clipped polygon (polytope.py);
* polygon on cap: corners of the polygon on the cap, points where its sides cross the rim, points of the rim over the polygon;
* cap on cap: points of each rim on the other cap, and where the rims cross;
* line (capsule, lying cylinder, edge of a box) on polygon or cap: the ends of the common stretch.

Two parallel lines get a contact at both ends of their common stretch. What has none of these gets the closest pair alone.
Everything is in the frame of solid a; emit_rows brings it to the world.
"""

from __future__ import annotations

import math

import numpy as np

from ..jit import kernel
from ..maths import mat3, vec3
from ..model import CYLINDER, SPHERE
from .cylinder import STANDING, rim_direction
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
from .reduction import GAP, HEIGHT, X, Y
from .segment import clamp, stretch_ends
from .sphere import CORES_TOUCH, emit_round
from .solid import facing, frame_of_face, load_face, rounding, straight_line

# Rows of the polygon that others are tested against.
REFERENCE_ROWS = 160

# Faces of one solid that features can tell apart; more faces share numbers, which only the warm start would notice.
FACES = 256

PAIR_FEATURE = 2 * FACES * FACES * ROW_FEATURES
FIRST_END_FEATURE = PAIR_FEATURE + 1

# Features of the points of a polygon and a rim.
CORNER, CROSSING, RIM = 0, 64, 256

# Sine of the angle between a line and what it lies on, or along, up to which its ends get contacts.
LINE_SLOPE = 0.05

# A common stretch of two lines must be this long, relative to the pair's size, to have two ends.
SHORTEST_STRETCH = 1e-3


@kernel
def _side(scratch, first, count, k):
    """Unit outward normal and offset of side k of a counter-clockwise polygon; nothing lies beyond a side of no length."""
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
def _polygon_on_cap(scratch, count, radius, slope_u, slope_v, local, tolerance):
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
            rows = append(scratch, FIRST_BUFFER, rows, x, y, 0.0, CORNER + corner)
            scratch[FIRST_BUFFER + rows - 1, HEIGHT] = height
        following = first + (corner + 1) % count
        dx, dy = scratch[following, X] - x, scratch[following, Y] - y
        enters, leaves = _rim_crossings(x, y, scratch[following, X], scratch[following, Y], radius)
        shortest = tolerance / (abs(dx) + abs(dy) + tolerance)
        for crossing in range(2):
            t = enters if crossing == 0 else leaves
            if shortest < t < 1.0 - shortest:
                rows = append(
                    scratch, FIRST_BUFFER, rows, x + t * dx, y + t * dy, 0.0, CROSSING + 2 * corner + crossing
                )
                scratch[FIRST_BUFFER + rows - 1, HEIGHT] = height + t * (scratch[following, HEIGHT] - height)
    if abs(area) <= tolerance * tolerance:
        return rows
    hx = (az * by - bz * ay) / area
    hy = (bz * ax - az * bx) / area
    for k in range(5):
        x, y, feature, _ = rim_direction(local, k)
        x, y = radius * x, radius * y
        if _inside_polygon(scratch, first, count, turn, x, y, -tolerance):
            rows = append(scratch, FIRST_BUFFER, rows, x, y, 0.0, RIM + feature)
            scratch[FIRST_BUFFER + rows - 1, HEIGHT] = (
                scratch[first, HEIGHT] + hx * (x - scratch[first, X]) + hy * (y - scratch[first, Y])
            )
    return rows
