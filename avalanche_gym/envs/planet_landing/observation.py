"""What the policy of PlanetLanding sees: everything in the frame of the lander, so that all places look alike."""

from __future__ import annotations

import numpy as np

from ...physics.jit import kernel
from ...physics.maths import quat, vec3
from ..lane_kernels import put, put_vector
from .scene import PLANET_RADIUS

# Scales that bring observations to the size of 1.
LENGTH = 5.0  # [m]
NEAR = 0.5  # [m] clearance of the feet
SPEED = 4.0  # [m/s]
SPIN = 1.0  # [rad/s]

SIZE = 1 + 2 + 3 + 3 + 3 + 1 + 4 + 1 + 3
BOUND = np.concatenate(
    [
        np.full(1, 10.0),  # altitude [LENGTH]
        np.full(2, 5.0),  # vertical and horizontal speed [SPEED]
        np.full(3, 5.0),  # velocity, frame of the lander [SPEED]
        np.full(3, 1.0),  # vertical, frame of the lander
        np.full(3, 10.0),  # angular velocity, frame of the lander [SPIN]
        np.full(1, 1.0),  # fuel left, share of a full tank
        np.full(4, 2.0),  # clearance of the feet [NEAR]
        np.full(1, 1.0),  # 1: a foot is down
        np.full(3, 10.0),  # from the lander to the site along the ground, frame of the lander [LENGTH]; zero without
    ]
).astype(np.float32)


@kernel
def way_to_site(lane, up):
    """[m] vector along the ground, at the place ``up``, whose length is the distance to the site; zero without one."""
    site = vec3.load(lane.site)
    along = vec3.add_scaled(site, -vec3.dot(site, up), up)
    sine = vec3.norm(along)
    if sine == 0.0:
        return vec3.ZERO
    return vec3.scale(PLANET_RADIUS * np.arctan2(sine, vec3.dot(site, up)) / sine, along)


@kernel
def observe_lane(row, bound, lane, position, orientation, velocity, spin):
    """Write the observation of one lane."""
    up = vec3.normalize(position)
    climb = vec3.dot(velocity, up)
    at = put(row, 0, lane.altitude / LENGTH, bound)
    at = put(row, at, climb / SPEED, bound)
    at = put(row, at, vec3.norm(vec3.add_scaled(velocity, -climb, up)) / SPEED, bound)
    at = put_vector(row, at, SPEED, quat.rotate_inverse(orientation, velocity), bound)
    at = put_vector(row, at, 1.0, quat.rotate_inverse(orientation, up), bound)
    at = put_vector(row, at, SPIN, quat.rotate_inverse(orientation, spin), bound)
    at = put(row, at, lane.fuel / lane.full if lane.full > 0.0 else 0.0, bound)
    for index in range(4):
        at = put(row, at, lane.feet[index] / NEAR, bound)
    at = put(row, at, float(lane.touching), bound)
    put_vector(row, at, LENGTH, quat.rotate_inverse(orientation, way_to_site(lane, up)), bound)
