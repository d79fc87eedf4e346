"""The convex edges and vertices of a height field that a shape may touch, listed for feature_contacts.py."""

from __future__ import annotations

import math

from ..jit import kernel
from ..maths import mat3, vec3
from .height_field_grid import bend_of, cell_index, outside, sample, upward_normal
from .terrain_features import TILT, put_edge
from .terrain_shape import (
    BOUNDS_ROW,
    CENTER_ROW,
    END_FEATURE_ROW,
    FIRST_FEATURE_ROW,
    axes_of,
    axis_of,
    get,
    is_box,
    margin_of,
    put,
    radius_of,
    reach_squared_of,
)

# Most rows of the list that one sample and its edges fill.
ROWS_OF_SAMPLE = 17


@kernel
def _is_convex(heights, rows, columns, row, column, rise, shift, flat):
    return bend_of(heights, rows, columns, row, column, rise, shift) > flat


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
    if row < rows - 1 and left_column >= 0:
        left = upward_normal(grid, heights, row * columns + left_column, columns, rise * shift)
        m1 = vec3.cross(left, e)
    else:
        m1 = _wall(e)
    if right_row >= 0 and column < columns - 1:
        right = upward_normal(grid, heights, right_row * columns + column, columns, 1 - rise * shift)
        m2 = vec3.cross(e, right)
    else:
        m2 = _wall(e)
    out = vec3.sub(vec3.cross(e, m1), vec3.cross(e, m2))
    number = 3 * (row * columns + column) + rise + rise * shift
    return put_edge(scratch, end, start, e, length, m1, m2, out, number)


@kernel
def list_vertex(grid, heights, rows, columns, row, column, scratch, end):
    """Append a sample to the list if three or more of its edges stick out (a wall counts); return the new end.

    With fewer, the normal cone has no inside, and the edges or faces have its contacts.
    """
    rim = row == 0 or column == 0 or row == rows - 1 or column == columns - 1
    convex = 1 if rim else 0
    for edge in range(3):
        rise = 0 if edge == 0 else 1
        shift = 0 if edge == 1 else 1
        convex += _is_convex(heights, rows, columns, row, column, rise, shift, grid[6])
        convex += _is_convex(heights, rows, columns, row - rise, column - shift, rise, shift, grid[6])
    if convex < 3:
        return end
    corner = row * columns + column
    spoke = end + 1
    if rim:
        put(scratch, spoke, 0, (0.0, 0.0, -1.0))
        spoke += 1
    for edge in range(6):
        # Along x, along y, the diagonal; then the same backwards.
        side = 1 if edge < 3 else -1
        rise = 0 if edge % 3 == 0 else side
        shift = 0 if edge % 3 == 1 else side
        if 0 <= row + rise < rows and 0 <= column + shift < columns:
            z = heights[corner + rise * columns + shift] - heights[corner]
            put(scratch, spoke, 0, (shift * grid[2], rise * grid[3], z))
            spoke += 1
    scratch[end, 0] = spoke - end - 1
    put(scratch, end, 1, sample(grid, heights, columns, row, column))
    put(scratch, end, 4, (0.0, 0.0, 1.0))
    scratch[end, 7] = corner
    return spoke


@kernel
def _meets_core(half, reach, x, y):
    """Whether the segment from x to x + y, in the frame of the core of the shape, comes near its box on all axes."""
    return (
        abs(x[0] + 0.5 * y[0]) <= half[0] + reach + 0.5 * abs(y[0])
        and abs(x[1] + 0.5 * y[1]) <= half[1] + reach + 0.5 * abs(y[1])
        and abs(x[2] + 0.5 * y[2]) <= half[2] + reach + 0.5 * abs(y[2])
    )


@kernel
def _face_over(half, margin, x, y):
    """The axis of a box under one of whose two faces on it the segment from x to x + y lies, in its frame; -1: neither.

    The segment must be farther inside the border of that face than it is from the face, beyond it or sunk into the box:
    then nothing of the box's edges and corners is near it.
    """
    for axis in range(3):
        far = max(abs(x[axis]), abs(x[axis] + y[axis]))
        near = min(abs(x[axis]), abs(x[axis] + y[axis]))
        if near > 0.5 * half[axis] and x[axis] * (x[axis] + y[axis]) > 0.0:
            i = (axis + 1) % 3
            j = (axis + 2) % 3
            inset = min(half[i] - max(abs(x[i]), abs(x[i] + y[i])), half[j] - max(abs(x[j]), abs(x[j] + y[j])))
            if inset > max(margin, half[axis] - near, far - half[axis]):
                return axis
    return -1


@kernel
def _lies_below(scratch, row, center, half, axes, reach):
    """Whether a listed edge, seen along the middle of its cone, is out of reach: so far apart are then all parts."""
    out = get(scratch, row + 2, 0)
    height = vec3.dot(out, vec3.sub(center, get(scratch, row, 1)))
    seen = mat3.apply_transposed(axes, out)
    height -= half[0] * abs(seen[0]) + half[1] * abs(seen[1]) + half[2] * abs(seen[2])
    return height > 0.0 and height * height > reach * reach * vec3.norm_squared(out)


@kernel
def _is_lowest(heights, grid, columns, corner, d):
    """Whether the neighbours of an inner sample stay behind it along d, as far as in_vertex_cone asks for."""
    for edge in range(3):
        rise = 0 if edge == 0 else 1
        shift = 0 if edge == 1 else 1
        level = shift * grid[2] * d[0] + rise * grid[3] * d[1]
        length_squared = (shift * grid[2]) ** 2 + (rise * grid[3]) ** 2
        step = rise * columns + shift
        for side in range(2):
            dz = heights[corner + step] - heights[corner] if side == 0 else heights[corner - step] - heights[corner]
            along = (level if side == 0 else -level) + dz * d[2]
            if along > 0.0 and along * along > TILT * TILT * (length_squared + dz * dz):
                return False
    return True


