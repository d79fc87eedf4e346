"""Measure and write the report.

    python -m benchmarks.report [--quick] [--out docs/report] [--fresh] [case ...]
    python -m benchmarks.report --point CASE ENGINE RATE [TOLERANCE]

Interrupted, it goes on where it was: points that are in the CSV file are not measured again (``--fresh`` does). Points
that failed are tried again. ``--costs`` times the rows of the file once more, engine beside engine, and keeps their
errors, which do not depend on what else the machine does. ``--point`` measures one row and prints it.
"""

from __future__ import annotations

import argparse
import os
import platform
import resource
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import TypeVar

import numpy as np

from ..csv_rows import append_row, read_rows, write_rows
from ..peers import Engine, all_engines
from ..residuals import Residuals, wanted
from .features import PAIRS, FeatureCost, measure_pair
from .machine import processor
from .measured import Measured
from .plan import FULL, LONG, QUICK, VERDICT_RATE, Budget, Point, points
from .push import PushCost, measure_pushes
from .table import FAILED, OK, Row, append, read, write
from .worker import Worker, measure

Wanted = TypeVar("Wanted")
ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "RAYON_NUM_THREADS")


@dataclass(frozen=True)
class CompileCost:
    """Of the engine's kernels."""

    date: str
    seconds: float  # CPU


def compile_seconds() -> float:
    """CPU seconds from an empty cache to the first step of a contact scene, in a fresh process."""
    import tempfile

    code = "from avalanche_gym import physics; from avalanche_gym.physics.scenes import HARD_CASES as c; "
    code += "physics.World(c['stack'].scene()).step(1)"
    with tempfile.TemporaryDirectory() as cache:
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run([sys.executable, "-c", code], env={**os.environ, "NUMBA_CACHE_DIR": cache}, check=True,
                       stderr=subprocess.DEVNULL)  # fmt: skip
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def compile_text(folder: Path, arguments: argparse.Namespace) -> str:
    """Measured once, and again by a fresh run."""
    path = folder / "compile.csv"
    found = [] if arguments.fresh else read_rows(CompileCost, path)
    if not found and arguments.page:
        return "not measured in this call"
    if not found:
        found = [CompileCost(datetime.now(UTC).strftime("%Y-%m-%d"), compile_seconds())]
        write_rows(path, found)
    return f"{found[0].seconds:.0f} CPU s from an empty cache to the first step of a stack ({found[0].date})"


def heading(command: str, started: float, arguments: argparse.Namespace, rows: list[Row]) -> dict[str, str]:
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else float("nan")
    dates = sorted(row.date for row in rows if row.date)
    return {
        "data": f"measured from {dates[0]} to {dates[-1]} UTC; each row has its date" if dates else "none",
        "command": f"`{command}`".replace("|", "/"),
        "machine": f"{processor()}, {os.cpu_count()} cores, {platform.system()} {platform.machine()}",
        "load while it ended": f"{load:.1f} (above 1, other programs took caches and memory from what was measured)",
        "versions": f"Python {platform.python_version()}, NumPy {np.__version__}, Numba {version('numba')}",
        "compiling, once": compile_text(Path(arguments.out), arguments),
        "took": f"{(time.monotonic() - started) / 60:.1f} minutes in this call"
        + (", quick form" if arguments.quick else ""),
        **({"note": arguments.note} if arguments.note else {}),
    }


class Progress:
    """Prints how far a list of things to measure is, and how long the rest may take."""

    def __init__(self, total: int) -> None:
        self.total, self.done, self.started = total, 0, time.monotonic()

    def show(self, row: Row) -> None:
        self.done += 1
        left = (time.monotonic() - self.started) / self.done * (self.total - self.done) / 60
        text = f"{row.status}: {row.note[:60]}"
        if row.status == OK:
            text = f"{row.error:9.2e} {row.us_per_step:8.2f} us"
        label = f"{row.case} 1/{row.rate} {row.tolerance}"
        print(f"{self.done:4d}/{self.total} {left:5.1f} min left  {label:36s} {row.engine:12s} {text}", flush=True)


def budget_of(arguments: argparse.Namespace) -> Budget:
    budget = QUICK if arguments.quick else FULL
    return replace(budget, run=arguments.seconds, verdict=10.0 * arguments.seconds) if arguments.seconds else budget


def measure_each(data: Path, wanted_rows: Sequence[Wanted], measure_one: Callable[[Worker, Wanted], Row]) -> None:
    """Rows measured in a process of their own, one after another, each written at once."""
    worker, progress = Worker(), Progress(len(wanted_rows))
    try:
        for one in wanted_rows:
            row = measure_one(worker, one)
            append(data, row)
            progress.show(row)
    finally:
        worker.close()


