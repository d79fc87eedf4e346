"""Where bodies will touch in this step: flight, broad phase and narrow phase of one world."""

from __future__ import annotations

import math

import numpy as np

from .broad_phase.all_pairs import all_pairs
from .broad_phase.bounds import swept_box
from .broad_phase.candidates import meeting_pairs, update_candidates
from .contacts.coherence import are_steady, chain_contacts, is_unmoved, recall_contacts
from .contacts.kinematics import turn_between
from .contacts.materials import mix_materials
from .contacts.sleeping import drop_sleeping_pairs
from .integrator.flight import copy_state, fly
from .jit import call_stage, kernel, stage
from .maths import vec3
from .memory import (
    bodies_of,
    colliders_of,
    contacts_of,
    fields_of,
    grid_of,
    grid_tables_of,
    header_at,
    rest_of,
    starts_of,
    states_of,
    table,
    traits_of,
    workspace_at,
    world_entry,
)
from .model import BODY_STATE, CONTACT, DYNAMIC, PAIR_RULE, REMOVED, SLACK, WHOLE
from .narrow_phase.answers import (
    ANY_PAIR,
    AT_START,
    FORESIGHT,
    UNKNOWN,
    forget_answers,
    keeps_answers,
    note_answers,
    recall_answers,
)
from .narrow_phase.collide import collide_bodies
from .narrow_phase.moving_heights import begin_moving, place_ground
from .narrow_phase.pair_query import aim, move_by, query_at

_BOX_BYTES = 6 * 8


@stage
def fly_bodies(address, workspace_address, world):
    """Fly every body to the end of the step into ``flown``, and into ``ends``, where contacts may change it."""
    header = header_at(address)
    workspace = workspace_at(workspace_address)
    bodies = bodies_of(header, world)
    states = states_of(header, world)
    rest = rest_of(header, world)
    fields = fields_of(header)
    flown = table(workspace.flown, header.num_bodies, BODY_STATE)
    ends = table(workspace.ends, header.num_bodies, BODY_STATE)
    members = table(workspace.members, header.num_bodies, np.int64)
    workspace.num_members = 0
    workspace.fastest_rate = 0.0
    if traits_of(header, world).moving_heights == 1:
        begin_moving(header, workspace, world)
    for index in range(header.num_bodies):
        if bodies[index].motion == DYNAMIC:
            members[workspace.num_members] = index
            workspace.num_members += 1
        if rest[index].asleep == 0:
            fly(states[index], bodies[index], fields, header.time_step, flown[index])
            copy_state(flown[index], ends[index])
        else:
            copy_state(states[index], flown[index])
            copy_state(states[index], ends[index])
    return 0


@kernel
def first_non_finite(header, workspace, world):
    """The first body whose state at the end of the step is not finite, or -1."""
    bodies = bodies_of(header, world)
    ends = table(workspace.ends, header.num_bodies, BODY_STATE)
    for index in range(header.num_bodies):
        if bodies[index].motion != REMOVED:
            # One sum is enough: it is finite only if every term is, up to overflow, which is no state to go on from.
            velocity = vec3.load(ends[index].velocity)
            spin = vec3.load(ends[index].angular_velocity)
            total = vec3.norm_squared(velocity) + vec3.norm_squared(spin)
            for axis in range(3):
                total += abs(ends[index].center[axis]) + abs(ends[index].orientation[axis + 1])
            if not math.isfinite(total):
                return index
    return -1


@kernel
def _turn(body, start, end, time_step):
    """Bound [rad] of how far a body turns within the step."""
    spin = max(vec3.norm(vec3.load(start.angular_velocity)), vec3.norm(vec3.load(end.angular_velocity)))
    return spin * time_step


