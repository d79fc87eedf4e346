"""Sphere, capsule and box against the facets of a height field.

Every shape is a core of corners and edges with a radius (terrain_shape.py). Three kinds of contact make up the
manifold: a corner of the core over a face of the terrain; an edge of the core across a convex edge of the terrain, or
a ball beside it; a convex vertex of the terrain under a face of the box, or beside a ball. Cells are found from the
footprint of the shape, so the size of the field does not matter.

**Beyond a concave edge** the plane of a face goes on below the surface, and holds what is above as well as the face
itself does. So a face counts for a corner whose foot can come over it across a concave edge within the step: what
slides down a slope has to know the next one before it gets there.

**A corner below the surface** belongs to the face it has come through: the nearest point of the surface is found, and
the contacts are those of that point, with the depth of the corner. In a corner of several walls this gives one
contact a wall; a thin ridge never pushes a corner out on its far side.
"""

from __future__ import annotations

import math

import numpy as np

from ..jit import kernel
from ..maths import vec3
from ..model import BOX, SPHERE
from .feature_contacts import collide_features
from .height_field_grid import bend_of, cell_index, cell_range, grid_of, list_features, outside, sample
from .height_field_walls import wall_in_front
from .terrain_candidates import FACE_PLACE, POINT, WALL_PLACE, add_candidate, emit_candidates, feature_of
from .terrain_shape import (
    BOUNDS_ROW,
    CENTER_ROW,
    CORNER_ROW,
    axis_of,
    get,
    margin_of,
    motion_of,
    put_shape,
    radius_of,
    scale_of,
    set_motion,
)
from .triangle import REGION_SLACK, closest_point

# A corner that is below the surface by less than this fraction of the shape's size still lies on it: what smooth motion
# leaves of overlap does not hide the next face. Larger: faces on the far side of a ridge that was sunk into.
AFLOAT = 1e-6
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


@kernel
def reach_below(reach, height):
    """Radius [m] of what a ball of radius ``reach`` has lower than ``height`` below its centre, seen from above."""
    if height <= 0.0:
        return reach
    return math.sqrt(max(reach * reach - height * height, 0.0))


@kernel
def corners_against_faces(grid, heights, rows, columns, num_corners, highest, scratch, count):
    """Contacts of the faces with the corners of the shape, or balls around them; return the new count of candidates.

    ``highest``: from highest_below.
    """
    radius = radius_of(scratch)
    reach = radius + margin_of(scratch)
    motion = motion_of(scratch)
    # With the slack of over_facet.
    near_squared = (reach + REGION_SLACK * (grid[2] + grid[3])) ** 2
    for number in range(CORNER_ROW, CORNER_ROW + num_corners):
        p = get(scratch, number, 0)
        if p[2] - highest > reach:
            continue
        base = surface_point(grid, heights, rows, columns, p)
        wall, distance, n = wall_in_front(grid, heights, rows, columns, p, base)
        if wall:
            if distance <= reach:
                position = vec3.add_scaled(p, -0.5 * (radius + distance), n)
                feature = feature_of(POINT, int(scratch[number, 3]), WALL_PLACE, 0)
                count = add_candidate(scratch, count, position, n, distance - radius, feature)
            continue
        is_free = base[0] == p[0] and base[1] == p[1] and base[2] == p[2]
        sunk = 0.0 if is_free else vec3.norm(vec3.sub(base, p))
        afloat = sunk <= AFLOAT * scale_of(scratch)
        first_row, last_row, first_column, last_column = cells_around(
            grid, rows, columns, base, reach_below(reach, base[2] - highest)
        )
        for row in range(first_row, last_row + 1):
            for column in range(first_column, last_column + 1):
                corner = row * columns + column
                a = sample(grid, heights, columns, row, column)
                r = vec3.sub(p, a)
                if is_free:
                    low, high = cell_range(heights, columns, corner)
                    apart = (
                        outside(p[0], a[0], a[0] + grid[2]),
                        outside(p[1], a[1], a[1] + grid[3]),
                        outside(p[2], low, high),
                    )
                    if vec3.norm_squared(apart) > near_squared:
                        continue
                for upper in range(2):
                    slope_x, slope_y = slopes(grid, heights, corner, columns, upper)
                    # A vertical distance; times the cosine of the slope it is that along the normal.
                    height = r[2] - slope_x * r[0] - slope_y * r[1]
                    stretch = 1.0 + slope_x * slope_x + slope_y * slope_y  # 1 / cosine^2
                    if height > 0.0 and height * height > reach * reach * stretch:
                        continue
                    # Most facets of a cell near a ball are not below its middle.
                    if is_free and not may_come_over_facet(grid, r, slope_x, slope_y, upper, motion):
                        continue
                    counts = over_facet(grid, vec3.sub(base, a), slope_x, slope_y, upper)
                    if not counts and motion > 0.0 and afloat and height * height >= radius * radius * stretch:
                        above = height >= 0.0 or height * height <= 4.0 * sunk * sunk * stretch
                        counts = above and comes_over_facet(
                            grid, heights, rows, columns, p, row, column, upper, motion, sunk
                        )
                    if counts:
                        cosine = 1.0 / math.sqrt(stretch)
                        n = (-cosine * slope_x, -cosine * slope_y, cosine)
                        gap = cosine * height - radius
                        position = vec3.add_scaled(p, -(radius + 0.5 * gap), n)
                        feature = feature_of(POINT, int(scratch[number, 3]), FACE_PLACE, 2 * corner + upper)
                        count = add_candidate(scratch, count, position, n, gap, feature)
    return count


