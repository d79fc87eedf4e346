"""The facets of a height field: samples, planes, and the features that stick out, read off the heights in place.

A cell (row i, column j) has the corners A = (i, j), B = (i, j + 1), C = (i + 1, j + 1), D = (i + 1, j) and the
triangles ABC and ACD. Every edge is a diagonal of the parallelogram of its two triangles, seen from above, so it
sticks out exactly if the mean of its ends is above the mean of the two corners opposite to it: a second difference of
heights. Nothing is precomputed, because heights may move.

``grid`` is (x of column 0, y of row 0, spacing along x, along y [m], their inverses [1/m], the second difference
below which an edge is flat [m]); ``heights`` is the (rows * columns,) view of one field. At the rim the solid ends in
a vertical wall: rim edges and vertices stick out, and their cones end at the horizontal.
"""

from __future__ import annotations

import math

from ..jit import kernel
from ..maths import vec3
from ..memory import height_field_of
from ..model import HEIGHT_FIELD
from ..shapes.flatness import FLAT_HEIGHT, HEIGHT_ROUND_OFF


@kernel
def grid_of(field):
    """``grid`` of a HEIGHT_FIELD_ROW.

    An edge is flat below a second difference of FLAT_HEIGHT of the size of the field; a body may sink in by as much.
    """
    dx = field.extent[0] / (field.columns - 1)
    dy = field.extent[1] / (field.rows - 1)
    flat = FLAT_HEIGHT * max(field.extent[0], field.extent[1])
    flat += HEIGHT_ROUND_OFF * max(abs(field.lowest), abs(field.highest))
    return (-0.5 * field.extent[0], -0.5 * field.extent[1], dx, dy, 1.0 / dx, 1.0 / dy, flat)


@kernel
def spacing_of(header, collider):
    """[m] between the samples of a height field of facets; of any other collider without bound."""
    if collider.shape != HEIGHT_FIELD:
        return math.inf
    field = height_field_of(header, collider.data)
    grid = grid_of(field)
    return min(grid[2], grid[3])


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
def slopes(grid, heights, corner, columns, upper):
    """Slopes dz/dx and dz/dy of triangle ABC (``upper`` 0) or ACD (1) of the cell whose A is sample ``corner``."""
    a = heights[corner]
    c = heights[corner + columns + 1]
    if upper == 0:
        b = heights[corner + 1]
        return (b - a) * grid[4], (c - b) * grid[5]
    d = heights[corner + columns]
    return (c - d) * grid[4], (d - a) * grid[5]


@kernel
def upward_normal(grid, heights, corner, columns, upper):
    """Normal of a facet with z component 1."""
    slope_x, slope_y = slopes(grid, heights, corner, columns, upper)
    # Not negated: a flat facet has +0.
    return (0.0 - slope_x, 0.0 - slope_y, 1.0)


@kernel
def face_normal(grid, heights, corner, columns, upper):
    """Unit normal of triangle ABC (``upper`` 0) or ACD (1) of the cell whose A is sample ``corner``."""
    n = upward_normal(grid, heights, corner, columns, upper)
    return vec3.scale(1.0 / math.sqrt(vec3.norm_squared(n)), n)


@kernel
def bend_of(heights, rows, columns, row, column, rise, shift):
    """How far [m] the edge from (row, column) to (row + rise, column + shift) sticks out, as a second difference.

    Infinite at the rim, minus infinite for an edge that does not exist.
    """
    if row < 0 or column < 0 or row + rise >= rows or column + shift >= columns:
        return -math.inf
    if (rise == 0 and (row == 0 or row == rows - 1)) or (shift == 0 and (column == 0 or column == columns - 1)):
        return math.inf
    corner = row * columns + column
    # The corner ahead of the edge and the one behind it.
    first = corner + 1 + columns * (1 - rise * shift)
    if rise == 0:
        second = corner - columns
    elif shift == 0:
        second = corner - 1
    else:
        second = corner + columns
    return heights[corner] + heights[corner + rise * columns + shift] - heights[first] - heights[second]


@kernel
def outside(value, low, high):
    """Distance of a number from an interval."""
    return max(low - value, value - high, 0.0)


@kernel
def cell_range(heights, columns, corner):
    """Lowest and highest sample of the cell whose A is sample ``corner``."""
    a, b = heights[corner], heights[corner + 1]
    c, d = heights[corner + columns + 1], heights[corner + columns]
    return min(min(a, b), min(c, d)), max(max(a, b), max(c, d))
