"""A step in parts: islands whose impacts have to be located go from one impact to the next, on a clock of their own.

    part:    fly, find and sort the contacts of the group for what is left of the step
             step it without the contacts to be located, and ask when the first of their impacts comes on that way
             none: step it to the end with all contacts, done
             else: step it up to there, let the impact happen (response/blow.py), go on with the next part

All other islands have been stepped before. A group that comes near a body of another island takes that island in and
starts anew: nothing is real before the step is committed. The number of parts is limited; the last one then closes
what closes at its end, as without located impacts, and the report says so.
"""

from __future__ import annotations

import math

import numpy as np

from .broad_phase.all_pairs import overlap
from .broad_phase.bounds import swept_box
from .contacts.prediction import SLACK
from .integrator.flight import fly
from .jit import call_stage, kernel, stage
from .maths import quat, vec3
from .memory import (
    address_of_states,
    bodies_of,
    colliders_of,
    contacts_of,
    fields_of,
    header_at,
    report_of,
    rest_of,
    states_of,
    table,
    workspace_at,
    world_entry,
)
from .model import (
    BODY_STATE,
    CONTACT,
    CONTACTS_FULL,
    CROWD,
    DYNAMIC,
    KINEMATIC,
    LAST,
    LEAST_BODIES,
    LIVELY,
    OK,
    PAIRS_FULL,
    REMOVED,
    SOLVER_FULL,
    TO_IMPACT,
)

# Parts of a step at most: so many for a group of few bodies, and fewer for a large one, whose parts cost more.
MOST_PARTS = 1024
MOST_BODY_PARTS = 1 << 17
FEWEST_PARTS = 64
# Labels of groups: the number of the island, plus DULL or LIVELY times the number of bodies while it waits, and DONE
# times in the end.
DONE = 3
# An impact without rebound counts as so many parts: what comes to rest rocks from corner to corner without end, and
# loses little if it is not followed.
NO_REBOUND = 128
# What is left of a step below this share of it is nothing.
INSTANT = 1e-13

# The group of what the pile tier has stepped, and of what is asleep: it is not stopped for those who come near it, and
# what they meet is found in the next step.
APART = -2

# What a group says in place of a status: it met a body of another island.
MET = -1


@kernel
def copy_state(source, target):
    vec3.store(target.center, vec3.load(source.center))
    quat.store(target.orientation, quat.load(source.orientation))
    vec3.store(target.velocity, vec3.load(source.velocity))
    vec3.store(target.angular_velocity, vec3.load(source.angular_velocity))
    vec3.store(target.angular_momentum, vec3.load(source.angular_momentum))
    vec3.store(target.force, vec3.load(source.force))
    vec3.store(target.torque, vec3.load(source.torque))


@kernel
def _bodies_table(header, address):
    return table(address, header.num_bodies, BODY_STATE)


@kernel
def _numbers(header, address):
    return table(address, header.num_bodies, np.int64)


@stage
def step_groups(address, workspace_address, world):
    """Step every island that waits; return the status, and ``num_kept`` contacts of the whole world in ``kept``."""
    header = header_at(address)
    workspace = workspace_at(workspace_address)
    bodies = bodies_of(header, world)
    states = states_of(header, world)
    begins = _bodies_table(header, workspace.begins)
    group = _numbers(header, workspace.group)
    rest = rest_of(header, world)
    waits = table(workspace.waits, workspace.waits_size, np.int64)
    island = _numbers(header, workspace.island)
    waiting = workspace.waiting
    for index in range(header.num_bodies):
        group[index] = island[index]
        if bodies[index].motion != DYNAMIC:
            copy_state(states[index], begins[index])
    _keep_finished(workspace, waits)
    # Parts count their islands in the same tables; from here on the label of a group says that it waits, or is done.
    num_bodies = header.num_bodies
    for index in range(num_bodies):
        if rest[index].asleep != 0 or (group[index] >= 0 and waits[group[index]] == CROWD):
            group[index] = APART
        elif group[index] >= 0:
            group[index] += waits[group[index]] * num_bodies
    for index in range(num_bodies):
        while num_bodies <= group[index] < DONE * num_bodies:
            status = _step_group(address, workspace_address, world, group[index])
            if status != OK and status != MET:
                workspace.starts = address_of_states(header, world)
                return status
    workspace.starts = address_of_states(header, world)
    workspace.waiting = waiting
    return OK


