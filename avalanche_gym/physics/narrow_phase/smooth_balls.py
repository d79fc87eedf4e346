"""A ball of a body (radius 0: a vertex) against the smooth surface of a height field.

It touches at the points of the surface that are locally the nearest to its centre. One search from below the centre
finds the only one if the surface does not bend as sharply as the ball within its reach,

    2 reach max(|z_xx|, |z_yy|) + |z_xy|) < 1,

which the second differences of the coefficients prove: then D (smooth_surface.py) is convex wherever a contact could
be. Otherwise the searches start from every local minimum of D on a lattice of ``LATTICE`` points across the reach; what
is finer than that lattice can be missed. A centre below the surface leaves by the shortest way.
"""

from __future__ import annotations

import math

from ..jit import kernel
from .smooth_candidates import FLAT_SLOPE, add_touch, numbered
from .smooth_surface import height, locate, signed_distance
from .terrain_shape import FIRST_FREE_ROW, margin_of

# Most points of a lattice of seeds along x and y; 28^2 heights fill the free rows of the scratch table.
LATTICE = 28
# A lattice has this many points in a cell, and in the reach.
POINTS_IN_CELL = 2.0
POINTS_IN_REACH = 4.0


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
            count = add_touch(scratch, count, p, radius, distance, normal, feature)
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
        count = add_touch(scratch, count, p, radius, deepest, way_out, feature)
    return count
