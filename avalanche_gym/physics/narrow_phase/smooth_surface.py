"""The smooth surface of a height field: height, slopes, second derivatives; the point of it nearest to a point.

In cell (row i, column j), with u and v in [0, 1] across it and b_0 ... b_3 the four pieces of the cubic B-spline,

    z(u, v) = sum_kl b_k(v) b_l(u) c[i + k, j + l],

c being the (rows + 2, columns + 2) coefficients of shapes/height_spline.py. Every value is a mean of 16 coefficients
with positive weights, so their extremes bound it.

**Nearest point.** Of p, minimise half of the squared distance D(x, y) = |q - p|^2 / 2 with q = (x, y, z(x, y)):

    D_x = (x - p_x) + (z - p_z) z_x,    D_xx = 1 + z_x^2 + (z - p_z) z_xx,    D_xy = z_x z_y + (z - p_z) z_xy,

by Newton's method, with the matrix of Gauss and Newton (second derivatives left out) where the full one is not positive
definite, and steps halved until D does not grow (Nocedal and Wright 2006, section 3.4). x and y stay in the rectangle:
a coordinate at its border that D wants outside is held there (projected Newton, Bertsekas 1982).

**The solid** is all below the surface, over the rectangle; its sides are upright walls. The signed distance of a point
is to the nearer of surface and walls.

``patch`` is (x of column 0, y of row 0, spacing along x, along y [m], their inverses [1/m], x of the last column, y of
the last row [m], columns - 1, rows - 1).
"""

from __future__ import annotations

import math

from ..jit import kernel
from ..maths import vec3

# A full Newton step below this part of a cell is the last one: the next would be its square.
LAST_STEP = 1e-7
# Any other step below this part of a cell ends the search: it has run into a border or into round-off.
SMALLEST_STEP = 1e-13
MOST_STEPS = 60
# D may grow by this many units of round-off in a step. A distance is known to so many, of the size of the field.
ROUND_OFF = 8.0 * 2.220446049250313e-16
# Added to |H|, whose size is 1 on flat ground: where the bend just cancels the distance a step would have no end.
# Larger: it takes long to leave a saddle.
SOFTEST = 1e-6


@kernel
def patch_of(field):
    """``patch`` of a HEIGHT_FIELD_ROW."""
    dx = field.extent[0] / (field.columns - 1)
    dy = field.extent[1] / (field.rows - 1)
    x, y = 0.5 * field.extent[0], 0.5 * field.extent[1]
    return (-x, -y, dx, dy, 1.0 / dx, 1.0 / dy, x, y, field.columns - 1, field.rows - 1)


@kernel
def coefficients_of(field, pool):
    """View (rows + 2, columns + 2) of the coefficients of a field in the pool of heights, or of rates."""
    first = field.first + field.rows * field.columns
    return pool[first : first + (field.rows + 2) * (field.columns + 2)].reshape((field.rows + 2, field.columns + 2))


@kernel
def locate(distance, inverse_spacing, cells):
    """The cell at a distance from the first sample, the nearest one outside the field, and the place in it."""
    u = distance * inverse_spacing
    cell = 0
    if u > 0.0:
        cell = cells - 1 if u >= cells else int(u)
    return cell, u - cell


@kernel
def _weights(u):
    v = 1.0 - u
    return (
        v * v * v / 6.0,
        (4.0 + u * u * (3.0 * u - 6.0)) / 6.0,
        (4.0 + v * v * (3.0 * v - 6.0)) / 6.0,
        u * u * u / 6.0,
    )


@kernel
def _slopes(u):
    v = 1.0 - u
    return (-0.5 * v * v, u * (1.5 * u - 2.0), v * (2.0 - 1.5 * v), 0.5 * u * u)


@kernel
def _sum(w, c, row, column):
    return w[0] * c[row, column] + w[1] * c[row, column + 1] + w[2] * c[row, column + 2] + w[3] * c[row, column + 3]


@kernel
def height(patch, c, x, y):
    """z [m] (or its rate, of the coefficients of rates) over x, y."""
    column, u = locate(x - patch[0], patch[4], patch[8])
    row, v = locate(y - patch[1], patch[5], patch[9])
    wu, wv = _weights(u), _weights(v)
    z = 0.0
    for k in range(4):
        z += wv[k] * _sum(wu, c, row + k, column)
    return z


@kernel
def jet(patch, c, x, y):
    """(z, z_x, z_y, z_xx, z_xy, z_yy) over x, y."""
    column, u = locate(x - patch[0], patch[4], patch[8])
    row, v = locate(y - patch[1], patch[5], patch[9])
    wu, su, bu = _weights(u), _slopes(u), (1.0 - u, 3.0 * u - 2.0, 1.0 - 3.0 * u, u)
    wv, sv, bv = _weights(v), _slopes(v), (1.0 - v, 3.0 * v - 2.0, 1.0 - 3.0 * v, v)
    z = zx = zy = zxx = zxy = zyy = 0.0
    for k in range(4):
        value = _sum(wu, c, row + k, column)
        slope = _sum(su, c, row + k, column)
        z += wv[k] * value
        zy += sv[k] * value
        zyy += bv[k] * value
        zx += wv[k] * slope
        zxy += sv[k] * slope
        zxx += wv[k] * _sum(bu, c, row + k, column)
    return (
        z,
        zx * patch[4],
        zy * patch[5],
        zxx * patch[4] * patch[4],
        zxy * patch[4] * patch[5],
        zyy * patch[5] * patch[5],
    )


