"""What located impacts cost: balls that bounce alone on a plane, each an island of its own, with and without events.

    python -m benchmarks.impacts [--balls 1 10 100 1000] [--steps 240] [--rate 60] [--restitution 0.8]

The cost a body and step is about the same for one as for a thousand if an impact costs what its own island does.
"""

from __future__ import annotations

import argparse
import math
import time

from avalanche_gym import physics

RADIUS = 0.1
REPEATS = 5


def bouncing_balls(count: int, restitution: float) -> physics.Scene:
    """Balls that meet nobody, let go at different heights."""
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity((0.0, 0.0, -9.81)))
    material = physics.Material(restitution=math.sqrt(restitution))
    scene.add_body(physics.Plane(), motion="static", material=material)
    side = math.ceil(math.sqrt(count))
    for number in range(count):
        row, column = divmod(number, side)
        height = 1.5 * RADIUS + RADIUS * (0.618 * number % 1.0)
        place = (5.0 * RADIUS * row, 5.0 * RADIUS * column, height)
        scene.add_body(physics.Sphere(RADIUS), mass=1.0, position=place, material=material)
    return scene


def cost(scene: physics.Scene, steps: int, options: physics.Options) -> tuple[float, float]:
    """CPU time of a step [us] and impacts in a step, the least of some repeats."""
    world = physics.World(scene, options=options)
    world.step(3)
    times = []
    for _ in range(REPEATS):
        world.reset()
        start = time.process_time()
        world.step(steps)
        times.append(time.process_time() - start)
    return min(times) / steps * 1e6, float(world.report().events[0]) / steps


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--balls", type=int, nargs="+", default=[1, 10, 100, 1000])
    parser.add_argument("--steps", type=int, default=240)
    parser.add_argument("--rate", type=int, default=60, help="steps a second")
    parser.add_argument("--restitution", type=float, default=0.8)
    arguments = parser.parse_args()
    print(f"{'balls':>6} {'us a body and step':>20} {'without events':>16} {'impacts a body and step':>24}")
    for count in arguments.balls:
        scene = bouncing_balls(count, arguments.restitution)
        with_events, impacts = (
            value / count for value in cost(scene, arguments.steps, physics.Options(time_step=1.0 / arguments.rate))
        )
        plain, _ = cost(scene, arguments.steps, physics.Options(time_step=1.0 / arguments.rate, events=False))
        print(f"{count:6d} {with_events:20.2f} {plain / count:16.2f} {impacts:24.3f}")


if __name__ == "__main__":
    main()
