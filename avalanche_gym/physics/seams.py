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
from .memory import bodies_of, colliders_of, header_at, starts_of, table, workspace_at
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
def _ground_lists(workspace):
    """The pairs of bodies, and for each dynamic one the chain of its pairs with ground: links and firsts."""
    return (
        table(workspace.pairs, workspace.pairs_size, np.int64),
        table(workspace.ground_links, workspace.ground_links_size, np.int64),
        table(workspace.ground_firsts, workspace.ground_firsts_size, np.int64),
    )


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
def _is_covered(header, probe_address, own, own_state, other, other_state, foot, distance, nearest, d, s):
    """Whether the collider ``other`` hides the feature of ``own`` with normal d at ``foot``, which it holds."""
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
def _body_of(bodies, a, b):
    """The dynamic one of two bodies of which the other is not, or -1."""
    a_moves = bodies[a].motion == DYNAMIC
    if a_moves == (bodies[b].motion == DYNAMIC):
        return -1
    return a if a_moves else b


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
def _holds(box, p, reach):
    """Whether a point is within ``reach`` [m] of a box."""
    return (
        box[0] - reach <= p[0] <= box[3] + reach
        and box[1] - reach <= p[1] <= box[4] + reach
        and box[2] - reach <= p[2] <= box[5] + reach
    )


@kernel
def _other(pairs, number, body):
    """The body that pair ``number`` joins with ``body``."""
    return pairs[2 * number + 1] if pairs[2 * number] == body else pairs[2 * number]


