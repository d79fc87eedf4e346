"""Contacts between two bodies: every collider of the one against every collider of the other."""

from __future__ import annotations

import math

import numpy as np

from ..jit import call_stage, kernel
from ..maths import mat3, quat, vec3
from ..memory import colliders_of, table, traits_of
from ..model import (
    BETWEEN,
    BOX,
    CAPSULE,
    CYLINDER,
    HEIGHT_FIELD,
    HULL,
    MESH,
    NUM_SHAPES,
    ON_A,
    ON_B,
    PLANE,
    SMOOTH_FIELD,
    SPHERE,
)
from .mesh_pieces import is_crossing, is_of_second
from .moving_heights import along_field
from .pair_query import contact_list, query_at, store_rotation
from .smooth_candidates import is_on_flat
from .terrain_candidates import is_terrain_vertex

# A normal along a face of a box to this cosine is that of the face.
FACE_COSINE = 1.0 - 1e-12
# Cosine between axis and normal up to which a cylinder rolls rather than stands.
LEANING_COSINE = 0.5


@kernel
def _turned_place(collider, state):
    """Position (3) and rotation (9) of a collider that does not lie as its body does."""
    rotation = quat.to_matrix(quat.load(state.orientation))
    position = vec3.add(vec3.load(state.center), mat3.apply(rotation, vec3.load(collider.position)))
    return position, mat3.multiply(rotation, quat.to_matrix(quat.load(collider.orientation)))


@kernel
def _is_centred(collider):
    """Whether a collider is at the centre of its body, turned as this is: most bodies of one collider are like that."""
    p, q = collider.position, collider.orientation
    return p[0] == 0.0 and p[1] == 0.0 and p[2] == 0.0 and q[1] == 0.0 and q[2] == 0.0 and q[3] == 0.0


@kernel
def place(collider, state):
    """Position (3) and rotation (9) of a collider in the world."""
    if _is_centred(collider):
        return vec3.load(state.center), quat.to_matrix(quat.load(state.orientation))
    return _turned_place(collider, state)


@kernel
def _position(collider, state):
    """The position alone."""
    if _is_centred(collider):
        return vec3.load(state.center)
    position, _ = _turned_place(collider, state)
    return position


@kernel
def _rounding(collider, state, normal):
    """Radius [m] of the ball at the contact, about a core that spin of a round shape does not move.

    Spheres and capsules are rounded points and segments. The normal through a point of a cylinder's side or rim meets
    the axis at radius / sine, whatever the tilt; one that (nearly) stands does not roll.
    """
    if collider.shape == SPHERE or collider.shape == CAPSULE:
        return collider.size[0]
    if collider.shape == CYLINDER:
        _, rotation = place(collider, state)
        cosine = vec3.dot(mat3.column(rotation, 2), normal)
        if abs(cosine) < LEANING_COSINE:
            return collider.size[0] / math.sqrt(1.0 - cosine * cosine)
    return 0.0


@kernel
def _flatness(shape):
    return shape + NUM_SHAPES if shape == PLANE or shape == HEIGHT_FIELD or shape == SMOOTH_FIELD else shape


@kernel
def _set_frame(first, state_a, second, state_b, contact):
    """What the normal of a contact between two colliders turns with, and whether that is only a first guess.

    The flatter of the two carries it, of two boxes the one with the face.
    """
    a, b = first.shape, second.shape
    contact.curved = 1 if curves(a, b) else 0
    contact.frame = ON_A if _flatness(a) > _flatness(b) else ON_B
    if a == SPHERE and b == SPHERE:
        contact.frame = BETWEEN
    elif a == BOX and b == BOX:
        normal = vec3.load(contact.normal)
        on_a = _along_axis(first, state_a, normal)
        contact.frame = ON_A if on_a else ON_B
        contact.curved = 0 if on_a or _along_axis(second, state_b, normal) else 1
    elif (max(a, b) == MESH or max(a, b) == HEIGHT_FIELD) and (
        min(a, b) == BOX or min(a, b) == HULL or min(a, b) >= HEIGHT_FIELD
    ):
        if is_crossing(contact.feature):
            # Both edges turn the normal; where they come to cross no more, it stays with the flatter body.
            contact.curved = 1
        elif min(a, b) >= HEIGHT_FIELD:
            # Between surfaces of triangles either one has the face.
            contact.frame = ON_A if is_of_second(contact.feature) != (a > b) else ON_B
        else:
            # Its corners slide on facets, and vertices of those on its faces.
            contact.frame = ON_A if is_terrain_vertex(contact.feature) == (a < b) else ON_B
    elif a == SMOOTH_FIELD or b == SMOOTH_FIELD:
        if is_on_flat(contact.feature):
            contact.curved = 0
    elif contact.curved == 1:
        # A cylinder that stands on its flat end is as good as a box.
        normal = vec3.load(contact.normal)
        stands = a == CYLINDER and _stands(first, state_a, normal)
        if stands or (b == CYLINDER and _stands(second, state_b, normal)):
            contact.curved = 0


@kernel
def _along_axis(collider, state, normal):
    _, rotation = place(collider, state)
    local = mat3.apply_transposed(rotation, normal)
    return max(abs(local[0]), abs(local[1]), abs(local[2])) >= FACE_COSINE


@kernel
def _stands(collider, state, normal):
    _, rotation = place(collider, state)
    return abs(mat3.apply_transposed(rotation, normal)[2]) >= FACE_COSINE


