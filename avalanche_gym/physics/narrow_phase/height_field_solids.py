"""Convex hull and cylinder against the facets of a height field.

As in height_field.py, with the hull's corners in turns and, for each facet, the points of a cylinder that would touch
its plane (cylinder.py): on flat ground the same contacts as on a plane, whatever the facets.
"""

from __future__ import annotations

import math

import numpy as np

from ..jit import kernel
from ..maths import mat3, vec3
from .cylinder import FLAT_POINTS, toward_plane
from .height_field import corners_against_faces, highest_below
from .height_field_facets import comes_over_facet, over_facet, surface_point
from .height_field_features import list_features
from .height_field_grid import cell_index, grid_of, sample, slopes
from .height_field_walls import facet_height, wall_in_front
from .terrain_candidates import FACE_PLACE, POINT, WALL_PLACE, add_candidate, emit_candidates, feature_of
from .terrain_cylinder import cylinder_features, put_cylinder
from .terrain_hull import hull_features, list_corners, put_hull
from .terrain_shape import BOUNDS_ROW, CENTER_ROW, get, margin_of, motion_of, scale_of, set_motion
from .triangle import REGION_SLACK


@kernel
def _cylinder_against_faces(grid, heights, rows, columns, radius, half_length, axes, scratch, count):
    """Contacts of the faces with a cylinder; return the new count of candidates."""
    center = get(scratch, CENTER_ROW, 0)
    lower = get(scratch, BOUNDS_ROW, 0)
    upper_bound = get(scratch, BOUNDS_ROW, 3)
    margin = margin_of(scratch)
    motion = motion_of(scratch)
    slack = REGION_SLACK * scale_of(scratch)
    first_row = cell_index(lower[1] - grid[1], grid[5], rows - 1)
    last_row = cell_index(upper_bound[1] - grid[1], grid[5], rows - 1)
    first_column = cell_index(lower[0] - grid[0], grid[4], columns - 1)
    last_column = cell_index(upper_bound[0] - grid[0], grid[4], columns - 1)
    for row in range(first_row, last_row + 1):
        for column in range(first_column, last_column + 1):
            corner = row * columns + column
            a = sample(grid, heights, columns, row, column)
            for upper in range(2):
                slope_x, slope_y = slopes(grid, heights, corner, columns, upper)
                cosine = 1.0 / math.sqrt(1.0 + slope_x * slope_x + slope_y * slope_y)
                n = (-cosine * slope_x, -cosine * slope_y, cosine)
                height = vec3.dot(n, vec3.sub(center, a))
                down = vec3.neg(mat3.apply_transposed(axes, n))
                tilt = math.sqrt(down[0] * down[0] + down[1] * down[1])
                if height - abs(down[2]) * half_length - tilt * radius > margin:
                    continue
                for k in range(FLAT_POINTS):
                    local, feature, exists = toward_plane(radius, half_length, down, k)
                    gap = height - vec3.dot(down, local)
                    if not exists or gap > margin:
                        continue
                    p = vec3.add(center, mat3.apply(axes, local))
                    base = p
                    if gap < -slack:
                        base = surface_point(grid, heights, rows, columns, p)
                    wall, _, _ = wall_in_front(grid, heights, rows, columns, p, base)
                    if wall:
                        continue
                    counts = over_facet(grid, vec3.sub(base, a), slope_x, slope_y, upper)
                    if not counts and motion > 0.0 and gap >= 0.0:
                        counts = comes_over_facet(grid, heights, rows, columns, p, row, column, upper, motion, 0.0)
                    if counts:
                        feature = feature_of(POINT, feature, FACE_PLACE, 2 * corner + upper)
                        count = add_candidate(scratch, count, vec3.add_scaled(p, -0.5 * gap, n), n, gap, feature)
    return count


@kernel
def _cylinder_against_walls(grid, heights, rows, columns, radius, half_length, axes, scratch, count):
    """Contacts of the walls with a cylinder whose middle is in front of them; return the new count of candidates."""
    center = get(scratch, CENTER_ROW, 0)
    margin = margin_of(scratch)
    for wall in range(4):
        axis = wall >> 1
        side = 2.0 * (wall & 1) - 1.0
        n = (side, 0.0, 0.0) if axis == 0 else (0.0, side, 0.0)
        height = side * center[axis] + grid[axis]
        if height <= 0.0:
            continue
        down = vec3.neg(mat3.apply_transposed(axes, n))
        for k in range(FLAT_POINTS):
            local, part, exists = toward_plane(radius, half_length, down, k)
            gap = height - vec3.dot(down, local)
            if not exists or gap > margin:
                continue
            p = vec3.add(center, mat3.apply(axes, local))
            x, y = min(max(p[0], grid[0]), -grid[0]), min(max(p[1], grid[1]), -grid[1])
            beside = p[1] != y if axis == 0 else p[0] != x
            if not beside and p[2] < facet_height(grid, heights, rows, columns, x, y):
                feature = feature_of(POINT, part, WALL_PLACE, wall)
                count = add_candidate(scratch, count, vec3.add_scaled(p, -0.5 * gap, n), n, gap, feature)
    return count


@kernel
def collide_cylinder_height_field(
    position_a, rotation_a, size_a, position_b, rotation_b, field, heights, margin, motion, contacts, count, scratch
):
    """Append the contacts of a cylinder with a height field; return the new count. Arguments as in height_field.py."""
    radius, half_length = size_a[0], size_a[1]
    _, axes = put_cylinder(size_a, position_a, rotation_a, position_b, rotation_b, margin, scratch)
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
    found = _cylinder_against_faces(grid, heights, rows, columns, radius, half_length, axes, scratch, np.int64(0))
    found = _cylinder_against_walls(grid, heights, rows, columns, radius, half_length, axes, scratch, found)
    item = 0
    while True:
        end, item = list_features(grid, heights, rows, columns, scratch, item)
        found = cylinder_features(scratch, end, radius, half_length, found)
        if item == 0:
            break
    return emit_candidates(scratch, found, position_b, rotation_b, contacts, count)


@kernel
def collide_hull_height_field(
    position_a, rotation_a, hull, position_b, rotation_b, field, heights, margin, motion, contacts, count, scratch
):
    """Append the contacts of a hull (terrain_hull.py) with a height field; return the new count."""
    origin, axes = put_hull(hull, position_a, rotation_a, position_b, rotation_b, margin, scratch)
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
    found = np.int64(0)
    number = np.int64(0)
    while number < hull[0][0].num_vertices:
        num_corners, number = list_corners(hull, origin, axes, number, highest + margin, scratch)
        found = corners_against_faces(grid, heights, rows, columns, num_corners, highest, scratch, found)
    item = 0
    while True:
        end, item = list_features(grid, heights, rows, columns, scratch, item)
        found = hull_features(scratch, end, hull, origin, axes, found)
        if item == 0:
            break
    return emit_candidates(scratch, found, position_b, rotation_b, contacts, count)
