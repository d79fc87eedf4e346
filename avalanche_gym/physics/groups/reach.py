"""What the bodies of a group may reach within a part of the step."""

from __future__ import annotations

import numpy as np

from ..broad_phase.all_pairs import overlap
from ..broad_phase.bounds import swept_box
from ..broad_phase.grid import list_within
from ..integrator.flight import copy_state
from ..jit import kernel
from ..maths import vec3
from ..memory import bodies_of, colliders_of, grid_of, grid_tables_of, states_of, table
from ..model import DYNAMIC, LIVELY, REMOVED, SLACK
from .members import APART, numbers_in, states_in


@kernel
def find_group_pairs(header, workspace, world, label, count):
    """Fill ``boxes`` of the group and ``pairs`` with all that any of its bodies may reach; return their number."""
    bodies = bodies_of(header, world)
    colliders = colliders_of(header)
    begins = states_in(header, workspace.begins)
    flown = states_in(header, workspace.flown)
    members = numbers_in(header, workspace.members)
    group = numbers_in(header, workspace.group)
    near = numbers_in(header, workspace.near)
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
        _note_stray(header, workspace, world, body, box)
    # A body that is only stopped goes less far than it would have flown, which met nobody.
    dull = label < LIVELY * header.num_bodies
    num_pairs = 0
    for number in range(count):
        one = members[number]
        if bodies[one].num_colliders == 0:
            continue
        for index in range(_list_near(header, workspace, world, one)):
            other = near[index]
            mine = group[other] == label
            if bodies[other].num_colliders == 0 or bodies[other].motion == REMOVED or (mine and other <= one):
                continue
            if group[other] == APART:
                continue
            if dull and not mine and bodies[other].motion == DYNAMIC:
                continue
            if bodies[other].motion == DYNAMIC and not mine:
                _place_stranger(header, workspace, world, other)
            if 2 * num_pairs + 1 < pairs.shape[0]:
                pairs[2 * num_pairs] = min(one, other)
                pairs[2 * num_pairs + 1] = max(one, other)
            num_pairs += 1
    return num_pairs


@kernel
def _note_stray(header, workspace, world, body, box):
    """List a body that leaves the bounds by which the grid finds it: it is compared with each that asks."""
    stray = numbers_in(header, workspace.stray)
    if header.num_slots == 0 or stray[body] != 0:
        return
    proxies, _, _ = grid_tables_of(header, world)
    fat = proxies[body].box
    inside = True
    for axis in range(3):
        inside = inside and fat[axis] <= box[axis] and box[3 + axis] <= fat[3 + axis]
    if not inside:
        stray[body] = 1
        numbers_in(header, workspace.strayed)[workspace.num_strayed] = body
        workspace.num_strayed += 1


@kernel
def _list_near(header, workspace, world, one):
    """Fill ``near`` with the bodies whose bounds meet those of one, in the order of their handles; return how many."""
    near = numbers_in(header, workspace.near)
    stray = numbers_in(header, workspace.stray)
    strayed = numbers_in(header, workspace.strayed)
    boxes = table(workspace.boxes, workspace.boxes_size, np.float64)
    count = np.int64(0)
    if header.num_slots == 0:
        for other in range(header.num_bodies):
            if other != one and overlap(boxes, one, other):
                near[count] = other
                count += 1
        return count
    proxies, cells, _ = grid_tables_of(header, world)
    listed = list_within(grid_of(header, world), proxies, cells, boxes[6 * one : 6 * one + 6], near)
    for index in range(listed):
        other = near[index]
        if other != one and stray[other] == 0 and overlap(boxes, one, other):
            count = _put_in_order(near, count, other)
    for index in range(workspace.num_strayed):
        other = strayed[index]
        if other != one and overlap(boxes, one, other):
            count = _put_in_order(near, count, other)
    return count


@kernel
def _put_in_order(near, count, other):
    """Insert a handle into near[:count]; what it takes the place of has been read."""
    place = count
    while place > 0 and near[place - 1] > other:
        near[place] = near[place - 1]
        place -= 1
    near[place] = other
    return count + 1


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
