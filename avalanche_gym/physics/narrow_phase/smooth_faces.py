"""A flat face of a body over a hilltop of the smooth surface.

With the outward unit normal m of the face, through the point o, the surface stands

    w(x, y) = m . (q - o),    q = (x, y, z(x, y))

in front of the face (negative: it has come through). Inside the face the contact is at a local minimum of w, where the
normal of the surface is -m:

    w_x = m_x + m_z z_x = 0,    w_y = m_y + m_z z_y = 0.

Seeds are the samples of the field over the face that are lower in w than their eight neighbours, at most ``SEEDS``
along x and y (then every second sample, or third, and so on). A face that spans few cells has two hilltops in one of
them, and hilltops beside lower ground: there seeds are the samples and the points midway from which Newton's method
goes to a minimum less than a pace away. Each is followed; one that leaves the face is left to its edges. A hilltop that
rises over its neighbours by less than the spline bends in a pace is missed.
"""

from __future__ import annotations

import math

import numpy as np

from ..jit import kernel
from ..maths import vec3
from .smooth_candidates import numbered
from .smooth_surface import SMALLEST_STEP, jet, locate
from .terrain_candidates import add_candidate
from .terrain_shape import END_FREE_ROW, get, margin_of, put

# Corners of the face in the last rows of the scratch table.
MOST_CORNERS = 32
CORNERS_ROW = END_FREE_ROW - MOST_CORNERS

# Most seeds along x and y.
SEEDS = 32
# A face over so many cells along x and y, or less, has seeds between the samples too. Larger: such faces cost more.
FEW_CELLS = 6
# A first step of Newton's method leads to a minimum nearby if it is no longer than this share of a cell: somewhat more
# than from one seed to the next.
NEARBY = 0.75
# A face that looks up or sideways, by this z of its normal, has no hilltop in front.
LOOKS_DOWN = -1e-6
# A sample is lower than its neighbours if by this part of a cell: a flat floor has no hilltops.
CLEARLY_LOWER = 1e-9
MOST_STEPS = 20


@kernel
def put_corner(scratch, number, p):
    """Write corner ``number`` of the face, in the terrain's frame, counter-clockwise seen from outside."""
    put(scratch, CORNERS_ROW + number, 0, p)


@kernel
def _in_front(patch, c, m, o, row, column):
    """w [m] at a sample, infinite outside the field."""
    if row < 0 or column < 0 or row > patch[9] or column > patch[8]:
        return math.inf
    # The coefficients are weighted 1, 4, 1 at a sample.
    z = 0.0
    for k in range(3):
        s = c[row + k, column] + 4.0 * c[row + k, column + 1] + c[row + k, column + 2]
        z += 4.0 * s if k == 1 else s
    x = patch[0] + column * patch[2]
    y = patch[1] + row * patch[3]
    return m[0] * (x - o[0]) + m[1] * (y - o[1]) + m[2] * (z / 36.0 - o[2])


@kernel
def _is_lowest(patch, c, m, o, row, column, stride, w):
    for i in range(-1, 2):
        for k in range(-1, 2):
            if i != 0 or k != 0:
                other = _in_front(patch, c, m, o, row + i * stride, column + k * stride)
                if other < w + CLEARLY_LOWER * min(patch[2], patch[3]):
                    return False
    return True


@kernel
def _leads_nearby(patch, c, m, o, x, y, near):
    """Whether w at x, y is at most ``near`` [m] and a bowl whose bottom is close by."""
    j = jet(patch, c, x, y)
    if m[0] * (x - o[0]) + m[1] * (y - o[1]) + m[2] * (j[0] - o[2]) > near:
        return False
    gx, gy = m[0] + m[2] * j[1], m[1] + m[2] * j[2]
    hxx, hxy, hyy = m[2] * j[3], m[2] * j[4], m[2] * j[5]
    determinant = hxx * hyy - hxy * hxy
    cell = min(patch[2], patch[3])
    # A flat floor is none.
    if not (hxx * cell > CLEARLY_LOWER and determinant * cell * cell > CLEARLY_LOWER * CLEARLY_LOWER):
        return False
    return (
        abs(hxy * gy - hyy * gx) <= NEARBY * patch[2] * determinant
        and abs(hxy * gx - hxx * gy) <= NEARBY * patch[3] * determinant
    )


