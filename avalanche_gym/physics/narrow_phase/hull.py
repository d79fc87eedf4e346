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
from .polytope import FIRST_BUFFER, MOST_CORNERS, append, emit_rows
from .reduction import GAP


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
    """Up to four contacts below the corners of a hull; the feature is the number of the corner. ``hull``: its row."""
    up = mat3.column(rotation_b, 2)
    u, v = mat3.column(rotation_b, 0), mat3.column(rotation_b, 1)
    offset = vec3.sub(position_a, position_b)
    height = vec3.dot(up, offset)
    if height - hull.radius > margin:
        return count
    rise = mat3.apply_transposed(rotation_a, up)
    rows = 0
    for number in range(hull.num_vertices):
        i = hull.first_vertex + number
        point = (points[i, 0], points[i, 1], points[i, 2])
        gap = height + vec3.dot(rise, point)
        if gap <= margin:
            place = vec3.add(offset, mat3.apply(rotation_a, point))
            if rows < MOST_CORNERS:
                rows = append(scratch, FIRST_BUFFER, rows, vec3.dot(u, place), vec3.dot(v, place), gap, number)
            else:
                # No room: the deepest stay.
                highest = FIRST_BUFFER
                for row in range(FIRST_BUFFER, FIRST_BUFFER + rows):
                    if scratch[row, GAP] > scratch[highest, GAP]:
                        highest = row
                if gap < scratch[highest, GAP]:
                    append(scratch, highest, np.int64(0), vec3.dot(u, place), vec3.dot(v, place), gap, number)
    return emit_rows(
        scratch,
        FIRST_BUFFER,
        rows,
        position_b,
        u,
        v,
        vec3.neg(up),
        -1.0,
        hull.radius,
        margin,
        np.int64(0),
        contacts,
        count,
    )
