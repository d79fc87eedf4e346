"""The same motion wherever, however large and in whatever units; inputs that must be refused or survived."""

from __future__ import annotations

import math
from functools import partial
from typing import Any

import numpy as np

from ..scene import Material, Scene, UniformGravity
from ..shapes import Box, Compound, Plane, Shape, Sphere, TriangleMesh
from .case import GRAVITY, Actuated, Companion, HardCase, Recording, angle_between
from .terrain import cut_floor

FAR_SPEED, FAR_SPIN = (2.0, 0.5, 0.0), (0.0, 0.0, 3.0)


def far_away(offset: float) -> Scene:
    """Three balls in a frame that slide and spin on a slab, ``offset`` [m] along x, y and z from the origin.

    Three contacts, since four share the load in more than one way, and each way brakes the spin by another moment.
    """
    upright = (1.0, 0.0, 0.0, 0.0)
    angles = (0.0, 2.0 * math.pi / 3.0, 4.0 * math.pi / 3.0)
    ends = [(0.25 * math.cos(angle), 0.25 * math.sin(angle), 0.0) for angle in angles]
    scene = Scene()
    scene.add_field(UniformGravity((0.0, 0.0, -GRAVITY)))
    place = np.full(3, offset)
    scene.add_body(Box((8.0, 8.0, 0.5)), motion="static", position=place)
    scene.add_body(
        Compound([(Sphere(0.125), end, upright) for end in ends]), mass=1.0,
        position=place + np.array([0.0, 0.0, 0.625]), linear_velocity=FAR_SPEED, angular_velocity=FAR_SPIN,
    )  # fmt: skip
    return scene


def measure_far_away(offset: float, far: Recording, near: Recording) -> dict[str, float]:
    """In spacings of floats at the offset."""
    spacing = float(np.spacing(offset))
    shift = np.abs(far.position[:, 1] - offset - near.position[:, 1]).max()
    return {"difference": shift / spacing, "angle": angle_between(far.orientation[:, 1], near.orientation[:, 1]).max()}


def scaled(length: float, mass: float, time: float) -> Scene:
    """Boxes and a ball that slide, roll, fall on each other and come to rest, in other units."""
    speed = length / time
    scene = Scene()
    scene.add_field(UniformGravity((0.0, 0.0, -GRAVITY * length / time**2)))
    scene.add_body(Plane(), motion="static")

    def add(shape: Shape, weight: float, place: tuple[float, ...], motion: tuple[float, ...]) -> None:
        scene.add_body(
            shape, mass=weight * mass, position=length * np.array(place), linear_velocity=speed * np.array(motion)
        )

    cube = Box((0.1 * length,) * 3)
    add(cube, 1.0, (0.0, 0.0, 0.1), (1.0, 0.0, 0.0))
    add(cube, 2.0, (0.02, 0.01, 0.3), (1.0, 0.0, 0.0))
    add(Sphere(0.1 * length), 1.0, (0.0, 1.0, 0.1), (2.0, 0.3, 0.0))
    add(cube, 1.0, (1.0, -1.0, 0.35), (0.0, 0.5, 0.0))
    return scene


def measure_scaled(length: float, time: float, plain: Recording, large: Recording) -> dict[str, float]:
    place = large.position[:, 1:] / length - plain.position[:, 1:]
    speed = large.linear_velocity[:, 1:] * time / length - plain.linear_velocity[:, 1:]
    return {"position": np.abs(place).max(), "velocity": np.abs(speed).max()}


GRAIN, BOULDER, GRAIN_SPEED, GRAIN_FRICTION = 1e-4, 1.0, 0.05, 0.3


def grain_and_boulder() -> Scene:
    """A grain that slides until it rolls, beside a boulder 1e4 times larger, on one plane."""
    scene = Scene()
    scene.add_field(UniformGravity((0.0, 0.0, -GRAVITY)))
    material = Material(friction=GRAIN_FRICTION)
    scene.add_body(Plane(), motion="static", material=material)
    scene.add_body(Sphere(BOULDER), position=(0, 5, BOULDER), material=material)
    scene.add_body(Sphere(GRAIN), position=(0, 0, GRAIN), linear_velocity=(GRAIN_SPEED, 0, 0), material=material)
    return scene


def measure_grain(recording: Recording) -> dict[str, float]:
    final = 5.0 / 7.0 * GRAIN_SPEED
    return {
        "speed": abs(recording.linear_velocity[-1, 2, 0] / final - 1.0),
        "height": abs(recording.position[-1, 2, 2] / GRAIN - 1.0),
        "boulder": np.linalg.norm(recording.position[-1, 1] - recording.position[0, 1]) / BOULDER,
    }


KICK = 1e12  # [N s]


def kicked() -> Scene:
    """A ball that gets an impulse of 1e12 N s."""
    scene = Scene()
    scene.add_field(UniformGravity((0.0, 0.0, -GRAVITY)))
    scene.add_body(Sphere(0.1), mass=1.0)
    return scene


def kick(simulation: Actuated, time: float, step: float) -> None:
    if time == 0.0:
        simulation.apply_impulse(0, (KICK, 0.0, 0.0))


def measure_kick(recording: Recording) -> dict[str, float]:
    return {"position": abs(recording.position[-1, 0, 0] / (KICK * recording.time[-1]) - 1.0)}


# Dirty triangles in a flat floor; the clean floor is the same without them.
DIRT = ("degenerate", "duplicate", "needle", "flipped")


