"""Which bodies a placed shape overlaps, by the functions of the narrow phase."""

from __future__ import annotations

import math

from ..jit import call_stage, entry_point
from ..maths import quat, vec3
from ..memory import bodies_of, colliders_of, header_at, pool_address, states_of, wears
from ..model import HEIGHT_FIELD, SMOOTH_FIELD
from ..narrow_phase.collide import place
from ..narrow_phase.pair_query import contact_list, move_anyhow, query_at, store_rotation


@entry_point
def overlapping_bodies(
    address, query_address, functions, worlds, shape, size, radius, position, orientation, wanted, results
):
    """Mark the bodies that a shape overlaps.

    Args:
        address, query_address: of the header and of a PAIR_QUERY that says where contacts go.
        functions: (NUM_SHAPES,) addresses of PAIR_STAGES of the shape with each other one.
        worlds: (k,) numbers of worlds.
        shape, size, radius: code, size (3,) [m] and bounding radius [m] of the shape.
        position, orientation: (3,) [m], (4,) of the shape, world frame.
        wanted: (bodies,) whether a body counts.
        results: (k, bodies) set to True where they overlap or touch.
    """
    header = header_at(address)
    colliders = colliders_of(header)
    query = query_at(query_address)
    contacts = contact_list(query)
    here = vec3.load(position)
    rotation = quat.to_matrix(quat.load(orientation))
    query.margin = 0.0
    move_anyhow(query, 0.0)
    for k in range(worlds.shape[0]):
        bodies = bodies_of(header, worlds[k])
        states = states_of(header, worlds[k])
        query.world = worlds[k]
        query.heights = pool_address(header.heights, header, worlds[k])
        for index in range(colliders.shape[0]):
            collider = colliders[index]
            body = collider.body
            if not wanted[body] or results[k, body] or not wears(bodies[body], index):
                continue
            there, turn = place(collider, states[body])
            reach = radius + collider.radius
            bounded = collider.shape != HEIGHT_FIELD and collider.shape != SMOOTH_FIELD and reach < math.inf
            if bounded and vec3.norm_squared(vec3.sub(there, here)) > reach * reach:
                continue
            own_first = shape <= collider.shape
            query.shape_a = shape if own_first else collider.shape
            query.shape_b = collider.shape if own_first else shape
            query.data_a = 0 if own_first else collider.data
            query.data_b = collider.data if own_first else 0
            vec3.store(query.position_a, here if own_first else there)
            vec3.store(query.position_b, there if own_first else here)
            store_rotation(query.rotation_a, rotation if own_first else turn)
            store_rotation(query.rotation_b, turn if own_first else rotation)
            own_size, other_size = vec3.load(size), vec3.load(collider.size)
            vec3.store(query.size_a, own_size if own_first else other_size)
            vec3.store(query.size_b, other_size if own_first else own_size)
            count = call_stage(functions[collider.shape], query_address, 0)
            for number in range(min(count, contacts.shape[0])):
                if contacts[number].gap <= 0.0:
                    results[k, body] = True
