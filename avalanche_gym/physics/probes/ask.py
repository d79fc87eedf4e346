"""Rays and points against all bodies of a world: the boxes of the colliders first, then the shapes inside them."""

from __future__ import annotations

import math

import numpy as np

from ..broad_phase.bounds import collider_box
from ..jit import Stage, call_stage, entry_point, kernel
from ..maths import mat3, quat, vec3
from ..memory import bodies_of, colliders_of, header_at, states_of, wears
from ..model import BOX, CAPSULE, CYLINDER, HEIGHT_FIELD, HULL, MESH, PLANE, SMOOTH_FIELD, SPHERE
from ..narrow_phase.collide import place
from . import nearest_primitives, nearest_terrain, ray_height_field, ray_mesh, ray_primitives
from .probe import HIT, probe_at
from .ray_mesh import enter_box, inverse_of

# By the code of the shape.
RAY_STAGES: dict[int, Stage] = {
    SPHERE: ray_primitives.ray_sphere,
    CAPSULE: ray_primitives.ray_tube,
    CYLINDER: ray_primitives.ray_tube,
    BOX: ray_primitives.ray_box,
    PLANE: ray_primitives.ray_plane,
    HULL: ray_primitives.ray_hull,
    HEIGHT_FIELD: ray_height_field.ray_facets,
    SMOOTH_FIELD: ray_height_field.ray_smooth,
    MESH: ray_mesh.ray_mesh,
}
NEAREST_STAGES: dict[int, Stage] = {
    SPHERE: nearest_primitives.near_ball,
    CAPSULE: nearest_primitives.near_ball,
    CYLINDER: nearest_primitives.near_cylinder,
    BOX: nearest_primitives.near_box,
    PLANE: nearest_primitives.near_plane,
    HULL: nearest_primitives.near_hull,
    HEIGHT_FIELD: nearest_terrain.near_facets,
    SMOOTH_FIELD: nearest_terrain.near_smooth,
    MESH: nearest_terrain.near_mesh,
}

# What a query returns for each ray or point.
HIT_DTYPE = np.dtype(
    [
        ("body", np.int64),  # handle, -1 if nothing is within the distance
        ("distance", np.float64),  # [m] along the ray; of a point signed, negative inside; infinite for none
        ("position", np.float64, 3),  # [m] on the surface, world frame; NaN for none
        ("normal", np.float64, 3),  # unit, outward, world frame; NaN for none
    ]
)


@kernel
def _write_boxes(header, colliders, states, boxes):
    """Fill boxes (colliders, 6) [m]: low, high."""
    for index in range(colliders.shape[0]):
        state = states[colliders[index].body]
        rotation = quat.to_matrix(quat.load(state.orientation))
        low, high = collider_box(header, colliders[index], vec3.load(state.center), rotation)
        for axis in range(3):
            boxes[index, axis] = low[axis]
            boxes[index, 3 + axis] = high[axis]


@kernel
def _ask(probe, probe_address, function, collider, state, origin, direction):
    """Put a ray or point in the frame of a collider and call the function of its shape; return MISS or HIT."""
    position, rotation = place(collider, state)
    probe.shape = collider.shape
    probe.data = collider.data
    vec3.store(probe.size, vec3.load(collider.size))
    if collider.shape == SPHERE:
        probe.size[1] = 0.0
    vec3.store(probe.origin, mat3.apply_transposed(rotation, vec3.sub(origin, position)))
    vec3.store(probe.direction, mat3.apply_transposed(rotation, direction))
    return call_stage(function, probe_address)


@kernel
def _note(probe, collider, state, result):
    _, rotation = place(collider, state)
    result.body = collider.body
    result.distance = probe.distance
    vec3.store(result.normal, mat3.apply(rotation, vec3.load(probe.normal)))


@kernel
def _begin(result):
    result.body = -1
    result.distance = math.inf
    for axis in range(3):
        result.position[axis] = result.normal[axis] = math.nan


@entry_point
def cast_rays(address, probe_address, functions, worlds, origins, directions, limit, wanted, boxes, results):
    """First hits of rays.

    Args:
        address: of the header.
        probe_address: of a PROBE.
        functions: (NUM_SHAPES,) addresses of RAY_STAGES.
        worlds: (k,) numbers of worlds.
        origins, directions: (k or 1, n, 3) [m], unit; 1: the same rays in every world.
        limit: [m] longest distance.
        wanted: (bodies,) whether a body counts.
        boxes: (colliders, 6) scratch.
        results: (k, n) of HIT_DTYPE.
    """
    header = header_at(address)
    colliders = colliders_of(header)
    probe = probe_at(probe_address)
    for k in range(worlds.shape[0]):
        world = worlds[k]
        bodies = bodies_of(header, world)
        states = states_of(header, world)
        _write_boxes(header, colliders, states, boxes)
        probe.header = address
        probe.world = world
        own_origins = origins[k if origins.shape[0] > 1 else 0]
        own_directions = directions[k if directions.shape[0] > 1 else 0]
        for ray in range(results.shape[1]):
            o, d = vec3.load(own_origins[ray]), vec3.load(own_directions[ray])
            inverse = inverse_of(d)
            result = results[k, ray]
            _begin(result)
            probe.limit = limit
            for index in range(colliders.shape[0]):
                collider = colliders[index]
                box = boxes[index]
                counts = wanted[collider.body] and wears(bodies[collider.body], index)
                if not counts or enter_box(box[:3], box[3:], o, inverse, probe.limit) == math.inf:
                    continue
                state = states[collider.body]
                if _ask(probe, probe_address, functions[collider.shape], collider, state, o, d) == HIT:
                    # Of two at the same distance the first counts.
                    if probe.distance < result.distance:
                        _note(probe, collider, state, result)
                        probe.limit = probe.distance
            if result.body >= 0:
                vec3.store(result.position, vec3.add_scaled(o, result.distance, d))


@kernel
def _box_distance(box, p):
    """Distance [m] of a point from a box."""
    return vec3.norm(
        (
            max(box[0] - p[0], 0.0, p[0] - box[3]),
            max(box[1] - p[1], 0.0, p[1] - box[4]),
            max(box[2] - p[2], 0.0, p[2] - box[5]),
        )
    )


@entry_point
def nearest_points(address, probe_address, functions, worlds, points, limit, wanted, boxes, results):
    """Nearest surfaces of points (k or 1, n, 3) [m]; other arguments as in ``cast_rays``."""
    header = header_at(address)
    colliders = colliders_of(header)
    probe = probe_at(probe_address)
    for k in range(worlds.shape[0]):
        world = worlds[k]
        bodies = bodies_of(header, world)
        states = states_of(header, world)
        _write_boxes(header, colliders, states, boxes)
        probe.header = address
        probe.world = world
        own = points[k if points.shape[0] > 1 else 0]
        for number in range(results.shape[1]):
            p = vec3.load(own[number])
            result = results[k, number]
            _begin(result)
            probe.limit = limit
            for index in range(colliders.shape[0]):
                collider = colliders[index]
                counts = wanted[collider.body] and wears(bodies[collider.body], index)
                if not counts or _box_distance(boxes[index], p) > max(probe.limit, 0.0):
                    continue
                state = states[collider.body]
                if _ask(probe, probe_address, functions[collider.shape], collider, state, p, vec3.ZERO) == HIT:
                    if probe.distance < result.distance:
                        _note(probe, collider, state, result)
                        probe.limit = probe.distance
            if result.body >= 0:
                normal = vec3.load(result.normal)
                vec3.store(result.position, vec3.add_scaled(p, -result.distance, normal))
