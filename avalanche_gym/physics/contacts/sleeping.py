"""Sleep: islands in balance are left alone until something disturbs them.

*Balance.* Flight adds gain = v_flown - v to the velocity of a body in a step, and its contacts take it away again. A
body is still if it moves by less than a fraction of its size in a step, at both ends of the step, and what the
contacts leave of the gain is small against it. So nothing sleeps at the top of its flight, however slow it is there.
An island whose bodies have all been still for STILL_STEPS steps in a row (a crowd may have a few that were jolted
since) falls asleep: velocities become exactly zero, and its contacts move to a table of their own, with the impulses
that bear it.

*Asleep.* Nothing of the island is flown, collided or solved; a world in which all sleeps does nothing in a step.

*Waking.* When an awake or moving body touches one of the island, or is about to; when the user acts on a body of it,
or on anything that is not dynamic (it may carry any island). The impulses come back with the contacts, so an island
that was woken for nothing goes on resting. What rests on moving ground or a moving kinematic body stays awake, and so
does what a held force acts on.
"""

from __future__ import annotations

import numpy as np

from ..jit import entry_point, kernel, stage
from ..maths import vec3
from ..memory import (
    asleep_contacts_of,
    bodies_of,
    contacts_of,
    header_at,
    report_of,
    rest_of,
    states_of,
    table,
    traits_of,
    workspace_at,
    world_entry,
)
from ..model import BODY_STATE, CONTACT, DYNAMIC, KINEMATIC, LEAST_BODIES, LONGEST_PAUSE
from .islands import root_of
from .prediction import OVERLAP

# [steps] in a row that all bodies of an island have to be still. Fewer: what turns round slowly is stopped more often.
STILL_STEPS = 60
# A still body moves by less than this fraction of its size in a step, and keeps less than this share of what flight
# adds to its velocity. Asleep, it no longer moves by that: the error that sleeping makes.
STILL, BALANCED = 1e-8, 1e-6
# The same for islands that the pile tier carries, whose bodies tremble as much as its sweeps leave undone.
CROWD_STILL, CROWD_BALANCED = 4e-3, 0.1
# There one body or another is jolted now and then. So few of them [share] hold up no other if they have been still for
# these steps since: longer than what turns round on a slope of a few degrees is slow.
LATE_SHARE, LATE_STEPS = 0.05, 15


@kernel
def _speed(state, size):
    """[m/s] of a body's fastest points, about."""
    return vec3.norm(vec3.load(state.velocity)) + size * vec3.norm(vec3.load(state.angular_velocity))


@kernel
def _way(time_step, state, end, size):
    """[m] that a body moves in a step: with the speed of its start or end, or because overlap is taken out."""
    shift = vec3.norm(vec3.sub(vec3.load(end.center), vec3.load(state.center)))
    return max(time_step * max(_speed(state, size), _speed(end, size)), shift)


@kernel
def _moves(body, state):
    """Whether something that is not dynamic moves."""
    if body.motion != KINEMATIC:
        return False
    total = vec3.norm_squared(vec3.load(state.velocity)) + vec3.norm_squared(vec3.load(state.angular_velocity))
    return total != 0.0


@kernel
def nothing_moves(header, world):
    """Whether all that could move in a world is asleep or at rest; the report counts the contacts all the same."""
    if traits_of(header, world).moving_heights == 1:
        return False
    bodies = bodies_of(header, world)
    states = states_of(header, world)
    rest = rest_of(header, world)
    for index in range(header.num_bodies):
        if bodies[index].motion == DYNAMIC:
            if rest[index].asleep == 0:
                return False
        elif _moves(bodies[index], states[index]):
            return False
    report = report_of(header, world)
    report.contacts = max(report.contacts, world_entry(header.num_asleep_contacts, world)[0])
    return True


