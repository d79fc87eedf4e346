"""The upright walls of a height field below its rim.

A field is solid below its surface, without a bottom, over its rectangle; nothing is outside. So a point beside the
rectangle and lower than the rim next to it has a wall in front, and a point below the surface leaves through the wall
if that is nearer than the surface.
"""

from __future__ import annotations

import math

from ..jit import kernel
from ..maths import vec3


@kernel
def nearest_wall(p, half_x, half_y):
    """Distance [m] to the nearest wall of a point over or below the rectangle, and its outward normal."""
    to_x, to_y = half_x - abs(p[0]), half_y - abs(p[1])
    if to_x < to_y:
        return to_x, (math.copysign(1.0, p[0]), 0.0, 0.0)
    return to_y, (0.0, math.copysign(1.0, p[1]), 0.0)


@kernel
def facet_height(grid, heights, rows, columns, x, y):
    """z [m] of the facets over x, y in the rectangle."""
    u = (x - grid[0]) * grid[4]
    v = (y - grid[1]) * grid[5]
    column = min(max(int(u), 0), columns - 2)
    row = min(max(int(v), 0), rows - 2)
    u -= column
    v -= row
    corner = row * columns + column
    a, c = heights[corner], heights[corner + columns + 1]
    if v > u:
        d = heights[corner + columns]
        return a + (c - d) * u + (d - a) * v
    b = heights[corner + 1]
    return a + (b - a) * u + (c - b) * v


@kernel
def wall_in_front(grid, heights, rows, columns, p, base):
    """Whether a wall is the nearest part of the field to a point; its signed distance [m] and outward normal.

    ``base`` is p itself, or the nearest point of the surface if p lies below that.
    """
    x, y = min(max(p[0], grid[0]), -grid[0]), min(max(p[1], grid[1]), -grid[1])
    if x != p[0] or y != p[1]:
        d = (p[0] - x, p[1] - y, 0.0)
        if p[2] >= facet_height(grid, heights, rows, columns, x, y):
            return False, 0.0, d
        distance = vec3.norm(d)
        return True, distance, vec3.scale(1.0 / distance, d)
    depth, normal = nearest_wall(p, -grid[0], -grid[1])
    return depth * depth < vec3.norm_squared(vec3.sub(p, base)), -depth, normal
