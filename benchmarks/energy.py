"""Does energy grow where bodies meet ground? Bodies of every shape, thrown with spin at ground of every kind.

    python -m benchmarks.energy [--grounds plane facets] [--shapes box] [--rates 60] [--worst 10]

A row is a ground, a shape and a rate, with friction and restitution from 0 to 1 and spins from 0 to 30 rad/s. Growth is
relative to the energy of the throw, kinetic and that of a fall of one metre: the largest in any step, and the largest
above the start at any time. Overlap is relative to the thickness of the body. ``limit`` counts the steps that met the
limit of events. All starts are drawn from fixed seeds. ``--worst`` lists the throws with the largest growth in a step.
"""

from __future__ import annotations

import argparse
import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from avalanche_gym import physics

THROWS, TIME = 6, 1.5  # throws of each pair of friction and restitution; [s] of each
RESTITUTIONS, FRICTIONS = (0.0, 0.5, 1.0), (0.0, 0.3, 1.0)
SPINS = (0.0, 5.0, 10.0, 15.0, 20.0, 30.0)  # [rad/s]
GRAVITY, EXTENT, PLANET = 9.81, 8.0, 5.0
GROUNDS = ("plane", "box", "facets", "mesh", "smooth", "planet")
SHAPES = ("sphere", "capsule", "box", "cylinder", "hull", "stick", "compound")


@dataclass(frozen=True)
class Throw:
    """The step of one throw in which energy grew most."""

    growth: float  # relative
    total: float  # relative, above the start
    overlap: float  # relative
    limits: int
    text: str


def shape_of(name: str) -> tuple[physics.Shape, float]:
    """A shape, and its thickness [m]."""
    generator = np.random.default_rng(11)
    shapes: dict[str, tuple[physics.Shape, float]] = {
        "sphere": (physics.Sphere(0.12), 0.24),
        "capsule": (physics.Capsule(0.08, 0.15), 0.16),
        "box": (physics.Box((0.15, 0.1, 0.07)), 0.14),
        "cylinder": (physics.Cylinder(0.1, 0.15), 0.2),
        "hull": (physics.ConvexHull(0.1 * generator.normal(size=(10, 3))), 0.2),
        "stick": (physics.Box((0.02, 0.02, 0.3)), 0.04),
        "compound": (
            physics.Compound(
                [
                    (physics.Sphere(0.1), (-0.12, 0.0, 0.0), (1, 0, 0, 0)),
                    (physics.Box((0.12, 0.05, 0.05)), (0.1, 0.0, 0.0), (1, 0, 0, 0)),
                ]
            ),
            0.1,
        ),
    }
    return shapes[name]


def heights() -> NDArray[np.float64]:
    """Rough ground: slopes of about 30 degrees."""
    return 0.1 * np.random.default_rng(5).normal(size=(33, 33))


def mesh() -> physics.TriangleMesh:
    rough = heights()
    count = len(rough)
    line = np.linspace(-EXTENT / 2, EXTENT / 2, count)
    x, y = np.meshgrid(line, line)
    i, j = (index.ravel() for index in np.mgrid[: count - 1, : count - 1])
    a = i * count + j
    faces = np.concatenate([np.stack([a, a + 1, a + count + 1], 1), np.stack([a, a + count + 1, a + count], 1)])
    return physics.TriangleMesh(np.stack([x, y, rough], axis=2).reshape(-1, 3), faces)


def ground_of(name: str) -> tuple[physics.Shape, float, float]:
    """A ground, the height [m] of its body, and that over which bodies start."""
    if name == "plane":
        return physics.Plane(), 0.0, 0.0
    if name == "box":
        return physics.Box((EXTENT / 2, EXTENT / 2, 0.1)), -0.1, 0.0
    if name == "planet":
        return physics.Sphere(PLANET), 0.0, PLANET
    if name == "mesh":
        return mesh(), 0.0, 0.35
    surface = "smooth" if name == "smooth" else "facets"
    return physics.HeightField(heights(), (EXTENT, EXTENT), surface=surface), 0.0, 0.35


