"""One step of one world: the whole algorithm on one screen, and the loop over steps and worlds.

The stages do not know each other; detection.py, response and groups join them, and the kernels here call those through
the addresses in the header, so a scene compiles only what it needs. The state changes only at the very end: a step that
cannot be completed leaves the world as it was.
"""

from __future__ import annotations

import numpy as np

from .contacts.sleeping import nothing_moves, wake_island
from .detection import first_non_finite
from .diagnostics import kinetic_energy_of, potential_energy_of
from .frames import kick
from .integrator.driven import begin_driving, end_driving
from .jit import call_stage, entry_point, kernel
from .maths import vec3
from .memory import (
    address_of_states,
    bodies_of,
    fields_of,
    header_at,
    report_of,
    rest_of,
    states_of,
    vectors_of,
    workspace_at,
    world_entry,
)
from .model import CONTACTS_FULL, NON_FINITE, OK, PAIRS_FULL, SOLVER_FULL, WHOLE


@kernel
def step_world(address, workspace_address, world):
    """Advance one world by one step, driven bodies in even acceleration; return its status and what REPORT.detail says
    to it.
    """
    header = header_at(address)
    bodies = bodies_of(header, world)
    states = states_of(header, world)
    rest = rest_of(header, world)
    if header.driven == 1:
        begin_driving(bodies, states, rest, header.time_step)
    status, detail = _step_driven(address, workspace_address, world)
    if header.driven == 1:
        end_driving(bodies, states, rest, status == OK)
    return status, detail


@kernel
def _step_driven(address, workspace_address, world):
    """The step of one world whose driven bodies have the velocities and accelerations of its start.

    flight        every body flies to the end of the step as if nothing touched (exact)
    broad phase   pairs of bodies whose swept bounds meet
    narrow phase  their contacts, at the start of the step, as far as the motion can reach
    contacts      which last and which strike, island by island; the impulses of the last step to start from
    solver        a smooth step of order 2 where all contacts last, a struck one where something closes;
                  measured overlap is removed without adding velocity
    groups        islands whose impacts have to be located in time step from one to the next
    hindsight     what bodies were pushed or turned into, unforeseen, is parted at the end of the step
    sleep         islands in balance are left alone from here on, until something disturbs them
    commit        the step becomes real
    """
    header = header_at(address)
    workspace = workspace_at(workspace_address)
    workspace.starts = address_of_states(header, world)
    workspace.span = header.time_step
    workspace.elapsed = 0.0
    workspace.part = WHOLE
    workspace.foreseen = 0
    workspace.waiting = 0
    if header.sleeping == 1 and nothing_moves(header, world):
        return OK, -1
    workspace.penetration = report_of(header, world).penetration
    count = np.int64(-1)
    while count < 0:  # anew if a sleeping island was touched
        call_stage(header.fly_bodies, address, workspace_address, world)
        count = np.int64(0)
        if header.collisions == 1:
            num_pairs = call_stage(header.find_pairs, address, workspace_address, world)
            if 2 * num_pairs > workspace.pairs_size:
                return PAIRS_FULL, num_pairs
            count = call_stage(header.find_contacts, address, workspace_address, world, num_pairs)
            if count > workspace.contacts_size:
                return CONTACTS_FULL, count
        if count > 0:
            count = call_stage(header.sort_contacts, address, workspace_address, world, count)
    if count > 0:
        if call_stage(header.step_islands, address, workspace_address, world) == 0:
            return SOLVER_FULL, -1
        if workspace.waiting > 0:
            status = call_stage(header.step_groups, address, workspace_address, world)
            if status != OK:
                return status, workspace.detail
            count = workspace.num_kept
    if header.collisions == 1:
        status = call_stage(header.part_overlaps, address, workspace_address, world, count)
        if status != OK:
            return status, workspace.detail
    body = first_non_finite(header, workspace, world)
    if body >= 0:
        return NON_FINITE, body
    if header.sleeping == 1:
        count = call_stage(header.settle, address, workspace_address, world, count)
    call_stage(header.commit, address, workspace_address, world, count)
    return OK, -1


@kernel
def begin_call(header, world):
    """Apply the impulses that wait, and open the report; return the body that one of them breaks, or -1."""
    bodies = bodies_of(header, world)
    states = states_of(header, world)
    impulses = vectors_of(header.impulses, header, world, 6)
    broken = -1
    for index in range(header.num_bodies):
        row = impulses[index]
        waiting = False
        for axis in range(6):
            waiting = waiting or row[axis] != 0.0
        if waiting:
            label = rest_of(header, world)[index].asleep
            if label > 0:
                wake_island(header, world, label)
            if not kick(bodies[index], states[index], (row[0], row[1], row[2]), (row[3], row[4], row[5])):
                broken = index
            for axis in range(6):
                row[axis] = 0.0
    report = report_of(header, world)
    report.residual = 0.0
    report.penetration = 0.0
    report.iterations = 0
    report.method = 0
    report.contacts = 0
    report.events = 0
    report.event_limit = 0
    report.steps = 0
    report.energy_start = kinetic_energy_of(bodies, states) + potential_energy_of(bodies, states, fields_of(header))
    return broken


@kernel
def end_call(header, world):
    """Forces last until the end of the call."""
    bodies = bodies_of(header, world)
    states = states_of(header, world)
    for index in range(header.num_bodies):
        vec3.store(states[index].force, vec3.ZERO)
        vec3.store(states[index].torque, vec3.ZERO)
    report = report_of(header, world)
    report.energy_end = kinetic_energy_of(bodies, states) + potential_energy_of(bodies, states, fields_of(header))


@entry_point
def advance(address, workspace_address, first, last, num_steps):
    """Step the worlds first <= world < last; return how many could not finish.

    ``num_steps`` is that of a call of World.step, or 0 to go on with one after tables have grown. A world that cannot
    finish keeps its remaining steps; its report holds status and detail.
    """
    header = header_at(address)
    stopped = 0
    for world in range(first, last):
        remaining = world_entry(header.remaining, world)
        report = report_of(header, world)
        report.status = OK
        if num_steps > 0:
            remaining[0] = num_steps
            broken = begin_call(header, world)
            if broken >= 0:
                report.status = NON_FINITE
                report.detail = broken
        while remaining[0] > 0 and report.status == OK:
            residual, penetration, method = report.residual, report.penetration, report.method
            status, detail = step_world(address, workspace_address, world)
            report.status = status
            report.detail = detail
            if status == OK:
                remaining[0] -= 1
                report.steps += 1
            else:  # nothing has happened, whatever was tried
                report.residual, report.penetration, report.method = residual, penetration, method
        if report.status == OK:
            end_call(header, world)
        else:
            stopped += 1
    return stopped
