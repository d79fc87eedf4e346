"""Spinning bodies on the ground: the tippe top, Euler's disk, a coin that rolls in a circle."""

from __future__ import annotations

import math
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ..scene import Material, Scene, UniformGravity
from ..shapes import Compound, Cylinder, Plane, Sphere
from .case import EVERY_STEP, GRAVITY, HardCase, Recording, about, rotation_matrices

# The tippe top of Leine and Glocker (2003): a heavy half below, a stem above; two spheres on one axis.
# With their friction of 0.3 and tilt of 0.1, and friction that knows no spin about the normal, it slides for 36 ms,
# then rolls, and a rolling top does not turn over. With 0.03 and 0.3 it slides all the way.
TOP_MASS, TOP_INERTIA, TOP_SPIN = 6e-3, (8e-7, 8e-7, 7e-7), 180.0  # [kg], [kg m^2], [rad/s]
TOP_CENTER, TOP_RADIUS, STEM_CENTER, STEM_RADIUS = (
    3e-3,
    1.5e-2,
    1.6e-2,
    5e-3,
)  # [m] on the axis, from the mass centre
ROLLING_TOP, SLIDING_TOP = (0.3, 0.1), (0.03, 0.3)  # friction, tilt [rad]
INVERSION_TIME = 9.5204025706  # [s] until the axis of the sliding top is level; tests/oracles/top_oracle.py


def tippe_top(friction: float, tilt: float) -> Scene:
    """A top that may turn over: its mass centre climbs while it spins and slides."""
    upright = (1.0, 0.0, 0.0, 0.0)
    shape = Compound(
        [(Sphere(TOP_RADIUS), (0, 0, TOP_CENTER), upright), (Sphere(STEM_RADIUS), (0, 0, STEM_CENTER), upright)]
    )
    material = Material(friction=friction)
    scene = Scene()
    scene.add_field(UniformGravity((0.0, 0.0, -GRAVITY)))
    scene.add_body(Plane(), motion="static", material=material)
    axis = np.array([0.0, -math.sin(tilt), math.cos(tilt)])
    scene.add_body(
        shape, mass=TOP_MASS, inertia=TOP_INERTIA, center_of_mass=(0, 0, 0),
        position=(0, 0, TOP_RADIUS - TOP_CENTER * math.cos(tilt)), orientation=about((1.0, 0.0, 0.0), tilt),
        angular_velocity=TOP_SPIN * axis, material=material,
    )  # fmt: skip
    return scene


def axis_heights(recording: Recording) -> NDArray[np.float64]:
    """(n,) vertical component of the top's axis."""
    return rotation_matrices(recording.orientation[:, 1])[:, 2, 2]


def measure_tippe_top(recording: Recording) -> dict[str, float]:
    height = axis_heights(recording)
    below = np.flatnonzero(height < 0.0)
    if not len(below):
        return {"time of inversion": math.inf}
    k = below[0]
    part = height[k - 1] / (height[k - 1] - height[k])
    time = recording.time[k - 1] + part * (recording.time[k] - recording.time[k - 1])
    return {"time of inversion": abs(time / INVERSION_TIME - 1.0), "lowest axis": float(height[-1])}


def measure_rolling_top(recording: Recording) -> dict[str, float]:
    """How much lower the axis came than it was at the start, where the true motion is at its lowest."""
    return {"fall of the axis": max(0.0, math.cos(ROLLING_TOP[1]) - float(axis_heights(recording).min()))}


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
    around = [math.sin(theta) * np.cos(rate * time), math.sin(theta) * np.sin(rate * time)]
    truth = np.stack([*around, np.full(len(time), math.cos(theta))], axis=1)
    circle = speed / rate * np.stack([np.cos(rate * time) - 1.0, np.sin(rate * time)], axis=1)
    tilt = np.arctan2(np.linalg.norm(axes[:, :2], axis=1), axes[:, 2])
    return {
        "tilt": np.abs(tilt - theta).max(),
        "axis": np.linalg.norm(axes - truth, axis=1).max(),
        "position": np.linalg.norm(place[:, :2] - circle, axis=1).max(),
    }


CASES = (
    HardCase(
        "tippe_top", 25, "Tippe top, 180 rad/s, mu 0.03", "time of inversion by DOP853 on the reduced equations",
        partial(tippe_top, *SLIDING_TOP), 12.0, measure_tippe_top, "time of inversion", "relative", 1e-2,
        sampling=EVERY_STEP, goal={240: 1e-3},
    ),
    HardCase(
        "tippe_top_rolls", 25, "Tippe top, 180 rad/s, mu 0.3", "rolls after 36 ms; its axis does not fall",
        partial(tippe_top, *ROLLING_TOP), 3.0, measure_rolling_top, "fall of the axis", "of its length", 1e-3,
        sampling=EVERY_STEP, goal={240: 1e-4}, order=False,
    ),
    *(
        HardCase(
            kind, 26, title, "steady rolling, closed form", partial(disk, kind), 2.0, partial(measure_disk, kind),
            "tilt", "rad", 1e-3, sampling=1.0 / 30.0, goal={240: 1e-4},
        )
        for kind, title in (("euler_disk", "Euler's disk at 20 degrees"), ("coin", "A coin that rolls in a circle"))
    ),
)  # fmt: skip
