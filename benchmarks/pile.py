"""A pile of many bodies beside Rapier in one run: CPU time of a step, overlap, and what sleeping saves.

    python -m benchmarks.pile [bodies] [--steps 360] [--rate 60] [--substeps 8] [--no-events] [--sleep] [--boxes]
                             [--rolling 0.005] [--alone]

``bodies`` is 100 or 1000 (the hard cases ``pile_100`` and ``pile_1000``) or any other number; ``--boxes`` takes boxes
of the same density alone. Both engines step in turn, 30 steps at a time, so that a busy machine slows both. Sleeping is
off on both sides. ``--alone`` and ``--sleep`` run ours alone, and so does ``--rolling``, rolling friction [m] for all.
"""

from __future__ import annotations

import argparse
import time

import numpy as np

from avalanche_gym import physics
from avalanche_gym.physics.scenes import HARD_CASES
from avalanche_gym.physics.scenes.piles import pile

CHUNK = 30


def boxes_only(scene: physics.Scene) -> physics.Scene:
    """The same places, with a box for every dynamic body: nothing rolls."""
    boxes = physics.Scene()
    boxes.add_field(physics.UniformGravity((0.0, 0.0, -9.81)))
    generator = np.random.default_rng(0)
    for body in scene.bodies:
        assert body is not None
        if body.motion == "static":
            boxes.add_body(body.shape, motion="static", material=body.material)
        else:
            half = 0.08 * generator.uniform(0.6, 1.0, 3)
            boxes.add_body(physics.Box(half), density=1000.0, position=body.position, orientation=body.orientation)
    return boxes


def timed(step: object, count: int) -> float:
    start = time.process_time()
    step(count)  # type: ignore[operator]
    return (time.process_time() - start) / count * 1e3


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("bodies", nargs="?", type=int, default=100)
    parser.add_argument("--steps", type=int, default=360)
    parser.add_argument("--rate", type=int, default=60, help="steps a second")
    parser.add_argument("--substeps", type=int, default=physics.Options().substeps)
    parser.add_argument("--no-events", action="store_true", help="impacts are not located in time")
    parser.add_argument("--sleep", action="store_true", help="ours alone, with sleeping")
    parser.add_argument("--alone", action="store_true", help="ours alone")
    parser.add_argument("--boxes", action="store_true", help="boxes only")
    parser.add_argument("--rolling", type=float, default=0.0, help="rolling friction [m]; ours alone")
    arguments = parser.parse_args()
    scene = pile(arguments.bodies, arguments.rolling)
    if arguments.boxes:
        scene = boxes_only(scene)
    options = physics.Options(
        time_step=1.0 / arguments.rate,
        substeps=arguments.substeps,
        events=not arguments.no_events,
        sleeping=arguments.sleep,
    )
    physics.World(scene, options=options).step(3)  # compiles
    world = physics.World(scene, options=options)
    peer = None
    if not (arguments.alone or arguments.sleep or arguments.rolling):
        from benchmarks.peers.rapier_engine import Rapier

        peer = Rapier(HARD_CASES["pile_100"], scene, options.time_step)
    sums = np.zeros(2)
    for done in range(CHUNK, arguments.steps + 1, CHUNK):
        costs = timed(world.step, CHUNK), timed(peer.step, CHUNK) if peer else 0.0
        sums += costs
        report, contacts = world.report(), world.contacts()
        depth = np.maximum(-contacts["gap"], 0.0) * 1e3 if len(contacts) else np.zeros(1)
        speed = np.median(np.linalg.norm(world.linear_velocity[0, 1:], axis=1))
        print(
            f"{done:5d}: {costs[0]:8.4f} ms"
            + (f", Rapier {costs[1]:7.3f} ms" if peer else f", {int(world.sleeping.sum()):4d} asleep")
            + f"; median speed {speed:.0e} m/s, {len(contacts):5d} contacts, {report.tier[0]},"
            + f" residual {report.residual[0]:.0e},"
            + f" overlap 99 % {np.percentile(depth, 99):.4f} mm, most {depth.max():.4f} mm",
            flush=True,
        )
    if peer:
        print(f"ours / Rapier: {sums[0] / sums[1]:.2f}")


if __name__ == "__main__":
    main()
