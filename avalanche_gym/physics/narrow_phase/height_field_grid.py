"""The facets of a height field: samples, planes, and the features that stick out, read off the heights in place.

A cell (row i, column j) has the corners A = (i, j), B = (i, j + 1), C = (i + 1, j + 1), D = (i + 1, j) and the
triangles ABC and ACD. Every edge is a diagonal of the parallelogram of its two triangles, seen from above, so it
sticks out exactly if the mean of its ends is above the mean of the two corners opposite to it: a second difference of
heights. Nothing is precomputed, because heights may move.

``grid`` is (x of column 0, y of row 0, spacing along x, along y [m], their inverses [1/m]); ``heights`` is the
(rows * columns,) view of one field. At the rim the solid ends in a vertical wall: rim edges and vertices stick out, and
their cones end at the horizontal.
"""

from __future__ import annotations

import math

from ..jit import kernel
from ..maths import vec3
from .terrain_features import put_edge
from .terrain_shape import BOUNDS_ROW, put

# An edge is flat below this angle [rad] between its faces: heights sampled from a plane carry round-off. What is lost
# is a bend that lets a body sink by this much of a cell.
FLAT_ANGLE = 1e-10
# ... or below this many units of round-off of the heights themselves.
FLAT_ROUND_OFF = 16.0 * 2.220446049250313e-16


@kernel
def grid_of(field):
    """``grid`` of a HEIGHT_FIELD_ROW."""
    dx = field.extent[0] / (field.columns - 1)
    dy = field.extent[1] / (field.rows - 1)
    return (-0.5 * field.extent[0], -0.5 * field.extent[1], dx, dy, 1.0 / dx, 1.0 / dy)


@kernel
def sample(grid, heights, columns, row, column):
    """The surface point of a sample."""
    return (grid[0] + column * grid[2], grid[1] + row * grid[3], heights[row * columns + column])


@kernel
def cell_index(distance, inverse_spacing, cells):
    """Index of the cell at this distance from the first sample; the nearest one outside the field."""
    u = distance * inverse_spacing
    if not u > 0.0:
        return 0
    if u >= cells:
        return cells - 1
    return int(u)


@kernel
def face_normal(grid, heights, corner, columns, upper):
    """Unit normal of triangle ABC (``upper`` 0) or ACD (1) of the cell whose A is sample ``corner``."""
    a = heights[corner]
    c = heights[corner + columns + 1]
    if upper == 0:
        b = heights[corner + 1]
        slope_x = (b - a) * grid[4]
        slope_y = (c - b) * grid[5]
    else:
        d = heights[corner + columns]
        slope_x = (c - d) * grid[4]
        slope_y = (d - a) * grid[5]
    s = 1.0 / math.sqrt(1.0 + slope_x * slope_x + slope_y * slope_y)
    return (-s * slope_x, -s * slope_y, s)


@kernel
def _is_convex(grid, heights, rows, columns, row, column, rise, shift):
    """Whether the edge from (row, column) to (row + rise, column + shift) exists and sticks out."""
    if row < 0 or column < 0 or row + rise >= rows or column + shift >= columns:
        return False
    corner = row * columns + column
    first = corner + columns + 1
    second = corner - columns
    spacing = grid[3]
    if rise == 0:
        if row == 0 or row == rows - 1:
            return True
    elif shift == 0:
        if column == 0 or column == columns - 1:
            return True
        second = corner - 1
        spacing = grid[2]
    else:
        first = corner + 1
        second = corner + columns
        spacing = min(grid[2], grid[3])
    ends = heights[corner] + heights[corner + rise * columns + shift]
    others = heights[first] + heights[second]
    return ends - others > FLAT_ANGLE * spacing + FLAT_ROUND_OFF * (abs(ends) + abs(others))


@kernel
def _wall(e):
    """Direction down the wall below a rim edge, at right angles to it."""
    return vec3.normalize((e[2] * e[0], e[2] * e[1], e[2] * e[2] - 1.0))


