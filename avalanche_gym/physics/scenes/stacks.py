"""Stacks, a card house and a table: what must stand still, and how the load is shared."""

from __future__ import annotations

import math
from functools import partial

import numpy as np

from ..scene import Material, Scene, UniformGravity
from ..shapes import Box, Compound, Plane
from .case import GRAVITY, HardCase, Recording, about, rotation_matrices

HALF, LEVELS = 0.1, 10


def stack(top_mass: float) -> Scene:
    """Ten boxes of 1 kg on one another, the uppermost of ``top_mass`` [kg]."""
    scene = Scene()
    scene.add_field(UniformGravity((0.0, 0.0, -GRAVITY)))
    scene.add_body(Plane(), motion="static")
    for level in range(LEVELS):
        mass = top_mass if level == LEVELS - 1 else 1.0
        scene.add_body(Box((HALF, HALF, HALF)), mass=mass, position=(0, 0, HALF * (2 * level + 1)))
    return scene


def lean(recording: Recording) -> float:
    """[rad] largest angle between the vertical and what was vertical at the start, bodies 1 and on."""
    first, last = (rotation_matrices(recording.orientation[index, 1:])[:, 2] for index in (0, -1))
    sine = np.linalg.norm(np.cross(first, last), axis=1)
    return float(np.arctan2(sine, (first * last).sum(axis=1)).max())


def measure_stack(top_mass: float, recording: Recording) -> dict[str, float]:
    last, first = recording.position[-1, 1:], recording.position[0, 1:]
    height = np.concatenate([[-HALF], last[:, 2]])
    errors = {
        "displacement": np.linalg.norm(last - first, axis=1).max(),
        "penetration": max(0.0, float((2 * HALF - np.diff(height)).max())),
        "tilt": lean(recording),
    }
    if recording.contact_force is not None:
        weights = GRAVITY * np.cumsum(([1.0] * (LEVELS - 1) + [top_mass])[::-1])[::-1]
        own = np.diff(np.append(weights, 0.0))  # what a box takes from below, less what it gives on top
        errors["force"] = np.abs(recording.contact_force[1:, 2] + own).max() / weights[0]
    return errors


CARD, CARD_LEAN, HOUSE = (0.001, 0.1, 0.2), math.radians(25.0), 5


def card_house() -> Scene:
    """Five levels of leaning pairs with level cards between; every contact touches and no two cards overlap."""
    scene = Scene()
    scene.add_field(UniformGravity((0.0, 0.0, -GRAVITY)))
    material = Material(friction=0.7)
    scene.add_body(Plane(), motion="static", material=material)
    thin, deep, tall = CARD
    width = tall * math.sin(CARD_LEAN) + thin * math.cos(CARD_LEAN)  # [m] half extent of a leaning card along x
    height = tall * math.cos(CARD_LEAN) + thin * math.sin(CARD_LEAN)  # [m] half extent along z
    pitch = 4.0 * width + 0.01  # from one pair to the next: their feet stay apart
    level_half = 0.5 * pitch - 0.25 * thin  # level cards almost meet above each pair
    ground = 0.0
    for level in range(HOUSE):
        pairs = HOUSE - level
        for pair in range(pairs):
            middle = pitch * (pair - 0.5 * (pairs - 1))
            for side in (-1.0, 1.0):
                place = (middle + side * width, 0.0, ground + height)
                turn = about((0.0, 1.0, 0.0), -side * CARD_LEAN)
                scene.add_body(Box(CARD), density=1000.0, position=place, orientation=turn, material=material)
        ground += 2.0 * height
        for card in range(pairs - 1):
            place = (pitch * (card - 0.5 * (pairs - 2)), 0.0, ground + thin)
            scene.add_body(Box((level_half, deep, thin)), density=1000.0, position=place, material=material)
        ground += 2.0 * thin
    return scene


def measure_card_house(recording: Recording) -> dict[str, float]:
    """How far the worst card moved; a card's height is 0.4 m."""
    return {
        "displacement": np.linalg.norm(recording.position[-1, 1:] - recording.position[0, 1:], axis=1).max(),
        "tilt": lean(recording),
    }


TABLE_MASS = 8.0


def table() -> Scene:
    """A table on four legs: the ground's forces are not unique, the motion is."""
    upright = (1.0, 0.0, 0.0, 0.0)
    legs = [(Box((0.05, 0.05, 0.35)), (0.55 * x, 0.35 * y, 0.0), upright) for x in (-1, 1) for y in (-1, 1)]
    shape = Compound([(Box((0.6, 0.4, 0.03)), (0.0, 0.0, 0.38), upright), *legs])
    scene = Scene()
    scene.add_field(UniformGravity((0.0, 0.0, -GRAVITY)))
    scene.add_body(Plane(), motion="static")
    scene.add_body(shape, mass=TABLE_MASS, position=(0, 0, 0.35))
    return scene


def measure_table(recording: Recording) -> dict[str, float]:
    errors = {
        "displacement": np.linalg.norm(recording.position[-1, 1] - recording.position[0, 1]),
        "tilt": lean(recording),
        "spin": np.abs(recording.angular_velocity[-1, 1]).max(),
    }
    if recording.contact_force is not None:
        force = recording.contact_force[1] - np.array([0.0, 0.0, GRAVITY * TABLE_MASS])
        errors["force"] = np.abs(force).max() / (GRAVITY * TABLE_MASS)
    return errors


CASES = (
    *(
        HardCase(
            name, 13, f"Ten boxes, the uppermost of {mass:g} times the mass", "at rest; forces equal the weights above",
            partial(stack, mass), 10.0, partial(measure_stack, mass), "displacement", "m", 1e-6,
            goal={60: 1e-6, 240: 1e-6, 960: 1e-6}, order=False,
        )
        for name, mass in (("stack", 1.0), ("stack_heavy", 1e3), ("stack_very_heavy", 1e6))
    ),
    HardCase(
        "card_house", 14, "Card house of five levels, mu 0.7", "stands for a minute", card_house, 60.0,
        measure_card_house, "displacement", "m", 1e-3, goal={60: 1e-3, 240: 1e-3}, order=False,
    ),
    HardCase(
        "table", 15, "A table on four legs", "at rest; total force equals the weight", table, 5.0, measure_table,
        "displacement", "m", 1e-9, goal={60: 1e-9, 240: 1e-9}, order=False,
    ),
)  # fmt: skip