@kernel
def _is_over_face(scratch, num_corners, radius, o, m, q):
    """Whether q lies inside the polygon of the corners, or the disc about o, seen along m."""
    if num_corners == 0:
        d = vec3.sub(q, o)
        return vec3.norm_squared(vec3.add_scaled(d, -vec3.dot(d, m), m)) <= radius * radius
    for k in range(num_corners):
        a = get(scratch, CORNERS_ROW + k, 0)
        b = get(scratch, CORNERS_ROW + (k + 1) % num_corners, 0)
        if vec3.dot(vec3.cross(m, vec3.sub(b, a)), vec3.sub(q, a)) < 0.0:
            return False
    return True


@kernel
def _follow(patch, c, m, x, y):
    """The local minimum of w near x, y: whether there is one, x, y and z."""
    cell = min(patch[2], patch[3])
    for _ in range(MOST_STEPS):
        j = jet(patch, c, x, y)
        gx, gy = m[0] + m[2] * j[1], m[1] + m[2] * j[2]
        hxx, hxy, hyy = m[2] * j[3], m[2] * j[4], m[2] * j[5]
        determinant = hxx * hyy - hxy * hxy
        if not (hxx > 0.0 and determinant > 0.0):
            return False, x, y, j[0]
        step_x = (hxy * gy - hyy * gx) / determinant
        step_y = (hxy * gx - hxx * gy) / determinant
        longest = max(abs(step_x), abs(step_y))
        if longest > cell:
            step_x, step_y = step_x * cell / longest, step_y * cell / longest
        x, y = x + step_x, y + step_y
        if not (patch[0] < x < patch[6] and patch[1] < y < patch[7]):
            return False, x, y, j[0]
        if longest <= SMALLEST_STEP * cell:
            break
    return True, x, y, jet(patch, c, x, y)[0]


@kernel
def collide_face(patch, c, m, o, low, high, num_corners, radius, depth, feature, scratch, count):
    """Contacts of the inside of a face with the surface; return the new count.

    Args:
        m, o: outward unit normal of the face, and a point of it (the centre of a disc), terrain's frame.
        low, high: (2,) bounds [m] of the face along x and y.
        num_corners: of the polygon in the scratch table; 0 for a disc of ``radius`` [m].
        depth: [m] a hilltop that is farther in is left to the other faces.
    """
    if m[2] > LOOKS_DOWN:
        return count
    first_column, _ = locate(low[0] - patch[0], patch[4], patch[8])
    last_column, _ = locate(high[0] - patch[0], patch[4], patch[8])
    first_row, _ = locate(low[1] - patch[1], patch[5], patch[9])
    last_row, _ = locate(high[1] - patch[1], patch[5], patch[9])
    cells = max(last_column - first_column + 1, last_row - first_row + 1)
    few = cells <= FEW_CELLS
    stride = 1 + cells // SEEDS
    pace = 0.5 if few else float(stride)
    margin = margin_of(scratch)
    near = margin + pace * max(patch[2], patch[3])
    rows = (2 if few else 1) * (last_row + 1 - first_row) // stride + 1
    columns = (2 if few else 1) * (last_column + 1 - first_column) // stride + 1
    for row in range(rows):
        for column in range(columns):
            x = patch[0] + (first_column + pace * column) * patch[2]
            y = patch[1] + (first_row + pace * row) * patch[3]
            if few:
                if not _leads_nearby(patch, c, m, o, x, y, near):
                    continue
            else:
                i, k = first_row + row * stride, first_column + column * stride
                w = _in_front(patch, c, m, o, i, k)
                if w > near or not _is_lowest(patch, c, m, o, i, k, stride, w):
                    continue
            found, x, y, z = _follow(patch, c, m, x, y)
            q = (x, y, z)
            gap = vec3.dot(m, vec3.sub(q, o))
            if found and -depth <= gap <= margin and _is_over_face(scratch, num_corners, radius, o, m, q):
                position = vec3.add_scaled(q, -0.5 * gap, m)
                count = add_candidate(scratch, count, position, vec3.neg(m), gap, np.float64(numbered(feature, False)))
    return count
