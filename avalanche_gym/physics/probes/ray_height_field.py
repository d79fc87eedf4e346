"""Rays against height fields: from cell to cell along the ray, from where it is as low as the highest sample.

The cells are those the ray crosses seen from above (Amanatides and Woo 1987). Over each the height of the ray above the
surface, f(t), starts positive; the hit is its first zero.

* Facets: f is linear over each of the two triangles, so its sign at the cell's borders and at the diagonal tells.
* Smooth: f is a polynomial of degree 6. Seven values give its Bernstein coefficients b_i; f lies in their convex hull,
  so it has no zero before the hull has. The interval is cut there, and again, which converges to the first zero from
  the left and never passes one (Bezier clipping: Sederberg and Nishita 1990).

The solid has upright walls below its rim, and no bottom; a ray that starts in it meets it at once.
"""

from __future__ import annotations

import math

import numpy as np

from ..jit import kernel, stage
from ..maths import vec3
from ..memory import header_at, height_field_of, heights_of, table
from ..narrow_phase.height_field_grid import face_normal, grid_of
from ..narrow_phase.height_field_walls import facet_height
from ..narrow_phase.smooth_surface import coefficients_of, height, jet, locate, normal_of, patch_of
from .probe import MISS, answer, answer_inside, probe_at

DEGREE = 6
_NODES = np.arange(DEGREE + 1) / DEGREE
# From values at equal distances to Bernstein coefficients.
TO_BERNSTEIN = np.linalg.inv(
    np.array(
        [[math.comb(DEGREE, k) * t**k * (1.0 - t) ** (DEGREE - k) for k in range(DEGREE + 1)] for t in _NODES.tolist()]
    )
)
# A cut that moves the start by less than this part of the interval ends the search, in vain or not.
SMALLEST_CUT = 1e-14
MOST_CUTS = 60


@kernel
def clip_to_field(o, d, half_x, half_y, limit):
    """The part of a ray over the rectangle: start, end, and the axis of the wall it comes through, -1 for none."""
    enter, leave = 0.0, limit
    wall = -1
    for axis in range(2):
        half = half_x if axis == 0 else half_y
        if d[axis] == 0.0:
            if abs(o[axis]) > half:
                leave = -math.inf
            continue
        near = (-math.copysign(half, d[axis]) - o[axis]) / d[axis]
        if near > enter:
            enter, wall = near, axis
        leave = min(leave, (math.copysign(half, d[axis]) - o[axis]) / d[axis])
    return enter, leave, wall


@kernel
def clip_to_heights(o, d, start, end, lowest, highest, cell):
    """Start and end of a ray that begins above a surface between these heights [m]: outside it cannot meet it."""
    if d[2] < 0.0:
        # A cell lower, so that round-off cannot end it too soon.
        return max(start, (highest - o[2]) / d[2]), min(end, (lowest - cell - o[2]) / d[2])
    if o[2] + start * d[2] > highest or (d[0] == 0.0 and d[1] == 0.0):
        return start, -math.inf
    return start, end


@kernel
def _next_cell(o, d, first, spacing, cell):
    """t where the ray leaves a cell along one axis."""
    if d == 0.0:
        return math.inf
    return (first + (cell + (1 if d > 0.0 else 0)) * spacing - o) / d


@kernel
def _first_below(o, d, patch, c, t0, t1, scratch):
    """The first t in [t0, t1] where the ray meets the smooth surface, infinite if it does not; it starts above."""
    start, length = t0, t1 - t0
    for _ in range(MOST_CUTS):
        for k in range(DEGREE + 1):
            t = start + length * k / DEGREE
            scratch[0, k] = o[2] + t * d[2] - height(patch, c, o[0] + t * d[0], o[1] + t * d[1])
        if scratch[0, 0] <= 0.0:
            return start
        # The first place where a line between two coefficients, the earlier one positive, comes down to zero.
        cut = math.inf
        for k in range(DEGREE + 1):
            b = 0.0
            for i in range(DEGREE + 1):
                b += TO_BERNSTEIN[k, i] * scratch[0, i]
            scratch[1, k] = b
            if b <= 0.0:
                for i in range(k):
                    before = scratch[1, i]
                    if before > 0.0:
                        cut = min(cut, (i + (k - i) * before / (before - b)) / DEGREE)
        if cut > 1.0:
            return math.inf
        start += cut * length
        if cut * length <= SMALLEST_CUT * (t1 - t0):
            return start
        length = max(t1 - start, 0.0)
    return start


@kernel
def _above_patch(patch, c, row, column):
    """The highest coefficient that weighs in a cell: a bound of the surface there."""
    highest = -math.inf
    for i in range(row, row + 4):
        for k in range(column, column + 4):
            highest = max(highest, c[i, k])
    return highest


