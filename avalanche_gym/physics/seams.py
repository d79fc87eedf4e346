"""Contacts with a feature of a static shape that another static shape covers: seams between pieces of ground.

Each piece of ground is checked alone, and where it ends it has edges, corners and walls. Where the next piece goes on
flush with it, or stands on it, those are inside of the union of the two, or flat in it, and nothing may catch on them.
For every dynamic body with contacts on several static (or kinematic) colliders this stage looks at the foot q of each
contact, on collider T with outward normal d, and at the other colliders S that hold q too:

* **Covered.** d is a normal of the union at q only if q is nearest to q + s d in S as well (the proximal normal of
  Clarke 1983, *Optimization and nonsmooth analysis*, sec. 2.5: normal cones of a union intersect). Else the contact is
  dropped, unless the feature of T goes on in the open: a wall that stands on a floor starts inside of it.
* **Flat.** An edge or vertex of terrain is dropped if the union is flat around q: the points of the body have their
  contacts with the faces.
"""

from __future__ import annotations

import math

import numpy as np

from .jit import call_stage, kernel, stage
from .maths import mat3, vec3
from .memory import bodies_of, colliders_of, header_at, states_of, table, workspace_at
from .model import (
    BODY_STATE,
    CAPSULE,
    CONTACT,
    CYLINDER,
    DYNAMIC,
    HEIGHT_FIELD,
    MESH,
    NUM_SHAPES,
    PLACE_BITS,
    SMOOTH_FIELD,
    SPHERE,
)
from .narrow_phase.collide import collide_pair, place
from .narrow_phase.terrain_candidates import FACE_PLACE, PLACE_NUMBERS
from .probes.ask import NEAREST_STAGES
from .probes.probe import HIT, probe_at

# Surfaces of two colliders this close together, in units of the body's size, are one. Larger: steps of that height
# between two chunks of ground are rolled over as if they were not there.
FLUSH = 1e-9
# ... and what round-off of coordinates far from the origin makes of it, in units of the distance from there.
ROUND_OFF = 1e-15
# How far from the foot the ground is looked at, in units of the body's size. Features smaller than that are not seen.
PROBED = 1e-3
# [rad] Normals that differ by less are the same: on flat shapes, and on curved ones, which bend that much in PROBED.
ALIKE, ALIKE_CURVED = 2e-6, 3e-3
# Directions in which the ground around a foot is looked at.
AROUND = 8


@kernel
def _nearest(header, probe_address, collider, state, point, limit):
    """Whether the collider is within ``limit`` [m] of a point; signed distance, outward normal, nearest point."""
    probe = probe_at(probe_address)
    position, rotation = place(collider, state)
    probe.shape = collider.shape
    probe.data = collider.data
    vec3.store(probe.size, vec3.load(collider.size))
    if collider.shape == SPHERE:
        probe.size[1] = 0.0
    probe.limit = limit
    vec3.store(probe.origin, mat3.apply_transposed(rotation, vec3.sub(point, position)))
    functions = table(header.nearest_functions, NUM_SHAPES, np.int64)
    found = call_stage(functions[collider.shape], probe_address) == HIT
    normal = mat3.apply(rotation, vec3.load(probe.normal))
    return found, probe.distance, normal, vec3.add_scaled(point, -probe.distance, normal)


@kernel
def _alike(shape):
    curved = shape == SPHERE or shape == CAPSULE or shape == CYLINDER or shape == SMOOTH_FIELD
    return ALIKE_CURVED if curved else ALIKE


@kernel
def _is_normal(header, probe_address, collider, state, foot, nearest, d, s):
    """Whether d is a normal of the collider at ``foot``, whose nearest point ``nearest`` is; and the one beside it."""
    _, distance, normal, other = _nearest(header, probe_address, collider, state, vec3.add_scaled(foot, s, d), math.inf)
    moved = vec3.norm(vec3.sub(other, nearest))
    return distance > 0.5 * s and moved <= _alike(collider.shape) * s, normal


@kernel
def _is_covered(header, probe_address, own, own_state, other, other_state, foot, d, s, flush):
    """Whether the collider ``other`` hides the feature of ``own`` with normal d at ``foot``."""
    holds, distance, _, nearest = _nearest(header, probe_address, other, other_state, foot, flush)
    if not holds:
        return False
    accepted, out = _is_normal(header, probe_address, other, other_state, foot, nearest, d, s)
    if accepted:
        return False
    # Along the feature out of the other collider.
    t = vec3.add_scaled(out, -vec3.dot(out, d), d)
    length = vec3.norm(t)
    if length <= ALIKE_CURVED:
        return True
    beyond = vec3.add_scaled(foot, (s + max(-distance, 0.0)) / length, t)
    exposed, _ = _is_normal(header, probe_address, own, own_state, beyond, beyond, d, s)
    return not exposed