@kernel
def list_edge(grid, heights, rows, columns, row, column, rise, shift, scratch, end):
    """Append the edge from (row, column) to (row + rise, column + shift) to the list; return its new end."""
    start = sample(grid, heights, columns, row, column)
    e = vec3.sub(sample(grid, heights, columns, row + rise, column + shift), start)
    length = math.sqrt(vec3.norm_squared(e))
    e = vec3.scale(1.0 / length, e)
    # The face to the left is ACD or, along x, ABC of the cell ahead; along y it is ABC of the cell behind. Right:
    # likewise.
    left_column = column - (1 if shift == 0 else 0)
    right_row = row - (1 if rise == 0 else 0)
    m1 = _wall(e)
    m2 = m1
    if row < rows - 1 and left_column >= 0:
        left = face_normal(grid, heights, row * columns + left_column, columns, rise * shift)
        m1 = vec3.cross(left, e)
    if right_row >= 0 and column < columns - 1:
        right = face_normal(grid, heights, right_row * columns + column, columns, 1 - rise * shift)
        m2 = vec3.cross(e, right)
    out = vec3.sub(vec3.cross(e, m1), vec3.cross(e, m2))
    return put_edge(scratch, end, start, e, length, m1, m2, out)


@kernel
def list_vertex(grid, heights, rows, columns, row, column, scratch, end):
    """Append a sample to the list if three or more of its edges stick out (a wall counts); return the new end.

    With fewer, the normal cone has no inside, and the edges or faces have its contacts.
    """
    rim = row == 0 or column == 0 or row == rows - 1 or column == columns - 1
    convex = 1 if rim else 0
    for rise in range(2):
        for shift in range(1 - rise, 2):
            convex += _is_convex(grid, heights, rows, columns, row, column, rise, shift)
            convex += _is_convex(grid, heights, rows, columns, row - rise, column - shift, rise, shift)
    if convex < 3:
        return end
    corner = row * columns + column
    spoke = end + 1
    if rim:
        put(scratch, spoke, 0, (0.0, 0.0, -1.0))
        spoke += 1
    for side in range(-1, 2, 2):
        for rise in range(2):
            for shift in range(1 - rise, 2):
                i = row + side * rise
                j = column + side * shift
                if 0 <= i < rows and 0 <= j < columns:
                    x = side * shift * grid[2]
                    y = side * rise * grid[3]
                    z = heights[i * columns + j] - heights[corner]
                    s = 1.0 / math.sqrt(x * x + y * y + z * z)
                    put(scratch, spoke, 0, (s * x, s * y, s * z))
                    spoke += 1
    scratch[end, 0] = spoke - end - 1
    put(scratch, end, 1, sample(grid, heights, columns, row, column))
    put(scratch, end, 4, (0.0, 0.0, 1.0))
    scratch[end, 7] = corner
    return spoke


@kernel
def list_features(grid, heights, rows, columns, row, column, scratch, end):
    """Append what sticks out of a sample and of the three edges it owns, within the shape's bounds; return the new end.

    Appends at most 17 rows.
    """
    x, y, z = sample(grid, heights, columns, row, column)
    if x > scratch[BOUNDS_ROW, 3] or y > scratch[BOUNDS_ROW, 4]:
        return end
    low = scratch[BOUNDS_ROW, 2]
    high = scratch[BOUNDS_ROW, 5]
    in_x = x >= scratch[BOUNDS_ROW, 0]
    in_y = y >= scratch[BOUNDS_ROW, 1]
    for edge in range(3):
        # Along x, along y, the diagonal.
        rise = 0 if edge == 0 else 1
        shift = 0 if edge == 1 else 1
        if (
            (in_x or x + shift * grid[2] >= scratch[BOUNDS_ROW, 0])
            and (in_y or y + rise * grid[3] >= scratch[BOUNDS_ROW, 1])
            and _is_convex(grid, heights, rows, columns, row, column, rise, shift)
        ):
            far = heights[(row + rise) * columns + column + shift]
            if max(z, far) >= low and min(z, far) <= high:
                end = list_edge(grid, heights, rows, columns, row, column, rise, shift, scratch, end)
    if in_x and in_y and low <= z <= high:
        end = list_vertex(grid, heights, rows, columns, row, column, scratch, end)
    return end
