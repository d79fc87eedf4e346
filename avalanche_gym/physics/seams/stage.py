"""Contacts with a feature of a static shape that another static shape covers: seams between pieces of ground.

Each piece of ground is checked alone, and where it ends it has edges, corners and walls. Where the next piece goes on
flush with it, or stands on it, those are inside of the union of the two, or flat in it, and nothing may catch on them
(hidden.py). The contacts of a dynamic body with several static (or kinematic) colliders are looked at when a step has
found them, and again when they are asked for with the bodies moved.
"""

from __future__ import annotations

import numpy as np

from ..jit import kernel, stage
from ..maths import vec3
from ..memory import bodies_of, colliders_of, header_at, starts_of, table, workspace_at
from ..model import BODY_STATE, CONTACT, PLACE_BITS
from ..narrow_phase.collide import collide_pair
from .ground import dynamic_body, ground_lists, link_ground, other_body
from .hidden import is_hidden


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
    if not link_ground(address, workspace_address, world, several):
        return count
    for number in range(workspace.num_members):
        heads[members[number]] = -1
    for index in range(count):
        contact = contacts[index]
        contact.island = 0
        order[index] = -1
        body = dynamic_body(bodies, contact.body_a, contact.body_b)
        if body >= 0 and several[body] > 1:
            if is_hidden(address, workspace_address, world, states, body, contact):
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
    pairs, links, firsts = ground_lists(workspace)
    states = table(places, header.num_bodies, BODY_STATE)
    flown = table(workspace.flown, header.num_bodies, BODY_STATE)
    mine = pair // colliders.shape[0]
    own = pair - mine * colliders.shape[0]
    body = dynamic_body(bodies, colliders[mine].body, colliders[own].body)
    if body < 0:
        return count
    body_first = colliders[mine].body == body
    if not body_first:
        mine, own = own, mine
    count = _drop_hidden(address, workspace_address, world, body, np.int64(0), count)
    link = firsts[body]
    while link >= 0:
        one, two = pairs[2 * link], pairs[2 * link + 1]
        other = other_body(pairs, link, body)
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
        if not is_hidden(address, workspace_address, world, flown, body, asked[index]):
            if kept < index:
                asked[kept] = asked[index]
            kept += 1
    return kept
