"""The function of each pair of shapes, as a stage: a scene compiles those that can occur in it."""

from __future__ import annotations

from ..jit import Stage, stage
from ..memory import header_at, heights_of, table
from ..model import (
    BOX,
    CAPSULE,
    FACE_ROW,
    HEIGHT_FIELD,
    HEIGHT_FIELD_ROW,
    MESH,
    MESH_ROW,
    NODE_ROW,
    PLANE,
    SPHERE,
    VERTEX_ROW,
)
from .box import box_box
from .capsule import capsule_box, capsule_capsule
from .height_field import collide_height_field
from .mesh import collide_mesh
from .pair_query import contact_list, first_of, query_at, scratch_of, second_of
from .plane import box_plane, capsule_plane, sphere_plane
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
    (SPHERE, HEIGHT_FIELD): height_field_stage,
    (SPHERE, MESH): mesh_stage,
    (CAPSULE, HEIGHT_FIELD): height_field_stage,
    (CAPSULE, MESH): mesh_stage,
    (BOX, HEIGHT_FIELD): height_field_stage,
    (BOX, MESH): mesh_stage,
}
