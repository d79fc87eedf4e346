"""Measure and write the report.

    python -m benchmarks.report [--quick] [--out docs/report] [--fresh] [case ...]
    python -m benchmarks.report --point CASE ENGINE RATE [TOLERANCE]

Interrupted, it goes on where it was: points that are in the CSV file are not measured again (``--fresh`` does). Points
that failed are tried again. ``--point`` measures one row and prints it.
"""

from __future__ import annotations

import argparse
import csv
import os
import platform
import resource
import subprocess
import sys
import time
from dataclasses import asdict, fields
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path

import numpy as np

from ..peers import all_engines
from .features import PAIRS, FeatureCost, measure_pair
from .machine import processor
from .plan import FULL, QUICK, Point, points
from .table import FAILED, append, read
from .worker import Worker, measure

ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "RAYON_NUM_THREADS")


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


def heading(command: str, started: float, quick: bool) -> dict[str, str]:
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else float("nan")
    return {
        "date": datetime.now(UTC).strftime("%Y-%m-%d"),
        "command": f"`{command}`",
        "machine": f"{processor()}, {os.cpu_count()} cores, {platform.system()} {platform.machine()}",
        "load while it ended": f"{load:.1f} (above 1, other programs took caches and memory from what was measured)",
        "versions": f"Python {platform.python_version()}, NumPy {np.__version__}, Numba {version('numba')}",
        "compiling, once": f"{compile_seconds():.0f} CPU s from an empty cache to the first step of a stack",
        "took": f"{(time.monotonic() - started) / 60:.1f} minutes in this call" + (", quick form" if quick else ""),
    }


def run(arguments: argparse.Namespace, command: str) -> None:
    started = time.monotonic()
    folder = Path(arguments.out)
    folder.mkdir(parents=True, exist_ok=True)
    data = folder / "data.csv"
    if arguments.fresh:
        data.unlink(missing_ok=True)
    engines, missing = all_engines()
    for name, reason in missing.items():
        print(f"{name} is left out: {reason}. Install the extra: pip install 'avalanche-gym[bench]'")
    done = {key for key, row in read(data).items() if row.status != FAILED}
    planned = points(engines, arguments.quick, arguments.cases)
    if arguments.engines:
        planned = [point for point in planned if point.engine in arguments.engines]
    waiting = [point for point in planned if point.key not in done]
    print(f"{len(planned)} points, {len(planned) - len(waiting)} of them measured before", flush=True)
    budget, worker = QUICK if arguments.quick else FULL, Worker()
    try:
        for number, point in enumerate(waiting, 1):
            row = worker.measure(point, budget)
            append(data, row)
            spent = time.monotonic() - started
            left = spent / number * (len(waiting) - number)
            text = (
                f"{row.error:9.2e} {row.us_per_step:8.2f} us"
                if row.status == "ok"
                else f"{row.status}: {row.note[:60]}"
            )
            label = f"{point.case} 1/{point.rate} {point.key[3]}"
            print(
                f"{number:4d}/{len(waiting)} {left / 60:5.1f} min left  {label:36s} {point.engine:12s} {text}",
                flush=True,
            )
    finally:
        worker.close()
    if arguments.data_only:
        return
    features = feature_costs(folder / "features.csv", arguments)
    from .pages import Report  # here, so that measuring one point needs no matplotlib

    Report(list(read(data).values()), engines, features).write(folder, heading(command, started, arguments.quick))
    print(f"written to {folder / 'index.md'} after {(time.monotonic() - started) / 60:.1f} minutes")


def feature_costs(path: Path, arguments: argparse.Namespace) -> list[FeatureCost]:
    """Measured anew unless only some cases were asked for; then what the file holds."""
    names = [entry.name for entry in fields(FeatureCost)]
    if arguments.cases and path.exists():
        with path.open(newline="") as file:
            rows = list(csv.DictReader(file))
        numbers = ("with_it", "without", "ratio")
        return [FeatureCost(**{k: float(v) if k in numbers else v for k, v in row.items()}) for row in rows]
    found = [measure_pair(name, *((500, 3) if arguments.quick else ())) for name in PAIRS]
    with path.open("w", newline="") as file:
        writer = csv.DictWriter(file, names, lineterminator="\n")
        writer.writeheader()
        writer.writerows(asdict(cost) for cost in found)
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cases", nargs="*", help="only these; all curves")
    parser.add_argument("--quick", action="store_true", help="three steps, a third of the scenes with curves; minutes")
    parser.add_argument("--engines", nargs="+", help="only these; the page keeps what the file holds of the others")
    parser.add_argument("--out", default="docs/report", help="folder of the page, its plots and data")
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