def measure_points(data: Path, engines: list[Engine], arguments: argparse.Namespace) -> None:
    """The points that the file lacks; those that failed are tried again."""
    done = {key for key, row in read(data).items() if row.status != FAILED}
    planned = points(engines, arguments.quick, arguments.cases)
    if arguments.engines:
        planned = [point for point in planned if point.engine in arguments.engines]
    waiting = [point for point in planned if point.key not in done]
    print(f"{len(planned)} points, {len(planned) - len(waiting)} of them measured before", flush=True)
    budget = budget_of(arguments)
    measure_each(data, waiting, lambda worker, point: worker.measure(point, budget))


def measure_costs(data: Path, arguments: argparse.Namespace) -> None:
    """The costs of all rows once more, engine beside engine; their errors stay."""
    rows = [
        row
        for row in read(data).values()
        if row.status == OK
        and row.repeats > 1
        and (not arguments.cases or row.case in arguments.cases)
        and (not arguments.engines or row.engine in arguments.engines)
    ]
    budget = budget_of(arguments)
    measure_each(data, rows, lambda worker, row: worker.time_again(row, budget))


def measure_residuals(path: Path, arguments: argparse.Namespace) -> None:
    """Of the cases that the file lacks."""
    done = {row.key for row in read_rows(Residuals, path)}
    worker = Worker()
    try:
        for case in wanted(arguments.cases):
            for sleeping in (True, False):
                if (case.name, VERDICT_RATE, sleeping) in done or (arguments.quick and case.name in LONG):
                    continue
                row = worker.residuals(case.name, VERDICT_RATE, sleeping, budget_of(arguments))
                append_row(path, row)
                print(
                    f"residuals of {row.case}, sleeping={sleeping}: {row.above} of {row.steps} steps above", flush=True
                )
    finally:
        worker.close()


def run(arguments: argparse.Namespace, command: str) -> None:
    started = time.monotonic()
    folder = Path(arguments.out)
    folder.mkdir(parents=True, exist_ok=True)
    data, residuals = folder / "data.csv", folder / "residuals.csv"
    if arguments.fresh:
        data.unlink(missing_ok=True)
        residuals.unlink(missing_ok=True)
    engines, missing = all_engines()
    for name, reason in missing.items():
        print(f"{name} is left out: {reason}. Install the extra: pip install 'avalanche-gym[bench]'")
    if arguments.costs:
        measure_costs(data, arguments)
    elif not arguments.page:
        measure_points(data, engines, arguments)
    if arguments.data_only:
        return
    if not arguments.page:
        measure_residuals(residuals, arguments)
        if not arguments.cases:
            short = (10, 3) if arguments.quick else ()
            write_rows(folder / "features.csv", [measure_pair(name, *short) for name in PAIRS])
            write_rows(folder / "pushes.csv", measure_pushes(engines))
    from .page import write_page  # here, so that measuring one point needs no matplotlib

    write(data, read(data))
    rows = list(read(data).values())
    measured = Measured(
        rows,
        engines,
        read_rows(FeatureCost, folder / "features.csv"),
        read_rows(Residuals, residuals),
        read_rows(PushCost, folder / "pushes.csv"),
    )
    write_page(measured, folder, heading(command, started, arguments, rows))
    print(f"written to {folder / 'index.md'} after {(time.monotonic() - started) / 60:.1f} minutes")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cases", nargs="*", help="only these; all curves")
    parser.add_argument("--quick", action="store_true", help="three steps, a third of the scenes with curves; minutes")
    parser.add_argument("--engines", nargs="+", help="only these; the page keeps what the file holds of the others")
    parser.add_argument("--out", default="docs/report", help="folder of the page, its plots and data")
    parser.add_argument("--seconds", type=float, help="CPU seconds a motion may take; ten times that for a verdict")
    parser.add_argument("--costs", action="store_true", help="time the rows of the file again; their errors stay")
    parser.add_argument("--note", help="a sentence for the page on how the rows were measured")
    parser.add_argument("--page", action="store_true", help="measure nothing, write the page from the files")
    parser.add_argument("--data-only", action="store_true", help="rows of data, no page and no plots")
    parser.add_argument("--fresh", action="store_true", help="measure everything again")
    parser.add_argument("--point", nargs="+", metavar="WORD", help="CASE ENGINE RATE [TOLERANCE]")
    arguments = parser.parse_args()
    for name in ONE_THREAD:
        os.environ.setdefault(name, "1")
    if arguments.point:
        case, engine, rate, *tolerance = arguments.point
        print(measure(Point(case, engine, int(rate), float(tolerance[0]) if tolerance else None), FULL))
    else:
        run(arguments, " ".join(["python -m benchmarks.report", *sys.argv[1:]]))


if __name__ == "__main__":
    main()
