"""Overlap that the straight view of a step missed is found where the bodies ended, and taken out there.

A step is solved with the contacts that free flight can reach, each along the normal it starts with. Some bodies end
elsewhere, or show another face there (strays.py).
Around such bodies the narrow phase is asked again, with all bodies at the end of the step, and the places of the bodies
are swept apart in the metric of their masses (solver/pile.py). No velocity is added: what still approaches is met by
the contacts of the next step.
"""

from __future__ import annotations

import math

import numpy as np

from .contacts.kinematics import turn_between, turned_gap_change
from .contacts.matching import chain_of
from .jit import call_stage, kernel, stage
from .maths import vec3
from .memory import bodies_of, header_at, report_of, rest_of, states_of, table, workspace_at
from .model import (
    BODY_STATE,
    CONTACT,
    CONTACTS_FULL,
    DYNAMIC,
    OK,
    PAIRS_FULL,
    SLACK,
)
from .narrow_phase.collide import collide_bodies
from .narrow_phase.moving_heights import place_ground
from .narrow_phase.pair_query import aim, move_anyhow, query_at
from .response.bodies import shift
from .response.pile_preparation import place_node, stand_still
from .solver.pile import gap_after, sweep_positions
from .solver.pile_memory import PILE_NODE, PILE_ROW
from .solver.pile_response import prepare_normal
from .strays import mark_sliders, mark_strays, shallow

# Contacts are found, and bodies swept apart, until that moves none of them far; at most so many times, for what cannot
# part. A round halves the deepest overlap, more or less, for turned bodies show new faces: from a whole body to none it
# takes ten to twenty. Fewer: single bodies of heaps that fall end a step half inside others.
ROUNDS = 24
# Neighbours of bodies that overlap, so many bodies away, are looked at as well: they give way.
HOPS = 2
# Contacts closer than this fraction of the smaller body keep others from being pushed into it.
NEAR = 0.05
# Sweeps that part them in a round, and the most of them where no other round follows. Fewer: deep heaps take more
# rounds, each of which looks for contacts again.
SWEEPS, MOST_SWEEPS = 20, 40
# What is known of a body's contacts at the end of the step: none overlaps by more than SHALLOW, or all that is near.
SHALLOW_ONES, ALL_NEAR = 1, 2


@stage
def part_overlaps(address, workspace_address, world, count):
    """Look at the end of the step around the bodies that went elsewhere; ``count`` contacts are listed.

    Returns a status; the entries that a full table needs are in the ``detail`` of the workspace.
    """
    header = header_at(address)
    workspace = workspace_at(workspace_address)
    marks = table(workspace.members, header.num_bodies, np.int64)
    strays = mark_strays(header, workspace, world, marks)
    if not mark_sliders(header, workspace, world, count, marks) and not strays:
        return OK
    looked_at = table(workspace.waits, header.num_bodies, np.int64)
    ends = table(workspace.ends, header.num_bodies, BODY_STATE)
    before = table(workspace.predicted, header.num_bodies, BODY_STATE)
    # What the last round moved far is looked at once more, for what is said of it.
    for number in range(1, ROUNDS + 2):
        num_pairs = _find_pairs_at_end(address, workspace_address, world)
        if 2 * num_pairs > workspace.pairs_size:
            workspace.detail = num_pairs
            return PAIRS_FULL
        for index in range(header.num_bodies):
            looked_at[index] = ALL_NEAR if marks[index] > 0 else 0
            before[index] = ends[index]
        close = _bring_to_front(header, workspace, world, 0, num_pairs, marks)
        # What was moved, or went elsewhere in a crowd, overlaps something most often: all near it is asked for at once.
        near = NEAR if number > 1 or header.step_pile != 0 else 0.0
        num_found, enough = _find_contacts_at_end(address, workspace_address, world, 0, close, near, np.int64(0))
        if not enough:
            _mark_overlapping(header, workspace, world, num_pairs, min(num_found, workspace.contacts_size), marks)
            if near == 0.0:
                # Only what overlaps is known so far: these are asked again, for what is near as well.
                close, num_found = np.int64(0), np.int64(0)
            last = _bring_to_front(header, workspace, world, close, num_pairs, marks)
            num_found, _ = _find_contacts_at_end(address, workspace_address, world, close, last, NEAR, num_found)
            for index in range(header.num_bodies):
                if marks[index] > 0:
                    looked_at[index] = ALL_NEAR
                elif looked_at[index] > 0 and near == 0.0:
                    looked_at[index] = SHALLOW_ONES
        if num_found > workspace.contacts_size:
            workspace.detail = num_found
            return CONTACTS_FULL
        far = not enough and number <= ROUNDS
        far = far and _sweep_apart(header, workspace, world, count, num_found, marks, number == ROUNDS)
        _measure_again(header, workspace, world, count, num_found, before, looked_at)
        if not far:
            break
    return OK


