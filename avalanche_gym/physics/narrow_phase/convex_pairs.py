"""The function of each pair of convex shapes and planes, as a stage: contacts in closed form, or by the convex test."""

from __future__ import annotations

from ..jit import stage
from .box import box_box
from .capsule import capsule_capsule
from .capsule_box import capsule_box
from .cylinder import cylinder_plane, sphere_cylinder
from .hull import collide_convex
from .hull_plane import hull_plane
from .pair_query import query_at, scratch_of
from .pair_shapes import hull_pools, opened
from .plane import box_plane, capsule_plane, sphere_plane
from .sphere import sphere_box, sphere_capsule, sphere_sphere


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
