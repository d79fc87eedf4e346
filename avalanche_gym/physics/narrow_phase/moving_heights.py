"""Height fields whose samples move: the surface and its velocity at every instant of a step.

A sample moves along the field's z axis. The user gives it one rate R_k for a step of length h, the mean of a motion
that is meant to be smooth; as for driven bodies (integrator/driven.py) it accelerates evenly within the step,

    z(t) = z_k + R_k t + a_k t (t - h) / 2,    z'(t) = R_k + (t - h/2) a_k,    h a_k = minmod(d_k, 2 d_{k-1}),

with d_k = R_k - R_{k-1}: a change against the last one, or beyond twice that, is a jump that is meant. A facet follows
its three corners, so the velocity at a point of the surface is interpolated there as the heights are; on a smooth
surface, by the spline through the rates.
"""

from __future__ import annotations

import numpy as np

from ..jit import kernel
from ..maths import mat3, vec3
from ..memory import height_field_of, height_pool, heights_of, pool_address, table, traits_of
from .height_field_grid import cell_index, grid_of
from .smooth_surface import coefficients_of, height, patch_of

# A change of a rate is one of smooth motion up to this many times the last one, as for driven bodies.
GROWTH = 2.0


@kernel
def begin_moving(header, workspace, world):
    """Accelerations of the samples in this step, and the largest speed [m/s] that any of them reaches in it."""
    rates = height_pool(header.height_rates, header, world)
    before = height_pool(header.height_rates_before, header, world)
    changes = height_pool(header.height_rate_changes, header, world)
    accelerations = table(workspace.height_accelerations, header.num_heights, np.float64)
    fastest = 0.0
    for sample in range(rates.shape[0]):
        change = rates[sample] - before[sample]
        most = GROWTH * changes[sample]
        if change * most <= 0.0:
            change = 0.0
        elif abs(most) < abs(change):
            change = most
        accelerations[sample] = change / header.time_step
        fastest = max(fastest, abs(rates[sample]) + 0.5 * abs(change))
    workspace.fastest_rate = fastest
    workspace.heights_time = -1.0


@kernel
def place_ground(header, workspace, query, world, time):
    """Let a query be about the ground as it is at ``time`` [s] from the start of the step."""
    if traits_of(header, world).moving_heights == 0:
        query.heights = pool_address(header.heights, header, world)
        return
    if workspace.heights_time != time:
        start = heights_of(header, world)
        rates = height_pool(header.height_rates, header, world)
        accelerations = table(workspace.height_accelerations, header.num_heights, np.float64)
        heights = table(workspace.heights_then, header.num_heights, np.float64)
        velocities = table(workspace.height_velocities, header.num_heights, np.float64)
        step = header.time_step
        for sample in range(start.shape[0]):
            acceleration = accelerations[sample]
            heights[sample] = start[sample] + time * (rates[sample] + 0.5 * acceleration * (time - step))
            velocities[sample] = rates[sample] + acceleration * (time - 0.5 * step)
        workspace.heights_time = time
    query.heights = workspace.heights_then
    query.height_velocities = workspace.height_velocities
    query.height_accelerations = workspace.height_accelerations


@kernel
def end_moving(header, world):
    """The samples at the end of the step, and what the next one has to know of their rates."""
    heights = heights_of(header, world)
    rates = height_pool(header.height_rates, header, world)
    before = height_pool(header.height_rates_before, header, world)
    changes = height_pool(header.height_rate_changes, header, world)
    for sample in range(heights.shape[0]):
        heights[sample] += header.time_step * rates[sample]
        changes[sample] = rates[sample] - before[sample]
        before[sample] = rates[sample]


@kernel
def along_field(header, pool, row, position, rotation, point):
    """What a ``pool`` (samples,) of rates says of the surface of height field number ``row`` near ``point`` [m], as a
    vector, world frame.

    ``position`` and ``rotation`` (9 floats) place the field in the world.
    """
    field = height_field_of(header, row)
    local = mat3.apply_transposed(rotation, vec3.sub(point, position))
    if field.smooth == 1:
        patch = patch_of(field)
        x = min(max(local[0], patch[0]), patch[6])
        y = min(max(local[1], patch[1]), patch[7])
        rate = height(patch, coefficients_of(field, pool), x, y)
        return vec3.scale(rate, mat3.column(rotation, 2))
    grid = grid_of(field)
    x = local[0] - grid[0]
    y = local[1] - grid[1]
    column = cell_index(x, grid[4], field.columns - 1)
    line = cell_index(y, grid[5], field.rows - 1)
    u = min(max(x * grid[4] - column, 0.0), 1.0)
    v = min(max(y * grid[5] - line, 0.0), 1.0)
    corner = field.first + line * field.columns + column
    a = pool[corner]
    c = pool[corner + field.columns + 1]
    # The third corner of the facet: B below the diagonal from A to C, D above it.
    if v <= u:
        b = pool[corner + 1]
        rate = a + (b - a) * u + (c - b) * v
    else:
        d = pool[corner + field.columns]
        rate = a + (c - d) * u + (d - a) * v
    return vec3.scale(rate, mat3.column(rotation, 2))
