"""A step in parts: islands whose impacts have to be located go from one impact to the next, on a clock of their own.

    part:    fly, find and sort the contacts of the group for what is left of the step
             step it without the contacts to be located, and ask when the first of their impacts comes on that way
             a contact that rests turns too far for a smooth step: only a shorter part
             none: this is the step of the group; the contacts looked for pass by, done
             undecided: step it to the end with all contacts, done
             else: step it up to there, let the impact happen (response/blow.py), go on with the next part

All other islands have been stepped before. A group that comes near a body of another island takes that island in and
starts anew: nothing is real before the step is committed. The number of parts is limited; the last one then closes
what closes at its end, as without located impacts, and the report says so. Where a body turns so fast that it could
pass through another in that part it waits for the next step instead, where it is: it loses what is left of its time.
"""

from __future__ import annotations

import math

import numpy as np

from ..contacts.turning import any_outruns, known_span, quiet_part, quiet_span, turning_speed
from ..integrator.flight import copy_state
from ..jit import call_stage, kernel, stage
from ..memory import (
    address_of_states,
    bodies_of,
    header_at,
    report_of,
    states_of,
    table,
    traits_of,
    workspace_at,
)
from ..model import (
    CONTACT,
    CONTACTS_FULL,
    LAST,
    LEAST_BODIES,
    MEETS,
    MOST_FOLLOWED,
    NO_ROOM,
    OK,
    PASSES,
    SOLVER_FULL,
    TO_IMPACT,
    UNDECIDED,
    UNTOUCHED,
)
from .contacts import (
    follow_gone,
    forget_impulses,
    keep_finished,
    note_bound,
    part_with,
    pass_by,
    remember,
)
from .limits import A_PART, could_pass, most_spent, moves_mesh, spent_by
from .members import (
    gather,
    label_groups,
    link_past,
    move_support,
    numbers_in,
    recall,
    states_in,
)
from .part import MET, contacts_full, find, go_on, go_to_impact, step_part

# Labels of groups: the number of the island, plus DULL or LIVELY times the number of bodies while it waits, and DONE
# times in the end.
DONE = 3
# A part in which a contact that rests turns too far is tried again, shorter, so many times at most.
MOST_SHORTER = 4
# What is left of a step below this share of it is nothing.
INSTANT = 1e-13


@stage
def step_groups(address, workspace_address, world):
    """Step every island that waits; return the status, and ``num_kept`` contacts of the whole world in ``kept``."""
    header = header_at(address)
    workspace = workspace_at(workspace_address)
    group = numbers_in(header, workspace.group)
    waiting = workspace.waiting
    num_bodies = header.num_bodies
    # Parts count their islands in the same tables; from here on the label of a group says that it waits, or is done.
    keep_finished(workspace, table(workspace.waits, workspace.waits_size, np.int64))
    label_groups(header, workspace, world)
    link_past(header, workspace, world)
    for index in range(num_bodies):
        while num_bodies <= group[index] < DONE * num_bodies:
            overlap = report_of(header, world).penetration
            status = _step_group(address, workspace_address, world, group[index])
            if status == MET:
                report_of(header, world).penetration = overlap
            if status != OK and status != MET:
                workspace.starts = address_of_states(header, world)
                return status
    workspace.starts = address_of_states(header, world)
    workspace.waiting = waiting
    return OK


