"""Sphere, capsule and box against the facets of a height field.

Every shape is a core of corners and edges with a radius (terrain_features.py). Three kinds of contact make up the manifold: a corner
of the core over a face of the terrain; an edge of the core across a convex edge of the terrain, or a ball beside it; a convex
vertex of the terrain under a face of the box, or beside a ball. Cells are found from the footprint of the shape, so the
size of the field does not matter.

**A corner below the surface** belongs to the face it has come through: the nearest point of the surface is found, and the contacts
are those of that point, with the depth of the corner. In a corner of several walls this gives one contact a wall; a thin
ridge never pushes a corner out on its far side.
"""

from __future__ import annotations

from ..jit import kernel
from ..maths import mat3, vec3
from .height_field_grid import cell_index, face_normal, grid_of, list_features, sample
from .terrain_candidates import END_FEATURE_ROW, FIRST_FEATURE_ROW, add_candidate, emit_candidates
from .terrain_features import collide_features, core_corner, core_of
from .triangle import REGION_SLACK, closest_point

# A corner below the surface looks for the nearest point of it this many cells around; deeper ones take the face above.
SEARCH_CELLS = 3.0
# Most rows that one sample can add to the list of features.
ROWS_OF_SAMPLE = 17


@kernel
def _cells(grid, rows, columns, p, reach):
    """First and last row, first and last column of the cells within ``reach`` [m] along x and y of p."""
    return (
        cell_index(p[1] - reach - grid[1], grid[5], rows - 1),
        cell_index(p[1] + reach - grid[1], grid[5], rows - 1),
        cell_index(p[0] - reach - grid[0], grid[4], columns - 1),
        cell_index(p[0] + reach - grid[0], grid[4], columns - 1),
    )


@kernel
def _surface_point(grid, heights, rows, columns, p):
    """p itself if it is free, else the point of the surface nearest to it."""
    x = (p[0] - grid[0]) * grid[4]
    y = (p[1] - grid[1]) * grid[5]
    if x < 0.0 or y < 0.0 or x > columns - 1 or y > rows - 1:
        return p
    column = min(int(x), columns - 2)
    row = min(int(y), rows - 2)
    upper = 1 if y - row > x - column else 0
    corner = row * columns + column
    n = face_normal(grid, heights, corner, columns, upper)
    a = sample(grid, heights, columns, row, column)
    depth = vec3.dot(n, vec3.sub(a, p)) / n[2]
    if depth <= 0.0:
        return p
    best = (p[0], p[1], p[2] + depth)
    best_square = depth * depth
    reach = min(depth, SEARCH_CELLS * max(grid[2], grid[3]))
    first_row, last_row, first_column, last_column = _cells(grid, rows, columns, p, reach)
    for row in range(first_row, last_row + 1):
        for column in range(first_column, last_column + 1):
            a = sample(grid, heights, columns, row, column)
            c = sample(grid, heights, columns, row + 1, column + 1)
            for upper in range(2):
                # ABC, and ACD as CDA.
                b = sample(grid, heights, columns, row + upper, column + 1 - upper)
                q, _ = closest_point(p, a, b, c)
                square = vec3.norm_squared(vec3.sub(p, q))
                if square < best_square:
                    best_square = square
                    best = q
    return best


@kernel
def ball_against_faces(grid, heights, rows, columns, p, radius, part, margin, scale, scratch, count):
    """Contacts of the faces with a ball (or a corner, radius 0) around p; return the new count of candidates."""
    base = _surface_point(grid, heights, rows, columns, p)
    slack = REGION_SLACK * (grid[2] + grid[3])
    first_row, last_row, first_column, last_column = _cells(grid, rows, columns, base, radius + margin)
    for row in range(first_row, last_row + 1):
        for column in range(first_column, last_column + 1):
            corner = row * columns + column
            a = sample(grid, heights, columns, row, column)
            r = vec3.sub(base, a)
            for upper in range(2):
                n = face_normal(grid, heights, corner, columns, upper)
                over = vec3.dot(n, r)
                gap = vec3.dot(n, vec3.sub(p, a)) - radius
                if over < -slack or gap > margin:
                    continue
                u = (r[0] - over * n[0]) * grid[4]
                v = (r[1] - over * n[1]) * grid[5]
                if upper == 1:
                    u, v = v, u
                # 0 <= v <= u <= 1 inside ABC, and the mirror image inside ACD.
                if v >= -REGION_SLACK and v <= u + REGION_SLACK and u <= 1.0 + REGION_SLACK:
                    position = vec3.add_scaled(p, -(radius + 0.5 * gap), n)
                    count = add_candidate(scratch, count, position, n, gap, part, scale, margin)
    return count


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
        contacts, count: as in ``manifold.emit``.
        scratch: (256, 8), overwritten.
    """
    center = mat3.apply_transposed(rotation_b, vec3.sub(position_a, position_b))
    axes = mat3.multiply(mat3.transpose(rotation_b), rotation_a)
    half, radius = core_of(shape_a, size_a)
    reach = radius + margin
    extent = (
        abs(axes[0]) * half[0] + abs(axes[1]) * half[1] + abs(axes[2]) * half[2] + reach,
        abs(axes[3]) * half[0] + abs(axes[4]) * half[1] + abs(axes[5]) * half[2] + reach,
        abs(axes[6]) * half[0] + abs(axes[7]) * half[1] + abs(axes[8]) * half[2] + reach,
    )
    lower = vec3.sub(center, extent)
    upper = vec3.add(center, extent)
    if (
        lower[2] > field.highest
        or abs(center[0]) - extent[0] > 0.5 * field.extent[0]
        or abs(center[1]) - extent[1] > 0.5 * field.extent[1]
    ):
        return count
    grid = grid_of(field)
    rows = field.rows
    columns = field.columns
    heights = heights[field.first : field.first + rows * columns]
    scale = max(half[0], half[1], half[2]) + radius
    found = 0
    for corner in range(8):
        p, counts = core_corner(center, axes, half, corner)
        if counts:
            found = ball_against_faces(grid, heights, rows, columns, p, radius, corner, margin, scale, scratch, found)
    first_row = cell_index(lower[1] - grid[1], grid[5], rows)
    last_row = cell_index(upper[1] - grid[1], grid[5], rows)
    first_column = cell_index(lower[0] - grid[0], grid[4], columns)
    last_column = cell_index(upper[0] - grid[0], grid[4], columns)
    end = FIRST_FEATURE_ROW
    for row in range(first_row, last_row + 1):
        for column in range(first_column, last_column + 1):
            end = list_features(grid, heights, rows, columns, row, column, lower, upper, scratch, end)
            if end + ROWS_OF_SAMPLE > END_FEATURE_ROW or (row == last_row and column == last_column):
                found = collide_features(scratch, end, shape_a, center, axes, half, radius, margin, scale, found)
                end = FIRST_FEATURE_ROW
    return emit_candidates(scratch, found, position_b, rotation_b, scale, margin, contacts, count)
