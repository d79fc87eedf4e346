"""Concave bodies: rabbits on terrain and on each other, a torus on a peg, a nut on a bolt."""

from __future__ import annotations

import math
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ..scene import Material, Scene, UniformGravity
from ..shapes import Cylinder, HeightField
from ..shapes.rabbit import rabbit
from ..shapes.ring_solids import torus
from ..shapes.thread import Thread, bolt, nut
from .case import EVERY_STEP, GRAVITY, HardCase, Recording, about, rotation_matrices

HEIGHT = 0.2  # [m] of a rabbit
ROUGH = Material(friction=0.5, rolling_friction=0.005)
ALONG_Y = about((1.0, 0.0, 0.0), 0.5 * math.pi)


def _gravity() -> Scene:
    scene = Scene()
    scene.add_field(UniformGravity((0.0, 0.0, -GRAVITY)))
    return scene


def rabbits(count: int) -> Scene:
    """``count`` rabbits of 5,000 triangles fall on each other on rough terrain."""
    scene = _gravity()
    generator = np.random.default_rng(7)
    heights = 0.1 * generator.random((21, 21))
    scene.add_body(HeightField(heights, (4.0, 4.0)), motion="static", material=ROUGH)
    shape = rabbit(HEIGHT)
    for number in range(count):
        x, y = generator.uniform(-0.06, 0.06, 2)
        turn = generator.normal(size=4)
        place = (x, y, 0.35 + 1.2 * HEIGHT * number)
        scene.add_body(shape, mass=1.0, position=place, orientation=turn / np.linalg.norm(turn), material=ROUGH)
    return scene


RING, TUBE, PEG = 0.1, 0.03, 0.02  # [m]
LENGTH = RING - TUBE - PEG  # [m] of the pendulum that the centre of a hung torus is


def torus_on_peg() -> Scene:
    """A torus dropped over a horizontal cylinder."""
    scene = _gravity()
    scene.add_body(Cylinder(PEG, 0.15), motion="static", orientation=ALONG_Y, material=ROUGH)
    start = (0.01, 0.0, 0.01 - LENGTH)
    scene.add_body(torus(RING, TUBE), mass=1.0, position=start, orientation=ALONG_Y, material=ROUGH)
    return scene


def measure_rest(recording: Recording) -> dict[str, float]:
    moving = recording.linear_velocity[-1, 1:]
    return {"speed": float(np.sqrt((moving**2).sum(axis=1).mean()))}


SWING = 0.1  # [rad]


def torus_pendulum(segments: int = 512, swing: float = SWING) -> Scene:
    """A torus hung on a cylinder, without friction; released where a side of its hole touches, ``swing`` [rad] off."""
    scene = _gravity()
    smooth = Material(friction=0.0)
    scene.add_body(Cylinder(PEG, 0.15), motion="static", orientation=ALONG_Y, material=smooth)
    # The hole is a polygon with a corner at the top.
    side = 2.0 * math.pi / segments
    reach = (RING - TUBE) * math.cos(0.5 * side) - PEG
    reach /= math.cos(swing % side - 0.5 * side)
    start = (reach * math.sin(swing), 0.0, -reach * math.cos(swing))
    shape = torus(RING, TUBE, segments=segments, sides=8)
    scene.add_body(shape, mass=1.0, position=start, orientation=ALONG_Y, material=smooth)
    return scene


def measure_pendulum(recording: Recording) -> dict[str, float]:
    """The mean period between downward crossings of the middle, against 2 pi sqrt(l / g) (1 + a^2 / 16)."""
    x = recording.position[:, 1, 0]
    before = np.flatnonzero((x[:-1] > 0.0) & (x[1:] <= 0.0))
    share = x[before] / (x[before] - x[before + 1])
    times = recording.time[before] + share * (recording.time[before + 1] - recording.time[before])
    exact = 2.0 * math.pi * math.sqrt(LENGTH / GRAVITY) * (1.0 + SWING**2 / 16.0)
    return {"period": abs(float(np.diff(times).mean()) / exact - 1.0) if len(times) > 1 else math.inf}


THREAD = Thread(radius=0.01, pitch=0.004, depth=0.002)
CLEARANCE = 2e-4  # [m]
PLACE = 5  # [pitches] of the nut at the start


def nut_on_bolt(friction: float) -> Scene:
    """A nut under its own weight on an upright bolt."""
    scene = _gravity()
    steel = Material(friction=friction)
    scene.add_body(bolt(THREAD, 10), motion="static", material=steel)
    ring = nut(THREAD, 2, clearance=CLEARANCE)
    scene.add_body(ring, density=7800.0, position=(0.0, 0.0, PLACE * THREAD.pitch), material=steel)
    return scene


def turned(recording: Recording) -> NDArray[np.float64]:
    """(n,) [rad] by which the nut has turned about the bolt, from samples less than half a turn apart."""
    axes = rotation_matrices(recording.orientation[:, 1])
    return np.unwrap(np.arctan2(axes[:, 1, 0], axes[:, 0, 0]))


def measure_held(recording: Recording) -> dict[str, float]:
    angle = turned(recording)
    settled = len(angle) // 2
    return {
        "turn": abs(float(angle[-1] - angle[settled])) / (2.0 * math.pi),
        "descent": abs(float(np.ptp(recording.position[settled:, 1, 2]))) / THREAD.pitch,
    }


def measure_screwed(recording: Recording) -> dict[str, float]:
    """Descent against one pitch a turn, beyond what the play in the thread allows."""
    angle = turned(recording)
    settled = len(angle) // 4
    turns = float(angle[-1] - angle[settled]) / (2.0 * math.pi)
    sunk = float(recording.position[-1, 1, 2] - recording.position[settled, 1, 2]) / THREAD.pitch
    return {"lead": abs(sunk / turns - 1.0) if turns < -0.1 else math.inf, "turns": -turns}


CASES = (
    *(
        HardCase(
            name, 23, title, "comes to rest", partial(rabbits, count), 30.0, measure_rest, "speed", "m/s", 1e-6,
            goal={240: 1e-6}, order=False, chaotic=True,
        )
        for name, title, count in (
            ("rabbit", "A rabbit of 5,000 triangles on rough terrain", 1),
            ("rabbit_on_rabbit", "A rabbit on a rabbit", 2),
            ("rabbit_heap", "A heap of ten rabbits", 10),
        )
    ),
    HardCase(
        "torus_on_peg", 23, "A torus of 4,096 triangles on a peg", "comes to rest", torus_on_peg, 30.0, measure_rest,
        "speed", "m/s", 1e-6, goal={240: 1e-6}, order=False, chaotic=True,
    ),
    HardCase(
        "torus_pendulum", 23, "A torus of 512 segments hung on a cylinder, without friction",
        "pendulum of length hole minus cylinder, 0.05 m", torus_pendulum, 5.0, measure_pendulum, "period", "relative",
        0.01, goal={240: 0.01}, sampling=EVERY_STEP, order=False,
    ),
    HardCase(
        "nut_holds", 23, "A nut on a bolt with five times the friction that holds it", "stays",
        partial(nut_on_bolt, 0.3), 1.0, measure_held, "descent", "pitches", 1e-3, goal={240: 1e-3},
        sampling=EVERY_STEP, order=False,
    ),
    HardCase(
        "nut_screws_down", 23, "A nut on a bolt with a third of the friction that holds it", "one pitch a turn",
        partial(nut_on_bolt, 0.02), 1.0, measure_screwed, "lead", "relative", 0.02, goal={240: 0.02},
        sampling=EVERY_STEP, order=False,
    ),
)  # fmt: skip