@kernel
def _sweep_boxes(header, workspace, world):
    """Fill ``boxes`` of the workspace with the bounds of every body over the step."""
    bodies = bodies_of(header, world)
    states = states_of(header, world)
    colliders = colliders_of(header)
    flown = table(workspace.flown, header.num_bodies, BODY_STATE)
    boxes = table(workspace.boxes, workspace.boxes_size, np.float64)
    for index in range(header.num_bodies):
        body = bodies[index]
        turned = _turn(body, states[index], flown[index], header.time_step)
        # Ground that moves may rise within the step.
        rise = header.time_step * workspace.fastest_rate
        slack = SLACK * body.size if body.motion == DYNAMIC else rise
        box = table(workspace.boxes + _BOX_BYTES * index, 6, np.float64)
        swept_box(header, colliders, body, states[index], flown[index], turned, slack, box)
    return boxes


@stage
def find_pairs(address, workspace_address, world):
    """Fill ``boxes`` and ``pairs`` of the workspace; return the number of pairs. For few bodies: each with each."""
    header = header_at(address)
    workspace = workspace_at(workspace_address)
    boxes = _sweep_boxes(header, workspace, world)
    pairs = table(workspace.pairs, workspace.pairs_size, np.int64)
    return drop_sleeping_pairs(header, world, pairs, all_pairs(bodies_of(header, world), boxes, pairs))


@stage
def find_pairs_in_grid(address, workspace_address, world):
    """The same pairs in the same order, for many bodies: from the grid of this world."""
    header = header_at(address)
    workspace = workspace_at(workspace_address)
    boxes = _sweep_boxes(header, workspace, world)
    grid = grid_of(header, world)
    proxies, cells, candidates = grid_tables_of(header, world)
    flown = table(workspace.flown, header.num_bodies, BODY_STATE)
    moved = table(workspace.body_starts, workspace.body_starts_size, np.int64)
    found = table(workspace.found, workspace.found_size, np.int64)
    pairs = table(workspace.pairs, workspace.pairs_size, np.int64)
    count = update_candidates(
        grid, bodies_of(header, world), states_of(header, world), flown, boxes, proxies, cells, candidates, moved,
        found, pairs,
    )  # fmt: skip
    if grid.valid == 0:
        # There is no room for them: the caller learns how many there are.
        return max(count, workspace.pairs_size)
    return drop_sleeping_pairs(header, world, pairs, meeting_pairs(candidates, count, boxes, pairs))


