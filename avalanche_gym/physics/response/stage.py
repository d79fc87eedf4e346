"""The stages of the step around its islands: sort the contacts into them, and make the step real."""

from __future__ import annotations

import numpy as np

from ..contacts.coherence import forget_place, note_place
from ..contacts.islands import find_islands
from ..contacts.matching import match_contacts
from ..contacts.prediction import predict_contacts
from ..contacts.sleeping import touch_sleepers
from ..frames import publish_body
from ..integrator.driven import give_back
from ..jit import stage
from ..maths import quat, vec3
from ..memory import (
    bodies_of,
    contacts_of,
    header_at,
    report_of,
    rest_of,
    starts_of,
    states_of,
    table,
    traits_of,
    workspace_at,
    world_entry,
)
from ..model import BODY_STATE, CONTACT, DYNAMIC, KINEMATIC, WHOLE
from ..narrow_phase.moving_heights import end_moving


@stage
def sort_contacts(address, workspace_address, world, count):
    """Predict the contacts, match them with those before, and sort them into islands.

    Returns how many remain, or -1 if a sleeping island was touched and woke: the step begins anew.
    """
    header = header_at(address)
    workspace = workspace_at(workspace_address)
    bodies = bodies_of(header, world)
    flown = table(workspace.flown, header.num_bodies, BODY_STATE)
    contacts = table(workspace.contacts, workspace.contacts_size, CONTACT)
    span = workspace.span
    # So few chains for a group that clearing them costs no more than its contacts.
    num_chains = workspace.island_starts_size if workspace.part == WHOLE else workspace.num_members + 1
    chains = table(workspace.island_starts, num_chains, np.int64)
    following = table(workspace.order, workspace.order_size, np.int64)
    # In a crowd they are not (response/island.py).
    lands = header.events == 1 and header.step_pile == 0
    count = predict_contacts(
        bodies, starts_of(header, workspace), flown, span, header.time_step, lands, contacts, count
    )
    if workspace.part == WHOLE:
        count = touch_sleepers(header, world, contacts, count)
        if count < 0:
            return -1
        num_old = world_entry(header.num_contacts, world)[0]
        match_contacts(bodies, contacts_of(header, world), num_old, contacts, count, span, chains, following)
    else:
        recent = table(workspace.recent, workspace.recent_size, CONTACT)
        match_contacts(bodies, recent, workspace.num_recent, contacts, count, span, chains, following)
    workspace.num_islands = find_islands(
        bodies,
        contacts,
        count,
        table(workspace.members, workspace.members_size, np.int64),
        workspace.num_members,
        table(workspace.island, workspace.island_size, np.int64),
        table(workspace.island_starts, workspace.island_starts_size, np.int64),
        table(workspace.order, workspace.order_size, np.int64),
        table(workspace.body_starts, workspace.body_starts_size, np.int64),
        table(workspace.island_bodies, workspace.island_bodies_size, np.int64),
    )
    return count


@stage
def commit(address, workspace_address, world, count):
    """Make the step real: states, public arrays, contacts to remember, moving ground."""
    header = header_at(address)
    workspace = workspace_at(workspace_address)
    bodies = bodies_of(header, world)
    states = states_of(header, world)
    ends = table(workspace.ends, header.num_bodies, BODY_STATE)
    kept = workspace.kept if workspace.waiting > 0 else workspace.contacts
    contacts = table(kept, workspace.contacts_size, CONTACT)
    rest = rest_of(header, world)
    group = table(workspace.group, header.num_bodies, np.int64)
    for index in range(header.num_bodies):
        body = bodies[index]
        note_place(rest[index], states[index])
        if workspace.waiting > 0 and group[index] >= header.num_bodies:
            # Its contacts are those of the last part of the step.
            forget_place(rest[index])
        if body.motion == DYNAMIC or body.motion == KINEMATIC:
            state = states[index]
            end = ends[index]
            vec3.store(state.center, vec3.load(end.center))
            quat.store(state.orientation, quat.load(end.orientation))
            vec3.store(state.velocity, vec3.load(end.velocity))
            vec3.store(state.angular_velocity, vec3.load(end.angular_velocity))
            vec3.store(state.angular_momentum, vec3.load(end.angular_momentum))
            if body.motion == KINEMATIC:
                give_back(state, rest[index])
            publish_body(header, world, index, body, state)
    memory = contacts_of(header, world)
    for number in range(count):
        memory[number] = contacts[number]
    world_entry(header.num_contacts, world)[0] = count
    if traits_of(header, world).moving_heights == 1:
        end_moving(header, world)
    report = report_of(header, world)
    report.contacts = max(report.contacts, count + world_entry(header.num_asleep_contacts, world)[0])
    return 0
