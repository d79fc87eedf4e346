"""Convex hulls and cylinders in the general convex test, and a hull against a plane.

The tables of the hulls (shapes/hull_preparation.py): ``hulls`` one row each, ``points`` (n, 3) their vertices,
``faces`` their plane faces, ``corners`` the vertices of each face, counter-clockwise from outside.
"""

from __future__ import annotations

import numpy as np

from ..jit import kernel
from ..maths import mat3, vec3
from ..model import HULL
from .convex import convex_convex
from .terrain_candidates import FACE_PLACE, POINT, add_candidate, emit_candidates, feature_of
from .terrain_shape import in_frame, put_core

UP = (0.0, 0.0, 1.0)


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


@kernel
def hull_plane(position_a, rotation_a, hull, points, position_b, rotation_b, margin, contacts, count, scratch):
    """A contact below each corner of a hull that is near; ``hull``: its row. Chosen as on terrain, so as on a floor."""
    origin, axes = in_frame(position_a, rotation_a, position_b, rotation_b)
    if origin[2] - hull.radius > margin:
        return count
    center = vec3.add(origin, mat3.apply(axes, vec3.load(hull.center)))
    put_core(center, axes, vec3.load(hull.half), 0.0, margin, scratch)
    found = np.int64(0)
    for number in range(hull.num_vertices):
        i = hull.first_vertex + number
        point = vec3.add(origin, mat3.apply(axes, (points[i, 0], points[i, 1], points[i, 2])))
        if point[2] <= margin:
            feature = feature_of(POINT, number, FACE_PLACE, 0)
            middle = (point[0], point[1], 0.5 * point[2])
            found = add_candidate(scratch, found, middle, UP, point[2], feature)
    return emit_candidates(scratch, found, position_b, rotation_b, contacts, count)
