"""The rows of data: one a measured point, in a CSV file that grows as points are measured."""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path

from avalanche_gym.physics.scenes import HARD_CASES

OK, UNSUPPORTED, REFUSED, FAILED, TOO_LONG = "ok", "unsupported", "refused", "failed", "too long"


@dataclass
class Row:
    """One point, as measured."""

    case: str
    engine: str
    version: str
    rate: int  # [steps/s]
    tolerance: str  # of our contact solver; empty for the default
    status: str  # one of the above
    error: float = math.nan  # the headline, in the unit of the case
    us_per_step: float = math.nan  # CPU [us], median
    us_low: float = math.nan
    us_high: float = math.nan
    steps: int = 0  # timed in each repeat
    repeats: int = 0
    residual: float = math.nan  # worst of any step, where the engine tells
    errors: dict[str, float] = field(default_factory=dict)  # everything the case measures
    note: str = ""
    date: str = ""
    command: str = ""  # makes this row again

    @property
    def cost(self) -> float:
        """CPU seconds per simulated second."""
        return self.us_per_step * 1e-6 * self.rate

    @property
    def key(self) -> tuple[str, str, int, str]:
        return (self.case, self.engine, self.rate, self.tolerance)


NAMES = [entry.name for entry in fields(Row)]


def read(path: Path) -> dict[tuple[str, str, int, str], Row]:
    """Rows by key; a later row of the same key replaces an earlier one."""
    if not path.exists():
        return {}
    found = {}
    with path.open(newline="") as file:
        for values in csv.DictReader(file):
            numbers = {name: float(values[name]) for name in ("error", "us_per_step", "us_low", "us_high", "residual")}
            counts = {name: int(values[name]) for name in ("rate", "steps", "repeats")}
            errors = {name: float(value) for name, value in json.loads(values["errors"]).items()}
            row = Row(**{**values, **numbers, **counts, "errors": errors})  # type: ignore[arg-type]
            found[row.key] = row
    return found


def append(path: Path, row: Row) -> None:
    """Write one row at once, so an interrupted report goes on where it was."""
    new = not path.exists()
    with path.open("a", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        if new:
            writer.writerow(NAMES)
        values = {name: getattr(row, name) for name in NAMES}
        values["errors"] = json.dumps({name: float(f"{value:.6g}") for name, value in row.errors.items()})
        for name in ("error", "us_per_step", "us_low", "us_high", "residual"):
            values[name] = f"{values[name]:.6g}"
        writer.writerow([values[name] for name in NAMES])


def write(path: Path, rows: Mapping[tuple[str, str, int, str], Row]) -> None:
    """Replace the file: rows that were measured again once only, case by case."""
    path.unlink(missing_ok=True)
    places = {name: place for place, name in enumerate(HARD_CASES)}
    for row in sorted(rows.values(), key=lambda row: places.get(row.case, len(places))):
        append(path, row)