@kernel
def _is_flat(address, workspace_address, world, states, body, foot, d, s, flush):
    """Whether the union of the ground around one body is flat around ``foot``."""
    header = header_at(address)
    workspace = workspace_at(workspace_address)
    bodies = bodies_of(header, world)
    colliders = colliders_of(header)
    pairs, links, firsts = _ground_lists(workspace)
    boxes = table(workspace.boxes, (workspace.boxes_size // 6, 6), np.float64)
    axis = 0
    for k in range(1, 3):
        if abs(d[k]) < abs(d[axis]):
            axis = k
    u = vec3.cross(d, (1.0 if axis == 0 else 0.0, 1.0 if axis == 1 else 0.0, 1.0 if axis == 2 else 0.0))
    u = vec3.scale(s / vec3.norm(u), u)
    v = vec3.cross(d, u)
    limit = ALIKE * s + flush
    for direction in range(AROUND):
        angle = 2.0 * math.pi * direction / AROUND
        beside = vec3.add_scaled(vec3.add_scaled(foot, math.cos(angle), u), math.sin(angle), v)
        there = False
        link = firsts[body]
        while link >= 0 and not there:
            ground = bodies[_other(pairs, link, body)]
            if _holds(boxes[_other(pairs, link, body)], beside, limit):
                for index in range(ground.first_collider, ground.first_collider + ground.num_colliders):
                    collider = colliders[index]
                    state = states[collider.body]
                    found, distance, _, _ = _nearest(header, workspace.probe, collider, state, beside, limit)
                    there = there or (found and distance >= -limit)
            link = links[link]
        if not there:
            return False
    return True


@kernel
def _is_hidden(address, workspace_address, world, states, body, contact):
    """Whether a contact of a body with ground, placed by ``states``, is inside of the ground, or flat in it."""
    header = header_at(address)
    workspace = workspace_at(workspace_address)
    bodies = bodies_of(header, world)
    colliders = colliders_of(header)
    pairs, links, firsts = _ground_lists(workspace)
    boxes = table(workspace.boxes, (workspace.boxes_size // 6, 6), np.float64)
    own = _ground_of(bodies, contact, colliders.shape[0])
    own_state = states[colliders[own].body]
    foot, d, s, flush = _foot_of(bodies, contact)
    shared = False
    link = firsts[body]
    while link >= 0:
        other = _other(pairs, link, body)
        if _holds(boxes[other], foot, flush):
            for index in range(
                bodies[other].first_collider, bodies[other].first_collider + bodies[other].num_colliders
            ):
                collider = colliders[index]
                state = states[other]
                if index == own:
                    continue
                found, distance, _, nearest = _nearest(header, workspace.probe, collider, state, foot, flush)
                if found:
                    shared = True
                    if _is_covered(
                        header,
                        workspace.probe,
                        colliders[own],
                        own_state,
                        collider,
                        state,
                        foot,
                        distance,
                        nearest,
                        d,
                        s,
                    ):
                        return True
        link = links[link]
    return (
        shared
        and _lies_across(contact, colliders[own])
        and _is_flat(address, workspace_address, world, states, body, foot, d, s, flush)
    )


@stage
def hide_seams(address, workspace_address, world, count):
    """Drop what the ground hides from the ``contacts`` of the workspace; return how many remain."""
    header = header_at(address)
    workspace = workspace_at(workspace_address)
    bodies = bodies_of(header, world)
    states = starts_of(header, workspace)
    contacts = table(workspace.contacts, workspace.contacts_size, CONTACT)
    spare = table(workspace.asked, workspace.asked_size, CONTACT)
    several = table(workspace.island, workspace.island_size, np.int64)
    heads = table(workspace.island_starts, workspace.island_starts_size, np.int64)
    order = table(workspace.order, workspace.order_size, np.int64)
    members = table(workspace.members, workspace.num_members, np.int64)
    if not _link_ground(address, workspace_address, world, several):
        return count
    for number in range(workspace.num_members):
        heads[members[number]] = -1
    for index in range(count):
        contact = contacts[index]
        contact.island = 0
        order[index] = -1
        body = _body_of(bodies, contact.body_a, contact.body_b)
        if body >= 0 and several[body] > 1:
            if _is_hidden(address, workspace_address, world, states, body, contact):
                contact.island = -1
            else:
                order[index] = heads[body]
                heads[body] = index
    for number in range(workspace.num_members):
        _sort_points(contacts, order, heads[members[number]], spare)
    kept = 0
    for index in range(count):
        if contacts[index].island == 0:
            if kept < index:
                contacts[kept] = contacts[index]
            kept += 1
    return kept


@kernel
def _link_ground(address, workspace_address, world, several):
    """Link the pairs of each dynamic body with ground; count their colliders in ``several``; return if any has two."""
    header = header_at(address)
    workspace = workspace_at(workspace_address)
    bodies = bodies_of(header, world)
    pairs, links, firsts = _ground_lists(workspace)
    probe = probe_at(workspace.probe)
    probe.header = address
    probe.world = world
    members = table(workspace.members, workspace.num_members, np.int64)
    for number in range(workspace.num_members):
        firsts[members[number]] = -1
        several[members[number]] = 0
    found = False
    for number in range(workspace.num_pairs):
        body = _body_of(bodies, pairs[2 * number], pairs[2 * number + 1])
        links[number] = -1
        if body >= 0:
            links[number] = firsts[body]
            firsts[body] = number
            several[body] += bodies[_other(pairs, number, body)].num_colliders
            found = found or several[body] > 1
    return found


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
def cross_seams(address, workspace_address, world, pair, count, places):
    """Put the ``asked`` contacts of one pair of colliders right; return how many there are then.

    A point that has slid past the end of its ground is found at the edge there, which the next piece covers, or not
    at all. The contacts of the body with the other pieces are appended. ``places``: address of the states (bodies,)
    that were asked for.
    """
    header = header_at(address)
    workspace = workspace_at(workspace_address)
    bodies = bodies_of(header, world)
    colliders = colliders_of(header)
    asked = table(workspace.asked, workspace.asked_size, CONTACT)
    pairs, links, firsts = _ground_lists(workspace)
    states = table(places, header.num_bodies, BODY_STATE)
    flown = table(workspace.flown, header.num_bodies, BODY_STATE)
    mine = pair // colliders.shape[0]
    own = pair - mine * colliders.shape[0]
    body = _body_of(bodies, colliders[mine].body, colliders[own].body)
    if body < 0:
        return count
    body_first = colliders[mine].body == body
    if not body_first:
        mine, own = own, mine
    count = _drop_hidden(address, workspace_address, world, body, np.int64(0), count)
    link = firsts[body]
    while link >= 0:
        one, two = pairs[2 * link], pairs[2 * link + 1]
        other = _other(pairs, link, body)
        states[other] = flown[other]
        for ground in range(bodies[other].first_collider, bodies[other].first_collider + bodies[other].num_colliders):
            if ground == own:
                continue
            start = count
            i, j = (mine, ground) if one == body else (ground, mine)
            count = collide_pair(header, workspace.query, states, one, i, two, j, start)
            count = min(count, np.int64(asked.shape[0]))
            count = _drop_hidden(address, workspace_address, world, body, start, count)
            if (one == body) != body_first:
                for index in range(start, count):
                    vec3.store(asked[index].normal, vec3.neg(vec3.load(asked[index].normal)))
        link = links[link]
    return count


@kernel
def _drop_hidden(address, workspace_address, world, body, start, count):
    """Drop what the ground at the end of the step hides of asked[start:count], contacts of a body with ground."""
    header = header_at(address)
    workspace = workspace_at(workspace_address)
    flown = table(workspace.flown, header.num_bodies, BODY_STATE)
    asked = table(workspace.asked, workspace.asked_size, CONTACT)
    kept = start
    for index in range(start, count):
        if not _is_hidden(address, workspace_address, world, flown, body, asked[index]):
            if kept < index:
                asked[kept] = asked[index]
            kept += 1
    return kept
