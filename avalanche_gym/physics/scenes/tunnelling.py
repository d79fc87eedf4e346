"""Thin and fast: bullets at walls and sheets, a spinning stick, beams edge on edge."""

from __future__ import annotations

import math
from functools import partial

import numpy as np

from ..scene import Material, Scene, UniformGravity
from ..shapes import Box, Shape, Sphere, TriangleMesh
from .case import EVERY_STEP, GRAVITY, HardCase, Recording

PHASES, LANE, BULLET, WALL_HALF = 64, 0.5, 0.02, 0.01  # count, and [m] between bullets, radius, half thickness


def lane_places(speed: float) -> np.ndarray:
    """Starts (64, 3) [m]: distances to the wall spread over what a bullet flies in 1/60 s, so every phase occurs."""
    distance = 1.0 + speed / 60.0 * (np.arange(PHASES) + 0.5) / PHASES
    return np.stack([-distance, LANE * np.arange(PHASES), np.zeros(PHASES)], axis=1)


def wall() -> Shape:
    half = 0.5 * LANE * PHASES + 1.0
    return Box((WALL_HALF, half, 1.0))


def sheet() -> Shape:
    """Two triangles that face the bullets."""
    half = 0.5 * LANE * PHASES + 1.0
    corners = [(0.0, -half, -1.0), (0.0, half, -1.0), (0.0, half, 1.0), (0.0, -half, 1.0)]
    return TriangleMesh(np.array(corners), np.array([[0, 2, 1], [0, 3, 2]]), two_sided=True)


def bullets(speed: float, target: str) -> Scene:
    """64 spheres that fly at something thin, without gravity, friction and restitution."""
    scene = Scene()
    material = Material(friction=0.0)
    shape = wall() if target == "wall" else sheet()
    scene.add_body(shape, motion="static", position=(0.0, 0.5 * LANE * (PHASES - 1), 0.0), material=material)
    for place in lane_places(speed):
        scene.add_body(Sphere(BULLET), mass=0.1, position=place, linear_velocity=(speed, 0, 0), material=material)
    return scene


def measure_bullets(half: float, recording: Recording) -> dict[str, float]:
    x = recording.position[-1, 1:, 0]
    surface = -half - BULLET
    return {
        "passed": float((x > 0.0).sum()),
        "off the surface": np.abs(np.where(x > 0.0, surface, x) - surface).max() / BULLET,
        "speed": np.abs(np.where(x > 0.0, 0.0, recording.linear_velocity[-1, 1:, 0])).max(),
    }


STICK_HALF, STICK_SPEED, STICK_SPIN, STICKS, STICK_LANE = (0.5, 0.02, 0.02), 30.0, 150.0, 16, 3.0


def sticks() -> Scene:
    """Sticks that spin about z as they fly at a thin wall: their tips are seven times faster than they are."""
    scene = Scene()
    material = Material(friction=0.0)
    half = 0.5 * STICK_LANE * STICKS + 1.0
    middle = 0.5 * STICK_LANE * (STICKS - 1)
    scene.add_body(Box((WALL_HALF, half, 1.0)), motion="static", position=(0.0, middle, 0.0), material=material)
    for number in range(STICKS):
        place = (-1.0 - STICK_SPEED / 60.0 * (number + 0.5) / STICKS, STICK_LANE * number, 0.0)
        scene.add_body(
            Box(STICK_HALF), mass=1.0, position=place, linear_velocity=(STICK_SPEED, 0, 0),
            angular_velocity=(0, 0, STICK_SPIN), material=material,
        )  # fmt: skip
    return scene


def measure_sticks(recording: Recording) -> dict[str, float]:
    """Sticks whose middle was ever behind the wall, and how deep a corner was in it at the end of a step."""
    x, w, z = (recording.position[:, 1:, 0], recording.orientation[:, 1:, 0], recording.orientation[:, 1:, 3])
    cosine, sine = w * w - z * z, 2.0 * w * z
    reach = STICK_HALF[0] * np.abs(cosine) + STICK_HALF[1] * np.abs(sine)
    before = x < 0.0
    depth = np.where(before.all(axis=0), x + reach + WALL_HALF, 0.0)
    energy = 0.5 * (recording.linear_velocity[:, 1:] ** 2).sum(axis=2)
    inertia = (STICK_HALF[0] ** 2 + STICK_HALF[1] ** 2) / 3.0
    energy = energy + 0.5 * inertia * recording.angular_velocity[:, 1:, 2] ** 2
    return {
        "passed": float((~before.all(axis=0)).sum()),
        "depth": max(0.0, depth.max()) / STICK_HALF[1],
        "energy gained": max(0.0, (energy / energy[0] - 1.0).max()),
    }


BEAM, BEAM_DROP = (0.6, 0.05, 0.05), 0.2


def crossed_beams() -> Scene:
    """A beam falls across another: no corner of either is ever over a face of the other."""
    scene = Scene()
    scene.add_field(UniformGravity((0.0, 0.0, -GRAVITY)))
    scene.add_body(Box(BEAM), motion="static")
    across = (math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5))
    scene.add_body(Box(BEAM), mass=2.0, position=(0, 0, 2 * BEAM[2] + BEAM_DROP), orientation=across)
    return scene


def measure_crossed_beams(recording: Recording) -> dict[str, float]:
    truth = np.array([0.0, 0.0, 2 * BEAM[2]])
    return {
        "position": float(np.linalg.norm(recording.position[-1, 1] - truth)),
        "speed": float(np.linalg.norm(recording.linear_velocity[-1, 1])),
    }


def bullet_case(name: str, speed: float, target: str, duration: float) -> HardCase:
    half = WALL_HALF if target == "wall" else 0.0
    return HardCase(
        name, 18, f"64 spheres of radius 0.02 m at {speed:g} m/s at a thin {target}",
        "none passes; rest on the surface",
        partial(bullets, speed, target), duration, partial(measure_bullets, half), "passed", "of 64", 0.0,
        goal={60: 0.0, 240: 0.0, 960: 0.0}, order=False,
    )  # fmt: skip


CASES = (
    bullet_case("bullet_wall", 300.0, "wall", 0.2),
    bullet_case("bullet_sheet", 300.0, "sheet", 0.2),
    bullet_case("bullet_1km", 1000.0, "wall", 0.2),
    HardCase(
        "spinning_sticks", 18, "Sticks that spin at 150 rad/s and fly at a thin wall", "none passes; no energy gained",
        sticks, 0.2, measure_sticks, "passed", "of 16", 0.0, sampling=EVERY_STEP, goal={60: 0.0, 240: 0.0}, order=False,
    ),
    HardCase(
        "crossed_beams", 22, "A beam falls across a beam, edges on edges", "rests on it", crossed_beams, 2.0,
        measure_crossed_beams, "position", "m", 1e-9, goal={60: 1e-9, 240: 1e-9}, order=False,
    ),
)  # fmt: skip
