"""Sliding, sticking and rolling under Coulomb friction; the plate that swings is in swinging_plate.py."""

from __future__ import annotations

import math
from functools import partial

import numpy as np

from ..scene import Material, Scene, UniformGravity
from ..shapes import Box, Capsule, Plane, Sphere
from .case import EVERY_STEP, GRAVITY, Actuated, HardCase, Recording, about

SLIDE_SPEED, SLIDE_FRICTION = 5.0, 0.5
SLIDE_DISTANCE = SLIDE_SPEED**2 / (2.0 * SLIDE_FRICTION * GRAVITY)


def ground_scene(friction: float, tilt: float = 0.0) -> Scene:
    """A plane under gravity that is turned by ``tilt`` [rad] towards x: an incline whose normal is z."""
    scene = Scene()
    scene.add_field(UniformGravity((GRAVITY * math.sin(tilt), 0.0, -GRAVITY * math.cos(tilt))))
    scene.add_body(Plane(), motion="static", material=Material(friction=friction))
    return scene


def slide() -> Scene:
    """A box that slides to a stop."""
    scene = ground_scene(SLIDE_FRICTION)
    material = Material(friction=SLIDE_FRICTION)
    scene.add_body(
        Box((0.2, 0.2, 0.1)), mass=3.0, position=(0, 0, 0.1), linear_velocity=(SLIDE_SPEED, 0, 0), material=material
    )
    return scene


def measure_slide(recording: Recording) -> dict[str, float]:
    stop = SLIDE_SPEED / (SLIDE_FRICTION * GRAVITY)
    time = np.minimum(recording.time, stop)
    path = SLIDE_SPEED * time - 0.5 * SLIDE_FRICTION * GRAVITY * time**2
    rest = recording.time > stop + 0.2
    return {
        "distance": abs(recording.position[-1, 1, 0] / SLIDE_DISTANCE - 1.0),
        "path": np.abs(recording.position[:, 1, 0] - path).max() / SLIDE_DISTANCE,
        "speed at rest": np.abs(recording.linear_velocity[rest, 1]).max(),
    }


TILT = math.radians(20.0)


def incline(factor: float) -> Scene:
    """A box on a slope of 20 degrees with ``factor`` times the friction at which it just stays."""
    friction = factor * math.tan(TILT)
    scene = ground_scene(friction, TILT)
    scene.add_body(Box((0.2, 0.2, 0.1)), mass=2.0, position=(0, 0, 0.1), material=Material(friction=friction))
    return scene


def measure_stick(recording: Recording) -> dict[str, float]:
    """Drift after the first tenth of a second, in which a soft contact may settle."""
    return {
        "drift": np.linalg.norm(recording.position[-1, 1] - recording.position[1, 1])
        / (recording.time[-1] - recording.time[1]),
        "speed": np.linalg.norm(recording.linear_velocity[-1, 1]),
    }


def measure_slip(factor: float, recording: Recording) -> dict[str, float]:
    acceleration = GRAVITY * (math.sin(TILT) - factor * math.tan(TILT) * math.cos(TILT))
    time = recording.time[-1]
    return {
        "acceleration": abs(recording.linear_velocity[-1, 1, 0] / (acceleration * time) - 1.0),
        "position": abs(recording.position[-1, 1, 0] / (0.5 * acceleration * time**2) - 1.0),
    }


ROLL_SPEED, ROLL_FRICTION, ROLL_RADIUS = 5.0, 0.3, 0.1


def slide_to_roll() -> Scene:
    """A sphere that slides until it rolls."""
    scene = ground_scene(ROLL_FRICTION)
    scene.add_body(
        Sphere(ROLL_RADIUS), mass=1.0, position=(0, 0, ROLL_RADIUS), linear_velocity=(ROLL_SPEED, 0, 0),
        material=Material(friction=ROLL_FRICTION),
    )  # fmt: skip
    return scene