@kernel
def _step_group(address, workspace_address, world, label):
    """Step one group to the end; return a status, or MET after it has taken another island in."""
    header = header_at(address)
    workspace = workspace_at(workspace_address)
    begins = states_in(header, workspace.begins)
    ends = states_in(header, workspace.ends)
    members = numbers_in(header, workspace.members)
    contacts = table(workspace.contacts, workspace.contacts_size, CONTACT)
    report = report_of(header, world)
    count = _begin(header, workspace, world, label)
    overlap = report.penetration
    events = 0
    spent = 0
    most = most_spent(count)
    sight = math.inf
    # A group for the pile tier is not stopped at every touch; what rebounds is not for that tier, nor what is fast.
    crowd = header.step_pile != 0 and count >= LEAST_BODIES and traits_of(header, world).restitution == 0
    if crowd and count <= MOST_FOLLOWED:
        crowd = not any_outruns(bodies_of(header, world), begins, members, 0, count, header.time_step)
    while True:
        left = header.time_step - workspace.elapsed
        part = LAST if crowd or spent >= most else TO_IMPACT
        span = left
        if part == TO_IMPACT:
            span = min(left, sight, known_span(_fastest_turn(header, workspace, world, count)))
        if part == LAST and not crowd:
            span = min(left, quiet_span(_fastest_turn(header, workspace, world, count), header.time_step))
        status, num_contacts = step_part(address, workspace_address, world, label, count, part, span)
        in_parts = not moves_mesh(header, bodies_of(header, world), contacts, num_contacts)
        for _ in range(MOST_SHORTER):
            if status == OK and in_parts and part == TO_IMPACT and workspace.calm < workspace.span:
                status, num_contacts = step_part(address, workspace_address, world, label, count, part, workspace.calm)
        if status != OK:
            return status
        ends_here = workspace.span == left
        if ends_here and (part == LAST or workspace.waiting == 0):
            break
        if part == LAST:
            if not go_on(header, workspace, world, count, num_contacts, span):
                return contacts_full(workspace)
            continue
        bound = note_bound(header, workspace, num_contacts, count)
        outcome = call_stage(header.find_impact_time, address, workspace_address, world, num_contacts)
        if ends_here and outcome == PASSES:
            pass_by(header, workspace, world, num_contacts)
            break
        if outcome == UNDECIDED:
            # However fast a body whirls, only a part in which it turns little is stepped unseen; and what is looked
            # over next is not much longer, for all that it may sweep by the end of the step is a lot to look at.
            sight = quiet_part(_fastest_turn(header, workspace, world, count))
            span = min(left, sight)
            status, num_contacts = step_part(address, workspace_address, world, label, count, LAST, span)
            if status != OK:
                return status
            if span == left:
                break
            if not go_on(header, workspace, world, count, num_contacts, span):
                return contacts_full(workspace)
            spent += A_PART
            continue
        if workspace.impact_time > 0.0:
            status = go_to_impact(address, workspace_address, world, label, count, num_contacts, bound)
            if status != OK:
                return status
        if outcome == PASSES:
            spent += A_PART
            sight *= 2.0
            if spent < most:
                continue
        left = header.time_step - workspace.elapsed
        workspace.span = max(left, INSTANT * header.time_step)
        status, num_contacts = find(address, workspace_address, world, label, count)
        if status != OK:
            return status
        if outcome == MEETS:
            blow = call_stage(header.strike, address, workspace_address, world)
            if blow == NO_ROOM:
                return SOLVER_FULL
            if not part_with(workspace, num_contacts):
                return contacts_full(workspace)
            remember(workspace, contacts, num_contacts, False)
            events += 1
            spent += spent_by(blow, count)
            if blow == UNTOUCHED and workspace.impact_time <= INSTANT * header.time_step:
                # The search sees a contact that the impact does not: it would see it again.
                spent = most
        waits = spent >= most and could_pass(header, workspace, world, num_contacts, left)
        if waits or left <= INSTANT * header.time_step:
            for number in range(count):
                copy_state(begins[members[number]], ends[members[number]])
            if waits:
                forget_impulses(contacts, num_contacts)
            break
    report.events += events
    if spent >= most:
        report.event_limit += 1
    # Only where the step ends, not in parts that were tried or led on.
    for index in range(num_contacts):
        overlap = max(overlap, -contacts[index].gap)
    report.penetration = overlap
    return _finish(header, workspace, world, label, count, num_contacts)


@kernel
def _begin(header, workspace, world, label):
    """Put the clock of a group to the start of the step; return how many bodies it has."""
    states = states_of(header, world)
    begins = states_in(header, workspace.begins)
    members = numbers_in(header, workspace.members)
    reached = table(workspace.reached, workspace.reached_size, np.float64)
    count = gather(header, workspace, label)
    for number in range(count):
        body = members[number]
        copy_state(states[body], begins[body])
        for axis in range(3):
            reached[6 * body + axis] = math.inf
            reached[6 * body + 3 + axis] = -math.inf
    recall(header, workspace, world, label, count)
    workspace.num_gone = 0
    workspace.foreseen = 0
    workspace.starts = workspace.begins
    workspace.elapsed = 0.0
    move_support(header, workspace, world)
    return count


@kernel
def _fastest_turn(header, workspace, world, count):
    """[rad/s] at which the fastest body of the group shows other faces than its contacts know of."""
    bodies = bodies_of(header, world)
    begins = states_in(header, workspace.begins)
    members = numbers_in(header, workspace.members)
    fastest = 0.0
    for number in range(count):
        body = members[number]
        fastest = max(fastest, turning_speed(bodies[body], begins[body]))
    return fastest


@kernel
def _finish(header, workspace, world, label, count, num_contacts):
    """Keep the contacts of the step, and what the group has reached, for the rest of it; return a status."""
    group = numbers_in(header, workspace.group)
    members = numbers_in(header, workspace.members)
    boxes = table(workspace.boxes, workspace.boxes_size, np.float64)
    reached = table(workspace.reached, workspace.reached_size, np.float64)
    contacts = table(workspace.contacts, workspace.contacts_size, CONTACT)
    kept = table(workspace.kept, workspace.kept_size, CONTACT)
    gone = table(workspace.gone, workspace.gone_size, CONTACT)
    done = label + DONE * header.num_bodies
    if not part_with(workspace, num_contacts):
        return contacts_full(workspace)
    follow_gone(header, workspace, world)
    total = num_contacts + workspace.num_gone
    if workspace.num_kept + total > kept.shape[0]:
        workspace.detail = workspace.num_kept + total
        return CONTACTS_FULL
    for number in range(total):
        if number < num_contacts:
            kept[workspace.num_kept] = contacts[number]
        else:
            kept[workspace.num_kept] = gone[number - num_contacts]
            # What was out of reach does not overlap, whatever the sides say that it once lay on.
            kept[workspace.num_kept].gap = max(kept[workspace.num_kept].gap, 0.0)
        kept[workspace.num_kept].island = done
        workspace.num_kept += 1
    for number in range(count):
        body = members[number]
        group[body] = done
        for axis in range(6):
            boxes[6 * body + axis] = reached[6 * body + axis]
    return OK
