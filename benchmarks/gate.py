"""Nothing may get worse unnoticed: errors, orders, verdicts and costs of our engine against a stored baseline.

    python -m benchmarks.gate [--quick] [--update] [case ...]

Fails if a case that passed does not, if an error grows by half (and is above round-off), if an order falls by 0.3, or
if a step costs 15 % more. Costs are ratios to a fixed piece of work that is timed in turns with each scene, the
smallest of many short slices of both, which other programs hardly touch; what looks dearer gets more slices before it
counts. Ratios depend on the processor: on another one than the baseline's, costs are shown and do not fail.
``--update`` writes the baseline; do that with the change that moves a figure, and say why in the changelog.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
import time
from dataclasses import asdict, dataclass, field
from pathlib import Path

import numba
import numpy as np

from avalanche_gym import physics
from avalanche_gym.physics.scenes import HARD_CASES, HardCase
from avalanche_gym.physics.scenes.recording import record

from .report.analysis import ROUND_OFF, fitted_order
from .report.machine import processor

BASELINE = Path(__file__).parent / "baseline.json"
RATES = (60, 120, 240)
COST_RATE = 240  # [steps/s] at which the cost is measured
QUICK = (
    "throw", "rotation_dzhanibekov", "bounce_e08", "flat_drop", "slide", "stick", "slide_to_roll", "roll_down", "stack",
    "stack_heavy", "cradle", "crossed_beams", "trough", "internal_edges_box", "bullet_wall", "far_1e6", "units_small",
)  # fmt: skip
TOO_LONG = (
    "rabbit_heap",
    "torus_on_peg",
    "torus_pendulum",
    "nut_holds",
    "nut_screws_down",
    "card_house",
    "balls_elastic",
    "balls_inelastic",
    "pile_100",
    "pile_1000",
    "orbit_e05",
    "orbit_e09",
    "tippe_top",
)
ERROR_GROWTH, ORDER_LOSS, COST_GROWTH = 1.5, 0.3, 1.15
SLICES, SLICE, ATTEMPTS = 30, 0.004, 5  # timed pairs of a look, CPU time of each [s], looks before a cost counts
PRODUCTS = 20_000  # in one slice


@numba.njit(cache=True)
def products(count, blocks, vectors):  # type: ignore[no-untyped-def]
    """Products of 6 x 6 blocks with vectors, normalised, in an order that jumps about: the sort of work of a step."""
    number = blocks.shape[0]
    place = 0
    for _ in range(count):
        place = (place * 1103515245 + 12345) % number
        other = (place * 7 + 3) % number
        size = 1e-30
        for i in range(6):
            total = 0.0
            for j in range(6):
                total += blocks[place, i, j] * vectors[other, j]
            vectors[place, i] = total
            size += total * total
        size = math.sqrt(size)
        for i in range(6):
            vectors[place, i] /= size


@dataclass
class Measured:
    """What the gate knows of a case."""

    errors: dict[str, float] = field(default_factory=dict)  # by steps a second; infinite where it failed
    order: float = math.nan
    passes: bool = False
    cost: float = math.nan  # a step, in units of one of ``products``


def errors_of(case: HardCase) -> Measured:
    found = Measured()
    for rate in RATES:
        try:
            recording, others, _ = record(case, physics.Options(time_step=1.0 / rate))
            error = case.errors(recording, *others)[case.error]
        except (ValueError, RuntimeError) as failure:
            error = 0.0 if case.refusal and isinstance(failure, ValueError) else math.inf
        found.errors[str(rate)] = error
    found.passes = found.errors[str(COST_RATE)] <= case.passes_at
    if case.order:
        found.order = fitted_order([1.0 / rate for rate in RATES], list(found.errors.values()))
    return found


class Stopwatch:
    """The smallest CPU time of a step and of a product, over slices timed in turns.

    What else runs on a machine only ever adds time, to some slices more than to others; the smallest of many short ones
    is what the work itself takes. Bodies stay awake: a scene that sleeps costs nothing and tells nothing.
    """

    def __init__(self, case: HardCase) -> None:
        self.case = case
        self.blocks, self.vectors = np.random.default_rng(0).normal(size=(512, 6, 6)), np.ones((512, 6))
        options = physics.Options(time_step=1.0 / COST_RATE, sleeping=False)
        self.world = physics.World(case.scene(), options=options)
        self.world.step(1)
        products(1, self.blocks, self.vectors)
        total = round(case.duration * COST_RATE)
        self.steps = max(10, min(total, round(SLICE / max(run(case, self.world, min(total, 50)), 1e-7))))
        self.step = self.product = math.inf

    def look(self) -> float:
        """Time more slices; return the cost of a step in products."""
        for _ in range(SLICES):
            self.step = min(self.step, run(self.case, self.world, self.steps))
            start = time.process_time()
            products(PRODUCTS, self.blocks, self.vectors)
            self.product = min(self.product, (time.process_time() - start) / PRODUCTS)
        return self.step / self.product


def run(case: HardCase, world: physics.World, steps: int) -> float:
    """CPU seconds of a step, from the start of the motion."""
    world.reset()
    start = time.process_time()
    if case.drive is None:
        world.step(steps)
    else:
        for number in range(steps):
            case.drive(world, number / COST_RATE, 1.0 / COST_RATE)
            world.step(1)
    return (time.process_time() - start) / steps


def complaints(case: HardCase, now: Measured, before: Measured, comparable: bool) -> list[str]:
    """What got worse, in words; costs only where they can be compared."""
    found = []
    if before.passes and not now.passes:
        found.append(f"no longer passes: {now.errors[str(COST_RATE)]:.2e} {case.unit}, allowed {case.passes_at:.0e}")
    for rate, error in now.errors.items():
        old = before.errors.get(rate, math.inf)
        if not case.chaotic and error > max(ERROR_GROWTH * old, ROUND_OFF):
            found.append(f"error at 1/{rate} s {error:.2e} {case.unit}, was {old:.2e}")
    if now.order < before.order - ORDER_LOSS:
        found.append(f"order {now.order:.2f}, was {before.order:.2f}")
    if comparable and now.cost > COST_GROWTH * before.cost:
        found.append(f"a step costs {now.cost / before.cost - 1:+.0%}")
    return found


def check(case: HardCase, before: Measured | None, comparable: bool) -> tuple[Measured, list[str]]:
    now = errors_of(case)
    try:
        watch = Stopwatch(case)
        now.cost = watch.look()
        for _ in range(ATTEMPTS - 1):
            if before is not None and now.cost <= COST_GROWTH * before.cost:
                break
            now.cost = watch.look()
    except (ValueError, RuntimeError):
        now.cost = math.nan
    return now, [] if before is None else complaints(case, now, before, comparable)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cases", nargs="*", help="only these")
    parser.add_argument("--quick", action="store_true", help="one or two cases of each theme")
    parser.add_argument("--show-costs", action="store_true", help="costs are shown and do not fail")
    parser.add_argument("--update", action="store_true", help="write the baseline")
    arguments = parser.parse_args()
    stored = json.loads(BASELINE.read_text()) if BASELINE.exists() else {"processor": "", "cases": {}}
    baseline = {name: Measured(**values) for name, values in stored["cases"].items()}
    comparable, why = stored["processor"] == processor(), f"the baseline is of another processor, {stored['processor']}"
    if arguments.show_costs:
        comparable, why = False, "as asked for"
    if not comparable and not arguments.update:
        print(f"costs are shown and do not fail: {why}")
    names = arguments.cases or (QUICK if arguments.quick else [name for name in HARD_CASES if name not in TOO_LONG])
    worse = 0
    for name in names:
        before = None if arguments.update else baseline.get(name)
        now, found = check(HARD_CASES[name], before, comparable)
        baseline[name] = now if arguments.update else baseline.get(name, now)
        change = f"{now.cost / before.cost - 1:+6.0%}" if before and before.cost > 0.0 else "   new"
        shown = " ".join(f"{error:8.1e}" for error in now.errors.values())
        print(f"{name:24s} {shown} | order {now.order:5.2f} | cost {now.cost:9.1f} {change}", flush=True)
        for text in found:
            print(f"    WORSE: {text}")
        worse += bool(found)
    if arguments.update:
        values = {name: asdict(baseline[name]) for name in HARD_CASES if name in baseline}
        BASELINE.write_text(json.dumps({"processor": processor(), "cases": values}, indent=1) + "\n")
    if worse:
        print(f"{worse} cases got worse. If that is meant, say why in CHANGELOG.md and run with --update.")
    sys.exit(bool(worse))


if __name__ == "__main__":
    main()
