"""What a scene needs: the cost of each feature, from pairs of scenes that differ in it alone, timed in turns."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from avalanche_gym import physics
from avalanche_gym.physics import Box, HeightField, Material, Plane, PointGravity, Scene, Sphere, TriangleMesh

STEPS = 80  # of 1/240 s, in which the box slides without stopping
SPEED = 2.0  # [m/s] of the box at first; at rest it would cost next to nothing
RUNS, REPEATS = 40, 7


def sliding_box(
    ground: physics.Shape | None = None, friction: float = 0.5, restitution: float = 0.0, motion: str = "static",
    others: int = 0,
) -> Scene:  # fmt: skip
    """A box that slides over the ground; ``others`` float far away."""
    scene = Scene()
    scene.add_field(physics.UniformGravity((0.0, 0.0, -9.81)))
    material = Material(friction=friction, restitution=restitution)
    scene.add_body(Plane() if ground is None else ground, motion=motion, material=material)
    scene.add_body(
        Box((0.1, 0.2, 0.1)), mass=1.0, position=(0.03, 0.04, 0.1), linear_velocity=(SPEED, 0.0, 0.0), material=material
    )
    for number in range(others):
        scene.add_body(Box((0.1, 0.2, 0.1)), mass=1.0, position=(100.0 * number, 0.0, 1e7), material=material)
    return scene


def flyer(inertia: tuple[float, float, float], spin: tuple[float, float, float], point: bool = False) -> Scene:
    scene = Scene()
    if point:
        scene.add_field(PointGravity((0.0, 0.0, 0.0), 100.0))
    else:
        scene.add_field(physics.UniformGravity((0.0, 0.0, -9.81)))
    scene.add_body(
        Sphere(0.1), mass=1.0, inertia=inertia, angular_velocity=spin, position=(10.0, 0.0, 0.0),
        linear_velocity=(0.0, 3.0, 0.0),
    )  # fmt: skip
    return scene


def flat_field() -> HeightField:
    return HeightField(np.zeros((65, 65)), (8.0, 8.0))


def flat_mesh() -> TriangleMesh:
    line = np.linspace(-4.0, 4.0, 65)
    x, y = np.meshgrid(line, line)
    corner = np.arange(64 * 65).reshape(64, 65)[:, :64].ravel()
    upper, lower = (corner, corner + 1, corner + 66), (corner, corner + 66, corner + 65)
    faces = np.concatenate([np.stack(upper, axis=1), np.stack(lower, axis=1)])
    return TriangleMesh(np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1), faces)


SPHERE, TOP, BODY = (0.2, 0.2, 0.2), (0.2, 0.2, 0.3), (0.1, 0.2, 0.3)
SPIN = (1.0, 2.0, 3.0)
PAIRS: dict[str, tuple[Callable[[], Scene], Callable[[], Scene]]] = {
    # feature: scene with it, scene without it
    "collisions": (sliding_box, lambda: flyer(SPHERE, (0.0, 0.0, 0.0))),
    "friction": (sliding_box, lambda: sliding_box(friction=0.0)),
    "restitution": (lambda: sliding_box(restitution=0.5), sliding_box),
    "spin": (lambda: flyer(SPHERE, SPIN), lambda: flyer(SPHERE, (0.0, 0.0, 0.0))),
    "symmetric top": (lambda: flyer(TOP, SPIN), lambda: flyer(SPHERE, SPIN)),
    "triaxial top": (lambda: flyer(BODY, SPIN), lambda: flyer(SPHERE, SPIN)),
    "point gravity": (lambda: flyer(SPHERE, SPIN, point=True), lambda: flyer(SPHERE, SPIN)),
    "height fields": (lambda: sliding_box(flat_field()), sliding_box),
    "triangle meshes": (lambda: sliding_box(flat_mesh()), sliding_box),
    "kinematic bodies": (lambda: sliding_box(motion="kinematic"), sliding_box),
    "30 bodies far away": (lambda: sliding_box(others=30), sliding_box),
}


@dataclass(frozen=True)
class FeatureCost:
    """CPU us of a step with and without a feature: medians, and the median of the ratios of neighbouring runs."""

    feature: str
    with_it: float
    without: float
    ratio: float
    modelled: str  # what world.features says of the scene with it
    left_out: str


def measure_pair(feature: str, runs: int = RUNS, repeats: int = REPEATS) -> FeatureCost:
    """Runs of both scenes in turns, each from its start, so that a machine that slows down slows both."""
    worlds = [physics.World(build()) for build in PAIRS[feature]]
    for world in worlds:
        world.step(STEPS)
    times = np.zeros((repeats, 2))
    for repeat in range(repeats):
        for _ in range(runs):
            for number, world in enumerate(worlds):
                world.reset()
                start = time.process_time()
                world.step(STEPS)
                times[repeat, number] += (time.process_time() - start) / (runs * STEPS) * 1e6
    found = worlds[0].features
    with_it, without = np.median(times, axis=0)
    ratio = float(np.median(times[:, 0] / times[:, 1]))
    return FeatureCost(
        feature, float(with_it), float(without), ratio, ", ".join(found.modelled), ", ".join(found.left_out)
    )
