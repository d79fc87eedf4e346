"""What contact costs: our engine and MuJoCo in turns in one run, and what a scene at rest makes the solver do.

    python -m benchmarks.contact_costs [--rate 240] [--runs 15]

CPU microseconds of a step, one core, the median of the runs (and the smallest). MuJoCo has a contact time constant of
two steps and the settings of its adapter; the ratio is the median of the ratios of neighbouring runs. Ours runs with
the default options and with ``sleeping=False``. Needs the extra ``bench``.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable

import numpy as np

from avalanche_gym import physics
from avalanche_gym.physics.scenes import HARD_CASES, HardCase

from .peers.mujoco_engine import engines

STEPS = 400  # timed in each run
SETTLE = 1.0  # [s] before a resting scene is timed

Stepper = Callable[[int], None]


def ours(case: HardCase, rate: int, sleeping: bool) -> physics.World:
    return physics.World(case.scene(), options=physics.Options(time_step=1.0 / rate, sleeping=sleeping))


def seconds(step: Stepper, steps: int) -> float:
    start = time.process_time()
    step(steps)
    return time.process_time() - start


def compare(name: str, rate: int, runs: int, rest: bool) -> None:
    """Times of all three in turns; a scene that moves starts anew in every run."""
    case, mujoco = HARD_CASES[name], engines()[0]
    settle = round(SETTLE * rate) if rest else 0
    steps = STEPS if rest else min(STEPS, round(0.6 * rate))  # what slides must not come to rest
    times = np.zeros((runs, 3))
    steppers: list[Stepper] = []
    for run in range(runs + 1):  # the first warms up
        if run == 0 or not rest:
            steppers = [ours(case, rate, sleeping).step for sleeping in (True, False)]
            steppers += [mujoco.build(case, case.scene(), 1.0 / rate).step]
            for step in steppers:
                step(max(settle, 2))
        spent = [seconds(step, steps) / steps * 1e6 for step in steppers]
        if run:
            times[run - 1] = spent
    for number, label in enumerate(("default", "sleeping=False", "MuJoCo")):
        own = times[:, number]
        text = f"{name:12s} 1/{rate:<4d} {label:15s} {np.median(own):7.2f} us ({own.min():.2f})"
        if number < 2:
            text += f"   {np.median(own / times[:, 2]):5.2f} of MuJoCo"
        print(text, flush=True)


def at_rest(name: str, rate: int) -> None:
    """What the solver does in each step of an awake scene at rest: a certificate, and factorisations beyond it."""
    case = HARD_CASES[name]
    world = ours(case, rate, False)
    world.step(round(SETTLE * rate))
    factorisations, beyond = 0, 0
    for _ in range(STEPS):
        world.step(1)
        report = world.report()
        factorisations += int(report.iterations[0])
        beyond += report.tier[0] not in ("certificate", "single contact")
    contacts = int(world.report().contacts[0])
    print(
        f"{name:12s} 1/{rate:<4d} {contacts:4d} contacts, {STEPS} steps: {beyond} needed more than the certificate, "
        f"{factorisations} factorisations",
        flush=True,
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rate", type=int, default=240, help="steps a second")
    parser.add_argument("--runs", type=int, default=15)
    arguments = parser.parse_args()
    for name, rest in (("stack", True), ("slide", False), ("stack_heavy", True)):
        compare(name, arguments.rate, arguments.runs, rest)
    print("\nscenes at rest, sleeping=False")
    for name in ("stick", "stack", "stack_heavy", "table", "card_house"):
        at_rest(name, arguments.rate)


if __name__ == "__main__":
    main()
