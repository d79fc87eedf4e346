"""What concave bodies cost, and how deep they ever overlap.

    python -m benchmarks.concave [ground] [triangles] [pairs]

ground     a rabbit of 5,000 triangles dropped on each kind of ground, facets of 0.2, 0.05 and 0.02 m
triangles  rabbits of 1,250 to 80,000 triangles on facets of 0.05 m: the cost follows the triangles near the contact
pairs      rabbits on each other, a torus on a peg, a hung torus, a nut on a bolt: scenes of physics/scenes/concave.py

CPU time of a step of 1/240 s: on average over the fall and the tumbling (the first two seconds), and the median at rest
without sleep, over a second. Penetration and speed: the largest after any step, and the largest of any body in the end.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator
from functools import partial

import numpy as np

from avalanche_gym import physics
from avalanche_gym.physics.scenes import concave
from avalanche_gym.physics.scenes.case import GRAVITY
from avalanche_gym.physics.scenes.concave import HEIGHT, ROUGH
from avalanche_gym.physics.shapes.rabbit import rabbit

RATE = 240  # [1/s]
MOVING, AWAKE = 2.0, 1.0  # [s]


def ground(kind: str, facet: float) -> physics.Shape:
    """Rough ground of 4 m with facets of this length [m]."""
    samples = round(4.0 / facet) + 1
    heights = 0.5 * facet * np.random.default_rng(7).random((samples, samples))
    if kind == "plane":
        return physics.Plane()
    if kind == "mesh":
        x = np.linspace(-2.0, 2.0, samples)
        points = np.stack([*np.meshgrid(x, x), heights], axis=-1).reshape(-1, 3)
        corner = (np.arange(samples - 1)[:, None] * samples + np.arange(samples - 1)).ravel()
        across = corner + samples + 1
        faces = [np.stack([corner, corner + 1, across], axis=1), np.stack([corner, across, across - 1], axis=1)]
        return physics.TriangleMesh(points, np.concatenate(faces))
    return physics.HeightField(heights, (4.0, 4.0), surface="smooth" if kind == "smooth" else "facets")


def dropped(kind: str, facet: float, triangles: int) -> physics.Scene:
    """A rabbit above the ground."""
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity((0.0, 0.0, -GRAVITY)))
    scene.add_body(ground(kind, facet), motion="static", material=ROUGH)
    turn = np.random.default_rng(3).normal(size=4)
    shape = rabbit(HEIGHT, triangles=triangles)
    orientation = turn / np.linalg.norm(turn)
    scene.add_body(shape, mass=1.0, position=(0.02, 0.01, 0.3), orientation=orientation, material=ROUGH)
    return scene


def cases(groups: list[str]) -> Iterator[tuple[str, partial[physics.Scene], float]]:
    """Name, scene and simulated time [s] until it is measured at rest."""
    if "ground" in groups:
        for kind, facets in (
            ("plane", (0.2,)),
            ("field", (0.2, 0.05, 0.02)),
            ("mesh", (0.2, 0.05)),
            ("smooth", (0.2,)),
        ):
            for facet in facets:
                yield f"rabbit on {kind}, {facet} m", partial(dropped, kind, facet, 5000), 4.0
    if "triangles" in groups:
        for triangles in (1250, 5000, 20000, 80000):
            yield f"{triangles} triangles, field", partial(dropped, "field", 0.05, triangles), 4.0
    if "pairs" in groups:
        yield "rabbit on rabbit", partial(concave.rabbits, 2), 6.0
        yield "heap of ten rabbits", partial(concave.rabbits, 10), 12.0
        yield "torus on a peg", concave.torus_on_peg, 4.0
        yield "hung torus, 512 segments", partial(concave.torus_pendulum, 512), 2.0
        yield "nut on a bolt, held", partial(concave.nut_on_bolt, 0.3), 2.0
        yield "nut on a bolt, sinking", partial(concave.nut_on_bolt, 0.02), 2.0


def measure(make: partial[physics.Scene], seconds: float) -> tuple[float, float, float, float]:
    """CPU time [us] of a step in motion and at rest, deepest overlap of all steps [m], speed in the end [m/s]."""
    world = physics.World(make(), options=physics.Options(time_step=1.0 / RATE, sleeping=False))
    world.step(1)
    costs, deepest = [], 0.0
    for _ in range(round((seconds + AWAKE) * RATE)):
        start = time.process_time()
        world.step(1)
        costs.append(1e6 * (time.process_time() - start))
        deepest = max(deepest, float(world.report().penetration[0]))
    speed = float(np.linalg.norm(world.linear_velocity[0], axis=1).max())
    moving, awake = costs[: round(MOVING * RATE)], costs[-round(AWAKE * RATE) :]
    return float(np.mean(moving)), float(np.median(awake)), deepest, speed


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    groups = ["ground", "triangles", "pairs"]
    parser.add_argument("groups", nargs="*", default=groups, metavar="group", help="ground, triangles, pairs; all")
    arguments = parser.parse_args()
    if not set(arguments.groups) <= set(groups):
        parser.error(f"groups are {', '.join(groups)}, not {', '.join(arguments.groups)}")
    print(f"{'':32s} {'in motion us':>13s} {'awake us':>9s} {'deepest m':>10s} {'speed m/s':>10s}")
    for name, make, seconds in cases(arguments.groups):
        moving, awake, deepest, speed = measure(make, seconds)
        print(f"{name:32s} {moving:13.1f} {awake:9.1f} {deepest:10.1e} {speed:10.1e}", flush=True)


if __name__ == "__main__":
    main()
