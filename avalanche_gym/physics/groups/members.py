"""Which bodies a group has, what any of them may reach within a part of the step, and whom it meets there."""

from __future__ import annotations

import numpy as np

from ..broad_phase.all_pairs import overlap
from ..broad_phase.bounds import swept_box
from ..contacts.prediction import SLACK
from ..jit import kernel
from ..maths import quat, vec3
from ..memory import bodies_of, colliders_of, states_of, table
from ..model import BODY_STATE, CONTACT, DYNAMIC, LIVELY, REMOVED

# The group of what the pile tier has stepped, and of what is asleep: it is not stopped for those who come near it, and
# what they meet is found in the next step.
APART = -2


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
def states_in(header, address):
    return table(address, header.num_bodies, BODY_STATE)


@kernel
def numbers_in(header, address):
    return table(address, header.num_bodies, np.int64)


@kernel
def gather(header, workspace, label):
    """List the bodies of a group; return their number."""
    group = numbers_in(header, workspace.group)
    members = numbers_in(header, workspace.members)
    count = 0
    for index in range(header.num_bodies):
        if group[index] == label:
            members[count] = index
            count += 1
    return count


@kernel
def find_group_pairs(header, workspace, world, label, count):
    """Fill ``boxes`` of the group and ``pairs`` with all that any of its bodies may reach; return their number."""
    bodies = bodies_of(header, world)
    colliders = colliders_of(header)
    begins = states_in(header, workspace.begins)
    flown = states_in(header, workspace.flown)
    members = numbers_in(header, workspace.members)
    group = numbers_in(header, workspace.group)
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
    ends = states_in(header, workspace.ends)
    begins = states_in(header, workspace.begins)
    flown = states_in(header, workspace.flown)
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
def meets(header, workspace, world, label, num_contacts):
    """Whether a contact reaches a body of another group; that group and this one become one."""
    bodies = bodies_of(header, world)
    contacts = table(workspace.contacts, workspace.contacts_size, CONTACT)
    group = numbers_in(header, workspace.group)
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
    group = numbers_in(header, workspace.group)
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