def measure_slide_to_roll(recording: Recording) -> dict[str, float]:
    final = 5.0 / 7.0 * ROLL_SPEED
    sliding = 2.0 * ROLL_SPEED / (7.0 * ROLL_FRICTION * GRAVITY)
    time = recording.time[-1]
    distance = 12.0 / 49.0 * ROLL_SPEED**2 / (ROLL_FRICTION * GRAVITY) + final * (time - sliding)
    return {
        "position": abs(recording.position[-1, 1, 0] / distance - 1.0),
        "speed": abs(recording.linear_velocity[-1, 1, 0] / final - 1.0),
        "spin": abs(recording.angular_velocity[-1, 1, 1] * ROLL_RADIUS / final - 1.0),
    }


def roll_down() -> Scene:
    """A sphere that rolls down a slope of 20 degrees."""
    scene = ground_scene(0.5, TILT)
    scene.add_body(Sphere(ROLL_RADIUS), mass=1.0, position=(0, 0, ROLL_RADIUS))
    return scene


def measure_roll_down(recording: Recording) -> dict[str, float]:
    time = recording.time[-1]
    distance = 5.0 / 14.0 * GRAVITY * math.sin(TILT) * time**2
    speed = 5.0 / 7.0 * GRAVITY * math.sin(TILT) * time
    return {
        "position": abs(recording.position[-1, 1, 0] / distance - 1.0),
        "speed": abs(recording.linear_velocity[-1, 1, 0] / speed - 1.0),
    }


# Rolling with load (SimBenchmark's rolling test): m a_box = F - T, 25 m a = T + S, 25 (2/5) m a = T - S, a_box = 2 a,
# with T between box and balls and S between balls and ground; no contact slips, as long as the box is not yet so far
# ahead that the hindmost balls bear too little (0.24 s).
LOAD_MASS, BALL_MASS, BALLS, PUSH = 10.0, 1.0, 25, 150.0
BALL_RADIUS, BALL_SPACING, LOAD_HALF = 0.5, 2.0, (6.0, 6.0, 0.02)
BALL_ACCELERATION = PUSH / (2.0 * LOAD_MASS + 0.7 * BALLS * BALL_MASS)


def rolling_load() -> Scene:
    """A plate on 25 balls, pushed."""
    scene = Scene()
    scene.add_field(UniformGravity((0.0, 0.0, -GRAVITY)))
    ground, ball, plate = Material(friction=0.4), Material(friction=0.4), Material(friction=0.8)
    scene.add_body(Plane(), motion="static", material=ground)
    height = 2.0 * BALL_RADIUS + LOAD_HALF[2]
    scene.add_body(Box(LOAD_HALF), mass=LOAD_MASS, position=(0, 0, height), material=plate)
    for i in range(5):
        for j in range(5):
            place = (BALL_SPACING * (i - 2), BALL_SPACING * (j - 2), BALL_RADIUS)
            scene.add_body(Sphere(BALL_RADIUS), mass=BALL_MASS, position=place, material=ball)
    return scene


def push_load(direction: tuple[float, float], simulation: Actuated, time: float, step: float) -> None:
    simulation.apply_force(1, (PUSH * direction[0], PUSH * direction[1], 0.0))


def measure_rolling_load(direction: tuple[float, float], recording: Recording) -> dict[str, float]:
    along = np.array(direction) / np.linalg.norm(direction)
    scale = np.linalg.norm(direction) * BALL_ACCELERATION * recording.time[-1]
    box = recording.linear_velocity[-1, 1, :2] - 2.0 * scale * along
    balls = recording.linear_velocity[-1, 2:, :2] - scale * along
    return {
        "speed of the box": np.linalg.norm(box) / (2.0 * scale),
        "speed of the balls": np.linalg.norm(balls, axis=1).max() / scale,
    }


# Painleve's rod: so much friction that no finite force is right while it slides at this angle; an impulse stops it.
ROD_HALF, ROD_RADIUS, ROD_ANGLE, ROD_FRICTION = 0.5, 0.01, math.radians(50.0), 2.0


