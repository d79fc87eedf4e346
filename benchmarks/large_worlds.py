"""What a step costs a body as a world grows: mixed bodies scattered over terrain, and the exponent of that cost.

    python -m benchmarks.large_worlds [--bodies 100 1000 10000] [--events]

CPU time of a step of 1/120 s, divided by the number of bodies, once they have fallen on the ground and roll and slide
on it; building the world, and adding and removing one body while it runs, apart. The exponent is that of cost against
number, 0 for a cost a body that is constant.
"""

from __future__ import annotations

import argparse
import time

import numpy as np

from avalanche_gym import physics
from avalanche_gym.physics.scenes.scattered import scattered

STEP, FALL, SAMPLES, STEPS = 1.0 / 120.0, 45, 5, 4


def measure(count: int, events: bool) -> tuple[float, float, float, float, float]:
    """CPU time of a step and body [us], of building [s], of adding and of removing a body [us]; contacts a body."""
    start = time.process_time()
    world = physics.World(
        scattered(count), options=physics.Options(time_step=STEP, tolerance=1e-6, events=events, sleeping=False)
    )
    built = time.process_time() - start
    world.step(FALL)
    costs = []
    for _ in range(SAMPLES):
        start = time.process_time()
        world.step(STEPS)
        costs.append((time.process_time() - start) / STEPS / count * 1e6)
    contacts = float(world.report().contacts[0]) / count
    added, removed = [], []
    for _ in range(20):
        start = time.process_time()
        handle = world.add_body(physics.Sphere(0.1), position=(0.0, 0.0, 9.0))
        added.append(time.process_time() - start)
        start = time.process_time()
        world.remove_body(handle)
        removed.append(time.process_time() - start)
    return float(np.median(costs)), built, float(np.median(added)) * 1e6, float(np.median(removed)) * 1e6, contacts


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bodies", nargs="+", type=int, default=[100, 300, 1000, 3000, 10000])
    parser.add_argument("--events", action="store_true", help="locate impacts in time")
    arguments = parser.parse_args()
    measure(min(arguments.bodies), arguments.events)  # compiles
    titles = ("us a body, step", "contacts a body", "built in s", "add us", "remove us")
    print(f"{'bodies':>7s}", *(f"{title:>16s}" for title in titles))
    costs = []
    for count in arguments.bodies:
        cost, built, added, removed, contacts = measure(count, arguments.events)
        costs.append(cost)
        print(f"{count:7d} {cost:16.2f} {contacts:16.2f} {built:16.2f} {added:16.0f} {removed:16.0f}", flush=True)
    if len(costs) > 1:
        slope = np.polyfit(np.log(arguments.bodies), np.log(costs), 1)[0]
        print(f"exponent of the cost a body: {slope:.3f}")


if __name__ == "__main__":
    main()
