"""Dataclasses as rows of a CSV file: fields of text, whole numbers, floats and truth values."""

from __future__ import annotations

import csv
from collections.abc import Iterable
from dataclasses import astuple, fields
from pathlib import Path
from typing import Any, TypeVar

Row = TypeVar("Row")
PARSE = {"int": int, "float": float, "bool": lambda text: text == "True", "str": str}


def read_rows(kind: type[Row], path: Path) -> list[Row]:
    """All rows of a file; none if there is no file."""
    if not path.exists():
        return []
    kinds = {entry.name: str(entry.type) for entry in fields(kind)}  # type: ignore[arg-type]
    with path.open(newline="") as file:
        return [
            kind(**{name: PARSE[kinds[name]](value) for name, value in row.items()}) for row in csv.DictReader(file)
        ]


def append_row(path: Path, row: Any) -> None:
    """Write one row at once, under the names of its fields."""
    new = not path.exists()
    with path.open("a", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        if new:
            writer.writerow([entry.name for entry in fields(row)])
        writer.writerow([f"{value:.4g}" if isinstance(value, float) else value for value in astuple(row)])


def write_rows(path: Path, rows: Iterable[Any]) -> None:
    """Replace the file."""
    path.unlink(missing_ok=True)
    for row in rows:
        append_row(path, row)
