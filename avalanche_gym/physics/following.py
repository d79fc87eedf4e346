"""Where the contacts of an island go: the narrow phase asked again, with the bodies where they are expected to end.

Contacts were found with the bodies where the step begins (detection.py). One that is curved, or that would close along
the normal it started with, may be elsewhere when the bodies have moved.
"""

from __future__ import annotations

import numpy as np

from .contacts.prediction import DRIFT
from .jit import call_stage, kernel, stage
from .maths import vec3
from .memory import colliders_of, header_at, starts_of, table, workspace_at
from .model import BODY_STATE, CONTACT, PLACE_BITS, SLACK, SLIDING
from .narrow_phase.collide import collide_pair
from .narrow_phase.moving_heights import place_ground
from .narrow_phase.pair_query import aim, move_anyhow, query_at

# Motion within a step below this fraction of the smaller body turns no contact by more than that.
STILL = 1e-7


@stage
def follow_contacts(address, workspace_address, world, first, last):
    """Where contacts of one island, order[first:last], are with the bodies at ``predicted``: fields ``end_*``.

    Asked for are curved contacts that last, unless their bodies hardly move against each other, and contacts that would
    close along the normal they started with: a ball that rolls up to an edge flush with the ground passes over it. If
    the two do not overlap in the end, and have moved by less than they could pass through each other, nothing closes. A
    contact that is not found again keeps what its fields hold.
    """
    header = header_at(address)
    workspace = workspace_at(workspace_address)
    states = starts_of(header, workspace)
    predicted = table(workspace.predicted, header.num_bodies, BODY_STATE)
    contacts = table(workspace.contacts, workspace.contacts_size, CONTACT)
    asked = table(workspace.asked, workspace.asked_size, CONTACT)
    order = table(workspace.order, workspace.order_size, np.int64)
    num_colliders = colliders_of(header).shape[0]
    query = query_at(workspace.query)
    aim(query, address, world, workspace, workspace.asked, workspace.asked_size)
    place_ground(header, workspace, query, world, workspace.elapsed + workspace.span)
    pair = np.int64(-1)
    count = np.int64(0)
    apart = False
    for index in range(first, last):
        contact = contacts[order[index]]
        closing = contact.persistent == 0 and contact.end_gap < 0.0
        if not closing and (contact.curved == 0 or contact.persistent == 0):
            continue
        if contact.pair != pair:
            pair = contact.pair
            count = np.int64(0)
            apart = False
            a = contact.body_a
            b = contact.body_b
            moved = _motion(states[a], predicted[a], states[b], predicted[b], contact)
            moved += workspace.span * workspace.fastest_rate
            if moved > STILL * contact.size:
                query.margin = SLACK * contact.size
                move_anyhow(query, moved)
                i = pair // num_colliders
                j = pair - i * num_colliders
                count = collide_pair(header, workspace.query, predicted, a, i, b, j, np.int64(0))
                if header.cross_seams != 0 and count <= asked.shape[0]:
                    count = call_stage(
                        header.cross_seams, address, workspace_address, world, pair, count, workspace.predicted
                    )
                # To pass through the thinnest sheet a body has to move by its whole thickness.
                apart = moved < 2.0 * contact.size and count <= asked.shape[0]
                for number in range(min(count, asked.shape[0])):
                    apart = apart and asked[number].gap >= -DRIFT * contact.size
        if closing:
            if apart:
                # What is not found again is farther away than was asked for.
                number = _find(asked, count, contact)
                contact.end_gap = max(asked[number].gap, 0.0) if number >= 0 else SLACK * contact.size
            continue
        number = _find(asked, min(count, asked.shape[0]), contact)
        if number >= 0:
            found = asked[number]
            vec3.store(contact.end_normal, vec3.load(found.normal))
            vec3.store(contact.end_position, vec3.load(found.position))
            vec3.store(contact.end_surface_velocity, vec3.load(found.surface_velocity))
            contact.end_gap = found.gap
    return 0


@kernel
def _find(asked, count, contact):
    """Which of the contacts is this one: the same feature, or the same point of a body on another part of the terrain.

    A point can touch several parts at once, as in a valley; of other parts the one that is most alike counts. -1: none.
    """
    best = -1.0
    chosen = -1
    for number in range(count):
        if asked[number].feature == contact.feature:
            return number
        if contact.feature >= SLIDING and asked[number].feature >> PLACE_BITS == contact.feature >> PLACE_BITS:
            alike = vec3.dot(vec3.load(asked[number].normal), vec3.load(contact.start_normal))
            if alike > best:
                best = alike
                chosen = number
    return chosen


@kernel
def _motion(start_a, end_a, start_b, end_b, contact):
    """Bound [m] of how far two bodies move against each other at a contact."""
    point = vec3.load(contact.start_position)
    arm_a = vec3.sub(point, vec3.load(start_a.center))
    arm_b = vec3.sub(point, vec3.load(start_b.center))
    moved = vec3.sub(vec3.load(end_b.center), vec3.load(start_b.center))
    moved = vec3.sub(moved, vec3.sub(vec3.load(end_a.center), vec3.load(start_a.center)))
    reach = vec3.norm(moved)
    for axis in range(1, 4):
        reach += 2.0 * vec3.norm(arm_a) * abs(end_a.orientation[axis] - start_a.orientation[axis])
        reach += 2.0 * vec3.norm(arm_b) * abs(end_b.orientation[axis] - start_b.orientation[axis])
    return reach