def dirty_floor(dirt: str) -> Scene:
    """A box that slides over a floor whose mesh is as ``dirt`` says, or clean."""
    vertices, faces = cut_floor(np.random.default_rng(7), (-1.0, -2.0), (6.0, 3.0), 60)
    if dirt == "degenerate":
        faces = np.concatenate([faces, [[faces[0, 0], faces[0, 1], faces[0, 1]]]])
    elif dirt == "duplicate":
        faces = np.concatenate([faces, faces[:20]])
    elif dirt == "needle":
        # One triangle in three, two of them a millionth as wide as they are long.
        a, b, c = faces[0]
        middle = 0.5 * (vertices[a] + vertices[b]) + 1e-6 * (vertices[c] - vertices[a])
        vertices, d = np.concatenate([vertices, [middle]]), len(vertices)
        faces = np.concatenate([faces[1:], [[a, b, d], [b, c, d], [c, a, d]]])
    elif dirt == "flipped":
        faces = faces.copy()
        faces[::7] = faces[::7, ::-1]
    scene = Scene()
    scene.add_field(UniformGravity((0.0, 0.0, -GRAVITY)))
    material = Material(friction=0.3)
    box = Box((0.2, 0.15, 0.1))
    scene.add_body(box, mass=1.0, position=(0, 0, 0.1), linear_velocity=(3.0, 0.7, 0.0), material=material)
    scene.add_body(TriangleMesh(vertices, faces), motion="static", material=material, name="floor")
    return scene


def measure_dirt(dirty: Recording, clean: Recording) -> dict[str, float]:
    return {"position": np.abs(dirty.position[:, 0] - clean.position[:, 0]).max()}


OPEN_MESH = TriangleMesh([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)], [[0, 1, 2]])
BAD_INPUTS: dict[str, dict[str, Any]] = {
    "nan_position": {"mass": 1.0, "position": (0.0, math.nan, 0.0)},
    "infinite_velocity": {"mass": 1.0, "linear_velocity": (math.inf, 0.0, 0.0)},
    "zero_mass": {"mass": 0.0},
    "negative_mass": {"mass": -1.0},
    "impossible_inertia": {"mass": 1.0, "inertia": (1.0, 1.0, 3.0)},
    "open_mesh": {"shape": OPEN_MESH},
}


def bad_input(name: str) -> Scene:
    """A scene with one body that cannot be."""
    values: dict[str, Any] = dict(BAD_INPUTS[name])
    scene = Scene()
    scene.add_body(values.pop("shape", Sphere(0.1)), name="culprit", **values)
    return scene


def measure_nothing(recording: Recording) -> dict[str, float]:
    """A motion that should not have come about."""
    return {"accepted": 1.0}


# Length, mass, time in other units. Powers of two change no digit of any number, so nothing may differ, however
# sensitive the motion is.
UNITS = {"small": (2.0**10, 2.0**10, 1.0), "large": (2.0**-10, 2.0**-20, 1.0), "fast": (1.0, 1.0, 2.0**10)}

CASES = (
    *(
        HardCase(
            f"far_{offset:.0e}".replace("e+0", "e"), 20,
            f"Three balls in a frame slide and spin {offset:g} m from the origin",
            "the motion at the origin", partial(far_away, offset), 1.0, partial(measure_far_away, offset), "difference",
            "float spacings", 1e3, goal={60: 1e3, 240: 1e3}, sampling=0.1, order=False,
            companions=(Companion(partial(far_away, 0.0)),),
        )
        for offset in (1e3, 1e6)
    ),
    *(
        HardCase(
            f"units_{unit}", 21, f"The same scene in {unit} units", "the same dimensionless motion, bit for bit",
            partial(scaled, 1.0, 1.0, 1.0), 1.0, partial(measure_scaled, scales[0], scales[2]), "position", "m",
            1e-12, goal={60: 0.0, 240: 0.0}, sampling=0.1, order=False,
            companions=(Companion(partial(scaled, *scales), scales[2]),),
        )
        for unit, scales in UNITS.items()
    ),
    HardCase(
        "grain_and_boulder", 21, "A grain of 0.1 mm beside a boulder of 1 m", "5/7 v0; both stay on the ground",
        grain_and_boulder, 0.5, measure_grain, "speed", "relative", 1e-6, goal={60: 1e-9, 240: 1e-9}, order=False,
    ),
    HardCase(
        "impulse_1e12", 30, "An impulse of 1e12 N s", "p / m t", kicked, 1.0, measure_kick, "position", "relative",
        1e-12,
        goal={60: 1e-14, 240: 1e-14}, drive=kick, order=False,
    ),
    *(
        HardCase(
            f"dirty_{dirt}", 19, f"A box slides over a floor with {dirt} triangles", "the motion on the clean mesh",
            partial(dirty_floor, dirt), 1.0, measure_dirt, "position", "m", 1e-9, goal={60: 1e-9, 240: 1e-9},
            sampling=0.1, companions=(Companion(partial(dirty_floor, "")),), order=False, refusal="allowed",
        )
        for dirt in DIRT
    ),
    *(
        HardCase(
            f"input_{name}", 30, f"Input that cannot be: {name.replace('_', ' ')}", "refused, with the body's name",
            partial(bad_input, name), 1.0 / 30.0, measure_nothing, "accepted", "times", 0.0, order=False,
            refusal="required",
        )
        for name in BAD_INPUTS
    ),
)  # fmt: skip