@kernel
def drop_sleeping_pairs(header, world, pairs, num_pairs):
    """Keep the pairs in which something awake is dynamic or something else moves; return their number."""
    if header.sleeping == 0 or 2 * num_pairs > pairs.shape[0]:
        return num_pairs
    bodies = bodies_of(header, world)
    states = states_of(header, world)
    rest = rest_of(header, world)
    ground_moves = traits_of(header, world).moving_heights == 1
    count = 0
    for pair in range(num_pairs):
        a = pairs[2 * pair]
        b = pairs[2 * pair + 1]
        lively = bodies[a].motion == DYNAMIC and rest[a].asleep == 0
        lively = lively or (bodies[b].motion == DYNAMIC and rest[b].asleep == 0)
        if lively or ground_moves or _moves(bodies[a], states[a]) or _moves(bodies[b], states[b]):
            pairs[2 * count] = a
            pairs[2 * count + 1] = b
            count += 1
    return count


@kernel
def wake_island(header, world, label):
    """Wake the island with this label, all if it is 0, and give its contacts back to the list of the last step.

    Where that list is full the impulses of the rest are forgotten: these contacts start cold.
    """
    rest = rest_of(header, world)
    for index in range(header.num_bodies):
        if rest[index].asleep != 0 and (rest[index].asleep == label or label == 0):
            rest[index].asleep = 0
            rest[index].still = 0
    number = world_entry(header.num_contacts, world)
    number_asleep = world_entry(header.num_asleep_contacts, world)
    contacts = contacts_of(header, world)
    resting = asleep_contacts_of(header, world)
    kept = 0
    for index in range(number_asleep[0]):
        if resting[index].island == label or label == 0:
            if number[0] < contacts.shape[0]:
                contacts[number[0]] = resting[index]
                number[0] += 1
        else:
            if kept < index:
                resting[kept] = resting[index]
            kept += 1
    number_asleep[0] = kept


@kernel
def touch_sleepers(header, world, contacts, num_contacts):
    """Wake what is touched; return -1 if anything was, else how many contacts remain without those of sleepers."""
    if header.sleeping == 0 or world_entry(header.num_asleep_contacts, world)[0] == 0:
        return num_contacts
    rest = rest_of(header, world)
    woken = False
    kept = 0
    for index in range(num_contacts):
        contact = contacts[index]
        label = max(rest[contact.body_a].asleep, rest[contact.body_b].asleep)
        if label > 0:
            if min(contact.gap, contact.free_gap) > OVERLAP * contact.size:
                continue
            for side in range(2):
                label = rest[contact.body_a if side == 0 else contact.body_b].asleep
                if label > 0:
                    wake_island(header, world, label)
                    woken = True
        if kept < index:
            contacts[kept] = contact
        kept += 1
    return -1 if woken else kept


@kernel
def _note_still(header, bodies, states, flown, ends, rest):
    """Count the steps in which each body was still; return whether an island may be ready to sleep."""
    enough = False
    for index in range(header.num_bodies):
        body = bodies[index]
        if body.motion != DYNAMIC or rest[index].asleep != 0:
            continue
        state = states[index]
        way = _way(header.time_step, state, ends[index], body.size)
        still = way <= CROWD_STILL * body.size and rest[index].barred == 0
        acts = vec3.norm_squared(vec3.load(state.force)) + vec3.norm_squared(vec3.load(state.torque))
        rest[index].still = rest[index].still + 1 if still and acts == 0.0 else 0
        # Where the others were not ready, it is asked again later.
        enough = enough or (rest[index].still > 0 and rest[index].still % LATE_STEPS == 0)
    return enough


@kernel
def _in_balance(time_step, body, state, flight, end, crowd):
    """Whether a body may sleep as one of a crowd, or else as one of few."""
    way = _way(time_step, state, end, body.size)
    speed = max(_speed(state, body.size), _speed(end, body.size))
    gain = vec3.norm(vec3.sub(vec3.load(flight.velocity), vec3.load(state.velocity)))
    still = CROWD_STILL if crowd else STILL
    balanced = CROWD_BALANCED if crowd else BALANCED
    # Without a gain there is nothing to be in balance with: in empty space nothing bears a body.
    return 0.0 < gain and way <= still * body.size and speed <= balanced * gain


