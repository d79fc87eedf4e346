"""One part of a step: the group flies, its contacts are found and sorted, and it goes on to the end of the part.

Up to an impact that was found on its way a part is solved once more, with the contacts that last. The longer one tells
where that leads and what they bear on average, so the shorter one has its prediction: it begins with the same forces
and the places on the way, and is solved in one go if they come true. The group then ends at just these places, where
the search has found it to touch. With forces that change by J [N/s] the way errs there by J (T t^2 / 4 - t^3 / 6) / m,
no more than a part of all the length T does at its end, J T^3 / 12 m, and velocities as those of the shorter part do.
"""

from __future__ import annotations

from ..integrator.flight import copy_state
from ..jit import call_stage, kernel
from ..memory import header_at, table, workspace_at
from ..model import CONTACT, CONTACTS_FULL, OK, PAIRS_FULL, SOLVER_FULL
from .contacts import carry_blows, follow_gone, follow_struck, hand_back, part_with, remember
from .members import fly_group, meets, move_support, numbers_in, place_on_way, states_in
from .reach import find_group_pairs

# What a group says in place of a status: it met a body of another island.
MET = -1


@kernel
def find(address, workspace_address, world, label, count):
    """Fly the group over ``span``, find its contacts and sort them; return (status or MET, number of contacts)."""
    header = header_at(address)
    workspace = workspace_at(workspace_address)
    fly_group(header, workspace, world, count)
    num_pairs = find_group_pairs(header, workspace, world, label, count)
    if 2 * num_pairs > workspace.pairs_size:
        workspace.detail = num_pairs
        return PAIRS_FULL, 0
    num_contacts = call_stage(header.find_contacts, address, workspace_address, world, num_pairs)
    if num_contacts > workspace.contacts_size:
        workspace.detail = num_contacts
        return CONTACTS_FULL, 0
    carry_blows(workspace, num_contacts)
    num_contacts = call_stage(header.sort_contacts, address, workspace_address, world, num_contacts)
    if meets(header, workspace, world, label, num_contacts):
        return MET, 0
    return OK, num_contacts


@kernel
def step_part(address, workspace_address, world, label, count, part, span):
    """Step the group over ``span``; return (status or MET, number of contacts)."""
    header = header_at(address)
    workspace = workspace_at(workspace_address)
    workspace.part = part
    workspace.span = span
    status, num_contacts = find(address, workspace_address, world, label, count)
    if status == OK and call_stage(header.step_islands, address, workspace_address, world) == 0:
        status = SOLVER_FULL
    return status, num_contacts


@kernel
def go_to_impact(address, workspace_address, world, label, count, num_contacts, bound):
    """Move the group, and its clock, to the instant that was found; return a status or MET."""
    header = header_at(address)
    workspace = workspace_at(workspace_address)
    instant = workspace.impact_time
    place_on_way(header, workspace, world, count, instant)
    workspace.span = instant
    if bound:
        # What a smooth part gains of energy is taken back only of a body alone (response/energy.py): others take the
        # part as one of which nothing is known.
        smooth = count == 1 and hand_back(workspace, num_contacts)
        status, num_contacts = find(address, workspace_address, world, label, count)
        if status != OK:
            return status
        workspace.foreseen = 1 if smooth else 0
        solved = call_stage(header.step_islands, address, workspace_address, world)
        workspace.foreseen = 0
        if solved == 0:
            return SOLVER_FULL
        return OK if go_on(header, workspace, world, count, num_contacts, instant) else contacts_full(workspace)
    fly_group(header, workspace, world, count)
    follow_struck(header, workspace, world)
    _move(header, workspace, world, count, instant)
    return OK


@kernel
def go_on(header, workspace, world, count, num_contacts, span):
    """Move the group, and its clock, to the end of a part that has been stepped; return whether there was room."""
    if not part_with(workspace, num_contacts):
        return False
    remember(workspace, table(workspace.contacts, workspace.contacts_size, CONTACT), num_contacts, True)
    _move(header, workspace, world, count, span)
    return True


@kernel
def _move(header, workspace, world, count, span):
    """The group begins where it has ended ``span`` [s] later."""
    begins = states_in(header, workspace.begins)
    ends = states_in(header, workspace.ends)
    members = numbers_in(header, workspace.members)
    follow_gone(header, workspace, world)
    for number in range(count):
        copy_state(ends[members[number]], begins[members[number]])
    workspace.elapsed += span
    move_support(header, workspace, world)


@kernel
def contacts_full(workspace):
    workspace.detail = workspace.contacts_size + 1
    return CONTACTS_FULL