def painleve_rod() -> Scene:
    """A rod whose lower end slides forward under it, with mu above the critical value 4/3."""
    scene = ground_scene(ROD_FRICTION)
    height = ROD_RADIUS + ROD_HALF * math.sin(ROD_ANGLE)
    # Axis z of the capsule turned to (cos, 0, sin): its lower end is behind, and the rod moves backwards.
    turn = about((0.0, 1.0, 0.0), 0.5 * math.pi - ROD_ANGLE)
    scene.add_body(
        Capsule(ROD_RADIUS, ROD_HALF), mass=1.0, position=(0, 0, height), orientation=turn,
        linear_velocity=(-4.0, 0.0, 0.0), material=Material(friction=ROD_FRICTION),
    )  # fmt: skip
    return scene


def measure_painleve(recording: Recording) -> dict[str, float]:
    """Energy gained, in terms of what it started with."""
    speed, spin = recording.linear_velocity[:, 1], recording.angular_velocity[:, 1]
    inertia = (2 * ROD_HALF + 2 * ROD_RADIUS) ** 2 / 12.0  # across, of a thin rod; the spin about its axis is small
    energy = 0.5 * (speed**2).sum(axis=1) + 0.5 * inertia * (spin**2).sum(axis=1)
    energy = energy + GRAVITY * recording.position[:, 1, 2]
    return {
        "energy gained": max(0.0, (energy / energy[0] - 1.0).max()),
        "greatest speed": np.linalg.norm(speed, axis=1).max(),
        "depth": max(0.0, -(recording.position[:, 1, 2].min() - ROD_RADIUS)) / ROD_RADIUS,
    }


STICK, JUST_STICK, SLIP, JUST_SLIP = 1.2, 1.0 + 1e-6, 0.5, 1.0 - 1e-6
PUSHES = {"y": (0.0, 1.0), "oblique": (0.5, 0.866)}

CASES = (
    HardCase(
        "slide", 7, "A box slides to a stop, 5 m/s, mu 0.5", "v^2 / (2 mu g), then at rest", slide, 1.5, measure_slide,
        "distance", "relative", 1e-4, goal={60: 4e-5, 240: 4e-6, 960: 1e-6}, sampling=0.1,
    ),
    *(
        HardCase(
            name, 8, f"A box on 20 degrees at {factor:.7g} times the critical friction", "at rest",
            partial(incline, factor), duration, measure_stick, "drift", "m/s", 1e-12,
            goal={60: 1e-12, 240: 1e-12, 960: 1e-12}, sampling=0.1, order=False,
        )
        for name, factor, duration in (("stick", STICK, 3.0), ("stick_critical", JUST_STICK, 10.0))
    ),
    *(
        HardCase(
            name, 8, f"A box on 20 degrees at {factor:.7g} times the critical friction", "g (sin - mu cos)",
            partial(incline, factor), 2.0, partial(measure_slip, factor), "acceleration", "relative", passes_at,
            goal={60: 1e-8, 240: 1e-8, 960: 1e-8},
        )
        for name, factor, passes_at in (("slip", SLIP, 1e-6), ("slip_critical", JUST_SLIP, 1e-2))
    ),
    HardCase(
        "slide_to_roll", 9, "A sphere slides until it rolls", "5/7 v0, and its place", slide_to_roll, 1.0,
        measure_slide_to_roll, "position", "relative", 1e-4, goal={60: 1e-5, 240: 1e-5, 960: 1e-5},
    ),
    HardCase(
        "roll_down", 9, "A sphere rolls down 20 degrees", "5/14 g sin(theta) t^2", roll_down, 2.0, measure_roll_down,
        "position", "relative", 1e-6, goal={60: 1e-8, 240: 1e-8, 960: 1e-8},
    ),
    *(
        HardCase(
            f"rolling_load_{name}", 10, f"A plate on 25 balls, pushed along {name}",
            "a_box = 2 a_balls, from the equations above", rolling_load, 0.2, partial(measure_rolling_load, direction),
            "speed of the box", "relative", 1e-6, goal={60: 1e-6, 240: 1e-6}, drive=partial(push_load, direction),
        )
        for name, direction in PUSHES.items()
    ),
    HardCase(
        "painleve", 27, "Painleve's rod, mu 2", "energy does not grow", painleve_rod, 1.0, measure_painleve,
        "energy gained", "relative", 1e-9, sampling=EVERY_STEP, order=False, goal={60: 1e-12, 240: 1e-12},
    ),
)  # fmt: skip
