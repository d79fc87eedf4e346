"""One point and the facets of a height field: whether its foot is on one, or comes over it, and the nearest of all."""

from __future__ import annotations

from ..jit import kernel
from ..maths import vec3
from .height_field_grid import bend_of, cell_index, sample, slopes
from .triangle import REGION_SLACK, closest_point

# A corner below the surface looks for the nearest point of it this many cells around; deeper ones take the face above.
SEARCH_CELLS = 3.0


@kernel
def cells_around(grid, rows, columns, p, reach):
    """First and last row, first and last column of the cells within ``reach`` [m] along x and y of p."""
    return (
        cell_index(p[1] - reach - grid[1], grid[5], rows - 1),
        cell_index(p[1] + reach - grid[1], grid[5], rows - 1),
        cell_index(p[0] - reach - grid[0], grid[4], columns - 1),
        cell_index(p[0] + reach - grid[0], grid[4], columns - 1),
    )


@kernel
def surface_point(grid, heights, rows, columns, p):
    """p itself if it is free, else the point of the surface nearest to it."""
    x = (p[0] - grid[0]) * grid[4]
    y = (p[1] - grid[1]) * grid[5]
    if not (0.0 <= x <= columns - 1 and 0.0 <= y <= rows - 1):
        return p
    column = min(int(x), columns - 2)
    row = min(int(y), rows - 2)
    corner = row * columns + column
    slope_x, slope_y = slopes(grid, heights, corner, columns, 1 if y - row > x - column else 0)
    depth = heights[corner] + slope_x * (x - column) * grid[2] + slope_y * (y - row) * grid[3] - p[2]
    if depth <= 0.0:
        return p
    best = (p[0], p[1], p[2] + depth)
    best_square = depth * depth
    reach = min(depth, SEARCH_CELLS * max(grid[2], grid[3]))
    first_row, last_row, first_column, last_column = cells_around(grid, rows, columns, p, reach)
    for row in range(first_row, last_row + 1):
        for column in range(first_column, last_column + 1):
            a = sample(grid, heights, columns, row, column)
            c = sample(grid, heights, columns, row + 1, column + 1)
            for upper in range(2):
                # ABC, and ACD as ADC: the way round does not matter here.
                b = sample(grid, heights, columns, row + upper, column + 1 - upper)
                q, _ = closest_point(p, a, b, c)
                square = vec3.norm_squared(vec3.sub(p, q))
                if square < best_square:
                    best_square = square
                    best = q
    return best


@kernel
def over_facet(grid, r, slope_x, slope_y, upper):
    """Whether the foot of a point above the plane of a facet lies on the facet; ``r`` [m] leads to it from corner A."""
    over = r[2] - slope_x * r[0] - slope_y * r[1]
    if over < -REGION_SLACK * (grid[2] + grid[3]):
        return False
    # Place in the cell of the foot, 0 to ``stretch``.
    stretch = 1.0 + slope_x * slope_x + slope_y * slope_y
    u = (r[0] * stretch + over * slope_x) * grid[4]
    v = (r[1] * stretch + over * slope_y) * grid[5]
    if upper == 1:
        u, v = v, u
    # 0 <= v <= u <= 1 inside ABC, and the mirror image inside ACD.
    tolerance = REGION_SLACK * stretch
    return v >= -tolerance and v <= u + tolerance and u <= stretch + tolerance


@kernel
def may_come_over_facet(grid, r, slope_x, slope_y, upper, motion):
    """Whether the foot of a point above or below a facet is on the facet, or comes over it if it moves by ``motion``
    [m], by a bound: seen from above it is beyond no side by more. On the facet it is at least as far beyond.

    ``r`` [m] leads to the point from corner A.
    """
    over = r[2] - slope_x * r[0] - slope_y * r[1]
    stretch = 1.0 + slope_x * slope_x + slope_y * slope_y
    # The foot from corner A, and all lengths beside it, times ``stretch``.
    x = r[0] * stretch + over * slope_x
    y = r[1] * stretch + over * slope_y
    far = (motion + 2.0 * REGION_SLACK * (grid[2] + grid[3])) * stretch
    # The diagonal is shorter than both sides together.
    diagonal = (grid[2] + grid[3]) * far
    if upper == 0:
        return y >= -far and x <= grid[2] * stretch + far and y * grid[2] - x * grid[3] <= diagonal
    return x >= -far and y <= grid[3] * stretch + far and x * grid[3] - y * grid[2] <= diagonal


@kernel
def comes_over_facet(grid, heights, rows, columns, p, row, column, upper, motion, sunk):
    """Whether the foot of p, beside a facet and above its plane, can come over the facet across a concave edge.

    p must be above the plane of the facet beyond that edge too: behind a wall the plane of the floor in front of it
    holds nothing. ``motion`` [m]: how far p can come; ``sunk`` [m]: how far p is below the surface; ``row``,
    ``column``: the cell; ``upper``: its facet as in ``slopes``.
    """
    corner = row * columns + column
    slope_x, slope_y = slopes(grid, heights, corner, columns, upper)
    n = vec3.normalize((-slope_x, -slope_y, 1.0))
    found = False
    for side in range(3):
        # The edge of the cell along x, the one along y, the diagonal; seen from above, the facet lies to its left.
        start_row, start_column, rise, shift, e, across = row, column, 1, 1, (-grid[2], -grid[3], 0.0), corner
        if side == 0:
            start_row, rise = row + upper, 0
            e = (grid[2], 0.0, 0.0)
            across = corner + (2 * upper - 1) * columns
        elif side == 1:
            start_column, shift = column + 1 - upper, 0
            e = (0.0, grid[3], 0.0)
            across = corner + 1 - 2 * upper
        start = sample(grid, heights, columns, start_row, start_column)
        if upper == 1:
            e = vec3.neg(e)
        e = (e[0], e[1], slope_x * e[0] + slope_y * e[1])
        r = vec3.sub(p, start)
        beyond = vec3.dot(vec3.cross(e, n), r)
        square = vec3.norm_squared(e)
        if beyond <= 0.0 or beyond * beyond <= REGION_SLACK * REGION_SLACK * square * square:
            continue
        bend = bend_of(heights, rows, columns, start_row, start_column, rise, shift)
        if bend > grid[6] or beyond * beyond > motion * motion * square:
            return False
        if bend < -grid[6]:
            slope_x_across, slope_y_across = slopes(grid, heights, across, columns, 1 - upper)
            below = slope_x_across * r[0] + slope_y_across * r[1] - r[2]
            stretch = 1.0 + slope_x_across * slope_x_across + slope_y_across * slope_y_across
            allowed = 2.0 * sunk + REGION_SLACK * (grid[2] + grid[3])
            if below > 0.0 and below * below > stretch * allowed * allowed:
                return False
            found = True
    return found