@kernel
def _body_of(bodies, contact):
    """The dynamic body of a contact with one that is not, or -1."""
    a_moves = bodies[contact.body_a].motion == DYNAMIC
    if a_moves == (bodies[contact.body_b].motion == DYNAMIC):
        return -1
    return contact.body_a if a_moves else contact.body_b


@kernel
def _ground_of(bodies, contact, num_colliders):
    """The collider of the body that is not dynamic."""
    i = contact.pair // num_colliders
    return i if bodies[contact.body_a].motion != DYNAMIC else contact.pair - i * num_colliders


@kernel
def _foot_of(bodies, contact):
    """Point of the ground, its outward normal, how far [m] to look from there, and what [m] is flush."""
    a_is_ground = bodies[contact.body_a].motion != DYNAMIC
    size = bodies[contact.body_b if a_is_ground else contact.body_a].size
    d = vec3.load(contact.normal) if a_is_ground else vec3.neg(vec3.load(contact.normal))
    foot = vec3.add_scaled(vec3.load(contact.position), -0.5 * contact.gap, d)
    flush = FLUSH * size + ROUND_OFF * (abs(foot[0]) + abs(foot[1]) + abs(foot[2]))
    return foot, d, PROBED * size, flush


@kernel
def _lies_across(contact, collider):
    """Whether a contact belongs to an edge or vertex of terrain."""
    terrain = collider.shape == HEIGHT_FIELD or collider.shape == MESH
    return terrain and contact.feature // PLACE_NUMBERS & 3 != FACE_PLACE


@kernel
def _is_flat(header, states, bodies, colliders, contacts, links, first, foot, d, s, flush, probe_address):
    """Whether the union of the ground under one body, whose contacts start at ``first``, is flat around ``foot``."""
    axis = 0
    for k in range(1, 3):
        if abs(d[k]) < abs(d[axis]):
            axis = k
    u = vec3.cross(d, (1.0 if axis == 0 else 0.0, 1.0 if axis == 1 else 0.0, 1.0 if axis == 2 else 0.0))
    u = vec3.scale(s / vec3.norm(u), u)
    v = vec3.cross(d, u)
    for direction in range(AROUND):
        angle = 2.0 * math.pi * direction / AROUND
        place_beside = vec3.add_scaled(vec3.add_scaled(foot, math.cos(angle), u), math.sin(angle), v)
        covered = False
        last = np.int64(-1)
        index = first
        while index >= 0 and not covered:
            ground = _ground_of(bodies, contacts[index], colliders.shape[0])
            if ground != last:
                last = ground
                collider = colliders[ground]
                state = states[collider.body]
                limit = ALIKE * s + flush
                found, distance, _, _ = _nearest(header, probe_address, collider, state, place_beside, limit)
                covered = found and distance >= -limit
            index = links[index]
        if not covered:
            return False
    return True


@kernel
def _is_hidden(header, states, bodies, colliders, contacts, links, first, index, probe_address):
    """Whether contact ``index``, one of the list that starts at ``first``, is inside of the ground, or flat in it."""
    contact = contacts[index]
    own = _ground_of(bodies, contact, colliders.shape[0])
    foot, d, s, flush = _foot_of(bodies, contact)
    touches_another = False
    last = own
    other = first
    while other >= 0:
        ground = _ground_of(bodies, contacts[other], colliders.shape[0])
        if ground != own and ground != last:
            last = ground
            collider = colliders[ground]
            state = states[collider.body]
            own_state = states[colliders[own].body]
            if _is_covered(header, probe_address, colliders[own], own_state, collider, state, foot, d, s, flush):
                return True
            found, _, _, _ = _nearest(header, probe_address, collider, state, foot, flush)
            touches_another = touches_another or found
        other = links[other]
    return (
        touches_another
        and _lies_across(contact, colliders[own])
        and _is_flat(header, states, bodies, colliders, contacts, links, first, foot, d, s, flush, probe_address)
    )


@stage
def hide_seams(address, workspace_address, world, count):
    """Drop what the ground hides from the ``contacts`` of the workspace; return how many remain.

    Uses ``island`` as the first contact of each body with ground, ``order`` as the links from one to the next.
    """
    header = header_at(address)
    workspace = workspace_at(workspace_address)
    bodies = bodies_of(header, world)
    states = states_of(header, world)
    colliders = colliders_of(header)
    contacts = table(workspace.contacts, workspace.contacts_size, CONTACT)
    firsts = table(workspace.island, workspace.island_size, np.int64)
    links = table(workspace.order, workspace.order_size, np.int64)
    probe = probe_at(workspace.probe)
    probe.header = address
    probe.world = world
    for index in range(header.num_bodies):
        firsts[index] = -1
    several = False
    for index in range(count):
        body = _body_of(bodies, contacts[index])
        links[index] = -1
        if body >= 0:
            first = firsts[body]
            links[index] = first
            firsts[body] = index
            if first >= 0 and contacts[first].pair != contacts[index].pair:
                several = True
    if not several:
        return count
    for index in range(count):
        contacts[index].island = 0
        body = _body_of(bodies, contacts[index])
        if body >= 0 and _is_hidden(
            header, states, bodies, colliders, contacts, links, firsts[body], index, workspace.probe
        ):
            contacts[index].island = -1
    spare = table(workspace.asked, workspace.asked_size, CONTACT)
    for body in range(header.num_bodies):
        _sort_points(contacts, links, firsts[body], spare)
    kept = 0
    for index in range(count):
        if contacts[index].island == 0:
            if kept < index:
                contacts[kept] = contacts[index]
            kept += 1
    return kept