@kernel
def _find_pairs_at_end(address, workspace_address, world):
    """The pairs of bodies that meet on the way they really went."""
    header = header_at(address)
    workspace = workspace_at(workspace_address)
    flown = workspace.flown
    workspace.flown = workspace.ends
    num_pairs = call_stage(header.find_pairs, address, workspace_address, world)
    workspace.flown = flown
    return num_pairs


@kernel
def _bring_to_front(header, workspace, world, first, num_pairs, marks):
    """Swap the pairs from ``first`` on in which a body is marked to the front of these; return where they end."""
    bodies = bodies_of(header, world)
    pairs = table(workspace.pairs, workspace.pairs_size, np.int64)
    count = first
    for pair in range(first, num_pairs):
        a = pairs[2 * pair]
        b = pairs[2 * pair + 1]
        ground = bodies[a].motion != DYNAMIC or bodies[b].motion != DYNAMIC
        # What pieces of ground hide of one another is not known here (seams).
        if marks[a] + marks[b] > 0 and not (ground and header.hide_seams != 0):
            pairs[2 * pair] = pairs[2 * count]
            pairs[2 * pair + 1] = pairs[2 * count + 1]
            pairs[2 * count] = a
            pairs[2 * count + 1] = b
            count += 1
    return count


@kernel
def _mark_overlapping(header, workspace, world, num_pairs, num_found, marks):
    """Mark the bodies of contacts that overlap, and their neighbours."""
    bodies = bodies_of(header, world)
    pairs = table(workspace.pairs, workspace.pairs_size, np.int64)
    found = table(workspace.recent, workspace.recent_size, CONTACT)
    for index in range(header.num_bodies):
        marks[index] = 0
    for index in range(num_found):
        if found[index].gap < -shallow(header) * found[index].size:
            marks[found[index].body_a] = 1
            marks[found[index].body_b] = 1
    for index in range(header.num_bodies):
        if bodies[index].motion != DYNAMIC:
            marks[index] = 0
    for hop in range(1, HOPS + 1):
        for pair in range(num_pairs):
            a = pairs[2 * pair]
            b = pairs[2 * pair + 1]
            if bodies[a].motion == DYNAMIC and bodies[b].motion == DYNAMIC:
                if marks[a] == hop and marks[b] == 0:
                    marks[b] = hop + 1
                elif marks[b] == hop and marks[a] == 0:
                    marks[a] = hop + 1


@kernel
def _find_contacts_at_end(address, workspace_address, world, first, last, near, count):
    """Append the contacts of the pairs first <= pair < last at the end of the step, up to ``near`` of the size apart,
    to the ``count`` that are in ``recent``.

    Returns how many these are then, and whether none of the new ones overlaps by more than counts.
    """
    header = header_at(address)
    workspace = workspace_at(workspace_address)
    bodies = bodies_of(header, world)
    ends = table(workspace.ends, header.num_bodies, BODY_STATE)
    pairs = table(workspace.pairs, workspace.pairs_size, np.int64)
    found = table(workspace.recent, workspace.recent_size, CONTACT)
    query = query_at(workspace.query)
    aim(query, address, world, workspace, workspace.recent, workspace.recent_size)
    place_ground(header, workspace, query, world, header.time_step)
    move_anyhow(query, 0.0)
    enough = True
    for pair in range(first, last):
        a = pairs[2 * pair]
        b = pairs[2 * pair + 1]
        size = min(bodies[a].size, bodies[b].size)
        query.margin = near * size
        start = count
        count = collide_bodies(header, workspace.query, bodies, ends, a, b, count)
        for index in range(start, min(count, found.shape[0])):
            contact = found[index]
            contact.size = size
            enough = enough and contact.gap >= -shallow(header) * size
    return count, enough


