"""Free flight: the parabola, free rotation, orbits. What the engine should get to round-off at every step size."""

from __future__ import annotations

import math
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ..scene import Material, PointGravity, Scene, UniformGravity
from ..shapes import Box, Sphere
from .case import GRAVITY, HardCase, Recording, angle_between, rotation_matrices
from .flight_reference import apoapsis_start, free_rotation, kepler_motion, planet_bounces

START, THROW, SPIN = np.array([1.0, 2.0, 3.0]), np.array([3.0, -2.0, 10.0]), np.array([0.3, 0.2, 0.1])


def throw() -> Scene:
    """A box thrown up; it turns too."""
    scene = Scene()
    scene.add_field(UniformGravity((0.0, 0.0, -GRAVITY)))
    scene.add_body(Box((0.1, 0.2, 0.3)), mass=1.0, position=START, linear_velocity=THROW, angular_velocity=SPIN)
    return scene


def measure_throw(recording: Recording) -> dict[str, float]:
    time = recording.time[:, None]
    parabola = START + THROW * time + 0.5 * np.array([0.0, 0.0, -GRAVITY]) * time**2
    return {"position": np.abs(recording.position[:, 0] - parabola).max()}


TUMBLERS = {
    # inertia [kg m^2], angular velocity [rad/s]
    "sphere": ((0.2, 0.2, 0.2), (1.0, 2.0, 3.0)),
    "symmetric": ((0.2, 0.2, 0.3), (1.0, 2.0, 3.0)),
    "triaxial": ((0.1, 0.2, 0.3), (1.0, 2.0, 3.0)),
    "dzhanibekov": ((0.1, 0.2, 0.3), (0.05, 5.0, 0.0)),
}


def tumbler(kind: str) -> Scene:
    """A body that turns freely; the last kind about its middle axis, which it leaves again and again."""
    inertia, spin = TUMBLERS[kind]
    scene = Scene()
    scene.add_body(Sphere(0.1), mass=1.0, inertia=inertia, angular_velocity=spin)
    return scene


def measure_tumbler(kind: str, recording: Recording) -> dict[str, float]:
    inertia, spin = (np.array(values) for values in TUMBLERS[kind])
    attitude = free_rotation(*TUMBLERS[kind], tuple(recording.time.tolist()))
    turns = rotation_matrices(recording.orientation[:, 0])
    body_rate = np.einsum("nji,nj->ni", turns, recording.angular_velocity[:, 0])
    momentum = np.einsum("nij,nj->ni", turns, inertia * body_rate)
    energy = 0.5 * (inertia * body_rate**2).sum(axis=1)
    true_momentum, true_energy = inertia * spin, 0.5 * (inertia * spin**2).sum()
    return {
        "angle": angle_between(recording.orientation[:, 0], attitude).max(),
        "energy": np.abs(energy / true_energy - 1.0).max(),
        "angular momentum": np.linalg.norm(momentum - true_momentum, axis=1).max() / np.linalg.norm(true_momentum),
    }


ATTRACTION, AXIS = 100.0, 10.0  # mu [m^3/s^2] and semi-major axis [m]
PERIOD = 2 * math.pi * math.sqrt(AXIS**3 / ATTRACTION)


def orbit(eccentricity: float) -> Scene:
    """A small body round a centre of attraction, from the apocentre."""
    scene = Scene()
    scene.add_field(PointGravity((0.0, 0.0, 0.0), ATTRACTION))
    position, velocity = apoapsis_start(ATTRACTION, AXIS, eccentricity)
    scene.add_body(Sphere(0.01), mass=1.0, position=position, linear_velocity=velocity)
    return scene


def measure_orbit(eccentricity: float, recording: Recording) -> dict[str, float]:
    truth = kepler_motion(ATTRACTION, AXIS, eccentricity, recording.time)
    place, speed = recording.position[:, 0], recording.linear_velocity[:, 0]
    energy = 0.5 * (speed**2).sum(axis=1) - ATTRACTION / np.linalg.norm(place, axis=1)
    return {
        "position": np.linalg.norm(place - truth, axis=1).max() / AXIS,
        "energy": np.abs(energy / (-0.5 * ATTRACTION / AXIS) - 1.0).max(),
    }


PLANET_RADIUS, LANDER_RADIUS, PLANET_RESTITUTION = 5.0, 0.1, 0.8
DESCENT: tuple[NDArray[np.float64], NDArray[np.float64]] = (np.array([9.0, 0.0, 0.0]), np.array([0.0, 1.2, 0.0]))


def touchdown() -> Scene:
    """A sphere on an orbit that meets its planet and bounces round it, without friction."""
    material = Material(friction=0.0, restitution=1.0)
    scene = Scene()
    scene.add_field(PointGravity((0.0, 0.0, 0.0), ATTRACTION))
    position, velocity = DESCENT
    bouncy = Material(friction=0.0, restitution=PLANET_RESTITUTION)
    scene.add_body(Sphere(LANDER_RADIUS), mass=1.0, position=position, linear_velocity=velocity, material=bouncy)
    scene.add_body(Sphere(PLANET_RADIUS), motion="static", material=material)
    return scene


def measure_touchdown(recording: Recording) -> dict[str, float]:
    truth = planet_bounces(ATTRACTION, *DESCENT, PLANET_RADIUS + LANDER_RADIUS, PLANET_RESTITUTION, recording.time)
    place = recording.position[:, 0]
    depth = PLANET_RADIUS + LANDER_RADIUS - np.linalg.norm(place, axis=1)
    return {
        "position": np.linalg.norm(place - truth, axis=1).max() / PLANET_RADIUS,
        "penetration": max(0.0, depth.max()) / LANDER_RADIUS,
    }


CASES = (
    HardCase(
        "throw",
        1,
        "Free fall and throw",
        "the parabola",
        throw,
        2.0,
        measure_throw,
        "position",
        "m",
        1e-11,
        goal={60: 1e-12, 960: 1e-12},
        sampling=0.1,
    ),
    *(
        HardCase(
            f"rotation_{kind}",
            2,
            f"Free rotation, {kind}",
            "Euler's equations by Taylor series of order 24",
            partial(tumbler, kind),
            20.0,
            partial(measure_tumbler, kind),
            "angle",
            "rad",
            1e-8,
            goal={60: 1e-10, 960: 1e-9},
            sampling=1.0,
        )
        for kind in TUMBLERS
    ),
    *(
        HardCase(
            f"orbit_e{round(10 * eccentricity):02d}",
            3,
            f"Kepler orbit, eccentricity {eccentricity}, 100.7 periods",
            "Kepler's equation",
            partial(orbit, eccentricity),
            2000.0,
            partial(measure_orbit, eccentricity),
            "position",
            "a",
            1e-8,
            goal={60: 1e-9, 240: 1e-9, 960: 1e-9},
            sampling=20.0,
        )
        for eccentricity in (0.5, 0.9)
    ),
    HardCase(
        "orbit_touchdown",
        4,
        "An orbit that bounces round its planet, e = 0.8",
        "Kepler arcs between exact reflections",
        touchdown,
        10.0,
        measure_touchdown,
        "position",
        "planet radii",
        1e-6,
        goal={60: 1e-8, 240: 1e-8},
        sampling=0.1,
    ),
)