@stage
def ray_facets(address):
    probe = probe_at(address)
    o, d = vec3.load(probe.origin), vec3.load(probe.direction)
    header = header_at(probe.header)
    field = height_field_of(header, probe.data)
    grid = grid_of(field)
    rows, columns = field.rows, field.columns
    heights = heights_of(header, probe.world)[field.first : field.first + rows * columns]
    start, end, wall = clip_to_field(o, d, -grid[0], -grid[1], probe.limit)
    if start > end:
        return MISS
    z = facet_height(grid, heights, rows, columns, o[0] + start * d[0], o[1] + start * d[1])
    if o[2] + start * d[2] <= z:
        if wall < 0:
            return answer_inside(probe)
        side = -math.copysign(1.0, d[wall])
        return answer(probe, start, (side if wall == 0 else 0.0, side if wall == 1 else 0.0, 0.0))
    start, end = clip_to_heights(o, d, start, end, field.lowest, field.highest, grid[2])
    row, _ = locate(o[1] + start * d[1] - grid[1], grid[5], rows - 1)
    column, _ = locate(o[0] + start * d[0] - grid[0], grid[4], columns - 1)
    t = start
    while t <= end:
        along_x = _next_cell(o[0], d[0], grid[0], grid[2], column)
        along_y = _next_cell(o[1], d[1], grid[1], grid[3], row)
        leave = max(min(along_x, along_y, end), t)
        corner = row * columns + column
        lowest = min(o[2] + t * d[2], o[2] + leave * d[2])
        below = max(heights[corner], heights[corner + 1], heights[corner + columns], heights[corner + columns + 1])
        if lowest <= below:
            # Where the ray crosses the diagonal, u = v.
            rate = d[0] * grid[4] - d[1] * grid[5]
            crossing = math.inf
            if rate != 0.0:
                u = (o[0] - grid[0]) * grid[4] - column
                v = (o[1] - grid[1]) * grid[5] - row
                crossing = (v - u) / rate
            middle = crossing if t < crossing < leave else leave
            inner = 0.5 * (t + middle)
            u = (o[0] + inner * d[0] - grid[0]) * grid[4] - column
            v = (o[1] + inner * d[1] - grid[1]) * grid[5] - row
            upper = 1 if v > u else 0
            here = t
            for half in range(2):
                there = middle if half == 0 else leave
                n = face_normal(grid, heights, corner, columns, upper)
                a = vec3.sub(o, (grid[0] + column * grid[2], grid[1] + row * grid[3], heights[corner]))
                height_0 = vec3.dot(n, vec3.add_scaled(a, here, d))
                height_1 = vec3.dot(n, vec3.add_scaled(a, there, d))
                if height_1 <= 0.0:
                    hit = here
                    if height_0 > 0.0:
                        hit = here + (there - here) * height_0 / (height_0 - height_1)
                    return answer(probe, hit, n)
                if there == leave:
                    break
                here = there
                upper = 1 - upper
        if leave >= end:
            return MISS
        if along_x <= along_y:
            column += 1 if d[0] > 0.0 else -1
        else:
            row += 1 if d[1] > 0.0 else -1
        if row < 0 or column < 0 or row > rows - 2 or column > columns - 2:
            return MISS
        t = leave
    return MISS


@stage
def ray_smooth(address):
    probe = probe_at(address)
    o, d = vec3.load(probe.origin), vec3.load(probe.direction)
    header = header_at(probe.header)
    field = height_field_of(header, probe.data)
    patch = patch_of(field)
    c = coefficients_of(field, heights_of(header, probe.world))
    scratch = table(probe.scratch, (256, 8), np.float64)
    start, end, wall = clip_to_field(o, d, patch[6], patch[7], probe.limit)
    if start > end:
        return MISS
    over = o[2] + start * d[2] - height(patch, c, o[0] + start * d[0], o[1] + start * d[1])
    if over <= 0.0:
        if wall < 0:
            return answer_inside(probe)
        side = -math.copysign(1.0, d[wall])
        return answer(probe, start, (side if wall == 0 else 0.0, side if wall == 1 else 0.0, 0.0))
    start, end = clip_to_heights(o, d, start, end, field.lowest, field.highest, patch[2])
    row, _ = locate(o[1] + start * d[1] - patch[1], patch[5], patch[9])
    column, _ = locate(o[0] + start * d[0] - patch[0], patch[4], patch[8])
    t = start
    while t <= end:
        along_x = _next_cell(o[0], d[0], patch[0], patch[2], column)
        along_y = _next_cell(o[1], d[1], patch[1], patch[3], row)
        leave = max(min(along_x, along_y, end), t)
        if min(o[2] + t * d[2], o[2] + leave * d[2]) <= _above_patch(patch, c, row, column):
            hit = _first_below(o, d, patch, c, t, leave, scratch)
            if hit < math.inf:
                return answer(probe, hit, normal_of(jet(patch, c, o[0] + hit * d[0], o[1] + hit * d[1])))
        if leave >= end:
            return MISS
        if along_x <= along_y:
            column += 1 if d[0] > 0.0 else -1
        else:
            row += 1 if d[1] > 0.0 else -1
        if row < 0 or column < 0 or row >= patch[9] or column >= patch[8]:
            return MISS
        t = leave
    return MISS