@kernel
def normal_of(j):
    """Upward unit normal of a jet."""
    s = 1.0 / math.sqrt(1.0 + j[1] * j[1] + j[2] * j[2])
    return (-s * j[1], -s * j[2], s)


@kernel
def _direction(j, dx, dy, dz, hold_x, hold_y):
    """Newton step for D, and whether its matrix was the full one; coordinates that are held do not move."""
    gx, gy = dx + dz * j[1], dy + dz * j[2]
    full = True
    hxx, hxy, hyy = 1.0 + j[1] * j[1] + dz * j[3], j[1] * j[2] + dz * j[4], 1.0 + j[2] * j[2] + dz * j[5]
    if hold_x:
        gx, hxx, hxy = 0.0, 1.0, 0.0
    if hold_y:
        gy, hyy, hxy = 0.0, 1.0, 0.0
    determinant = hxx * hyy - hxy * hxy
    if not (hxx > 0.0 and determinant > 0.0):
        # The surface bends away more sharply than p is far: |H|, the root of H^2, leads downhill on the same scale.
        full = False
        size = abs(determinant)
        root = math.sqrt(hxx * hxx + hyy * hyy + 2.0 * (hxy * hxy + size))
        hxx, hxy, hyy = (
            (hxx * hxx + hxy * hxy + size) / root + SOFTEST,
            hxy * (hxx + hyy) / root,
            (hyy * hyy + hxy * hxy + size) / root + SOFTEST,
        )
        determinant = hxx * hyy - hxy * hxy
    return (hxy * gy - hyy * gx) / determinant, (hxy * gx - hxx * gy) / determinant, full


@kernel
def descend(patch, c, p, x, y):
    """From x, y in the rectangle down to a point of the surface that is locally the nearest to p: x, y and its jet."""
    cell = min(patch[2], patch[3])
    best = math.inf
    step_x = step_y = 0.0
    size = 1.0
    full = last = False
    from_x, from_y = x, y
    j = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    for _ in range(MOST_STEPS):
        j = jet(patch, c, x, y)
        dx, dy, dz = x - p[0], y - p[1], j[0] - p[2]
        square = dx * dx + dy * dy + dz * dz
        moved = abs(x - from_x) + abs(y - from_y)
        if square <= best * (1.0 + ROUND_OFF):
            if last or (best < math.inf and moved <= SMALLEST_STEP * cell):
                break
            best = square
            from_x, from_y = x, y
            gx, gy = dx + dz * j[1], dy + dz * j[2]
            hold_x = (x <= patch[0] and gx > 0.0) or (x >= patch[6] and gx < 0.0)
            hold_y = (y <= patch[1] and gy > 0.0) or (y >= patch[7] and gy < 0.0)
            step_x, step_y, full = _direction(j, dx, dy, dz, hold_x, hold_y)
            # What is known of one cell says little of the next but one.
            size = 1.0 if full else min(1.0, cell / max(math.hypot(step_x, step_y), SMALLEST_STEP * cell))
            last = full and abs(step_x) + abs(step_y) <= LAST_STEP * cell
        elif moved <= SMALLEST_STEP * cell:
            break
        else:
            size *= 0.5
            last = False
        x = min(max(from_x + size * step_x, patch[0]), patch[6])
        y = min(max(from_y + size * step_y, patch[1]), patch[7])
    return x, y, j


@kernel
def signed_distance(patch, c, p, x, y):
    """Distance [m] of p from the solid, negative inside, and the unit outward normal there, of the search from x, y.

    The distance is infinite where that search ends on the far side of a ridge.
    """
    near_x = min(max(p[0], patch[0]), patch[6])
    near_y = min(max(p[1], patch[1]), patch[7])
    above = p[2] >= height(patch, c, near_x, near_y)
    beside = near_x != p[0] or near_y != p[1]
    if beside and not above:
        # The wall is in front of it, straight.
        d = (p[0] - near_x, p[1] - near_y, 0.0)
        distance = vec3.norm(d)
        return distance, vec3.scale(1.0 / distance, d)
    x, y, j = descend(patch, c, p, x, y)
    normal = normal_of(j)
    d = (p[0] - x, p[1] - y, p[2] - j[0])
    distance = vec3.dot(normal, d)
    reach = vec3.norm(d)
    if above:
        on_rim = x <= patch[0] or x >= patch[6] or y <= patch[1] or y >= patch[7]
        if ((on_rim and distance >= 0.0) or beside) and distance < reach * (1.0 - ROUND_OFF):
            # On the rim the nearest point need not be straight below.
            return reach, vec3.scale(1.0 / reach, d)
        # Of a point on the surface, to round-off, the sign says nothing.
        unsure = ROUND_OFF * (patch[6] + patch[7] + abs(p[2]))
        return (distance if distance >= -unsure else math.inf), normal
    # Inside: out through the surface, or through a wall that is nearer.
    to_x = min(p[0] - patch[0], patch[6] - p[0])
    to_y = min(p[1] - patch[1], patch[7] - p[1])
    if min(to_x, to_y) < reach:
        if to_x < to_y:
            return -to_x, (1.0 if p[0] > 0.0 else -1.0, 0.0, 0.0)
        return -to_y, (0.0, 1.0 if p[1] > 0.0 else -1.0, 0.0)
    return -reach, normal
