"""What the policy of PlanetLanding sees: everything in the frame of the lander, so that all places look alike."""

from __future__ import annotations

import numpy as np

from ...physics.jit import entry_point, kernel
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


@entry_point
def observe(mask, lander, lanes, position, orientation, linear_velocity, angular_velocity, bound, rows):
    """Write the observations of the lanes of the mask."""
    for number in range(mask.shape[0]):
        if not mask[number]:
            continue
        lane, row = lanes[number], rows[number]
        q = quat.load(orientation[number, lander])
        velocity = vec3.load(linear_velocity[number, lander])
        up = vec3.normalize(vec3.load(position[number, lander]))
        climb = vec3.dot(velocity, up)
        put(row, 0, lane.altitude / LENGTH, bound)
        put(row, 1, climb / SPEED, bound)
        put(row, 2, vec3.norm(vec3.add_scaled(velocity, -climb, up)) / SPEED, bound)
        at = put_vector(row, 3, SPEED, quat.rotate_inverse(q, velocity), bound)
        at = put_vector(row, at, 1.0, quat.rotate_inverse(q, up), bound)
        spin = vec3.load(angular_velocity[number, lander])
        at = put_vector(row, at, SPIN, quat.rotate_inverse(q, spin), bound)
        put(row, at, lane.fuel / lane.full, bound)
        for index in range(4):
            put(row, at + 1 + index, lane.feet[index] / NEAR, bound)
        put(row, at + 5, float(lane.touching), bound)
        put_vector(row, at + 6, LENGTH, quat.rotate_inverse(q, way_to_site(lane, up)), bound)