@stage
def settle(address, workspace_address, world, count):
    """Let islands in balance fall asleep at the end of a step; return how many of the ``count`` contacts stay awake."""
    header = header_at(address)
    workspace = workspace_at(workspace_address)
    bodies = bodies_of(header, world)
    states = states_of(header, world)
    rest = rest_of(header, world)
    flown = table(workspace.flown, header.num_bodies, BODY_STATE)
    ends = table(workspace.ends, header.num_bodies, BODY_STATE)
    if not _note_still(header, bodies, states, flown, ends, rest):
        return count
    listed = workspace.kept if workspace.waiting > 0 else workspace.contacts
    contacts = table(listed, workspace.contacts_size, CONTACT)
    parent = table(workspace.members, header.num_bodies, np.int64)
    size = table(workspace.bound, header.num_bodies, np.int64)
    late = table(workspace.near, header.num_bodies, np.int64)
    for index in range(header.num_bodies):
        parent[index] = index
        size[index] = 0
        late[index] = 0
    for index in range(count):
        a = contacts[index].body_a
        b = contacts[index].body_b
        if bodies[a].motion == DYNAMIC and bodies[b].motion == DYNAMIC:
            root_a = root_of(parent, a)
            root_b = root_of(parent, b)
            parent[max(root_a, root_b)] = min(root_a, root_b)
    for index in range(header.num_bodies):
        size[root_of(parent, index)] += 1
    # An island that may not sleep gets a negative size.
    for index in range(header.num_bodies):
        if bodies[index].motion == DYNAMIC and rest[index].asleep == 0:
            root = root_of(parent, index)
            # A few that jam and that the exact tier gives up are carried as the many are.
            given_up = abs(size[root]) > 1 and rest[root].pause == LONGEST_PAUSE
            crowd = given_up or abs(size[root]) >= LEAST_BODIES
            calm = _in_balance(header.time_step, bodies[index], states[index], flown[index], ends[index], crowd)
            if rest[index].still < STILL_STEPS:
                late[root] += 1
            few = crowd and late[root] <= LATE_SHARE * abs(size[root])
            if rest[index].still < (LATE_STEPS if few else STILL_STEPS) or not calm:
                size[root] = -abs(size[root])
    ground_moves = traits_of(header, world).moving_heights == 1
    for index in range(count):
        a = contacts[index].body_a
        b = contacts[index].body_b
        if ground_moves or _moves(bodies[a], states[a]) or _moves(bodies[b], states[b]):
            root = root_of(parent, a if bodies[a].motion == DYNAMIC else b)
            size[root] = -abs(size[root])
    resting = asleep_contacts_of(header, world)
    number_asleep = world_entry(header.num_asleep_contacts, world)
    kept = 0
    for index in range(count):
        contact = contacts[index]
        root = root_of(parent, contact.body_a if bodies[contact.body_a].motion == DYNAMIC else contact.body_b)
        if size[root] > 0 and number_asleep[0] + count - index > resting.shape[0]:
            # No room for its contacts: all that is left stays awake.
            size[root] = -size[root]
        if size[root] > 0:
            contact.island = root + 1
            resting[number_asleep[0]] = contact
            number_asleep[0] += 1
        else:
            if kept < index:
                contacts[kept] = contact
            kept += 1
    for index in range(header.num_bodies):
        if bodies[index].motion == DYNAMIC and rest[index].asleep == 0:
            root = root_of(parent, index)
            if size[root] > 0:
                rest[index].asleep = root + 1
                vec3.store(ends[index].velocity, vec3.ZERO)
                vec3.store(ends[index].angular_velocity, vec3.ZERO)
                vec3.store(ends[index].angular_momentum, vec3.ZERO)
    return kept


@entry_point
def wake(address, world_mask, body):
    """Wake the island of one body in the worlds of the mask; all islands if the body is not dynamic, or negative."""
    header = header_at(address)
    for world in range(header.num_worlds):
        if world_mask[world]:
            label = 0
            if body >= 0 and bodies_of(header, world)[body].motion == DYNAMIC:
                label = rest_of(header, world)[body].asleep
                if label == 0:
                    continue
            wake_island(header, world, label)
