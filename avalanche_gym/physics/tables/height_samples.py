"""Samples of height fields in a running world: set, read, put back, and their bounds kept."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..given import real_array
from ..layout import HEIGHT_POOLS
from ..shapes.flatness import flattened
from ..shapes.height_spline import pool_of_field
from .storage import Storage


def set_heights(
    storage: Storage, row: int, mask: NDArray[np.bool_], heights: ArrayLike | None, height_rates: ArrayLike | None
) -> None:
    """Write samples and rates of one height field; see World.set_heights."""
    field = storage.arrays["height_fields"][row]
    shape = (int(field["rows"]), int(field["columns"]))
    chosen = int(mask.sum())
    given: dict[str, NDArray[np.float64]] = {}
    for name, value, unit in (("heights", heights, "m"), ("height_rates", height_rates, "m/s")):
        if value is None:
            continue
        label = f"set_heights({name})"
        try:
            array = real_array(value)
        except (TypeError, ValueError):
            raise TypeError(f"{label} is not numeric; give {shape} or {(chosen, *shape)} [{unit}].") from None
        if array.shape not in (shape, (chosen, *shape)):
            raise ValueError(f"{label} has shape {array.shape}; give {shape} or {(chosen, *shape)} [{unit}].")
        if not np.isfinite(array).all():
            raise ValueError(f"{label} holds values that are not finite; replace them.")
        array = array.reshape(-1, *shape)
        if name == "heights":
            array = flattened(array, field["extent"])
        given[name] = pool_of_field(array, bool(field["smooth"]))
    if chosen == 0:
        return
    given.setdefault("height_rates", np.zeros((1, int(field["size"]))))
    # Each world advances its own moving heights, so those are never shared.
    moving = bool(given["height_rates"].any())
    if moving or not mask.all() or any(len(array) > 1 for array in given.values()):
        storage.separate_heights(moving)
    samples = slice(int(field["first"]), int(field["first"] + field["size"]))
    if not moving:
        # What rests has no past: it may start to move at once.
        given["height_rates_before"] = given["height_rate_changes"] = np.zeros((1, int(field["size"])))
    for name, array in given.items():
        _write_heights(storage.arrays[name][:, samples], mask, array)
    if "heights" in given:
        _widen_bounds(field, given["heights"])
    storage.note_features()


def heights_of(storage: Storage, row: int, world: int) -> NDArray[np.float64]:
    """(rows, columns) a copy of the samples of one height field in one world."""
    field, pool = storage.arrays["height_fields"][row], storage.arrays["heights"]
    rows, columns, first = int(field["rows"]), int(field["columns"]), int(field["first"])
    # Worlds that share their terrain have one row of samples.
    samples: NDArray[np.float64] = pool[world if len(pool) > 1 else 0, first : first + rows * columns]
    return samples.reshape(rows, columns).copy()


def reset_heights(storage: Storage, mask: NDArray[np.bool_], initial: NDArray[np.float64]) -> None:
    """Put the samples of the selected worlds back to ``initial`` (1, samples), at rest."""
    arrays = storage.arrays
    if not (mask.any() and initial.size):
        return
    shared = len(arrays["heights"]) != len(mask)
    if shared and not mask.all() and not np.array_equal(arrays["heights"], initial):
        storage.separate_heights(moving=False)
    _write_heights(arrays["heights"], mask, initial)
    for name in HEIGHT_POOLS[1:]:
        _write_heights(arrays[name], mask, np.zeros_like(initial))
    for field in arrays["height_fields"]:
        _widen_bounds(field, initial[:, field["first"] : field["first"] + field["size"]])
    storage.note_features()


def _write_heights(pool: NDArray[np.float64], mask: NDArray[np.bool_], values: NDArray[np.float64]) -> None:
    """Write ``values`` (1 or selected worlds, samples) into a pool (1 or worlds, samples)."""
    if len(pool) == len(mask):
        pool[mask] = values
    else:
        pool[0] = values[0]


def _widen_bounds(field: Any, heights: NDArray[np.float64]) -> None:
    field["lowest"] = min(float(field["lowest"]), float(heights.min()))
    field["highest"] = max(float(field["highest"]), float(heights.max()))