@kernel
def _meets_ball(reach_squared, r, e):
    """Whether the segment from r to r + e comes within reach of the origin."""
    along = -vec3.dot(r, e)
    length_squared = vec3.norm_squared(e)
    if along >= length_squared:
        return vec3.norm_squared(vec3.add(r, e)) <= reach_squared
    square = vec3.norm_squared(r)
    if along > 0.0:
        square -= along * along / length_squared
    return square <= reach_squared


@kernel
def list_features(grid, heights, rows, columns, scratch, item):
    """List what sticks out within the bounds of the shape, from sample ``item`` of its footprint on.

    Returns:
        End of the list, and the item to go on with; 0 when all are listed.
    """
    lower = get(scratch, BOUNDS_ROW, 0)
    upper = get(scratch, BOUNDS_ROW, 3)
    center = get(scratch, CENTER_ROW, 0)
    half = get(scratch, CENTER_ROW, 3)
    axes = axes_of(scratch)
    reach = radius_of(scratch) + margin_of(scratch)
    reach_squared = reach_squared_of(scratch)
    box = is_box(scratch)
    # A ball meets what its middle is near: its core has no axes to look along.
    ball = half[0] == 0.0 and half[1] == 0.0 and half[2] == 0.0
    # How edges along x and along y lead across, in the frame of the core; what they rise is added edge by edge.
    to_x = vec3.scale(grid[2], (axes[0], axes[1], axes[2]))
    to_y = vec3.scale(grid[3], (axes[3], axes[4], axes[5]))
    up = (axes[6], axes[7], axes[8])
    # Samples whose edges can reach into the footprint.
    first_row = cell_index(lower[1] - grid[1], grid[5], rows)
    last_row = cell_index(upper[1] - grid[1], grid[5], rows)
    first_column = cell_index(lower[0] - grid[0], grid[4], columns)
    last_column = cell_index(upper[0] - grid[0], grid[4], columns)
    width = last_column - first_column + 1
    row = first_row
    column = first_column
    if item > 0:
        row += item // width
        column += item % width
    end = FIRST_FEATURE_ROW
    while row <= last_row:
        if end + ROWS_OF_SAMPLE > END_FEATURE_ROW:
            return end, item
        x = grid[0] + column * grid[2]
        y = grid[1] + row * grid[3]
        corner = row * columns + column
        z = heights[corner]
        r = (x - center[0], y - center[1], z - center[2])
        near = True
        bent = True
        inner = False
        ahead = aside = across = 0.0
        if 0 < row < rows - 1 and 0 < column < columns - 1:
            b, c, d = heights[corner + 1], heights[corner + columns + 1], heights[corner + columns]
            lowest = min(min(z, b), min(c, d))
            highest = max(max(z, b), max(c, d))
            apart = (
                outside(center[0], x, x + grid[2]),
                outside(center[1], y, y + grid[3]),
                outside(center[2], lowest, highest),
            )
            near = lowest <= upper[2] and highest >= lower[2] and vec3.norm_squared(apart) <= reach_squared
            # The three edges at once, as in bend_of.
            ahead = z + b - c - heights[corner - columns]
            aside = z + d - c - heights[corner - 1]
            across = z + c - b - d
            bent = max(ahead, aside, across) > grid[6]
            inner = True
        if near:
            local = r if ball else mat3.apply_transposed(axes, r)
            for edge in range(3 if bent else 0):
                rise = 0 if edge == 0 else 1
                shift = 0 if edge == 1 else 1
                bend = ahead if edge == 0 else (aside if edge == 1 else across)
                if not inner:
                    bend = bend_of(heights, rows, columns, row, column, rise, shift)
                if bend > grid[6]:
                    rises = heights[corner + rise * columns + shift] - z
                    if ball:
                        listed = _meets_ball(reach_squared, r, (shift * grid[2], rise * grid[3], rises))
                    else:
                        flat = to_x if edge == 0 else (to_y if edge == 1 else vec3.add(to_x, to_y))
                        e = vec3.add_scaled(flat, rises, up)
                        listed = _meets_core(half, reach, local, e)
                        if box:
                            listed = listed and _face_over(half, reach, local, e) < 0
                        else:
                            listed = listed and _meets_ball(reach_squared, local, e)
                    if listed:
                        last = list_edge(grid, heights, rows, columns, row, column, rise, shift, scratch, end)
                        if not _lies_below(scratch, end, center, half, axes, reach):
                            end = last
            listed = vec3.norm_squared(r) <= reach_squared and (ball or _meets_core(half, reach, local, vec3.ZERO))
            if listed and inner:
                # Those behind: along x, along y, the diagonal.
                b, c, d = heights[corner - 1], heights[corner - columns - 1], heights[corner - columns]
                convex = int(ahead > grid[6]) + int(aside > grid[6]) + int(across > grid[6])
                convex += int(b + z - heights[corner + columns] - c > grid[6])
                convex += int(d + z - heights[corner + 1] - c > grid[6])
                convex += int(c + z - d - b > grid[6])
                listed = convex >= 3
            if listed and box and inner:
                axis = _face_over(half, reach, local, vec3.ZERO)
                if axis >= 0 and abs(local[axis]) > half[axis]:
                    out = vec3.scale(-math.copysign(1.0, local[axis]), axis_of(scratch, axis))
                    listed = _is_lowest(heights, grid, columns, corner, out)
            if listed:
                end = list_vertex(grid, heights, rows, columns, row, column, scratch, end)
        item += 1
        column += 1
        if column > last_column:
            column = first_column
            row += 1
    return end, 0
