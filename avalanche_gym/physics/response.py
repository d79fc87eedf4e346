"""What contacts do to the motion of one world: solve the impulses, move the bodies, remember."""

from __future__ import annotations

import math

import numpy as np

from .contacts.islands import find_islands
from .contacts.matching import match_contacts
from .contacts.prediction import SLACK, measure_end, predict_contacts, prepare_impacts, release_lasting, unsettle
from .frames import publish_body
from .jit import call_stage, kernel, stage
from .maths import quat, vec3
from .memory import (
    bodies_of,
    contacts_of,
    header_at,
    height_rates_of,
    heights_of,
    report_of,
    states_of,
    table,
    workspace_at,
    world_entry,
)
from .model import BODY_STATE, CONTACT, DYNAMIC, KINEMATIC
from .solver.exact import NEEDS_MEMORY, solve_rows, write_solution
from .solver.problem import prepare_nodes, prepare_rows
from .solver.projection import prepare_gaps
from .solver.workspace import NODE, ROW

# Overlap of less than this fraction of the smaller body is round-off and stays.
OVERLAP = 1e-9
# Relative residual of the projection: what remains is about this part of the overlap.
PROJECTION_TOLERANCE = 1e-9


@kernel
def _solver_memory(workspace):
    """The four arrays of solver/workspace.py."""
    return (
        table(workspace.solver_rows, workspace.solver_rows_size, ROW),
        table(workspace.solver_nodes, workspace.solver_nodes_size, NODE),
        table(workspace.solver_blocks, (workspace.solver_blocks_size // 36, 36), np.float64),
        table(workspace.solver_index, workspace.solver_index_size, np.int64),
    )


@stage
def solve_problem(address, workspace_address, num_contacts, num_bodies):
    """Solve the contact problem that lies prepared in the workspace, to its ``tolerance``; return the method.

    A stage, because it is large and serves velocities and positions.
    """
    header = header_at(address)
    workspace = workspace_at(workspace_address)
    rows, nodes, blocks, index = _solver_memory(workspace)
    residual, iterations, method = solve_rows(
        num_contacts,
        num_bodies,
        header.num_bodies,
        workspace.tolerance,
        header.max_iterations,
        rows,
        nodes,
        blocks,
        index,
    )
    workspace.residual = residual
    workspace.iterations = iterations
    return method


@stage
def solve_contacts(address, workspace_address, world, count):
    """From contacts to velocities (``moving``) and places at the end of the step (``flown``).

    Returns how many contacts remain, or -1 if the solver needs more memory.
    """
    header = header_at(address)
    workspace = workspace_at(workspace_address)
    bodies = bodies_of(header, world)
    states = states_of(header, world)
    flown = table(workspace.flown, header.num_bodies, BODY_STATE)
    moving = table(workspace.moving, header.num_bodies, BODY_STATE)
    contacts = table(workspace.contacts, workspace.contacts_size, CONTACT)
    corrections = table(workspace.corrections, (header.num_bodies, 6), np.float64)
    old = contacts_of(header, world)
    num_old = world_entry(header.num_contacts, world)[0]

    count = predict_contacts(bodies, states, flown, moving, header.time_step, contacts, count)
    match_contacts(old, num_old, contacts, count, bodies)
    release_lasting(contacts, count)
    _average_flight(bodies, states, flown, contacts, count, header.time_step)
    islands = _islands(header, workspace, bodies, contacts, count)
    if not _solve(address, workspace_address, world, islands):
        return -1
    if _unsettle(workspace, states, flown, contacts, islands, header.time_step) > 0:
        _restart(moving, flown)
        if not _solve(address, workspace_address, world, islands):
            return -1
    _displacements(bodies, states, contacts, count, header.time_step, corrections)
    _displace_all(bodies, flown, corrections)
    if prepare_impacts(states, header.time_step, contacts, count) > 0:
        _restart(moving, flown)
        if not _solve(address, workspace_address, world, islands):
            return -1
    if not _remove_overlap(address, workspace_address, world, count, islands):
        return -1
    return count


@stage
def commit(address, workspace_address, world, count):
    """Make the step real: states, public arrays, contacts to remember, moving ground."""
    header = header_at(address)
    workspace = workspace_at(workspace_address)
    bodies = bodies_of(header, world)
    states = states_of(header, world)
    flown = table(workspace.flown, header.num_bodies, BODY_STATE)
    moving = table(workspace.moving, header.num_bodies, BODY_STATE)
    contacts = table(workspace.contacts, workspace.contacts_size, CONTACT)
    for index in range(header.num_bodies):
        body = bodies[index]
        if body.motion == DYNAMIC or body.motion == KINEMATIC:
            state = states[index]
            vec3.store(state.center, vec3.load(flown[index].center))
            quat.store(state.orientation, quat.load(flown[index].orientation))
            vec3.store(state.velocity, vec3.load(moving[index].velocity))
            vec3.store(state.angular_velocity, vec3.load(moving[index].angular_velocity))
            vec3.store(state.angular_momentum, vec3.load(flown[index].angular_momentum))
            publish_body(header, world, index, body, state)
    memory = contacts_of(header, world)
    for number in range(count):
        memory[number] = contacts[number]
    world_entry(header.num_contacts, world)[0] = count
    if header.moving_heights == 1:
        heights = heights_of(header, world)
        rates = height_rates_of(header, world)
        for sample in range(heights.shape[0]):
            heights[sample] += header.time_step * rates[sample]
    report = report_of(header, world)
    report.contacts = max(report.contacts, count)
    return 0


@kernel
def _average_flight(bodies, starts, ends, contacts, count, time_step):
    """Bodies that lasting contacts bear move by the mean of their velocities at both ends: the trapezoid rule.

    In uniform gravity that is the parabola again. Elsewhere it keeps a body at rest exactly where it is, whatever the
    order to which its fall and the support's impulse, taken apart, would cancel.
    """
    for number in range(count):
        contact = contacts[number]
        if contact.persistent == 1:
            for side in range(2):
                index = contact.body_a if side == 0 else contact.body_b
                if bodies[index].motion == DYNAMIC:
                    total = vec3.add(vec3.load(starts[index].velocity), vec3.load(ends[index].velocity))
                    place = vec3.add_scaled(vec3.load(starts[index].center), 0.5 * time_step, total)
                    vec3.store(ends[index].center, place)


@kernel
def _unsettle(workspace, states, flown, contacts, islands, time_step):
    """In islands that something strikes, let all contacts move their bodies alike; return how many changed."""
    starts = table(workspace.island_starts, workspace.island_starts_size, np.int64)
    order = table(workspace.order, workspace.order_size, np.int64)
    changed = 0
    for number in range(islands):
        changed += unsettle(states, flown, time_step, contacts, order, starts[number], starts[number + 1])
    return changed


@kernel
def _restart(moving, flown):
    """Back to the velocities that the flight alone gives."""
    for index in range(moving.shape[0]):
        vec3.store(moving[index].velocity, vec3.load(flown[index].velocity))
        vec3.store(moving[index].angular_velocity, vec3.load(flown[index].angular_velocity))


@kernel
def _displace_all(bodies, flown, corrections):
    for index in range(bodies.shape[0]):
        if bodies[index].motion == DYNAMIC:
            _displace(flown[index], corrections[index])


@kernel
def _islands(header, workspace, bodies, contacts, count):
    """Sort contacts by island; return the number of islands."""
    return find_islands(
        bodies,
        contacts,
        count,
        table(workspace.island, workspace.island_size, np.int64),
        table(workspace.island_starts, workspace.island_starts_size, np.int64),
        table(workspace.order, workspace.order_size, np.int64),
    )


@kernel
def _displacements(bodies, states, contacts, count, time_step, corrections):
    """How far the impulses move each body within the step, beyond its flight: [m] and [rad], (bodies, 6).

    An impulse spread over the step moves by half of h times the change of velocity, one of a new contact by all of it.
    """
    for index in range(bodies.shape[0]):
        for axis in range(6):
            corrections[index, axis] = 0.0
    for number in range(count):
        contact = contacts[number]
        time = 0.5 * time_step if contact.persistent == 1 else time_step
        push = vec3.scale(time, vec3.load(contact.impulse))
        point = vec3.load(contact.position)
        _accumulate(corrections[contact.body_b], states[contact.body_b], point, push)
        _accumulate(corrections[contact.body_a], states[contact.body_a], point, vec3.neg(push))
    for index in range(bodies.shape[0]):
        body = bodies[index]
        q = quat.load(states[index].orientation)
        row = corrections[index]
        turn = quat.rotate_inverse(q, (row[3], row[4], row[5]))
        turn = quat.rotate(q, vec3.multiply(vec3.load(body.inverse_inertia), turn))
        for axis in range(3):
            row[axis] *= body.inverse_mass
            row[3 + axis] = turn[axis]


@kernel
def _accumulate(row, state, point, push):
    moment = vec3.cross(vec3.sub(point, vec3.load(state.center)), push)
    for axis in range(3):
        row[axis] += push[axis]
        row[3 + axis] += moment[axis]


@kernel
def _displace(state, row):
    """Shift and turn a state by a row of ``corrections``."""
    vec3.store(state.center, vec3.add(vec3.load(state.center), (row[0], row[1], row[2])))
    if row[3] != 0.0 or row[4] != 0.0 or row[5] != 0.0:
        turn = quat.from_rotation_vector((row[3], row[4], row[5]))
        quat.store(state.orientation, quat.normalize(quat.multiply(turn, quat.load(state.orientation))))


@kernel
def _gather_bodies(island, count, number, island_bodies):
    """Handles of the bodies of one island; return how many."""
    found = 0
    for index in range(count):
        if island[index] == number:
            island_bodies[found] = index
            found += 1
    return found


@kernel
def _solve(address, workspace_address, world, islands):
    """Solve every island; return False if the solver needs more memory."""
    header = header_at(address)
    workspace = workspace_at(workspace_address)
    rows, nodes, _, index = _solver_memory(workspace)
    bodies = bodies_of(header, world)
    moving = table(workspace.moving, header.num_bodies, BODY_STATE)
    contacts = table(workspace.contacts, workspace.contacts_size, CONTACT)
    starts = table(workspace.island_starts, workspace.island_starts_size, np.int64)
    order = table(workspace.order, workspace.order_size, np.int64)
    island = table(workspace.island, workspace.island_size, np.int64)
    island_bodies = table(workspace.island_bodies, workspace.island_bodies_size, np.int64)
    report = report_of(header, world)
    for number in range(islands):
        num_bodies = _gather_bodies(island, header.num_bodies, number, island_bodies)
        first = starts[number]
        own = starts[number + 1] - first
        prepare_nodes(bodies, moving, island_bodies, num_bodies, nodes, index)
        prepare_rows(contacts, order[first:], own, bodies, moving, num_bodies, rows, nodes, index)
        workspace.tolerance = header.tolerance
        method = call_stage(header.solve_problem, address, workspace_address, own, num_bodies)
        if method == NEEDS_MEMORY:
            return False
        write_solution(contacts, order[first:], own, moving, island_bodies, num_bodies, rows, nodes)
        report.residual = max(report.residual, workspace.residual)
        report.iterations += workspace.iterations
        report.method = max(report.method, method)
    return True


@kernel
def _overlaps(bodies, contacts, order, first, last):
    """Whether any contact of an island overlaps by more than round-off, and the size [m] of its smallest body."""
    size = math.inf
    found = False
    for index in range(first, last):
        contact = contacts[order[index]]
        own = min(bodies[contact.body_a].size, bodies[contact.body_b].size)
        size = min(size, own)
        found = found or contact.gap < -OVERLAP * own
    return found, size


@kernel
def _remove_overlap(address, workspace_address, world, count, islands):
    """Measure the gaps at the end of the step, and push apart what overlaps, without adding velocity.

    Returns False if the solver needs more memory.
    """
    header = header_at(address)
    workspace = workspace_at(workspace_address)
    rows, nodes, _, index = _solver_memory(workspace)
    bodies = bodies_of(header, world)
    states = states_of(header, world)
    flown = table(workspace.flown, header.num_bodies, BODY_STATE)
    contacts = table(workspace.contacts, workspace.contacts_size, CONTACT)
    corrections = table(workspace.corrections, (header.num_bodies, 6), np.float64)
    starts = table(workspace.island_starts, workspace.island_starts_size, np.int64)
    order = table(workspace.order, workspace.order_size, np.int64)
    island = table(workspace.island, workspace.island_size, np.int64)
    island_bodies = table(workspace.island_bodies, workspace.island_bodies_size, np.int64)
    report = report_of(header, world)
    worst = measure_end(states, flown, header.time_step, contacts, count)
    moved = False
    for number in range(islands):
        found, size = _overlaps(bodies, contacts, order, starts[number], starts[number + 1])
        if not found:
            continue
        num_bodies = _gather_bodies(island, header.num_bodies, number, island_bodies)
        first = starts[number]
        own = starts[number + 1] - first
        prepare_nodes(bodies, flown, island_bodies, num_bodies, nodes, index)
        prepare_rows(contacts, order[first:], own, bodies, flown, num_bodies, rows, nodes, index)
        prepare_gaps(contacts, order[first:], own, SLACK * size, rows)
        workspace.tolerance = PROJECTION_TOLERANCE
        if call_stage(header.solve_problem, address, workspace_address, own, num_bodies) == NEEDS_MEMORY:
            return False
        report.iterations += workspace.iterations
        for node in range(num_bodies):
            row = corrections[island_bodies[node]]
            for axis in range(3):
                row[axis] = nodes[node].linear[axis]
                row[3 + axis] = nodes[node].angular[axis]
            _displace(flown[island_bodies[node]], row)
        moved = True
    if moved:
        worst = measure_end(states, flown, header.time_step, contacts, count)
    report.penetration = max(report.penetration, worst)
    return True
