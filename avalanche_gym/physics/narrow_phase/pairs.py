"""The function of each pair of shapes, as a stage: a scene compiles those that can occur in it.

Every stage opens the query the same way: ``opened`` gives what a pair of closed forms takes, ``height_field_pools``,
``mesh_of``, ``hull_pools`` and ``hull_of`` the tables of shapes.
"""

from __future__ import annotations

import numpy as np

from ..jit import Stage, kernel, stage
from ..memory import header_at, table
from ..model import (
    BOX,
    CAPSULE,
    CYLINDER,
    FACE_ROW,
    HEIGHT_FIELD,
    HEIGHT_FIELD_ROW,
    HULL,
    HULL_EDGE_ROW,
    HULL_FACE_ROW,
    HULL_ROW,
    MESH,
    MESH_ROW,
    NODE_ROW,
    PLANE,
    SMOOTH_FIELD,
    SPHERE,
    VERTEX_ROW,
)
from .box import box_box
from .capsule import capsule_box, capsule_capsule
from .cylinder import cylinder_plane, sphere_cylinder
from .height_field import collide_height_field
from .height_field_solids import collide_cylinder_height_field, collide_hull_height_field
from .hull import collide_convex
from .hull_plane import hull_plane
from .mesh import collide_mesh
from .mesh_height_field import collide_mesh_height_field, collide_mesh_smooth_field
from .mesh_mesh import collide_meshes
from .mesh_plane import collide_plane_mesh
from .mesh_solids import collide_cylinder_mesh, collide_hull_mesh
from .pair_query import contact_list, first_of, query_at, scratch_of, second_of, turned_of_second
from .path import path_of
from .plane import box_plane, capsule_plane, sphere_plane
from .smooth_field import collide_box, collide_cylinder, collide_hull, collide_rounded
from .sphere import sphere_box, sphere_capsule, sphere_sphere
from .terrain_hull import hull_tables


@kernel
def opened(query):
    """Both placed shapes, the margin, and the list of contacts."""
    position_a, rotation_a, size_a = first_of(query)
    position_b, rotation_b, size_b = second_of(query)
    return position_a, rotation_a, size_a, position_b, rotation_b, size_b, query.margin, contact_list(query)


@kernel
def motion_of(query):
    """``motion``, ``path`` and ``loose`` as a mesh asks for them."""
    return query.motion, path_of(query), query.loose


@kernel
def height_field_pools(query):
    """Rows of all height fields, and their heights."""
    header = header_at(query.header)
    rows = table(header.height_fields, header.height_fields_size, HEIGHT_FIELD_ROW)
    return rows, table(query.heights, header.num_heights, np.float64)


@kernel
def mesh_of(query, number):
    """Tables of one mesh by its number: MESH_ROW (1), VERTEX_ROW, FACE_ROW, NODE_ROW."""
    header = header_at(query.header)
    rows = table(header.meshes, header.meshes_size, MESH_ROW)[number : number + 1]
    row = rows[0]
    vertices = table(header.mesh_vertices, header.mesh_vertices_size, VERTEX_ROW)
    faces = table(header.mesh_faces, header.mesh_faces_size, FACE_ROW)
    nodes = table(header.mesh_nodes, header.mesh_nodes_size, NODE_ROW)
    return (
        rows,
        vertices[row.first_vertex : row.first_vertex + row.num_vertices],
        faces[row.first_face : row.first_face + row.num_faces],
        nodes[row.first_node : row.first_node + row.num_nodes],
    )