@kernel
def _keep_finished(workspace, waits):
    """Contacts of the islands that do not wait."""
    contacts = table(workspace.contacts, workspace.contacts_size, CONTACT)
    kept = table(workspace.kept, workspace.kept_size, CONTACT)
    starts = table(workspace.island_starts, workspace.island_starts_size, np.int64)
    count = 0
    for index in range(starts[workspace.num_islands]):
        contact = contacts[index]
        if waits[contact.island] == 0 or waits[contact.island] == CROWD:
            kept[count] = contact
            count += 1
    workspace.num_kept = count


@kernel
def _gather(header, workspace, label):
    """List the bodies of a group; return their number."""
    group = _numbers(header, workspace.group)
    members = _numbers(header, workspace.members)
    count = 0
    for index in range(header.num_bodies):
        if group[index] == label:
            members[count] = index
            count += 1
    return count


@kernel
def _step_group(address, workspace_address, world, label):
    """Step one group to the end; return a status, or MET after it has taken another island in."""
    header = header_at(address)
    workspace = workspace_at(workspace_address)
    states = states_of(header, world)
    begins = _bodies_table(header, workspace.begins)
    ends = _bodies_table(header, workspace.ends)
    group = _numbers(header, workspace.group)
    members = _numbers(header, workspace.members)
    boxes = table(workspace.boxes, workspace.boxes_size, np.float64)
    reached = table(workspace.reached, workspace.reached_size, np.float64)
    contacts = table(workspace.contacts, workspace.contacts_size, CONTACT)
    recent = table(workspace.recent, workspace.recent_size, CONTACT)
    report = report_of(header, world)
    count = _gather(header, workspace, label)
    for number in range(count):
        body = members[number]
        copy_state(states[body], begins[body])
        for axis in range(3):
            reached[6 * body + axis] = math.inf
            reached[6 * body + 3 + axis] = -math.inf
    old = contacts_of(header, world)
    workspace.num_recent = 0
    for number in range(world_entry(header.num_contacts, world)[0]):
        contact = old[number]
        if group[contact.body_a] == label or group[contact.body_b] == label:
            recent[workspace.num_recent] = contact
            vec3.store(recent[workspace.num_recent].blow, vec3.ZERO)
            workspace.num_recent += 1
    workspace.starts = workspace.begins
    workspace.elapsed = 0.0
    events = 0
    spent = 0
    most = min(MOST_PARTS, max(FEWEST_PARTS, MOST_BODY_PARTS // count))
    # A group for the pile tier is not stopped at every touch; what rebounds is not for that tier.
    crowd = header.step_pile != 0 and count >= LEAST_BODIES and header.restitution == 0
    while True:
        left = header.time_step - workspace.elapsed
        workspace.part = TO_IMPACT if spent < most and not crowd else LAST
        workspace.span = left
        status, num_contacts = _find(address, workspace_address, world, label, count)
        if status != OK:
            return status
        if call_stage(header.step_islands, address, workspace_address, world) == 0:
            return SOLVER_FULL
        if workspace.part == LAST:
            break
        if workspace.waiting == 0:
            break
        bound = _note_bound(header, workspace, num_contacts, count)
        strikes = call_stage(header.find_impact_time, address, workspace_address, world, num_contacts) == 1
        if not strikes:
            workspace.part = LAST
            if bound:
                status, num_contacts = _find(address, workspace_address, world, label, count)
                if status != OK:
                    return status
            if call_stage(header.step_islands, address, workspace_address, world) == 0:
                return SOLVER_FULL
            break
        instant = workspace.impact_time
        if instant > 0.0:
            workspace.span = instant
            if bound:
                status, num_contacts = _find(address, workspace_address, world, label, count)
                if status != OK:
                    return status
                if call_stage(header.step_islands, address, workspace_address, world) == 0:
                    return SOLVER_FULL
                _remember(workspace, contacts, num_contacts, True)
            else:
                _fly(header, workspace, world, count)
            for number in range(count):
                copy_state(ends[members[number]], begins[members[number]])
            workspace.elapsed += instant
            _move_support(header, workspace, world)
        left = max(header.time_step - workspace.elapsed, INSTANT * header.time_step)
        workspace.span = left
        status, num_contacts = _find(address, workspace_address, world, label, count)
        if status != OK:
            return status
        outcome = call_stage(header.strike, address, workspace_address, world)
        if outcome == 0:
            return SOLVER_FULL
        _remember(workspace, contacts, num_contacts, False)
        events += 1
        spent += 1 if outcome == 2 else NO_REBOUND
        if header.time_step - workspace.elapsed <= INSTANT * header.time_step:
            for number in range(count):
                copy_state(begins[members[number]], ends[members[number]])
            break
    report.events += events
    if spent >= most:
        report.event_limit += 1
    kept = table(workspace.kept, workspace.kept_size, CONTACT)
    if workspace.num_kept + num_contacts > kept.shape[0]:
        workspace.detail = workspace.num_kept + num_contacts
        return CONTACTS_FULL
    for number in range(num_contacts):
        kept[workspace.num_kept] = contacts[number]
        kept[workspace.num_kept].island = label + DONE * header.num_bodies
        workspace.num_kept += 1
    for number in range(count):
        body = members[number]
        group[body] = label + DONE * header.num_bodies
        for axis in range(6):
            boxes[6 * body + axis] = reached[6 * body + axis]
    return OK


@kernel
def _fly(header, workspace, world, count):
    """Fly the group, and what is not dynamic, over ``span`` into ``flown`` and ``ends``."""
    bodies = bodies_of(header, world)
    fields = fields_of(header)
    begins = _bodies_table(header, workspace.begins)
    flown = _bodies_table(header, workspace.flown)
    ends = _bodies_table(header, workspace.ends)
    members = _numbers(header, workspace.members)
    for number in range(count):
        body = members[number]
        fly(begins[body], bodies[body], fields, workspace.span, flown[body])
        copy_state(flown[body], ends[body])
    for body in range(header.num_bodies):
        if bodies[body].motion == KINEMATIC:
            fly(begins[body], bodies[body], fields, workspace.span, flown[body])


@kernel
def _move_support(header, workspace, world):
    """What is moved by the user is where the clock of the group says."""
    bodies = bodies_of(header, world)
    states = states_of(header, world)
    begins = _bodies_table(header, workspace.begins)
    for body in range(header.num_bodies):
        if bodies[body].motion == KINEMATIC:
            fly(states[body], bodies[body], fields_of(header), workspace.elapsed, begins[body])


@kernel
def _find(address, workspace_address, world, label, count):
    """Fly the group over ``span``, find its contacts and sort them; return (status or MET, number of contacts)."""
    header = header_at(address)
    workspace = workspace_at(workspace_address)
    _fly(header, workspace, world, count)
    num_pairs = _pairs(header, workspace, world, label, count)
    if 2 * num_pairs > workspace.pairs_size:
        workspace.detail = num_pairs
        return PAIRS_FULL, 0
    num_contacts = call_stage(header.find_contacts, address, workspace_address, world, num_pairs)
    if num_contacts > workspace.contacts_size:
        workspace.detail = num_contacts
        return CONTACTS_FULL, 0
    _carry_blows(workspace, num_contacts)
    num_contacts = call_stage(header.sort_contacts, address, workspace_address, world, num_contacts)
    if _meet(header, workspace, world, label, num_contacts):
        return MET, 0
    return OK, num_contacts


@kernel
def _pairs(header, workspace, world, label, count):
    """Fill ``boxes`` of the group and ``pairs`` with all that any of its bodies may reach; return their number."""
    bodies = bodies_of(header, world)
    colliders = colliders_of(header)
    begins = _bodies_table(header, workspace.begins)
    flown = _bodies_table(header, workspace.flown)
    members = _numbers(header, workspace.members)
    group = _numbers(header, workspace.group)
    boxes = table(workspace.boxes, workspace.boxes_size, np.float64)
    reached = table(workspace.reached, workspace.reached_size, np.float64)
    pairs = table(workspace.pairs, workspace.pairs_size, np.int64)
    for number in range(count):
        body = members[number]
        box = boxes[6 * body : 6 * body + 6]
        spin = max(
            vec3.norm(vec3.load(begins[body].angular_velocity)), vec3.norm(vec3.load(flown[body].angular_velocity))
        )
        slack = SLACK * bodies[body].size
        swept_box(header, colliders, bodies[body], begins[body], flown[body], spin * workspace.span, slack, box)
        for axis in range(3):
            reached[6 * body + axis] = min(reached[6 * body + axis], box[axis])
            reached[6 * body + 3 + axis] = max(reached[6 * body + 3 + axis], box[3 + axis])
    # A body that is only stopped goes less far than it would have flown, which met nobody.
    dull = label < LIVELY * header.num_bodies
    num_pairs = 0
    for number in range(count):
        one = members[number]
        if bodies[one].num_colliders == 0:
            continue
        for other in range(header.num_bodies):
            mine = group[other] == label
            if bodies[other].num_colliders == 0 or bodies[other].motion == REMOVED or (mine and other <= one):
                continue
            if group[other] == APART:
                continue
            if dull and not mine and bodies[other].motion == DYNAMIC:
                continue
            if overlap(boxes, one, other):
                if bodies[other].motion == DYNAMIC and not mine:
                    _place_stranger(header, workspace, world, other)
                if 2 * num_pairs + 1 < pairs.shape[0]:
                    pairs[2 * num_pairs] = min(one, other)
                    pairs[2 * num_pairs + 1] = max(one, other)
                num_pairs += 1
    return num_pairs


@kernel
def _place_stranger(header, workspace, world, body):
    """A body of another group, straight between both ends of its step: near enough to see whether it is met."""
    states = states_of(header, world)
    ends = _bodies_table(header, workspace.ends)
    begins = _bodies_table(header, workspace.begins)
    flown = _bodies_table(header, workspace.flown)
    part = workspace.elapsed / header.time_step
    start = vec3.load(states[body].center)
    way = vec3.sub(vec3.load(ends[body].center), start)
    copy_state(ends[body], begins[body])
    copy_state(ends[body], flown[body])
    now = vec3.add_scaled(start, part, way)
    vec3.store(begins[body].center, now)
    rest = workspace.span / header.time_step
    vec3.store(flown[body].center, vec3.add_scaled(now, rest, way))


@kernel
def _meet(header, workspace, world, label, num_contacts):
    """Whether a contact reaches a body of another group; that group and this one become one."""
    bodies = bodies_of(header, world)
    contacts = table(workspace.contacts, workspace.contacts_size, CONTACT)
    group = _numbers(header, workspace.group)
    met = False
    for index in range(num_contacts):
        for side in range(2):
            body = contacts[index].body_a if side == 0 else contacts[index].body_b
            if bodies[body].motion == DYNAMIC and group[body] != label:
                met = True
                _absorb(header, workspace, label, body)
    return met


@kernel
def _absorb(header, workspace, label, body):
    """Move the whole group of a body into this one; contacts that were kept for it are found anew."""
    group = _numbers(header, workspace.group)
    kept = table(workspace.kept, workspace.kept_size, CONTACT)
    other = group[body]
    if other < 0:
        group[body] = label
        return
    for index in range(header.num_bodies):
        if group[index] == other:
            group[index] = label
    count = 0
    for index in range(workspace.num_kept):
        if kept[index].island != other:
            if count < index:
                kept[count] = kept[index]
            count += 1
    workspace.num_kept = count


@kernel
def _note_bound(header, workspace, num_contacts, count):
    """Note which bodies of the group are not in free flight; return whether there is any contact but the located."""
    contacts = table(workspace.contacts, workspace.contacts_size, CONTACT)
    bound = _numbers(header, workspace.bound)
    members = _numbers(header, workspace.members)
    for number in range(count):
        bound[members[number]] = 0
    # What the group rests on is no member of it.
    for index in range(num_contacts):
        bound[contacts[index].body_a] = 0
        bound[contacts[index].body_b] = 0
    found = False
    for index in range(num_contacts):
        contact = contacts[index]
        if contact.located == 0:
            found = True
            if vec3.norm_squared(vec3.load(contact.impulse)) > 0.0:
                bound[contact.body_a] = 1
                bound[contact.body_b] = 1
    return found


@kernel
def _remember(workspace, contacts, num_contacts, acted):
    """Keep the contacts of a part for the next one; if their impulses have ``acted`` they count as given."""
    recent = table(workspace.recent, workspace.recent_size, CONTACT)
    for index in range(num_contacts):
        recent[index] = contacts[index]
        if acted:
            if contacts[index].located == 0:
                total = vec3.add(vec3.load(contacts[index].blow), vec3.load(contacts[index].impulse))
                vec3.store(recent[index].blow, total)
            else:
                vec3.store(recent[index].impulse, vec3.ZERO)
    workspace.num_recent = num_contacts


@kernel
def _carry_blows(workspace, num_contacts):
    """Hand what contacts have borne earlier in the step to the same contacts of this part, or to those of the pair."""
    contacts = table(workspace.contacts, workspace.contacts_size, CONTACT)
    recent = table(workspace.recent, workspace.recent_size, CONTACT)
    for number in range(workspace.num_recent):
        blow = vec3.load(recent[number].blow)
        if vec3.norm_squared(blow) == 0.0:
            continue
        chosen = -1
        for index in range(num_contacts):
            if contacts[index].pair == recent[number].pair:
                if chosen < 0 or contacts[index].feature == recent[number].feature:
                    chosen = index
                if contacts[index].feature == recent[number].feature:
                    break
        if chosen >= 0:
            vec3.store(contacts[chosen].blow, vec3.add(vec3.load(contacts[chosen].blow), blow))
