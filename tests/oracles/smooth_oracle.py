"""Slow, obvious twins of the smooth surface: SciPy's spline, and nearest points by search from a dense grid."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import make_interp_spline
from scipy.optimize import minimize

from avalanche_gym.physics.model import CONTACT
from avalanche_gym.physics.narrow_phase import smooth_cylinder, smooth_field
from avalanche_gym.physics.narrow_phase.pair_query import SCRATCH_ROWS
from avalanche_gym.physics.shape_rows import HEIGHT_FIELD_ROW
from avalanche_gym.physics.shapes.height_spline import pool_of_field
from tests.oracles.terrain_oracle import IDENTITY, ORIGIN, floats


def smooth_terrain(heights, size):
    """A table of one HEIGHT_FIELD_ROW, and its pool."""
    heights = np.asarray(heights, float)
    pool = pool_of_field(heights, smooth=True)
    field = np.zeros(1, HEIGHT_FIELD_ROW)
    field["rows"], field["columns"] = heights.shape
    field["extent"] = size
    field["smooth"], field["size"] = 1, pool.size
    field["lowest"], field["highest"] = pool.min(), pool.max()
    return field, pool


def spline_height(heights, size, x, y, derivatives=(0, 0)):
    """z or a derivative (along x, along y) at points, of SciPy's not-a-knot spline; at least 4 x 4 samples."""
    rows, columns = np.shape(heights)
    along_y = make_interp_spline(np.linspace(-0.5 * size[1], 0.5 * size[1], rows), heights, k=3, axis=0)
    along_x = make_interp_spline(np.linspace(-0.5 * size[0], 0.5 * size[0], columns), np.eye(columns), k=3, axis=0)
    wx = along_x.derivative(derivatives[0])(x) if derivatives[0] else along_x(x)
    wy = along_y.derivative(derivatives[1])(y) if derivatives[1] else along_y(y)
    return np.sum(wx * wy, axis=-1)


def nearest_distance(heights, size, p, points=201):
    """Unsigned distance [m] of p from the surface: the best of a dense grid, then a descent from there."""
    x, y = (np.linspace(-0.5 * extent, 0.5 * extent, points) for extent in size)
    grid_x, grid_y = (a.ravel() for a in np.meshgrid(x, y))
    z = spline_height(heights, size, grid_x, grid_y)
    square = (grid_x - p[0]) ** 2 + (grid_y - p[1]) ** 2 + (z - p[2]) ** 2
    start = np.argmin(square)

    def distance_squared(q):
        return (q[0] - p[0]) ** 2 + (q[1] - p[1]) ** 2 + (spline_height(heights, size, q[0], q[1]) - p[2]) ** 2

    bounds = [(-0.5 * extent, 0.5 * extent) for extent in size]
    found = minimize(distance_squared, (grid_x[start], grid_y[start]), bounds=bounds, tol=1e-14)
    return float(np.sqrt(found.fun))


def _contacts(kernel, shape, position, rotation, size, terrain, margin, place):
    field, pool = terrain
    contacts, scratch = np.zeros(64, CONTACT), np.zeros((SCRATCH_ROWS, 8))
    count = kernel(
        *shape,
        floats(position),
        rotation,
        *size,
        *place,
        field[0],
        pool,
        float(margin),
        contacts,
        0,
        scratch,
    )
    return contacts[:count]


def rounded_contacts(shape, position, rotation, size, terrain, margin, place=(ORIGIN, IDENTITY)):
    """Contacts (n,) of CONTACT of a sphere or capsule with ``smooth_terrain(...)``."""
    kernel = smooth_field.collide_rounded
    return _contacts(kernel, (shape,), position, rotation, (floats(size),), terrain, margin, place)


def box_contacts(position, rotation, size, terrain, margin, place=(ORIGIN, IDENTITY)):
    return _contacts(smooth_field.collide_box, (), position, rotation, (floats(size),), terrain, margin, place)


def cylinder_contacts(position, rotation, size, terrain, margin, place=(ORIGIN, IDENTITY)):
    return _contacts(smooth_cylinder.collide_cylinder, (), position, rotation, (floats(size),), terrain, margin, place)


def hull_contacts(position, rotation, prepared, terrain, margin, place=(ORIGIN, IDENTITY)):
    """Contacts of a ``prepare_hull(...)``."""
    tables = (prepared.hull[0], prepared.points, prepared.faces, prepared.corners)
    return _contacts(smooth_field.collide_hull, (), position, rotation, tables, terrain, margin, place)
