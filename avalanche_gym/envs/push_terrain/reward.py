"""What PushTerrain rewards: potentials that fall to zero on the way, so that no detour earns anything.

progress    distance of the body from the goal, decrease since the last step
approach    distance of the pusher from the point behind the body, decrease since the last step
effort      minus the mean square of the action
success     once, when the body is slow inside the goal
lost        once, when pusher or body leaves the terrain
"""

from __future__ import annotations

import math

from ...physics.jit import kernel
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


@kernel
def remember(lane, pusher, body):
    """Keep the potentials that the next step compares with."""
    progress, approach = potentials(lane, pusher, body)
    lane.potential[0] = progress
    lane.potential[1] = approach


@kernel
def judge_lane(lane, terms, action, pusher, body, body_velocity):
    """Write the terms of a step; return their sum, whether the episode is over, and whether it is a success."""
    before_progress, before_approach = lane.potential[0], lane.potential[1]
    remember(lane, pusher, body)
    square = 0.0
    for axis in range(action.shape[0]):
        clipped = min(max(action[axis], -1.0), 1.0)
        square += clipped * clipped
    distance = math.hypot(lane.goal[0] - body[0], lane.goal[1] - body[1])
    success = distance < lane.goal_radius and vec3.norm(body_velocity) < GOAL_SPEED
    lost = is_outside(pusher) or is_outside(body)
    terms[0] = lane.potential[0] - before_progress
    terms[1] = lane.potential[1] - before_approach
    terms[2] = -EFFORT * square / action.shape[0]
    terms[3] = SUCCESS if success else 0.0
    terms[4] = LOST if lost else 0.0
    total = 0.0
    for term in range(terms.shape[0]):
        total += terms[term]
    return total, success or lost, success
