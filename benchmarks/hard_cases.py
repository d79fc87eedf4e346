"""Our engine on the hard cases: error, residual and cost of a step.

    python -m benchmarks.hard_cases [name ...] [--rates 60 240 960] [--tolerance 1e-12] [--awake] [--all] [--list]

A name may be the first letters of several. One line a case: the headline error at each rate, the worst residual, and
the CPU microseconds of a step. ``--all`` shows every error that the case measures.
"""

from __future__ import annotations

import argparse
import math
import time
from dataclasses import replace

from avalanche_gym import physics
from avalanche_gym.physics.scenes import HARD_CASES, UNBUILT, HardCase
from avalanche_gym.physics.scenes.recording import record

RATES = (60, 240, 960)


def run(case: HardCase, options: physics.Options) -> tuple[dict[str, float], float, float, str]:
    """Errors, worst residual, CPU us a step, and what went wrong."""
    try:
        recording, others, report = record(case, options)
        cost = cost_of_a_step(case, options)
    except (ValueError, physics.PhysicsError, RuntimeError) as error:
        if case.refusal and isinstance(error, ValueError):
            return {case.error: 0.0}, 0.0, 0.0, f"refused: {error}"
        return {case.error: math.inf}, math.nan, math.nan, f"{type(error).__name__}: {error}"
    return case.errors(recording, *others), float(report.residual[0]), cost, ""


def cost_of_a_step(case: HardCase, options: physics.Options) -> float:
    """CPU us, with one call of ``World.step`` for all steps unless the case drives something before each."""
    world = physics.World(case.scene(), options=options)
    total = min(round(case.duration / options.time_step), 20_000)
    start = time.process_time()
    if case.drive is None:
        world.step(total)
    else:
        for number in range(total):
            case.drive(world, number * options.time_step, options.time_step)
            world.step(1)
    return (time.process_time() - start) / total * 1e6


def show(case: HardCase, rates: list[int], options: physics.Options, everything: bool) -> None:
    if case.refusal != "required":
        try:
            world = physics.World(case.scene())
            world.step(1)  # compiles what the scene needs
        except (ValueError, physics.PhysicsError):
            pass
    columns, notes, residuals, costs = [], [], [], []
    for rate in rates:
        errors, residual, cost, note = run(case, replace(options, time_step=1.0 / rate))
        columns.append(errors)
        residuals.append(residual)
        costs.append(cost)
        if note and note not in notes:
            notes.append(note)
    heads = " ".join(f"{errors.get(case.error, math.nan):9.2e}" for errors in columns)
    goals = " ".join(f"{case.goal[rate]:8.0e}" if rate in case.goal else "       -" for rate in rates)
    cost = " ".join(f"{value:8.2f}" for value in costs)
    print(
        f"{case.number:2d} {case.name:24s} {heads}  {case.unit:15s} | {goals} | {max(residuals):8.1e} | {cost}",
        flush=True,
    )
    if everything:
        for name in columns[0]:
            if name != case.error:
                print(f"   {name:>24s} " + " ".join(f"{errors.get(name, math.nan):9.2e}" for errors in columns))
    for note in notes:
        print(f"   {note[:200]}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*")
    parser.add_argument("--rates", nargs="+", type=int, default=list(RATES), help="steps a second")
    parser.add_argument("--tolerance", type=float, default=physics.Options().tolerance)
    parser.add_argument("--awake", action="store_true", help="sleeping=False")
    parser.add_argument("--all", action="store_true", help="every error that a case measures")
    parser.add_argument("--list", action="store_true", help="names and titles, no runs")
    arguments = parser.parse_args()
    chosen = [
        case
        for name, case in HARD_CASES.items()
        if not arguments.names or any(name.startswith(prefix) for prefix in arguments.names)
    ]
    if arguments.list:
        for case in chosen:
            print(f"{case.number:2d} {case.name:24s} {case.title}; truth: {case.truth}")
        for missing in UNBUILT:
            print(f"{missing.number:2d} not built: {missing.title}: {missing.lacking}")
        return
    options = physics.Options(tolerance=arguments.tolerance, sleeping=not arguments.awake)
    rates = " ".join(f"{'1/' + str(rate):>9s}" for rate in arguments.rates)
    print(f"   {'case':24s} {rates}  {'unit':15s} | goals | residual | us a step")
    for case in chosen:
        show(case, arguments.rates, options, arguments.all)


if __name__ == "__main__":
    main()
