"""Whether the contact solver reaches its tolerance in every step of every hard case, and how far it is off where not.

    python -m benchmarks.residuals [name ...] [--rate 240] [--csv FILE]

Every case runs with the default options, and once more with ``sleeping=False``. One line a run: the steps, those whose
residual is above the tolerance, the worst residual, and the last resort that the solver needed. A name may be the first
letters of several. ``--csv`` adds rows to a file, and leaves out what the file holds already.
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from avalanche_gym import physics
from avalanche_gym.physics.report import METHODS
from avalanche_gym.physics.scenes import HARD_CASES, HardCase

from .csv_rows import append_row, read_rows

CHUNK = 64  # steps in one call; looked at one by one only where one of them is above the tolerance


@dataclass
class Residuals:
    """What one run of a case left, over all its steps."""

    case: str
    rate: int  # [steps/s]
    sleeping: bool
    steps: int = 0
    above: int = 0  # steps with a residual above the tolerance
    worst: float = 0.0
    method: str = METHODS[0]  # the last resort of any step
    contacts: int = 0  # most in any step
    overlap: float = 0.0  # [m] deepest at the end of any step
    seconds: float = 0.0  # CPU
    note: str = ""

    @property
    def key(self) -> tuple[str, int, bool]:
        return (self.case, self.rate, self.sleeping)


def reports(case: HardCase, world: physics.World) -> Iterator[physics.StepReport]:
    """Of all steps: of many at once where all are within the tolerance, else of each."""
    step = world.options.time_step
    total, done = round(case.duration / step), 0
    while done < total:
        count = min(CHUNK, total - done) if case.drive is None else 1
        if case.drive is not None:
            case.drive(world, done * step, step)
        before = world.snapshot() if count > 1 else None
        world.step(count)
        report = world.report()
        done += count
        if before is None or report.residual[0] <= world.options.tolerance:
            yield report
            continue
        world.restore(before)
        for _ in range(count):
            world.step(1)
            yield world.report()


def measure(case: HardCase, rate: int, sleeping: bool) -> Residuals:
    found, start = Residuals(case.name, rate, sleeping), time.process_time()
    try:
        options = physics.Options(time_step=1.0 / rate, sleeping=sleeping)
        for report in reports(case, physics.World(case.scene(), options=options)):
            residual = float(report.residual[0])
            found.steps += int(report.steps[0])
            found.above += residual > options.tolerance
            found.worst = max(found.worst, residual)
            found.method = max(found.method, str(report.tier[0]), key=METHODS.index)
            found.contacts = max(found.contacts, int(report.contacts[0]))
            found.overlap = max(found.overlap, float(report.penetration[0]))
    except (ValueError, physics.PhysicsError) as error:
        found.note = f"{type(error).__name__}: {error}".replace("\n", " ")[:120]
        found.worst = math.nan
    found.seconds = time.process_time() - start
    return found


def wanted(names: list[str]) -> list[HardCase]:
    """All cases that are stepped at all; those that begin with one of the names."""
    return [
        case
        for name, case in HARD_CASES.items()
        if case.refusal != "required" and (not names or any(name.startswith(prefix) for prefix in names))
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*")
    parser.add_argument("--rate", type=int, default=240, help="steps a second")
    parser.add_argument("--csv", type=Path, help="file of rows")
    arguments = parser.parse_args()
    done = {row.key for row in read_rows(Residuals, arguments.csv)} if arguments.csv else set()
    print(f"{'case':26s} {'sleeping':8s} {'steps':>7s} {'above':>6s} {'worst':>8s}  last resort")
    for case in wanted(arguments.names):
        for sleeping in (True, False):
            if (case.name, arguments.rate, sleeping) in done:
                continue
            row = measure(case, arguments.rate, sleeping)
            if arguments.csv:
                append_row(arguments.csv, row)
            print(
                f"{row.case:26s} {sleeping!s:8s} {row.steps:7d} {row.above:6d} {row.worst:8.1e}  {row.method} "
                f"({row.contacts} contacts, overlap {row.overlap:.1e} m, {row.seconds:.1f} s) {row.note}",
                flush=True,
            )


if __name__ == "__main__":
    main()
