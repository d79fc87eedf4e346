"""What PushTerrain rewards: potentials that fall to zero on the way, so that no detour earns anything.

progress    distance of the body from the goal, decrease since the last step
approach    distance of the pusher from the point behind the body, decrease since the last step
effort      minus the mean square of the action
success     once, when the body is slow inside the goal
lost        once, when pusher or body leaves the terrain
"""

from __future__ import annotations

import math

from ...physics.jit import entry_point, kernel
from ...physics.maths import vec3
from .scene import EXTENT, MARGIN

TERMS = ("progress", "approach", "effort", "success", "lost")

PROGRESS = 4.0  # [1/m]
APPROACH = 1.0  # [1/m]
EFFORT = 0.002
SUCCESS = 5.0
LOST = -5.0
BEHIND = 0.3  # [m] from the middle of the body to the point behind it that the pusher is drawn to
GOAL_SPEED = 0.2  # [m/s] the body must be slower than this in the goal


@kernel
def potentials(lane, pusher, body):
    """Progress and approach: both grow towards zero."""
    dx, dy = lane.goal[0] - body[0], lane.goal[1] - body[1]
    distance = math.hypot(dx, dy)
    scale = BEHIND / max(distance, 1e-9)
    behind = math.hypot(body[0] - scale * dx - pusher[0], body[1] - scale * dy - pusher[1])
    return -PROGRESS * distance, -APPROACH * behind


@kernel
def is_outside(a):
    """Whether a point is too close to the rim, or beyond it."""
    return max(abs(a[0]), abs(a[1])) > 0.5 * EXTENT - MARGIN


@entry_point
def open_episode(mask, pusher, body, lanes, position):
    """Remember the potentials that the first step compares with."""
    for number in range(mask.shape[0]):
        if mask[number]:
            lane = lanes[number]
            progress, approach = potentials(
                lane, vec3.load(position[number, pusher]), vec3.load(position[number, body])
            )
            lane.potential[0] = progress
            lane.potential[1] = approach


@entry_point
def judge(pusher, body, actions, lanes, position, linear_velocity, terms, reward, terminated, success):
    """Write reward, terms and the ends of episodes of all lanes after a step."""
    for number in range(lanes.shape[0]):
        lane = lanes[number]
        pusher_place = vec3.load(position[number, pusher])
        body_place = vec3.load(position[number, body])
        progress, approach = potentials(lane, pusher_place, body_place)
        square = 0.0
        for axis in range(actions.shape[1]):
            action = min(max(actions[number, axis], -1.0), 1.0)
            square += action * action
        distance = math.hypot(lane.goal[0] - body_place[0], lane.goal[1] - body_place[1])
        slow = vec3.norm(vec3.load(linear_velocity[number, body])) < GOAL_SPEED
        success[number] = distance < lane.goal_radius and slow
        lost = is_outside(pusher_place) or is_outside(body_place)
        terminated[number] = success[number] or lost
        row = terms[number]
        row[0] = progress - lane.potential[0]
        row[1] = approach - lane.potential[1]
        row[2] = -EFFORT * square / actions.shape[1]
        row[3] = SUCCESS if success[number] else 0.0
        row[4] = LOST if lost else 0.0
        total = 0.0
        for term in range(row.shape[0]):
            total += row[term]
        reward[number] = total
        lane.potential[0] = progress
        lane.potential[1] = approach
