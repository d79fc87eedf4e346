"""Convex hulls and cylinders in the general convex test.

The tables of the hulls (shapes/hull_preparation.py): ``hulls`` one row each, ``points`` (n, 3) their vertices,
``faces`` their plane faces, ``corners`` the vertices of each face, counter-clockwise from outside.
"""

from __future__ import annotations

import numpy as np

from ..jit import kernel
from ..model import HULL
from .convex import convex_convex


@kernel
def solid_of(shape, size, data, hulls):
    """The solid (solid.py) of a collider and its scale [m]."""
    if shape == HULL:
        row = hulls[data]
        first, last = row.first_vertex, row.first_vertex + row.num_vertices
        return (shape, (row.radius, 0.0, 0.0), first, last, row.first_face, row.first_face + row.num_faces), row.radius
    none = np.int64(0)
    return (shape, size, none, none, none, none), size[0] + size[1] + size[2]


@kernel
def collide_convex(
    shape_a,
    position_a,
    rotation_a,
    size_a,
    data_a,
    shape_b,
    position_b,
    rotation_b,
    size_b,
    data_b,
    hulls,
    points,
    faces,
    corners,
    margin,
    contacts,
    count,
    scratch,
):
    """Append the contacts of two shapes, one of them a cylinder or hull, shape_a <= shape_b < PLANE; the new count.

    ``data``: row of ``hulls``, if the shape is one.
    """
    solid_a, extent_a = solid_of(shape_a, size_a, data_a, hulls)
    solid_b, extent_b = solid_of(shape_b, size_b, data_b, hulls)
    return convex_convex(
        solid_a,
        position_a,
        rotation_a,
        solid_b,
        position_b,
        rotation_b,
        extent_a + extent_b,
        points,
        faces,
        corners,
        margin,
        contacts,
        count,
        scratch,
    )
