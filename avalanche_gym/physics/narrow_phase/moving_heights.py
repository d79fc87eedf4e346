"""The velocity of a height field's surface where its samples move.

A sample moves along the field's z axis at its rate, and a facet follows its three corners, so the velocity at a point
of the surface is the rate interpolated there as the heights are; on a smooth surface, the spline through the rates.
"""

from __future__ import annotations

from ..jit import kernel
from ..maths import mat3, vec3
from ..memory import height_rates_of, table
from ..model import HEIGHT_FIELD_ROW
from .height_field_grid import cell_index, grid_of
from .smooth_surface import coefficients_of, height, patch_of


@kernel
def fastest_rate(header, world):
    """[m/s] largest speed of any sample of one world."""
    rates = height_rates_of(header, world)
    fastest = 0.0
    for sample in range(rates.shape[0]):
        fastest = max(fastest, abs(rates[sample]))
    return fastest


@kernel
def height_velocity(header, world, row, position, rotation, point):
    """Velocity [m/s], world frame, of the surface of height field number ``row`` against its body, near ``point`` [m].

    ``position`` and ``rotation`` (9 floats) place the field in the world.
    """
    field = table(header.height_fields, header.height_fields_size, HEIGHT_FIELD_ROW)[row]
    rates = height_rates_of(header, world)
    local = mat3.apply_transposed(rotation, vec3.sub(point, position))
    if field.smooth == 1:
        patch = patch_of(field)
        x = min(max(local[0], patch[0]), patch[6])
        y = min(max(local[1], patch[1]), patch[7])
        rate = height(patch, coefficients_of(field, rates), x, y)
        return vec3.scale(rate, mat3.column(rotation, 2))
    grid = grid_of(field)
    x = local[0] - grid[0]
    y = local[1] - grid[1]
    column = cell_index(x, grid[4], field.columns - 1)
    line = cell_index(y, grid[5], field.rows - 1)
    u = min(max(x * grid[4] - column, 0.0), 1.0)
    v = min(max(y * grid[5] - line, 0.0), 1.0)
    corner = field.first + line * field.columns + column
    a = rates[corner]
    c = rates[corner + field.columns + 1]
    # The third corner of the facet: B below the diagonal from A to C, D above it.
    if v <= u:
        b = rates[corner + 1]
        rate = a + (b - a) * u + (c - b) * v
    else:
        d = rates[corner + field.columns]
        rate = a + (c - d) * u + (d - a) * v
    return vec3.scale(rate, mat3.column(rotation, 2))