def throw(ground: str, shape: str, rate: int, restitution: float, friction: float) -> list[Throw]:
    """Throw a body in as many worlds as there are spins, one after the other spinning faster."""
    scene = physics.Scene()
    if ground == "planet":
        scene.add_field(physics.PointGravity(center=(0, 0, 0), mu=GRAVITY * PLANET**2))
    else:
        scene.add_field(physics.UniformGravity((0.0, 0.0, -GRAVITY)))
    surface, height, top = ground_of(ground)
    material = physics.Material(friction=friction, restitution=restitution)
    scene.add_body(surface, motion="static", position=(0, 0, height), material=material)
    solid, thickness = shape_of(shape)
    body = scene.add_body(solid, mass=1.0, position=(0, 0, top + 1.0), material=material)
    world = physics.World(scene, num_worlds=THROWS, options=physics.Options(time_step=1.0 / rate))
    seed = [GROUNDS.index(ground), SHAPES.index(shape), round(10 * restitution), round(10 * friction)]
    generator = np.random.default_rng(seed)
    for number, spin in enumerate(SPINS):
        turn, axis = generator.normal(size=4), generator.normal(size=3)
        world.set_state(
            body, world=number, orientation=turn / np.linalg.norm(turn),
            position=(*generator.uniform(-0.5, 0.5, 2), top + generator.uniform(0.4, 0.8)),
            linear_velocity=generator.normal(size=3) * (1.5, 1.5, 1.0),
            angular_velocity=spin * axis / np.linalg.norm(axis),
        )  # fmt: skip
    energy = world.kinetic_energy() + world.potential_energy()
    start, scale, before = energy, world.kinetic_energy() + GRAVITY, energy
    growth, total, overlap = np.full((3, THROWS), -1.0)
    limits, step_of = np.zeros((2, THROWS), dtype=int)
    inside = np.full(THROWS, True)
    for step in range(round(TIME * rate)):
        world.step(1)
        if ground not in ("plane", "planet"):  # what reaches the edge of the ground is not watched further
            inside &= np.abs(world.position[:, body, :2]).max(axis=1) < EXTENT / 2 - 0.5
        energy = world.kinetic_energy() + world.potential_energy()
        gained = np.where(inside, (energy - before) / scale, -1.0)
        step_of = np.where(gained > growth, step, step_of)
        growth = np.maximum(growth, gained)
        total = np.where(inside, np.maximum(total, (energy - start) / scale), total)
        report = world.report()
        overlap = np.where(inside, np.maximum(overlap, report.penetration / thickness), overlap)
        limits += np.where(inside, report.event_limit, 0)
        before = energy
    texts = [
        f"{ground} {shape} 1/{rate} e {restitution} mu {friction} spin {SPINS[number]:g}, step {step_of[number]}"
        for number in range(THROWS)
    ]
    rows = zip(growth.tolist(), total.tolist(), overlap.tolist(), limits.tolist(), texts, strict=True)
    return [Throw(*row) for row in rows]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--grounds", nargs="+", default=GROUNDS)
    parser.add_argument("--shapes", nargs="+", default=SHAPES)
    parser.add_argument("--rates", nargs="+", type=int, default=[30, 60, 240])
    parser.add_argument("--restitutions", nargs="+", type=float, default=RESTITUTIONS)
    parser.add_argument("--frictions", nargs="+", type=float, default=FRICTIONS)
    parser.add_argument("--worst", type=int, default=0)
    arguments = parser.parse_args()
    print(f"{'ground':8s} {'shape':9s} {'rate':>4s}  in a step  above start    overlap  limit")
    all_throws: list[Throw] = []
    for ground, shape, rate in itertools.product(arguments.grounds, arguments.shapes, arguments.rates):
        throws: list[Throw] = []
        for restitution, friction in itertools.product(arguments.restitutions, arguments.frictions):
            throws += throw(ground, shape, rate, restitution, friction)
        growth, total = (max(max(values), 0.0) for values in zip(*((t.growth, t.total) for t in throws), strict=True))
        overlap, limits = max(t.overlap for t in throws), sum(t.limits for t in throws)
        print(f"{ground:8s} {shape:9s} {rate:4d} {growth:10.1e} {total:12.1e} {overlap:10.1e} {limits:6d}", flush=True)
        all_throws += throws
    for one in sorted(all_throws, key=lambda one: -one.growth)[: arguments.worst]:
        print(f"{one.growth:9.1e} {one.total:9.1e} {one.overlap:9.1e} {one.limits:3d}  {one.text}")


if __name__ == "__main__":
    main()
