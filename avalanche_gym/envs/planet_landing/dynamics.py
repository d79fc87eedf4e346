"""Thrust, attitude impulses, and what is noticed after each physics step: clearance of the feet, touch, crash."""

from __future__ import annotations

import math

from ...physics.jit import entry_point, kernel
from ...physics.maths import quat, vec3
from .ground import altitude_of, clearance_of, facet_below
from .scene import FEET, FOOT, LANDER_MASS, LEG_RADIUS

MAX_THRUST = 2.5  # [m/s^2] 2.5 times the gravity at the surface
MAX_TURN = 0.2  # [rad/s] change of the angular velocity about each body axis in a control step at action 1

TOUCH_CLEARANCE = 0.02  # [m] a foot closer to the ground than this is down
CRASH_SPEED = 0.8  # [m/s] a touch this fast is a crash
CRASH_TILT = math.radians(45.0)  # touching the ground with this tilt is a crash: the lander topples
REST_SPEED = 0.05  # [m/s]
REST_SPIN = 0.1  # [rad/s]
REST_TILT = math.radians(15.0)
REST_FEET = 3  # that must be down

_FEET = tuple(tuple(float(value) for value in foot) for foot in FEET)


@entry_point
def thrust(actions, number_of_step, interval, step, lander, inertia, lanes, orientation, impulses):
    """Write the impulses of one physics step; an empty tank gives no thrust.

    Args:
        actions: (lanes, 4) throttle and turns about the body axes.
        number_of_step: of the physics step in the control step, from 0.
        interval: [s] of a control step.
        step: [s] of a physics step.
        lander: handle.
        inertia: (3,) [kg m^2] principal, body axes.
        lanes: (lanes,) records.
        orientation: (lanes, bodies, 4).
        impulses: (lanes, bodies, 6) written.
    """
    share = step / interval
    for number in range(lanes.shape[0]):
        lane = lanes[number]
        if number_of_step == 0:
            lane.burnt = 0.0
            lane.fastest = 0.0
        q = quat.load(orientation[number, lander])
        throttle = 0.5 * (1.0 + min(max(actions[number, 0], -1.0), 1.0))
        change = min(throttle * MAX_THRUST * step, lane.fuel)
        lane.fuel -= change
        lane.burnt += change
        push = quat.rotate(q, (0.0, 0.0, LANDER_MASS * change))
        x = share * MAX_TURN * inertia[0] * min(max(actions[number, 1], -1.0), 1.0)
        y = share * MAX_TURN * inertia[1] * min(max(actions[number, 2], -1.0), 1.0)
        z = share * MAX_TURN * inertia[2] * min(max(actions[number, 3], -1.0), 1.0)
        turn = quat.rotate(q, (x, y, z))
        row = impulses[number, lander]
        for axis in range(3):
            row[axis] = push[axis]
            row[3 + axis] = turn[axis]


@kernel
def tilt_of(position, orientation):
    """Cosine of the angle between body axis and vertical."""
    return vec3.dot(vec3.normalize(position), quat.rotate(orientation, (0.0, 0.0, 1.0)))


@kernel
def measure_lane(lane, position, orientation, directions, faces, centers, planes):
    """Update altitude and clearance of the feet."""
    for index in range(5):  # the four feet, then the middle: one loop, so that the search is compiled in once
        point = position
        if index < 4:
            point = vec3.add(position, quat.rotate(orientation, _FEET[index]))
        plane = planes[facet_below(point, directions, faces, centers, planes)]
        if index < 4:
            lane.feet[index] = clearance_of(point, plane) - LEG_RADIUS
        else:
            lane.altitude = altitude_of(point, plane) + FOOT[2] - LEG_RADIUS


@kernel
def feet_down(lane):
    """How many feet are on the ground."""
    down = 0
    for index in range(4):
        if lane.feet[index] < TOUCH_CLEARANCE:
            down += 1
    return down


@entry_point
def watch(mask, opening, lander, lanes, position, orientation, linear_velocity, directions, faces, centers, planes):
    """After a physics step: who touches the ground, how fast it came, and whether it survives that.

    With ``opening`` 1, at the start of an episode, only altitude, clearance and speed are measured.
    """
    for number in range(mask.shape[0]):
        if not mask[number]:
            continue
        lane = lanes[number]
        place = vec3.load(position[number, lander])
        q = quat.load(orientation[number, lander])
        measure_lane(lane, place, q, directions, faces, centers, planes)
        before = lane.speed
        lane.speed = vec3.norm(vec3.load(linear_velocity[number, lander]))
        if opening == 1:
            continue
        touching = feet_down(lane) > 0
        if touching:
            if lane.touching == 0:
                lane.touchdown = max(lane.touchdown, before)
            if lane.touchdown >= CRASH_SPEED or tilt_of(place, q) < math.cos(CRASH_TILT):
                lane.crashed = 1
        lane.touching = 1 if touching else 0
        lane.fastest = max(lane.fastest, lane.speed)


@kernel
def is_resting(lane, position, orientation, spin):
    """Whether the lander stood still through the control step."""
    return (
        feet_down(lane) >= REST_FEET
        and lane.fastest < REST_SPEED
        and vec3.norm(spin) < REST_SPIN
        and tilt_of(position, orientation) > math.cos(REST_TILT)
    )