@kernel
def curves(a, b):
    """Whether contacts of two shapes can turn otherwise than one of the bodies does."""
    if a == SMOOTH_FIELD or b == SMOOTH_FIELD or a == CYLINDER or b == CYLINDER:
        return True
    if a == CAPSULE or b == CAPSULE:
        return a <= CAPSULE and b <= CAPSULE and a + b > 0
    return (a == BOX and b == BOX) or (a == HULL and (b == BOX or b == HULL)) or (a == BOX and b == HULL)


@kernel
def _ask(header, query, query_address, first, state_first, second, state_second, count):
    """Contacts of two colliders, the smaller shape code first; normals from first to second."""
    reach = first.radius + second.radius + query.margin
    if second.shape != HEIGHT_FIELD and second.shape != SMOOTH_FIELD and reach < math.inf:
        apart = vec3.sub(_position(second, state_second), _position(first, state_first))
        if vec3.norm_squared(apart) > reach * reach:
            return count
    position_a, rotation_a = place(first, state_first)
    position_b, rotation_b = place(second, state_second)
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
def _along_ground(header, pool, collider, state, point):
    """What a pool of rates of moving heights says of a collider's surface, as a vector; zero for all other shapes."""
    if collider.shape != HEIGHT_FIELD and collider.shape != SMOOTH_FIELD:
        return vec3.ZERO
    position, rotation = place(collider, state)
    return along_field(header, pool, collider.data, position, rotation, point)


@kernel
def _note_ground(header, query, first, state_a, second, state_b, contact):
    """How the surface of moving heights moves at a contact, b against a."""
    point = vec3.load(contact.position)
    pool = table(query.height_velocities, header.num_heights, np.float64)
    moved_a = _along_ground(header, pool, first, state_a, point)
    moved_b = _along_ground(header, pool, second, state_b, point)
    vec3.store(contact.surface_velocity, vec3.sub(moved_b, moved_a))
    pool = table(query.height_accelerations, header.num_heights, np.float64)
    moved_a = _along_ground(header, pool, first, state_a, point)
    moved_b = _along_ground(header, pool, second, state_b, point)
    vec3.store(contact.surface_acceleration, vec3.sub(moved_b, moved_a))


@kernel
def collide_pair(header, query_address, states, a, i, b, j, count):
    """Append the contacts of collider i of body a and collider j of body b > a; return the new count."""
    query = query_at(query_address)
    contacts = contact_list(query)
    colliders = colliders_of(header)
    start = count
    swapped = colliders[i].shape > colliders[j].shape
    query.sense = -1.0 if swapped else 1.0
    if swapped:
        count = _ask(header, query, query_address, colliders[j], states[b], colliders[i], states[a], count)
    else:
        count = _ask(header, query, query_address, colliders[i], states[a], colliders[j], states[b], count)
    for index in range(start, min(count, contacts.shape[0])):
        contact = contacts[index]
        contact.pair = i * colliders.shape[0] + j
        contact.body_a = a
        contact.body_b = b
        vec3.store(contact.surface_velocity, vec3.ZERO)
        vec3.store(contact.surface_acceleration, vec3.ZERO)
        if traits_of(header, query.world).moving_heights == 1:
            _note_ground(header, query, colliders[i], states[a], colliders[j], states[b], contact)
        if swapped:
            vec3.store(contact.normal, vec3.neg(vec3.load(contact.normal)))
        normal = vec3.load(contact.normal)
        contact.radius_a = _rounding(colliders[i], states[a], normal)
        contact.radius_b = _rounding(colliders[j], states[b], normal)
        _set_frame(colliders[i], states[a], colliders[j], states[b], contact)
    return count


@kernel
def _apart(first, second, reach):
    """Whether two points are farther apart than ``reach`` [m], which may be infinite."""
    return vec3.norm_squared(vec3.sub(second, first)) > reach * reach


@kernel
def _collide_parts(header, query_address, bodies, states, a, b, count):
    """The same as collide_bodies for compounds: parts whose spheres are apart are passed over."""
    body_a = bodies[a]
    body_b = bodies[b]
    margin = query_at(query_address).margin
    colliders = colliders_of(header)
    center_a = vec3.load(states[a].center)
    center_b = vec3.load(states[b].center)
    rotation_a = quat.to_matrix(quat.load(states[a].orientation))
    rotation_b = quat.to_matrix(quat.load(states[b].orientation))
    for i in range(body_a.first_collider, body_a.first_collider + body_a.num_colliders):
        reach = colliders[i].radius + margin
        middle = vec3.add(center_a, mat3.apply(rotation_a, vec3.load(colliders[i].position)))
        if _apart(middle, center_b, reach + body_b.radius):
            continue
        for j in range(body_b.first_collider, body_b.first_collider + body_b.num_colliders):
            other = vec3.add(center_b, mat3.apply(rotation_b, vec3.load(colliders[j].position)))
            if not _apart(middle, other, reach + colliders[j].radius):
                count = collide_pair(header, query_address, states, a, i, b, j, count)
    return count


@kernel
def collide_bodies(header, query_address, bodies, states, a, b, count):
    """Append the contacts of bodies a < b placed by ``states`` to the list of the query; return the new count.

    The query holds margin, world, and where contacts go. Normals point from a to b.
    """
    body_a = bodies[a]
    body_b = bodies[b]
    if body_a.num_colliders == 1 and body_b.num_colliders == 1:
        return collide_pair(header, query_address, states, a, body_a.first_collider, b, body_b.first_collider, count)
    return _collide_parts(header, query_address, bodies, states, a, b, count)
