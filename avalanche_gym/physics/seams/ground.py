"""Which pieces of ground a dynamic body is near: its pairs with static and kinematic bodies, as a chain."""

from __future__ import annotations

import numpy as np

from ..jit import kernel
from ..memory import bodies_of, header_at, table, workspace_at
from ..model import DYNAMIC
from ..probes.probe import probe_at


@kernel
def ground_lists(workspace):
    """The pairs of bodies, and for each dynamic one the chain of its pairs with ground: links and firsts."""
    return (
        table(workspace.pairs, workspace.pairs_size, np.int64),
        table(workspace.ground_links, workspace.ground_links_size, np.int64),
        table(workspace.ground_firsts, workspace.ground_firsts_size, np.int64),
    )


@kernel
def dynamic_body(bodies, a, b):
    """The dynamic one of two bodies of which the other is not, or -1."""
    a_moves = bodies[a].motion == DYNAMIC
    if a_moves == (bodies[b].motion == DYNAMIC):
        return -1
    return a if a_moves else b


@kernel
def ground_collider(bodies, contact, num_colliders):
    """The collider of the body that is not dynamic."""
    i = contact.pair // num_colliders
    return i if bodies[contact.body_a].motion != DYNAMIC else contact.pair - i * num_colliders


@kernel
def other_body(pairs, number, body):
    """The body that pair ``number`` joins with ``body``."""
    return pairs[2 * number + 1] if pairs[2 * number] == body else pairs[2 * number]


@kernel
def link_ground(address, workspace_address, world, several):
    """Link the pairs of each dynamic body with ground; count their colliders in ``several``; return if any has two."""
    header = header_at(address)
    workspace = workspace_at(workspace_address)
    bodies = bodies_of(header, world)
    pairs, links, firsts = ground_lists(workspace)
    probe = probe_at(workspace.probe)
    probe.header = address
    probe.world = world
    members = table(workspace.members, workspace.num_members, np.int64)
    for number in range(workspace.num_members):
        firsts[members[number]] = -1
        several[members[number]] = 0
    found = False
    for number in range(workspace.num_pairs):
        body = dynamic_body(bodies, pairs[2 * number], pairs[2 * number + 1])
        links[number] = -1
        if body >= 0:
            links[number] = firsts[body]
            firsts[body] = number
            several[body] += bodies[other_body(pairs, number, body)].num_colliders
            found = found or several[body] > 1
    return found
