"""What the policy of PushTerrain sees."""

from __future__ import annotations

import numpy as np

from ...physics.jit import kernel
from ...physics.maths import quat, vec3
from ..lane_kernels import put, put_vector
from .scene import height_at

PATCH = 5  # heights along x and y, centred on the body
PATCH_SPACING = 0.3  # [m]

# Scales that bring observations to the size of 1, and bounds in those scales.
LENGTH = 1.0  # [m]
SPEED = 1.0  # [m/s]
SPIN = 5.0  # [rad/s]
HEIGHT = 0.2  # [m] of the terrain above the place of the body

SIZE = 3 + 3 + 2 + 2 + 3 + 6 + 3 + PATCH * PATCH
BOUND = np.concatenate(
    [
        np.full(3, 10.0),  # pusher - body [LENGTH]
        np.full(3, 5.0),  # velocity of the pusher [SPEED]
        np.full(2, 10.0),  # goal - body, x and y [LENGTH]
        np.full(2, 1.0),  # direction to the goal
        np.full(3, 5.0),  # velocity of the body [SPEED]
        np.full(6, 1.0),  # x and z axes of the body
        np.full(3, 5.0),  # angular velocity of the body [SPIN]
        np.full(PATCH * PATCH, 10.0),  # heights around the body [HEIGHT], row by row along y
    ]
).astype(np.float32)


@kernel
def observe_lane(row, bound, lane, pusher, pusher_velocity, body, body_orientation, body_velocity, body_spin, heights):
    """Write the observation of one lane."""
    at = put_vector(row, 0, LENGTH, vec3.sub(pusher, body), bound)
    at = put_vector(row, at, SPEED, pusher_velocity, bound)
    to_goal = (lane.goal[0] - body[0], lane.goal[1] - body[1], 0.0)
    direction = vec3.normalize(to_goal)
    for axis in range(2):
        put(row, at + axis, to_goal[axis] / LENGTH, bound)
        put(row, at + 2 + axis, direction[axis], bound)
    at = put_vector(row, at + 4, SPEED, body_velocity, bound)
    at = put_vector(row, at, 1.0, quat.rotate(body_orientation, (1.0, 0.0, 0.0)), bound)
    at = put_vector(row, at, 1.0, quat.rotate(body_orientation, (0.0, 0.0, 1.0)), bound)
    at = put_vector(row, at, SPIN, body_spin, bound)
    ground = height_at(heights, body[0], body[1])
    for i in range(PATCH):
        y = body[1] + (i - PATCH // 2) * PATCH_SPACING
        for j in range(PATCH):
            x = body[0] + (j - PATCH // 2) * PATCH_SPACING
            put(row, at, (height_at(heights, x, y) - ground) / HEIGHT, bound)
            at += 1
