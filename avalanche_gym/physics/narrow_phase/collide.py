"""Contacts between two bodies: every collider of the one against every collider of the other."""

from __future__ import annotations

import math

import numpy as np

from ..jit import call_stage, kernel
from ..maths import mat3, quat, vec3
from ..memory import colliders_of, table
from ..model import BETWEEN, BOX, CAPSULE, HEIGHT_FIELD, NUM_SHAPES, ON_A, ON_B, SPHERE
from .moving_heights import height_velocity
from .pair_query import contact_list, query_at, store_rotation

# A normal along a face of a box to this cosine is that of the face.
FACE_COSINE = 1.0 - 1e-12


@kernel
def place(collider, state):
    """Position (3) and rotation (9) of a collider in the world."""
    rotation = quat.to_matrix(quat.load(state.orientation))
    position = vec3.add(vec3.load(state.center), mat3.apply(rotation, vec3.load(collider.position)))
    return position, mat3.multiply(rotation, quat.to_matrix(quat.load(collider.orientation)))


@kernel
def _rounding(collider):
    """Radius [m] by which a shape is thicker than its core: spheres and capsules are rounded points and segments."""
    return collider.size[0] if collider.shape == SPHERE or collider.shape == CAPSULE else 0.0


@kernel
def _frame(first, state_a, second, state_b, normal):
    """What the normal of a contact between two colliders turns with: the flatter one, and of two boxes the one with the
    face.
    """
    if second.shape == SPHERE and first.shape == SPHERE:
        return BETWEEN
    if first.shape == BOX and second.shape == BOX:
        _, rotation = place(first, state_a)
        local = mat3.apply_transposed(rotation, normal)
        return ON_A if max(abs(local[0]), abs(local[1]), abs(local[2])) >= FACE_COSINE else ON_B
    return ON_A if first.shape > second.shape else ON_B


@kernel
def _ask(header, query, query_address, first, state_first, second, state_second, count):
    """Contacts of two colliders, the smaller shape code first; normals from first to second."""
    position_a, rotation_a = place(first, state_first)
    position_b, rotation_b = place(second, state_second)
    reach = first.radius + second.radius + query.margin
    if second.shape != HEIGHT_FIELD and reach < math.inf:
        if vec3.norm_squared(vec3.sub(position_b, position_a)) > reach * reach:
            return count
    query.shape_a = first.shape
    query.shape_b = second.shape
    query.data_a = first.data
    query.data_b = second.data
    vec3.store(query.position_a, position_a)
    vec3.store(query.position_b, position_b)
    store_rotation(query.rotation_a, rotation_a)
    store_rotation(query.rotation_b, rotation_b)
    vec3.store(query.size_a, vec3.load(first.size))
    vec3.store(query.size_b, vec3.load(second.size))
    function = table(header.pair_functions, header.pair_functions_size, np.int64)[
        first.shape * NUM_SHAPES + second.shape
    ]
    return call_stage(function, query_address, count)


@kernel
def _surface_velocity(header, world, collider, state, point):
    """Velocity [m/s] of a collider's surface against its body: only that of moving heights is not zero."""
    if collider.shape != HEIGHT_FIELD:
        return vec3.ZERO
    position, rotation = place(collider, state)
    return height_velocity(header, world, collider.data, position, rotation, point)


@kernel
def collide_bodies(header, query_address, bodies, states, a, b, count):
    """Append the contacts of bodies a < b placed by ``states`` to the list of the query; return the new count.

    The query holds margin, world, and where contacts go. Normals point from a to b.
    """
    query = query_at(query_address)
    contacts = contact_list(query)
    colliders = colliders_of(header)
    num_colliders = colliders.shape[0]
    body_a = bodies[a]
    body_b = bodies[b]
    for i in range(body_a.first_collider, body_a.first_collider + body_a.num_colliders):
        for j in range(body_b.first_collider, body_b.first_collider + body_b.num_colliders):
            start = count
            swapped = colliders[i].shape > colliders[j].shape
            if swapped:
                count = _ask(header, query, query_address, colliders[j], states[b], colliders[i], states[a], count)
            else:
                count = _ask(header, query, query_address, colliders[i], states[a], colliders[j], states[b], count)
            for index in range(start, min(count, contacts.shape[0])):
                contact = contacts[index]
                contact.pair = i * num_colliders + j
                contact.body_a = a
                contact.body_b = b
                contact.radius_a = _rounding(colliders[i])
                contact.radius_b = _rounding(colliders[j])
                vec3.store(contact.surface_velocity, vec3.ZERO)
                if header.moving_heights == 1:
                    point = vec3.load(contact.position)
                    moved_a = _surface_velocity(header, query.world, colliders[i], states[a], point)
                    moved_b = _surface_velocity(header, query.world, colliders[j], states[b], point)
                    vec3.store(contact.surface_velocity, vec3.sub(moved_b, moved_a))
                if swapped:
                    vec3.store(contact.normal, vec3.neg(vec3.load(contact.normal)))
                contact.frame = _frame(colliders[i], states[a], colliders[j], states[b], vec3.load(contact.normal))
    return count