@kernel
def _sweep_apart(header, workspace, world, count, num_found, marks, is_last):
    """Move the bodies at the end of the step until the contacts found there are open.

    Marks those that went so far that they may have met what was not found; returns whether there are any.
    """
    bodies = bodies_of(header, world)
    rest = rest_of(header, world)
    states = states_of(header, world)
    ends = table(workspace.ends, header.num_bodies, BODY_STATE)
    found = table(workspace.recent, workspace.recent_size, CONTACT)
    rows = table(workspace.pile_rows, workspace.pile_rows_size, PILE_ROW)
    nodes = table(workspace.pile_nodes, workspace.pile_nodes_size, PILE_NODE)
    listed = table(workspace.kept if workspace.waiting > 0 else workspace.contacts, workspace.contacts_size, CONTACT)
    chains = table(workspace.bound, header.num_bodies, np.int64)
    following = table(workspace.order, workspace.order_size, np.int64)
    _chain(bodies, listed, count, chains, following)
    last = header.num_bodies
    stand_still(nodes[last])
    for index in range(last):
        if bodies[index].motion == DYNAMIC and rest[index].asleep == 0:
            place_node(bodies[index], ends[index], nodes[index])
    enough = math.inf
    for index in range(num_found):
        contact = found[index]
        row = rows[index]
        a = contact.body_a
        b = contact.body_b
        row.a = a if bodies[a].motion == DYNAMIC and rest[a].asleep == 0 else last
        row.b = b if bodies[b].motion == DYNAMIC and rest[b].asleep == 0 else last
        point = vec3.load(contact.position)
        normal = vec3.load(contact.normal)
        vec3.store(row.normal, normal)
        vec3.store(row.arm_a, vec3.sub(point, vec3.load(ends[a].center)))
        vec3.store(row.arm_b, vec3.sub(point, vec3.load(ends[b].center)))
        row.gap = contact.gap
        row.push = 0.0
        row.local[0] = prepare_normal(row, nodes)
        # Overlap that motion made is undone at once.
        row.floor = 0.0
        way = header.time_step * (_speed(bodies[a], states[a]) + _speed(bodies[b], states[b]))
        if way <= SLACK * contact.size:
            # What was deep before the step goes on parting at its pace (response/overlap.py).
            start_gap = 0.0
            same = chains[chain_of(bodies, a, b) % chains.shape[0]]
            while same >= 0:
                # What a part of the step began with was made within the step.
                whole = listed[same].span == header.time_step
                if whole and listed[same].body_a == a and listed[same].body_b == b:
                    start_gap = min(start_gap, listed[same].start_gap)
                same = following[same]
            row.floor = min(start_gap + SLACK * contact.size, 0.0)
        enough = min(enough, 0.1 * shallow(header) * contact.size)
    # What went far is looked at again, and swept apart then.
    parted = sweep_positions(rows, nodes, num_found, 1, SWEEPS, enough)
    far = _mark_far(header, workspace, world, nodes, marks)
    if not parted and (is_last or not far):
        sweep_positions(rows, nodes, num_found, SWEEPS + 1, MOST_SWEEPS, enough)
        far = _mark_far(header, workspace, world, nodes, marks)
    for index in range(num_found):
        found[index].gap = gap_after(rows[index], nodes)
    for index in range(last):
        if bodies[index].motion == DYNAMIC and rest[index].asleep == 0 and nodes[index].shoved > 0:
            shift(bodies[index], ends[index], vec3.load(nodes[index].moved), vec3.load(nodes[index].turned))
    return far


