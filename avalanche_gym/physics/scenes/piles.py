"""Many bodies: overlap that must be removed, balls dropped on each other, piles on concave terrain."""

from __future__ import annotations

import math
from functools import partial

import numpy as np

from ..scene import Material, Scene, UniformGravity
from ..shapes import Box, Capsule, HeightField, Plane, Sphere
from .case import EVERY_STEP, GRAVITY, HardCase, Recording

OVERLAP_HALF, OVERLAP, SIDE = 0.1, 0.25, 3


def overlapped() -> Scene:
    """27 boxes, each a quarter of its width inside its neighbours."""
    scene = Scene()
    scene.add_field(UniformGravity((0.0, 0.0, -GRAVITY)))
    scene.add_body(Plane(), motion="static")
    pitch = 2 * OVERLAP_HALF * (1 - OVERLAP)
    for number in range(SIDE**3):
        cell = np.array([number % SIDE, number // SIDE % SIDE, number // SIDE**2])
        place = pitch * cell + np.array([0.0, 0.0, OVERLAP_HALF])
        scene.add_body(Box((OVERLAP_HALF,) * 3), mass=1.0, position=place)
    return scene


def measure_overlapped(recording: Recording) -> dict[str, float]:
    """Kinetic energy against what it takes to lift the pile out of its overlap.

    Apart, level k of the pile stands k overlap depths higher; pushing it there is m g times that, and no more can ever
    come back as motion.
    """
    level = np.arange(SIDE**3) // SIDE**2
    lift = GRAVITY * (2 * OVERLAP_HALF * OVERLAP * level).sum()
    energy = 0.5 * (recording.linear_velocity[:, 1:] ** 2).sum(axis=(1, 2))
    top = recording.position[-1, 1:, 2]
    return {
        "kinetic energy": energy.max() / lift,
        "speed at the end": np.linalg.norm(recording.linear_velocity[-1, 1:], axis=1).max(),
        "sunk": max(0.0, OVERLAP_HALF - top.min()) / OVERLAP_HALF,
        "launched": float((top > 2 * OVERLAP_HALF * (SIDE + 1)).sum()),
    }


BALLS, BALL_RADIUS = 6, 0.1


def ball_cube(restitution: float, friction: float) -> Scene:
    """216 balls (SimBenchmark's 666 test), a little out of line, dropped on the ground and on each other."""
    generator = np.random.default_rng(666)
    scene = Scene()
    scene.add_field(UniformGravity((0.0, 0.0, -GRAVITY)))
    material = Material(friction=friction, restitution=restitution)
    scene.add_body(Plane(), motion="static", material=material)
    for number in range(BALLS**3):
        cell = np.array([number % BALLS, number // BALLS % BALLS, number // BALLS**2])
        place = 2.5 * BALL_RADIUS * cell + np.array([0.0, 0.0, 0.5]) + generator.uniform(-0.01, 0.01, 3)
        scene.add_body(Sphere(BALL_RADIUS), mass=1.0, position=place, material=material)
    return scene


def ball_energy(recording: Recording) -> np.ndarray:
    """(n,) [J] of translation and height; balls without friction do not turn."""
    speed = (recording.linear_velocity[:, 1:] ** 2).sum(axis=(1, 2))
    spin = (recording.angular_velocity[:, 1:] ** 2).sum(axis=(1, 2)) * 0.4 * BALL_RADIUS**2
    return 0.5 * (speed + spin) + GRAVITY * recording.position[:, 1:, 2].sum(axis=1)


def ball_depth(recording: Recording) -> float:
    """[m] deepest overlap of any two balls, or of one and the ground, in any sample."""
    from scipy.spatial import cKDTree

    deepest = 0.0
    for places in recording.position[:, 1:]:
        deepest = max(deepest, BALL_RADIUS - float(places[:, 2].min()))
        pairs = cKDTree(places).query_pairs(2 * BALL_RADIUS, output_type="ndarray")
        if len(pairs):
            gaps = np.linalg.norm(places[pairs[:, 0]] - places[pairs[:, 1]], axis=1)
            deepest = max(deepest, float(2 * BALL_RADIUS - gaps.min()))
    return deepest


def measure_elastic_balls(recording: Recording) -> dict[str, float]:
    energy = ball_energy(recording)
    fallen = energy[0] - GRAVITY * BALL_RADIUS * BALLS**3  # what is in play: nothing lies lower than on the ground
    return {
        "energy": np.abs(energy - energy[0]).max() / fallen,
        "penetration": ball_depth(recording) / BALL_RADIUS,
    }


def measure_inelastic_balls(recording: Recording) -> dict[str, float]:
    energy = ball_energy(recording)
    return {
        "penetration": ball_depth(recording) / BALL_RADIUS,
        "energy gained": max(0.0, float(np.diff(energy).max())) / energy[0],
    }


PILE_FALL, PILE_SIDE = 0.35, 4.0  # [m] between layers, width of the terrain


def pile_terrain() -> HeightField:
    """A hollow with ripples: concave on the large and on the small."""
    line = np.linspace(-0.5, 0.5, 33)
    x, y = np.meshgrid(line, line)
    heights = 2.0 * (x**2 + y**2) + 0.05 * np.sin(12 * x) * np.cos(10 * y)
    return HeightField(heights, (PILE_SIDE, PILE_SIDE))


def pile(count: int, rolling_friction: float = 0.0) -> Scene:
    """Mixed bodies, spheres, boxes and capsules in turn, that fall in layers into a hollow of rippled terrain.

    Without ``rolling_friction`` [m] some ball rolls on in its ripple, and no more is heard of it for minutes.
    """
    generator = np.random.default_rng(count)
    scene = Scene()
    scene.add_field(UniformGravity((0.0, 0.0, -GRAVITY)))
    material = Material(friction=0.6, rolling_friction=rolling_friction)
    scene.add_body(pile_terrain(), motion="static", material=material)
    size = 0.1 if count <= 100 else 0.06
    columns = 5 if count <= 100 else 8
    for number in range(count):
        cell = np.array([number % columns, number // columns % columns, number // columns**2])
        place = 3.2 * size * (cell - 0.5 * (columns - 1)) + generator.uniform(-0.1, 0.1, 3) * size
        place[2] = 0.6 + 3.2 * size * cell[2] + generator.uniform(0.0, 0.1) * size
        scale = size * generator.uniform(0.7, 1.0)
        shape = (
            Sphere(scale),
            Box((scale * generator.uniform(0.5, 1.0, 3)).tolist()),
            Capsule(0.6 * scale, 0.6 * scale),
        )[number % 3]
        axis = generator.normal(size=4)
        turn = axis / np.linalg.norm(axis)
        scene.add_body(shape, density=1000.0, position=place, orientation=turn, material=material)
    return scene


def terrain_height(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """[m] of the smooth ground that the samples were taken from."""
    u, v = x / PILE_SIDE, y / PILE_SIDE
    return 2.0 * (u**2 + v**2) + 0.05 * np.sin(12 * u) * np.cos(10 * v)


def measure_pile(recording: Recording) -> dict[str, float]:
    """Statistics only: each engine ends in another heap."""
    place, speed = recording.position[-1, 1:], recording.linear_velocity[-1, 1:]
    ground = terrain_height(place[:, 0], place[:, 1])
    inside = np.abs(place[:, :2]).max(axis=1) < 0.5 * PILE_SIDE
    return {
        "fallen through": float((inside & (place[:, 2] < ground)).sum()),
        "outside": float((~inside).sum()),
        "rms speed": math.sqrt(float((speed[inside] ** 2).sum(axis=1).mean())) if inside.any() else math.inf,
        "mean height": float(place[inside, 2].mean()) if inside.any() else math.nan,
    }


CASES = (
    HardCase(
        "overlapped", 17, "27 boxes that start a quarter inside each other", "no more energy than lifting them apart",
        overlapped, 2.0, measure_overlapped, "kinetic energy", "of the lift", 1.0, sampling=EVERY_STEP, order=False,
        chaotic=True, goal={60: 1.0, 240: 1.0},
    ),
    HardCase(
        "balls_elastic", 28, "216 balls dropped, e = 1, no friction", "energy", partial(ball_cube, 1.0, 0.0), 2.0,
        measure_elastic_balls, "energy", "relative", 1e-3, sampling=0.1, chaotic=True, goal={240: 1e-9},
    ),
    HardCase(
        "balls_inelastic", 28, "216 balls dropped, e = 0", "no overlap", partial(ball_cube, 0.0, 0.5), 2.0,
        measure_inelastic_balls, "penetration", "radii", 1e-3, sampling=0.1, chaotic=True, goal={240: 1e-6},
    ),
    *(
        HardCase(
            f"pile_{count}", 29, f"{count} mixed bodies on concave terrain", "nothing falls through; it settles",
            partial(pile, count), duration, measure_pile, "fallen through", "bodies", 0.0, sampling=0.5, chaotic=True,
            order=False, goal={60: 0.0, 240: 0.0},
        )
        for count, duration in ((100, 6.0), (1000, 6.0))
    ),
)  # fmt: skip