@stage
def find_contacts(address, workspace_address, world, num_pairs):
    """Fill ``contacts`` of the workspace with those the motion of this step can reach; return how many."""
    header = header_at(address)
    workspace = workspace_at(workspace_address)
    bodies = bodies_of(header, world)
    states = starts_of(header, workspace)
    flown = table(workspace.flown, header.num_bodies, BODY_STATE)
    pairs = table(workspace.pairs, workspace.pairs_size, np.int64)
    contacts = table(workspace.contacts, workspace.contacts_size, CONTACT)
    query = query_at(workspace.query)
    aim(query, address, world, workspace, workspace.contacts, workspace.contacts_size)
    place_ground(header, workspace, query, world, workspace.elapsed)
    rules = table(header.pair_rules, header.pair_rules_size, PAIR_RULE)
    span = workspace.span
    rise = span * workspace.fastest_rate
    rest = rest_of(header, world)
    before = contacts_of(header, world)
    chains = table(workspace.island_starts, workspace.island_starts_size, np.int64)
    following = table(workspace.order, workspace.order_size, np.int64)
    ground_moves = traits_of(header, world).moving_heights == 1
    coherent = workspace.part == WHOLE and not ground_moves
    chained = False
    colliders = colliders_of(header)
    # In a crowd most islands are not stopped for their impacts: what is said of them is not asked again. Ground that
    # moves would have to be asked again.
    kept = header.events == 1 and not ground_moves and (workspace.part != WHOLE or header.step_pile == 0)
    if workspace.part == WHOLE:
        forget_answers(workspace)
    count = np.int64(0)
    workspace.num_pairs = num_pairs
    for pair in range(num_pairs):
        a = pairs[2 * pair]
        b = pairs[2 * pair + 1]
        start = count
        if coherent and is_unmoved(rest[a], states[a]) and is_unmoved(rest[b], states[b]):
            if not chained:
                chain_contacts(bodies, before, world_entry(header.num_contacts, world)[0], chains, following)
                chained = True
            count = recall_contacts(bodies, before, chains, following, a, b, contacts, count)
            if are_steady(contacts, start, min(count, contacts.shape[0])):
                continue  # recalled with all that follows
        else:
            _foresee(query, span, bodies, states, flown, a, b, rise)
            query.margin = SLACK * min(bodies[a].size, bodies[b].size) + query.motion
            keeps = kept and keeps_answers(colliders, bodies[a], bodies[b])
            known = np.int64(UNKNOWN)
            if keeps:
                known = recall_answers(
                    workspace, states, a, b, np.int64(ANY_PAIR), query.margin, query.motion, contacts, count
                )
                query.margin += (FORESIGHT - 1.0) * query.motion
                query.motion *= FORESIGHT
            if known >= 0:
                count = known
            else:
                count = collide_bodies(header, workspace.query, bodies, states, a, b, count)
                if keeps:
                    note_answers(
                        workspace, states, a, b, np.int64(AT_START), query.margin, query.motion, contacts, start, count
                    )
            for index in range(start, min(count, contacts.shape[0])):
                contacts[index].steady = 0
        rule = rules[bodies[a].material * header.num_materials + bodies[b].material]
        for index in range(start, min(count, contacts.shape[0])):
            mix_materials(bodies[a], bodies[b], rule, contacts[index])
            vec3.store(contacts[index].blow, vec3.ZERO)
    if header.hide_seams != 0 and count <= contacts.shape[0]:
        return call_stage(header.hide_seams, address, workspace_address, world, count)
    return count


@kernel
def _foresee(query, span, bodies, states, flown, a, b, rise):
    """Write into the query how body b moves against body a within the step, if nothing touches.

    What something bears does not follow the fields: it may come as far as the velocity leads that it has.
    The turns are taken to first order, theta for R(theta); what that leaves out is theta^2 r / 2 at a distance r.
    """
    center_a = vec3.load(states[a].center)
    center_b = vec3.load(states[b].center)
    apart = vec3.sub(center_b, center_a)
    moved = vec3.sub(vec3.load(flown[b].center), center_b)
    moved = vec3.sub(moved, vec3.sub(vec3.load(flown[a].center), center_a))
    relative = vec3.sub(vec3.load(states[b].velocity), vec3.load(states[a].velocity))
    motion = max(vec3.norm(moved), span * vec3.norm(relative)) + rise
    loose = rise
    # A surface without end (a plane, a planet) turns under the other body: the arc where that body is counts.
    distance = vec3.norm(apart)
    turn_a = _turn(bodies[a], states[a], flown[a], span)
    turn_b = _turn(bodies[b], states[b], flown[b], span)
    turn = vec3.ZERO
    if turn_a > 0.0:
        reach = min(bodies[a].radius, distance + bodies[b].radius)
        motion += turn_a * reach
        loose += 0.5 * turn_a * turn_a * reach
        own = _rotation(states[a], flown[a])
        turn = vec3.neg(own)
        moved = vec3.sub(moved, vec3.cross(own, apart))
    if turn_b > 0.0:
        reach = min(bodies[b].radius, distance + bodies[a].radius)
        motion += turn_b * reach
        loose += 0.5 * turn_b * turn_b * reach
        turn = vec3.add(turn, _rotation(states[b], flown[b]))
    move_by(query, center_b, moved, turn, loose, motion, turn_a, turn_b)


@kernel
def _rotation(start, end):
    """Twice the vector part of the rotation from ``start`` to ``end``: [rad] to second order."""
    q = turn_between(start, end)
    return vec3.scale(math.copysign(2.0, q[0]), (q[1], q[2], q[3]))
