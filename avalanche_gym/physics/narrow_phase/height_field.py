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
from .height_field_facets import cells_around, comes_over_facet, may_come_over_facet, over_facet, surface_point
from .height_field_features import list_features
from .height_field_grid import cell_index, cell_range, grid_of, outside, sample, slopes
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
from .triangle import REGION_SLACK

# A corner that is below the surface by less than this fraction of the shape's size still lies on it: what smooth motion
# leaves of overlap does not hide the next face. Larger: faces on the far side of a ridge that was sunk into.
AFLOAT = 1e-6


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