@kernel
def _mark_far(header, workspace, world, nodes, marks):
    """Mark the bodies moved so far that they may have met what was not found; return whether there are any."""
    bodies = bodies_of(header, world)
    rest = rest_of(header, world)
    far = False
    for index in range(header.num_bodies):
        marks[index] = 0
        if bodies[index].motion == DYNAMIC and rest[index].asleep == 0 and nodes[index].shoved > 0:
            way = vec3.norm(vec3.load(nodes[index].moved))
            way += bodies[index].radius * vec3.norm(vec3.load(nodes[index].turned))
            if way > 0.5 * NEAR * bodies[index].size:
                marks[index] = 1
                far = True
    return far


@kernel
def _speed(body, state):
    """[m/s] of the fastest point of a body; ground counts as at rest."""
    if body.motion != DYNAMIC:
        return 0.0
    return vec3.norm(vec3.load(state.velocity)) + body.radius * vec3.norm(vec3.load(state.angular_velocity))


@kernel
def _chain(bodies, contacts, count, chains, following):
    """Lead from the bodies of a contact to all contacts between them (matching.chain_of)."""
    for chain in range(chains.shape[0]):
        chains[chain] = -1
    for index in range(count):
        chain = chain_of(bodies, contacts[index].body_a, contacts[index].body_b) % chains.shape[0]
        following[index] = chains[chain]
        chains[chain] = index


@kernel
def _moved(before, after):
    change = vec3.sub(vec3.load(after.center), vec3.load(before.center))
    turn = turn_between(before, after)
    return vec3.norm_squared(change) + turn[1] * turn[1] + turn[2] * turn[2] + turn[3] * turn[3] > 0.0


@kernel
def _measure_again(header, workspace, world, count, num_found, before, looked_at):
    """Bring the listed contacts of the bodies that were looked at to where these are; report the deepest overlap."""
    bodies = bodies_of(header, world)
    ends = table(workspace.ends, header.num_bodies, BODY_STATE)
    contacts = table(workspace.kept if workspace.waiting > 0 else workspace.contacts, workspace.contacts_size, CONTACT)
    found = table(workspace.recent, workspace.recent_size, CONTACT)
    chains = table(workspace.bound, header.num_bodies, np.int64)
    following = table(workspace.order, workspace.order_size, np.int64)
    _chain(bodies, found, num_found, chains, following)
    worst = 0.0
    for index in range(count):
        contact = contacts[index]
        a = contact.body_a
        b = contact.body_b
        looked = max(looked_at[a], looked_at[b])
        if looked == 0 and not (_moved(before[a], ends[a]) or _moved(before[b], ends[b])):
            worst = max(worst, -contact.gap)
            continue
        # The next step would find its gap another way: it is not one that changes nothing, to the last bit.
        contact.steady = 0
        same = chains[chain_of(bodies, contact.body_a, contact.body_b) % chains.shape[0]]
        while same >= 0 and (found[same].pair != contact.pair or found[same].feature != contact.feature):
            same = following[same]
        if same >= 0:
            vec3.store(contact.position, vec3.load(found[same].position))
            vec3.store(contact.normal, vec3.load(found[same].normal))
            contact.gap = found[same].gap
        else:
            contact.gap += turned_gap_change(
                contact, vec3.load(contact.position), vec3.load(contact.normal), contact.gap,
                before[a], ends[a], turn_between(before[a], ends[a]),
                before[b], ends[b], turn_between(before[b], ends[b]),
            )  # fmt: skip
            # Overlap along a normal that no longer counts is none.
            if looked == ALL_NEAR:
                contact.gap = max(contact.gap, 0.0)
            elif looked == SHALLOW_ONES:
                contact.gap = max(contact.gap, -shallow(header) * contact.size)
        worst = max(worst, -contact.gap)
    for index in range(num_found):
        worst = max(worst, -found[index].gap)
    report = report_of(header, world)
    report.penetration = max(workspace.penetration, worst)