@kernel
def hull_pools(query):
    """Rows, points, faces and corners of all hulls."""
    header = header_at(query.header)
    return (
        table(header.hulls, header.hulls_size, HULL_ROW),
        table(header.hull_points, (header.hull_points_size // 3, 3), np.float64),
        table(header.hull_faces, header.hull_faces_size, HULL_FACE_ROW),
        table(header.hull_corners, header.hull_corners_size, np.int64),
    )


@kernel
def hull_of(query):
    """``hull`` of terrain_hull.py for the first shape."""
    header = header_at(query.header)
    rows, points, faces, corners = hull_pools(query)
    edges = table(header.hull_edges, header.hull_edges_size, HULL_EDGE_ROW)
    return hull_tables(rows, query.data_a, points, faces, corners, edges)


@stage
def sphere_sphere_stage(address, count):
    query = query_at(address)
    return sphere_sphere(*opened(query), count)


@stage
def sphere_capsule_stage(address, count):
    query = query_at(address)
    return sphere_capsule(*opened(query), count)


@stage
def sphere_box_stage(address, count):
    query = query_at(address)
    return sphere_box(*opened(query), count)


@stage
def sphere_plane_stage(address, count):
    query = query_at(address)
    return sphere_plane(*opened(query), count)


@stage
def capsule_capsule_stage(address, count):
    query = query_at(address)
    return capsule_capsule(*opened(query), count)


@stage
def capsule_box_stage(address, count):
    query = query_at(address)
    return capsule_box(*opened(query), count)


@stage
def capsule_plane_stage(address, count):
    query = query_at(address)
    return capsule_plane(*opened(query), count)


@stage
def box_box_stage(address, count):
    query = query_at(address)
    return box_box(*opened(query), count, scratch_of(query))


@stage
def box_plane_stage(address, count):
    query = query_at(address)
    return box_plane(*opened(query), count)


@stage
def sphere_cylinder_stage(address, count):
    query = query_at(address)
    return sphere_cylinder(*opened(query), count)


@stage
def cylinder_plane_stage(address, count):
    query = query_at(address)
    return cylinder_plane(*opened(query), count)


@stage
def hull_plane_stage(address, count):
    query = query_at(address)
    position_a, rotation_a, _, position_b, rotation_b, _, margin, contacts = opened(query)
    rows, points, _, _ = hull_pools(query)
    row = rows[query.data_a]
    scratch = scratch_of(query)
    return hull_plane(position_a, rotation_a, row, points, position_b, rotation_b, margin, contacts, count, scratch)


@stage
def convex_stage(address, count):
    query = query_at(address)
    position_a, rotation_a, size_a, position_b, rotation_b, size_b, margin, contacts = opened(query)
    return collide_convex(
        query.shape_a,
        position_a,
        rotation_a,
        size_a,
        query.data_a,
        query.shape_b,
        position_b,
        rotation_b,
        size_b,
        query.data_b,
        *hull_pools(query),
        margin,
        contacts,
        count,
        scratch_of(query),
    )


@stage
def height_field_stage(address, count):
    query = query_at(address)
    position_a, rotation_a, size_a, position_b, rotation_b, _, margin, contacts = opened(query)
    rows, heights = height_field_pools(query)
    place = (query.shape_a, position_a, rotation_a, size_a, position_b, rotation_b)
    return collide_height_field(
        *place, rows[query.data_b], heights, margin, query.motion, contacts, count, scratch_of(query)
    )


@stage
def cylinder_height_field_stage(address, count):
    query = query_at(address)
    position_a, rotation_a, size_a, position_b, rotation_b, _, margin, contacts = opened(query)
    rows, heights = height_field_pools(query)
    place = (position_a, rotation_a, size_a, position_b, rotation_b)
    return collide_cylinder_height_field(
        *place, rows[query.data_b], heights, margin, query.motion, contacts, count, scratch_of(query)
    )


@stage
def hull_height_field_stage(address, count):
    query = query_at(address)
    position_a, rotation_a, _, position_b, rotation_b, _, margin, contacts = opened(query)
    rows, heights = height_field_pools(query)
    place = (position_a, rotation_a, hull_of(query), position_b, rotation_b)
    return collide_hull_height_field(
        *place, rows[query.data_b], heights, margin, query.motion, contacts, count, scratch_of(query)
    )


@stage
def mesh_stage(address, count):
    query = query_at(address)
    position_a, rotation_a, size_a, position_b, rotation_b, _, margin, contacts = opened(query)
    place = (query.shape_a, position_a, rotation_a, size_a, position_b, rotation_b)
    moves = (query.motion, turned_of_second(query))
    return collide_mesh(*place, mesh_of(query, query.data_b), margin, *moves, contacts, count, scratch_of(query))


@stage
def cylinder_mesh_stage(address, count):
    query = query_at(address)
    position_a, rotation_a, size_a, position_b, rotation_b, _, margin, contacts = opened(query)
    place = (position_a, rotation_a, size_a, position_b, rotation_b)
    mesh = mesh_of(query, query.data_b)
    moves = (query.motion, turned_of_second(query))
    return collide_cylinder_mesh(*place, mesh, margin, *moves, contacts, count, scratch_of(query))


@stage
def hull_mesh_stage(address, count):
    query = query_at(address)
    position_a, rotation_a, _, position_b, rotation_b, _, margin, contacts = opened(query)
    place = (position_a, rotation_a, hull_of(query), position_b, rotation_b)
    moves = (query.motion, turned_of_second(query))
    return collide_hull_mesh(*place, mesh_of(query, query.data_b), margin, *moves, contacts, count, scratch_of(query))


@stage
def plane_mesh_stage(address, count):
    query = query_at(address)
    position_a, rotation_a, _, position_b, rotation_b, _, margin, contacts = opened(query)
    place = (position_a, rotation_a, position_b, rotation_b, mesh_of(query, query.data_b))
    return collide_plane_mesh(*place, margin, motion_of(query), contacts, count, scratch_of(query))


@stage
def height_field_mesh_stage(address, count):
    query = query_at(address)
    position_a, rotation_a, _, position_b, rotation_b, _, margin, contacts = opened(query)
    fields, heights = height_field_pools(query)
    field = (position_a, rotation_a, fields[query.data_a], heights)
    mesh = (position_b, rotation_b, mesh_of(query, query.data_b))
    return collide_mesh_height_field(*field, *mesh, margin, motion_of(query), contacts, count, scratch_of(query))


@stage
def mesh_mesh_stage(address, count):
    query = query_at(address)
    position_a, rotation_a, _, position_b, rotation_b, _, margin, contacts = opened(query)
    mesh_a = (position_a, rotation_a, mesh_of(query, query.data_a))
    mesh_b = (position_b, rotation_b, mesh_of(query, query.data_b))
    return collide_meshes(*mesh_a, *mesh_b, margin, motion_of(query), contacts, count, scratch_of(query))


@stage
def mesh_smooth_stage(address, count):
    query = query_at(address)
    position_a, rotation_a, _, position_b, rotation_b, _, margin, contacts = opened(query)
    fields, heights = height_field_pools(query)
    mesh = (position_a, rotation_a, mesh_of(query, query.data_a))
    field = (position_b, rotation_b, fields[query.data_b], heights)
    return collide_mesh_smooth_field(*mesh, *field, margin, motion_of(query), contacts, count, scratch_of(query))


@stage
def smooth_rounded_stage(address, count):
    query = query_at(address)
    position_a, rotation_a, size_a, position_b, rotation_b, _, margin, contacts = opened(query)
    rows, heights = height_field_pools(query)
    place = (query.shape_a, position_a, rotation_a, size_a, position_b, rotation_b)
    return collide_rounded(*place, rows[query.data_b], heights, margin, contacts, count, scratch_of(query))


@stage
def smooth_box_stage(address, count):
    query = query_at(address)
    position_a, rotation_a, size_a, position_b, rotation_b, _, margin, contacts = opened(query)
    rows, heights = height_field_pools(query)
    place = (position_a, rotation_a, size_a, position_b, rotation_b)
    return collide_box(*place, rows[query.data_b], heights, margin, contacts, count, scratch_of(query))


@stage
def smooth_cylinder_stage(address, count):
    query = query_at(address)
    position_a, rotation_a, size_a, position_b, rotation_b, _, margin, contacts = opened(query)
    rows, heights = height_field_pools(query)
    place = (position_a, rotation_a, size_a, position_b, rotation_b)
    return collide_cylinder(*place, rows[query.data_b], heights, margin, contacts, count, scratch_of(query))


@stage
def smooth_hull_stage(address, count):
    query = query_at(address)
    position_a, rotation_a, _, position_b, rotation_b, _, margin, contacts = opened(query)
    hulls, points, faces, corners = hull_pools(query)
    rows, heights = height_field_pools(query)
    hull = (hulls[query.data_a], points, faces, corners)
    place = (position_a, rotation_a, *hull, position_b, rotation_b)
    return collide_hull(*place, rows[query.data_b], heights, margin, contacts, count, scratch_of(query))


# By the codes of the two shapes, the smaller first.
PAIR_STAGES: dict[tuple[int, int], Stage] = {
    (SPHERE, SPHERE): sphere_sphere_stage,
    (SPHERE, CAPSULE): sphere_capsule_stage,
    (SPHERE, BOX): sphere_box_stage,
    (SPHERE, CYLINDER): sphere_cylinder_stage,
    (SPHERE, HULL): convex_stage,
    (SPHERE, PLANE): sphere_plane_stage,
    (SPHERE, HEIGHT_FIELD): height_field_stage,
    (SPHERE, MESH): mesh_stage,
    (CAPSULE, CAPSULE): capsule_capsule_stage,
    (CAPSULE, BOX): capsule_box_stage,
    (CAPSULE, CYLINDER): convex_stage,
    (CAPSULE, HULL): convex_stage,
    (CAPSULE, PLANE): capsule_plane_stage,
    (CAPSULE, HEIGHT_FIELD): height_field_stage,
    (CAPSULE, MESH): mesh_stage,
    (BOX, BOX): box_box_stage,
    (BOX, CYLINDER): convex_stage,
    (BOX, HULL): convex_stage,
    (BOX, PLANE): box_plane_stage,
    (BOX, HEIGHT_FIELD): height_field_stage,
    (BOX, MESH): mesh_stage,
    (CYLINDER, CYLINDER): convex_stage,
    (CYLINDER, HULL): convex_stage,
    (CYLINDER, PLANE): cylinder_plane_stage,
    (CYLINDER, HEIGHT_FIELD): cylinder_height_field_stage,
    (CYLINDER, MESH): cylinder_mesh_stage,
    (HULL, HULL): convex_stage,
    (HULL, PLANE): hull_plane_stage,
    (HULL, HEIGHT_FIELD): hull_height_field_stage,
    (HULL, MESH): hull_mesh_stage,
    (PLANE, MESH): plane_mesh_stage,
    (HEIGHT_FIELD, MESH): height_field_mesh_stage,
    (MESH, MESH): mesh_mesh_stage,
    (MESH, SMOOTH_FIELD): mesh_smooth_stage,
    (SPHERE, SMOOTH_FIELD): smooth_rounded_stage,
    (CAPSULE, SMOOTH_FIELD): smooth_rounded_stage,
    (BOX, SMOOTH_FIELD): smooth_box_stage,
    (CYLINDER, SMOOTH_FIELD): smooth_cylinder_stage,
    (HULL, SMOOTH_FIELD): smooth_hull_stage,
}