@kernel
def _sort_points(contacts, links, first, spare):
    """Sort the contacts of one body, from the last one back, by its points: the order they would have on one ground.

    How contacts that share a load undetermined by the contact law do so depends on their order in the last digits.
    """
    sorted_all = False
    while not sorted_all:
        sorted_all = True
        index = first
        while index >= 0 and links[index] >= 0:
            before = links[index]
            if contacts[before].feature >> PLACE_BITS > contacts[index].feature >> PLACE_BITS:
                spare[0] = contacts[before]
                contacts[before] = contacts[index]
                contacts[index] = spare[0]
                sorted_all = False
            index = before


@stage
def cross_seams(address, workspace_address, world, count):
    """Put the ``asked`` contacts of one pair right, with the bodies at ``predicted``; return how many there are then.

    A point that has slid past the end of its ground is found at the edge there, which the next piece covers, or not
    at all. The contacts of the body with the other pieces are appended.
    """
    header = header_at(address)
    workspace = workspace_at(workspace_address)
    bodies = bodies_of(header, world)
    colliders = colliders_of(header)
    num_colliders = colliders.shape[0]
    asked = table(workspace.asked, workspace.asked_size, CONTACT)
    pairs = table(workspace.pairs, workspace.pairs_size, np.int64)
    body = _body_of(bodies, asked[0]) if count > 0 else -1
    if body < 0:
        return count
    own = _ground_of(bodies, asked[0], num_colliders)
    mine = asked[0].pair // num_colliders + asked[0].pair % num_colliders - own
    body_first = asked[0].body_a == body
    kept = _drop_covered(address, workspace_address, world, body, own, 0, count)
    predicted = table(workspace.predicted, header.num_bodies, BODY_STATE)
    flown = table(workspace.flown, header.num_bodies, BODY_STATE)
    count = kept
    for pair in range(workspace.num_pairs):
        one, two = pairs[2 * pair], pairs[2 * pair + 1]
        other = two if one == body else one
        if (one != body and two != body) or bodies[other].motion == DYNAMIC:
            continue
        predicted[other] = flown[other]
        first = bodies[other].first_collider
        for ground in range(first, first + bodies[other].num_colliders):
            if ground == own:
                continue
            start = count
            if one == body:
                count = collide_pair(header, workspace.query, predicted, one, mine, two, ground, start)
            else:
                count = collide_pair(header, workspace.query, predicted, one, ground, two, mine, start)
            count = min(count, np.int64(asked.shape[0]))
            count = _drop_covered(address, workspace_address, world, body, ground, start, count)
            if (one == body) != body_first:
                for index in range(start, count):
                    vec3.store(asked[index].normal, vec3.neg(vec3.load(asked[index].normal)))
    return count


@kernel
def _drop_covered(address, workspace_address, world, body, own, start, count):
    """Drop those of asked[start:count], contacts of a body with collider ``own``, that other ground covers."""
    header = header_at(address)
    workspace = workspace_at(workspace_address)
    bodies = bodies_of(header, world)
    colliders = colliders_of(header)
    flown = table(workspace.flown, header.num_bodies, BODY_STATE)
    asked = table(workspace.asked, workspace.asked_size, CONTACT)
    pairs = table(workspace.pairs, workspace.pairs_size, np.int64)
    probe = probe_at(workspace.probe)
    probe.header = address
    probe.world = world
    own_state = flown[colliders[own].body]
    kept = start
    for index in range(start, count):
        foot, d, s, flush = _foot_of(bodies, asked[index])
        covered = False
        for pair in range(workspace.num_pairs):
            one, two = pairs[2 * pair], pairs[2 * pair + 1]
            other = two if one == body else one
            if covered or (one != body and two != body) or bodies[other].motion == DYNAMIC:
                continue
            first = bodies[other].first_collider
            for ground in range(first, first + bodies[other].num_colliders):
                if ground != own and not covered:
                    covered = _is_covered(
                        header, workspace.probe, colliders[own], own_state, colliders[ground], flown[other], foot, d, s,
                        flush,
                    )  # fmt: skip
        if not covered:
            if kept < index:
                asked[kept] = asked[index]
            kept += 1
    return kept
