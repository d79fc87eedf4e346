"""Spinning bodies on the ground: the tippe top, Euler's disk, a coin that rolls in a circle."""

from __future__ import annotations

import math
from functools import cache, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..scene import Material, Scene, UniformGravity
from ..shapes import Compound, Cylinder, Plane, Sphere
from .case import EVERY_STEP, GRAVITY, HardCase, Recording, about, rotation_matrices

# The tippe top of Leine and Glocker (2003): a heavy half below, a stem above; two spheres on one axis.
TOP_MASS, TOP_INERTIA, TOP_FRICTION = 6e-3, (8e-7, 8e-7, 7e-7), 0.3  # [kg], [kg m^2]
TOP_CENTER, TOP_RADIUS, STEM_CENTER, STEM_RADIUS = 3e-3, 1.5e-2, 1.6e-2, 5e-3  # [m] along the axis, from the mass centre
TOP_SPIN, TOP_TILT = 180.0, 0.1  # [rad/s], [rad]


def tippe_top() -> Scene:
    """A top that turns over: its mass centre climbs while it spins."""
    upright = (1.0, 0.0, 0.0, 0.0)
    shape = Compound(
        [(Sphere(TOP_RADIUS), (0, 0, TOP_CENTER), upright), (Sphere(STEM_RADIUS), (0, 0, STEM_CENTER), upright)]
    )
    material = Material(friction=TOP_FRICTION)
    scene = Scene()
    scene.add_field(UniformGravity((0.0, 0.0, -GRAVITY)))
    scene.add_body(Plane(), motion="static", material=material)
    axis = np.array([0.0, -math.sin(TOP_TILT), math.cos(TOP_TILT)])
    scene.add_body(
        shape, mass=TOP_MASS, inertia=TOP_INERTIA, center_of_mass=(0, 0, 0),
        position=(0, 0, TOP_RADIUS - TOP_CENTER * math.cos(TOP_TILT)), orientation=about((1.0, 0.0, 0.0), TOP_TILT),
        angular_velocity=TOP_SPIN * axis, material=material,
    )  # fmt: skip
    return scene