@kernel
def highest_below(grid, heights, rows, columns, scratch):
    """The highest sample [m] of the cells under the shape's bounds; minus infinity if it lies beside the field."""
    return highest_between(grid, heights, rows, columns, get(scratch, BOUNDS_ROW, 0), get(scratch, BOUNDS_ROW, 3))


@kernel
def highest_between(grid, heights, rows, columns, lower, upper):
    """The highest sample [m] of the cells under bounds; minus infinity if these lie beside the field."""
    if lower[0] > -grid[0] or lower[1] > -grid[1] or upper[0] < grid[0] or upper[1] < grid[1]:
        return -math.inf
    first = cell_index(lower[0] - grid[0], grid[4], columns - 1)
    last = cell_index(upper[0] - grid[0], grid[4], columns - 1) + 1
    highest = -math.inf
    for row in range(
        cell_index(lower[1] - grid[1], grid[5], rows - 1), cell_index(upper[1] - grid[1], grid[5], rows - 1) + 2
    ):
        for index in range(row * columns + first, row * columns + last + 1):
            highest = max(highest, heights[index])
    return highest


@kernel
def _draw_in(highest, scratch):
    """Narrow the bounds of a ball to the part of it that is not above ``highest`` [m]."""
    center = get(scratch, CENTER_ROW, 0)
    reach = reach_below(radius_of(scratch) + margin_of(scratch), center[2] - highest)
    for axis in range(2):
        scratch[BOUNDS_ROW, axis] = center[axis] - reach
        scratch[BOUNDS_ROW, 3 + axis] = center[axis] + reach


@kernel
def _draw_in_box(highest, scratch):
    """Narrow the bounds of a box to what is near the part of it that is not above ``highest`` [m] by the margin.

    From its lowest corner that goes along each edge until the box ends, or is too high.
    """
    center = get(scratch, CENTER_ROW, 0)
    margin = margin_of(scratch)
    lower = scratch[BOUNDS_ROW, 2] + margin
    # Of a face that lies flat up to round-off all counts.
    height = highest + margin - lower + REGION_SLACK * scale_of(scratch)
    first_x, last_x = center[0], center[0]
    first_y, last_y = center[1], center[1]
    for k in range(3):
        half = scratch[CENTER_ROW, 3 + k]
        edge = axis_of(scratch, k)
        if edge[2] < 0.0:
            edge = vec3.neg(edge)
        far = half
        if 2.0 * half * edge[2] > height:
            far = height / edge[2] - half
        first_x += min(-half * edge[0], far * edge[0])
        last_x += max(-half * edge[0], far * edge[0])
        first_y += min(-half * edge[1], far * edge[1])
        last_y += max(-half * edge[1], far * edge[1])
    scratch[BOUNDS_ROW, 0] = first_x - margin
    scratch[BOUNDS_ROW, 1] = first_y - margin
    scratch[BOUNDS_ROW, 3] = last_x + margin
    scratch[BOUNDS_ROW, 4] = last_y + margin


@kernel
def collide_height_field(
    shape_a,
    position_a,
    rotation_a,
    size_a,
    position_b,
    rotation_b,
    field,
    heights,
    margin,
    motion,
    contacts,
    count,
    scratch,
):
    """Append the contacts of a sphere, capsule or box with a height field; return the new count.

    Args:
        shape_a: code of the shape.
        position_a, rotation_a, size_a: its place [m], body-to-world matrix and size.
        position_b, rotation_b: place of the field.
        field: its HEIGHT_FIELD_ROW.
        heights: pool of samples [m].
        margin: [m] contacts farther apart are left out.
        motion: [m] bound of how far the shape can come within the step.
        contacts, count: as in ``manifold.emit``.
        scratch: (264, 8), overwritten.
    """
    num_corners = put_shape(shape_a, position_a, rotation_a, size_a, position_b, rotation_b, margin, scratch)
    set_motion(motion, scratch)
    if scratch[BOUNDS_ROW, 2] > field.highest:
        return count
    grid = grid_of(field)
    rows = field.rows
    columns = field.columns
    heights = heights[field.first : field.first + rows * columns]
    highest = highest_below(grid, heights, rows, columns, scratch)
    if scratch[BOUNDS_ROW, 2] > highest:
        return count
    if shape_a == SPHERE:
        _draw_in(highest, scratch)
    elif shape_a == BOX:
        _draw_in_box(highest, scratch)
    found = corners_against_faces(grid, heights, rows, columns, num_corners, highest, scratch, np.int64(0))
    item = 0
    while True:
        end, item = list_features(grid, heights, rows, columns, scratch, item)
        found = collide_features(scratch, end, shape_a, found)
        if item == 0:
            break
    return emit_candidates(scratch, found, position_b, rotation_b, contacts, count)
