"""The function of each pair of shapes, as a stage: a scene compiles those that can occur in it."""

from __future__ import annotations

import numpy as np

from ..jit import Stage, stage
from ..memory import header_at, heights_of, table
from ..model import (
    BOX,
    CAPSULE,
    CYLINDER,
    FACE_ROW,
    HEIGHT_FIELD,
    HEIGHT_FIELD_ROW,
    HULL,
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
from .hull import collide_convex, hull_plane
from .mesh import collide_mesh
from .pair_query import contact_list, first_of, query_at, scratch_of, second_of
from .plane import box_plane, capsule_plane, sphere_plane
from .smooth_field import collide_box, collide_cylinder, collide_hull, collide_rounded
from .sphere import sphere_box, sphere_capsule, sphere_sphere


@stage
def sphere_sphere_stage(address, count):
    query = query_at(address)
    position_a, rotation_a, size_a = first_of(query)
    position_b, rotation_b, size_b = second_of(query)
    contacts = contact_list(query)
    return sphere_sphere(position_a, rotation_a, size_a, position_b, rotation_b, size_b, query.margin, contacts, count)


@stage
def sphere_capsule_stage(address, count):
    query = query_at(address)
    position_a, rotation_a, size_a = first_of(query)
    position_b, rotation_b, size_b = second_of(query)
    contacts = contact_list(query)
    return sphere_capsule(position_a, rotation_a, size_a, position_b, rotation_b, size_b, query.margin, contacts, count)


@stage
def sphere_box_stage(address, count):
    query = query_at(address)
    position_a, rotation_a, size_a = first_of(query)
    position_b, rotation_b, size_b = second_of(query)
    contacts = contact_list(query)
    return sphere_box(position_a, rotation_a, size_a, position_b, rotation_b, size_b, query.margin, contacts, count)


@stage
def sphere_plane_stage(address, count):
    query = query_at(address)
    position_a, rotation_a, size_a = first_of(query)
    position_b, rotation_b, size_b = second_of(query)
    contacts = contact_list(query)
    return sphere_plane(position_a, rotation_a, size_a, position_b, rotation_b, size_b, query.margin, contacts, count)


@stage
def capsule_capsule_stage(address, count):
    query = query_at(address)
    position_a, rotation_a, size_a = first_of(query)
    position_b, rotation_b, size_b = second_of(query)
    contacts = contact_list(query)
    return capsule_capsule(
        position_a, rotation_a, size_a, position_b, rotation_b, size_b, query.margin, contacts, count
    )


@stage
def capsule_box_stage(address, count):
    query = query_at(address)
    position_a, rotation_a, size_a = first_of(query)
    position_b, rotation_b, size_b = second_of(query)
    contacts = contact_list(query)
    return capsule_box(position_a, rotation_a, size_a, position_b, rotation_b, size_b, query.margin, contacts, count)


@stage
def capsule_plane_stage(address, count):
    query = query_at(address)
    position_a, rotation_a, size_a = first_of(query)
    position_b, rotation_b, size_b = second_of(query)
    contacts = contact_list(query)
    return capsule_plane(position_a, rotation_a, size_a, position_b, rotation_b, size_b, query.margin, contacts, count)


@stage
def box_box_stage(address, count):
    query = query_at(address)
    position_a, rotation_a, size_a = first_of(query)
    position_b, rotation_b, size_b = second_of(query)
    contacts = contact_list(query)
    return box_box(
        position_a, rotation_a, size_a, position_b, rotation_b, size_b, query.margin, contacts, count, scratch_of(query)
    )


@stage
def box_plane_stage(address, count):
    query = query_at(address)
    position_a, rotation_a, size_a = first_of(query)
    position_b, rotation_b, size_b = second_of(query)
    contacts = contact_list(query)
    return box_plane(position_a, rotation_a, size_a, position_b, rotation_b, size_b, query.margin, contacts, count)


@stage
def sphere_cylinder_stage(address, count):
    query = query_at(address)
    position_a, rotation_a, size_a = first_of(query)
    position_b, rotation_b, size_b = second_of(query)
    contacts = contact_list(query)
    return sphere_cylinder(
        position_a, rotation_a, size_a, position_b, rotation_b, size_b, query.margin, contacts, count
    )


@stage
def cylinder_plane_stage(address, count):
    query = query_at(address)
    position_a, rotation_a, size_a = first_of(query)
    position_b, rotation_b, size_b = second_of(query)
    contacts = contact_list(query)
    return cylinder_plane(position_a, rotation_a, size_a, position_b, rotation_b, size_b, query.margin, contacts, count)


@stage
def hull_plane_stage(address, count):
    query = query_at(address)
    position_a, rotation_a, _ = first_of(query)
    position_b, rotation_b, _ = second_of(query)
    header = header_at(query.header)
    hull = table(header.hulls, header.hulls_size, HULL_ROW)[query.data_a]
    points = table(header.hull_points, (header.hull_points_size // 3, 3), np.float64)
    return hull_plane(
        position_a,
        rotation_a,
        hull,
        points,
        position_b,
        rotation_b,
        query.margin,
        contact_list(query),
        count,
        scratch_of(query),
    )


@stage
def convex_stage(address, count):
    query = query_at(address)
    position_a, rotation_a, size_a = first_of(query)
    position_b, rotation_b, size_b = second_of(query)
    header = header_at(query.header)
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
        table(header.hulls, header.hulls_size, HULL_ROW),
        table(header.hull_points, (header.hull_points_size // 3, 3), np.float64),
        table(header.hull_faces, header.hull_faces_size, HULL_FACE_ROW),
        table(header.hull_corners, header.hull_corners_size, np.int64),
        query.margin,
        contact_list(query),
        count,
        scratch_of(query),
    )


@stage
def height_field_stage(address, count):
    query = query_at(address)
    position_a, rotation_a, size_a = first_of(query)
    position_b, rotation_b, _ = second_of(query)
    header = header_at(query.header)
    field = table(header.height_fields, header.height_fields_size, HEIGHT_FIELD_ROW)[query.data_b]
    return collide_height_field(
        query.shape_a,
        position_a,
        rotation_a,
        size_a,
        position_b,
        rotation_b,
        field,
        heights_of(header, query.world),
        query.margin,
        contact_list(query),
        count,
        scratch_of(query),
    )


@stage
def mesh_stage(address, count):
    query = query_at(address)
    position_a, rotation_a, size_a = first_of(query)
    position_b, rotation_b, _ = second_of(query)
    header = header_at(query.header)
    return collide_mesh(
        query.shape_a,
        position_a,
        rotation_a,
        size_a,
        position_b,
        rotation_b,
        table(header.meshes, header.meshes_size, MESH_ROW)[query.data_b],
        table(header.mesh_vertices, header.mesh_vertices_size, VERTEX_ROW),
        table(header.mesh_faces, header.mesh_faces_size, FACE_ROW),
        table(header.mesh_nodes, header.mesh_nodes_size, NODE_ROW),
        query.margin,
        contact_list(query),
        count,
        scratch_of(query),
    )


@stage
def smooth_rounded_stage(address, count):
    query = query_at(address)
    position_a, rotation_a, size_a = first_of(query)
    position_b, rotation_b, _ = second_of(query)
    header = header_at(query.header)
    return collide_rounded(
        query.shape_a,
        position_a,
        rotation_a,
        size_a,
        position_b,
        rotation_b,
        table(header.height_fields, header.height_fields_size, HEIGHT_FIELD_ROW)[query.data_b],
        heights_of(header, query.world),
        query.margin,
        contact_list(query),
        count,
        scratch_of(query),
    )


@stage
def smooth_box_stage(address, count):
    query = query_at(address)
    position_a, rotation_a, size_a = first_of(query)
    position_b, rotation_b, _ = second_of(query)
    header = header_at(query.header)
    return collide_box(
        position_a,
        rotation_a,
        size_a,
        position_b,
        rotation_b,
        table(header.height_fields, header.height_fields_size, HEIGHT_FIELD_ROW)[query.data_b],
        heights_of(header, query.world),
        query.margin,
        contact_list(query),
        count,
        scratch_of(query),
    )


@stage
def smooth_cylinder_stage(address, count):
    query = query_at(address)
    position_a, rotation_a, size_a = first_of(query)
    position_b, rotation_b, _ = second_of(query)
    header = header_at(query.header)
    return collide_cylinder(
        position_a,
        rotation_a,
        size_a,
        position_b,
        rotation_b,
        table(header.height_fields, header.height_fields_size, HEIGHT_FIELD_ROW)[query.data_b],
        heights_of(header, query.world),
        query.margin,
        contact_list(query),
        count,
        scratch_of(query),
    )


@stage
def smooth_hull_stage(address, count):
    query = query_at(address)
    position_a, rotation_a, _ = first_of(query)
    position_b, rotation_b, _ = second_of(query)
    header = header_at(query.header)
    return collide_hull(
        position_a,
        rotation_a,
        table(header.hulls, header.hulls_size, HULL_ROW)[query.data_a],
        table(header.hull_points, (header.hull_points_size // 3, 3), np.float64),
        table(header.hull_faces, header.hull_faces_size, HULL_FACE_ROW),
        table(header.hull_corners, header.hull_corners_size, np.int64),
        position_b,
        rotation_b,
        table(header.height_fields, header.height_fields_size, HEIGHT_FIELD_ROW)[query.data_b],
        heights_of(header, query.world),
        query.margin,
        contact_list(query),
        count,
        scratch_of(query),
    )


# By the codes of the two shapes, the smaller first.
PAIR_STAGES: dict[tuple[int, int], Stage] = {
    (SPHERE, SPHERE): sphere_sphere_stage,
    (SPHERE, CAPSULE): sphere_capsule_stage,
    (SPHERE, BOX): sphere_box_stage,
    (SPHERE, PLANE): sphere_plane_stage,
    (CAPSULE, CAPSULE): capsule_capsule_stage,
    (CAPSULE, BOX): capsule_box_stage,
    (CAPSULE, PLANE): capsule_plane_stage,
    (BOX, BOX): box_box_stage,
    (BOX, PLANE): box_plane_stage,
    (SPHERE, CYLINDER): sphere_cylinder_stage,
    (CAPSULE, CYLINDER): convex_stage,
    (BOX, CYLINDER): convex_stage,
    (CYLINDER, CYLINDER): convex_stage,
    (CYLINDER, PLANE): cylinder_plane_stage,
    (SPHERE, HULL): convex_stage,
    (CAPSULE, HULL): convex_stage,
    (BOX, HULL): convex_stage,
    (CYLINDER, HULL): convex_stage,
    (HULL, HULL): convex_stage,
    (HULL, PLANE): hull_plane_stage,
    (SPHERE, HEIGHT_FIELD): height_field_stage,
    (SPHERE, MESH): mesh_stage,
    (CAPSULE, HEIGHT_FIELD): height_field_stage,
    (CAPSULE, MESH): mesh_stage,
    (BOX, HEIGHT_FIELD): height_field_stage,
    (BOX, MESH): mesh_stage,
    (SPHERE, SMOOTH_FIELD): smooth_rounded_stage,
    (CAPSULE, SMOOTH_FIELD): smooth_rounded_stage,
    (BOX, SMOOTH_FIELD): smooth_box_stage,
    (CYLINDER, SMOOTH_FIELD): smooth_cylinder_stage,
    (HULL, SMOOTH_FIELD): smooth_hull_stage,
}