def tippe_top_rates(time: float, state: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rate of (axis, velocity, angular velocity), each (3,), world frame, while the large sphere slides on the ground.

    m v' = N (n - mu u / |u|) - m g n and, the top being symmetric, L' = r x (N (n - mu u / |u|)) with
    L = I1 w + (I3 - I1) (w.e) e; N keeps the sphere on the ground.
    """
    axis, velocity, spin = state[:3], state[3:6], state[6:]
    up = np.array([0.0, 0.0, 1.0])
    across, along = TOP_INERTIA[0], TOP_INERTIA[2]
    arm = TOP_CENTER * axis - TOP_RADIUS * up
    slip = velocity + np.cross(spin, arm)
    direction = up - TOP_FRICTION * np.array([slip[0], slip[1], 0.0]) / math.hypot(slip[0], slip[1])
    axis_rate = np.cross(spin, axis)

    def spin_rate(torque: NDArray[np.float64], drive: float) -> NDArray[np.float64]:
        # I1 w' = torque - (I3 - I1) [(w.e)' e + (w.e) e'], with I3 (w.e)' = torque.e.
        turning = (torque @ axis) / along * axis + drive * (spin @ axis) * axis_rate
        return (torque - (along - across) * turning) / across

    def lift(rate: NDArray[np.float64]) -> float:
        return float(TOP_CENTER * np.cross(rate, axis)[2])

    free = spin_rate(np.zeros(3), 1.0)
    per_force = spin_rate(np.cross(arm, direction), 0.0)
    # The height of the large sphere's centre stays: v_z' + (w' x a e)_z + (w x (w x a e))_z = 0.
    rest = -GRAVITY + lift(free) + TOP_CENTER * float(np.cross(spin, axis_rate)[2])
    force = -rest / (1.0 / TOP_MASS + lift(per_force))
    acceleration = force * direction / TOP_MASS - GRAVITY * up
    return np.concatenate([axis_rate, acceleration, free + force * per_force])


@cache
def inversion_time() -> float:
    """[s] at which the axis of the top is level, by DOP853."""
    from scipy.integrate import solve_ivp

    axis = np.array([0.0, -math.sin(TOP_TILT), math.cos(TOP_TILT)])

    def level(time: float, state: Any) -> float:
        return float(state[2])

    level.terminal = True  # type: ignore[attr-defined]
    start = np.concatenate([axis, np.zeros(3), TOP_SPIN * axis])
    found = solve_ivp(tippe_top_rates, (0.0, 10.0), start, "DOP853", events=level, rtol=1e-12, atol=1e-13)
    return float(found.t_events[0][0])


def measure_tippe_top(recording: Recording) -> dict[str, float]:
    height = rotation_matrices(recording.orientation[:, 1])[:, 2, 2]
    below = np.flatnonzero(height < 0.0)
    if not len(below):
        return {"time of inversion": math.inf}
    k = below[0]
    part = height[k - 1] / (height[k - 1] - height[k])
    time = recording.time[k - 1] + part * (recording.time[k] - recording.time[k - 1])
    return {"time of inversion": abs(time / inversion_time() - 1.0), "lowest axis": float(height[-1])}


# A disk that rolls steadily: its axis e goes round the vertical at the rate W at the angle theta, and it spins about e
# at the rate s. The equations of no slip and of angular momentum about the mass centre are linear in s for given W.
DISK_RADIUS, DISK_HALF, DISK_MASS = 0.1, 0.005, 1.0
DISK_ACROSS = DISK_MASS * (DISK_RADIUS**2 / 4.0 + DISK_HALF**2 / 3.0)
DISK_ALONG = DISK_MASS * DISK_RADIUS**2 / 2.0


def steady_spin(theta: float, rate: float) -> tuple[float, float]:
    """Spin s [rad/s] about the axis, and speed [m/s] of the mass centre round its circle."""
    sine, cosine = math.sin(theta), math.cos(theta)
    x = DISK_RADIUS * cosine - DISK_HALF * sine  # [m] from the mass centre to the contact, outwards
    z = DISK_RADIUS * sine + DISK_HALF * cosine  # and down
    factor = rate * (sine * DISK_ALONG + z * DISK_MASS * DISK_RADIUS)
    rest = x * DISK_MASS * (GRAVITY + z * rate**2) + rate**2 * sine * cosine * (DISK_ALONG - DISK_ACROSS)
    spin = -rest / factor
    return spin, -(rate * x + spin * DISK_RADIUS)


def still_rate(theta: float) -> float:
    """Rate W [rad/s] at which the mass centre stands still: Euler's disk."""
    sine, cosine = math.sin(theta), math.cos(theta)
    moment = DISK_MASS * GRAVITY * (DISK_RADIUS * cosine / sine - DISK_HALF)
    return math.sqrt(moment / (DISK_ACROSS * cosine - DISK_ALONG * DISK_HALF * sine / DISK_RADIUS))


DISKS = {"euler_disk": (math.radians(20.0), still_rate(math.radians(20.0))), "coin": (math.radians(75.0), 1.0)}


def disk(kind: str) -> Scene:
    """A disk in steady rolling, its axis towards x at the start."""
    theta, rate = DISKS[kind]
    spin, speed = steady_spin(theta, rate)
    axis = np.array([math.sin(theta), 0.0, math.cos(theta)])
    material = Material(friction=0.8)
    scene = Scene()
    scene.add_field(UniformGravity((0.0, 0.0, -GRAVITY)))
    scene.add_body(Plane(), motion="static", material=material)
    height = DISK_RADIUS * math.sin(theta) + DISK_HALF * math.cos(theta)
    scene.add_body(
        Cylinder(DISK_RADIUS, DISK_HALF), mass=DISK_MASS, position=(0, 0, height),
        orientation=about((0.0, 1.0, 0.0), theta), linear_velocity=(0.0, speed, 0.0),
        angular_velocity=rate * np.array([0.0, 0.0, 1.0]) + spin * axis, material=material,
    )  # fmt: skip
    return scene


def measure_disk(kind: str, recording: Recording) -> dict[str, float]:
    theta, rate = DISKS[kind]
    speed = steady_spin(theta, rate)[1]
    time, place = recording.time, recording.position[:, 1]
    axes = rotation_matrices(recording.orientation[:, 1])[:, :, 2]
    truth = np.stack(
        [math.sin(theta) * np.cos(rate * time), math.sin(theta) * np.sin(rate * time), np.full(len(time), math.cos(theta))],
        axis=1,
    )
    circle = speed / rate * np.stack([np.cos(rate * time) - 1.0, np.sin(rate * time)], axis=1)
    tilt = np.arctan2(np.linalg.norm(axes[:, :2], axis=1), axes[:, 2])
    return {
        "tilt": np.abs(tilt - theta).max(),
        "axis": np.linalg.norm(axes - truth, axis=1).max(),
        "position": np.linalg.norm(place[:, :2] - circle, axis=1).max(),
    }


CASES = (
    HardCase(
        "tippe_top", 25, "Tippe top, 180 rad/s", "time of inversion by DOP853 on the reduced equations", tippe_top, 3.0,
        measure_tippe_top, "time of inversion", "relative", 1e-2, sampling=EVERY_STEP, goal={240: 1e-3},
    ),
    *(
        HardCase(
            kind, 26, title, "steady rolling, closed form", partial(disk, kind), 2.0, partial(measure_disk, kind),
            "tilt", "rad", 1e-3, sampling=1.0 / 30.0, goal={240: 1e-4},
        )
        for kind, title in (("euler_disk", "Euler's disk at 20 degrees"), ("coin", "A coin that rolls in a circle"))
    ),
)  # fmt: skip
