"""The reduced equations of a tippe top that slides or rolls on its large sphere, by DOP853 with switching events."""

from __future__ import annotations

import math

import numpy as np
from scipy.integrate import solve_ivp

from avalanche_gym.physics.scenes.case import GRAVITY
from avalanche_gym.physics.scenes.tops import TOP_CENTER, TOP_INERTIA, TOP_MASS, TOP_RADIUS

UP = np.array([0.0, 0.0, 1.0])
ACROSS, ALONG = TOP_INERTIA[0], TOP_INERTIA[2]
STILL = 1e-7  # [m/s] slip at which the contact is taken to stick; 1e-6 of the rim's speed


def cross(u, v):
    return np.array([u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]])


def spin_rate(axis, spin, torque, gyroscopic):
    """w' from L = I1 w + (I3 - I1) (w.e) e, L' = torque and I3 (w.e)' = torque.e."""
    turning = (torque @ axis) / ALONG * axis + gyroscopic * (spin @ axis) * cross(spin, axis)
    return (torque - (ALONG - ACROSS) * turning) / ACROSS


def contact_arm(axis):
    return TOP_CENTER * axis - TOP_RADIUS * UP


def slip(state):
    return state[3:5] + cross(state[6:], contact_arm(state[:3]))[:2]


def sliding(state, friction):
    """Rates while it slides: the force is N (n - mu u / |u|), and N keeps the sphere on the ground."""
    axis, spin = state[:3], state[6:]
    u = slip(state)
    direction = UP - friction * np.array([*u, 0.0]) / math.hypot(*u)
    free = spin_rate(axis, spin, np.zeros(3), 1.0)
    per_force = spin_rate(axis, spin, cross(contact_arm(axis), direction), 0.0)
    axis_rate = cross(spin, axis)
    rest = -GRAVITY + TOP_CENTER * (cross(free, axis)[2] + cross(spin, axis_rate)[2])
    force = -rest / (1.0 / TOP_MASS + TOP_CENTER * cross(per_force, axis)[2])
    return np.concatenate([axis_rate, force * direction / TOP_MASS - GRAVITY * UP, free + force * per_force])


def rolling_force(state):
    """The force (3,) [N] for which the point at the ground has no acceleration that slip would have."""
    axis, spin = state[:3], state[6:]
    arm = contact_arm(axis)
    free = spin_rate(axis, spin, np.zeros(3), 1.0)
    base = -GRAVITY * UP + cross(free, arm) + cross(spin, TOP_CENTER * cross(spin, axis))
    columns = [unit / TOP_MASS + cross(spin_rate(axis, spin, cross(arm, unit), 0.0), arm) for unit in np.eye(3)]
    return np.linalg.solve(np.stack(columns, axis=1), -base)


def rolling(state):
    axis, spin = state[:3], state[6:]
    force = rolling_force(state)
    rate = spin_rate(axis, spin, cross(contact_arm(axis), force), 1.0)
    return np.concatenate([cross(spin, axis), force / TOP_MASS - GRAVITY * UP, rate])


def event(function, direction):
    function.terminal, function.direction = True, direction
    return function


def top_motion(friction, tilt, spin, duration, tolerance=1e-10):
    """Time at which the axis is level (infinite if never), lowest axis height e_z, and the phases (mode, end [s])."""
    axis = np.array([0.0, -math.sin(tilt), math.cos(tilt)])
    state = np.concatenate([axis, np.zeros(3), spin * axis])
    time, mode, lowest, phases = 0.0, "slides", 1.0, []
    sticks = event(lambda t, s: math.hypot(*slip(s)) - STILL, -1)
    level = event(lambda t, s: s[2], -1)

    def spare(t, s):
        force = rolling_force(s)
        return friction * force[2] - math.hypot(force[0], force[1])

    lets_go = event(spare, -1)
    while time < duration:
        rates, end = (
            (lambda t, s: sliding(s, friction), sticks) if mode == "slides" else (lambda t, s: rolling(s), lets_go)
        )
        found = solve_ivp(
            rates, (time, duration), state, "DOP853", events=[end, level], rtol=tolerance, atol=1e-2 * tolerance
        )
        time, state, lowest = found.t[-1], found.y[:, -1].copy(), min(lowest, found.y[2].min())
        phases.append((mode, time))
        if len(found.t_events[1]):
            return time, 0.0, phases
        if mode == "slides" and spare(0.0, state) > 0.0:
            mode = "rolls"
        else:
            mode = "slides"
            force = rolling_force(state)[:2]
            state[3:5] -= 2.0 * STILL * force / math.hypot(*force)
    return math.inf, lowest, phases
