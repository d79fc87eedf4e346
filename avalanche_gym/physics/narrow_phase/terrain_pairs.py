"""The function of each pair with a mesh or a height field, as a stage.

Facets, edges and vertices of terrain (height_field.py, mesh.py), a moving mesh leaf by leaf (mesh_mesh.py), and the
smooth surface of a height field (smooth_field.py).
"""

from __future__ import annotations

from ..jit import stage
from .height_field import collide_height_field
from .height_field_solids import collide_cylinder_height_field, collide_hull_height_field
from .mesh import collide_mesh
from .mesh_height_field import collide_mesh_height_field
from .mesh_mesh import collide_meshes
from .mesh_plane import collide_plane_mesh
from .mesh_smooth_field import collide_mesh_smooth_field
from .mesh_solids import collide_cylinder_mesh, collide_hull_mesh
from .pair_query import query_at, scratch_of, turned_of_second
from .pair_shapes import (
    first_height_field,
    first_mesh,
    hull_of,
    hull_pools,
    motion_of,
    opened,
    pool_of_heights,
    second_height_field,
    second_mesh,
)
from .smooth_cylinder import collide_cylinder
from .smooth_field import collide_box, collide_hull, collide_rounded


@stage
def height_field_stage(address, count):
    query = query_at(address)
    position_a, rotation_a, size_a, position_b, rotation_b, _, margin, contacts = opened(query)
    field = (second_height_field(query), pool_of_heights(query))
    place = (query.shape_a, position_a, rotation_a, size_a, position_b, rotation_b)
    return collide_height_field(*place, *field, margin, query.motion, contacts, count, scratch_of(query))


@stage
def cylinder_height_field_stage(address, count):
    query = query_at(address)
    position_a, rotation_a, size_a, position_b, rotation_b, _, margin, contacts = opened(query)
    field = (second_height_field(query), pool_of_heights(query))
    place = (position_a, rotation_a, size_a, position_b, rotation_b)
    return collide_cylinder_height_field(*place, *field, margin, query.motion, contacts, count, scratch_of(query))


@stage
def hull_height_field_stage(address, count):
    query = query_at(address)
    position_a, rotation_a, _, position_b, rotation_b, _, margin, contacts = opened(query)
    field = (second_height_field(query), pool_of_heights(query))
    place = (position_a, rotation_a, hull_of(query), position_b, rotation_b)
    return collide_hull_height_field(*place, *field, margin, query.motion, contacts, count, scratch_of(query))


@stage
def mesh_stage(address, count):
    query = query_at(address)
    position_a, rotation_a, size_a, position_b, rotation_b, _, margin, contacts = opened(query)
    place = (query.shape_a, position_a, rotation_a, size_a, position_b, rotation_b)
    moves = (query.motion, turned_of_second(query))
    return collide_mesh(*place, second_mesh(query), margin, *moves, contacts, count, scratch_of(query))


@stage
def cylinder_mesh_stage(address, count):
    query = query_at(address)
    position_a, rotation_a, size_a, position_b, rotation_b, _, margin, contacts = opened(query)
    place = (position_a, rotation_a, size_a, position_b, rotation_b)
    mesh = second_mesh(query)
    moves = (query.motion, turned_of_second(query))
    return collide_cylinder_mesh(*place, mesh, margin, *moves, contacts, count, scratch_of(query))


@stage
def hull_mesh_stage(address, count):
    query = query_at(address)
    position_a, rotation_a, _, position_b, rotation_b, _, margin, contacts = opened(query)
    place = (position_a, rotation_a, hull_of(query), position_b, rotation_b)
    moves = (query.motion, turned_of_second(query))
    return collide_hull_mesh(*place, second_mesh(query), margin, *moves, contacts, count, scratch_of(query))


@stage
def plane_mesh_stage(address, count):
    query = query_at(address)
    position_a, rotation_a, _, position_b, rotation_b, _, margin, contacts = opened(query)
    place = (position_a, rotation_a, position_b, rotation_b, second_mesh(query))
    return collide_plane_mesh(*place, margin, motion_of(query), contacts, count, scratch_of(query))


@stage
def height_field_mesh_stage(address, count):
    query = query_at(address)
    position_a, rotation_a, _, position_b, rotation_b, _, margin, contacts = opened(query)
    field = (position_a, rotation_a, first_height_field(query), pool_of_heights(query))
    mesh = (position_b, rotation_b, second_mesh(query))
    return collide_mesh_height_field(*field, *mesh, margin, motion_of(query), contacts, count, scratch_of(query))


@stage
def mesh_mesh_stage(address, count):
    query = query_at(address)
    position_a, rotation_a, _, position_b, rotation_b, _, margin, contacts = opened(query)
    mesh_a = (position_a, rotation_a, first_mesh(query))
    mesh_b = (position_b, rotation_b, second_mesh(query))
    return collide_meshes(*mesh_a, *mesh_b, margin, motion_of(query), contacts, count, scratch_of(query))


@stage
def mesh_smooth_stage(address, count):
    query = query_at(address)
    position_a, rotation_a, _, position_b, rotation_b, _, margin, contacts = opened(query)
    mesh = (position_a, rotation_a, first_mesh(query))
    field = (position_b, rotation_b, second_height_field(query), pool_of_heights(query))
    return collide_mesh_smooth_field(*mesh, *field, margin, motion_of(query), contacts, count, scratch_of(query))


@stage
def smooth_rounded_stage(address, count):
    query = query_at(address)
    position_a, rotation_a, size_a, position_b, rotation_b, _, margin, contacts = opened(query)
    field = (second_height_field(query), pool_of_heights(query))
    place = (query.shape_a, position_a, rotation_a, size_a, position_b, rotation_b)
    return collide_rounded(*place, *field, margin, contacts, count, scratch_of(query))


@stage
def smooth_box_stage(address, count):
    query = query_at(address)
    position_a, rotation_a, size_a, position_b, rotation_b, _, margin, contacts = opened(query)
    field = (second_height_field(query), pool_of_heights(query))
    place = (position_a, rotation_a, size_a, position_b, rotation_b)
    return collide_box(*place, *field, margin, contacts, count, scratch_of(query))


@stage
def smooth_cylinder_stage(address, count):
    query = query_at(address)
    position_a, rotation_a, size_a, position_b, rotation_b, _, margin, contacts = opened(query)
    field = (second_height_field(query), pool_of_heights(query))
    place = (position_a, rotation_a, size_a, position_b, rotation_b)
    return collide_cylinder(*place, *field, margin, contacts, count, scratch_of(query))


@stage
def smooth_hull_stage(address, count):
    query = query_at(address)
    position_a, rotation_a, _, position_b, rotation_b, _, margin, contacts = opened(query)
    hulls, points, faces, corners = hull_pools(query)
    field = (second_height_field(query), pool_of_heights(query))
    hull = (hulls[query.data_a], points, faces, corners)
    place = (position_a, rotation_a, *hull, position_b, rotation_b)
    return collide_hull(*place, *field, margin, contacts, count, scratch_of(query))
