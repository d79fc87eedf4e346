"""Numbers as a user gives them, read as float64. What is no real number is told from what is one but not finite."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

# [kg], [kg m^2] of a dynamic body: beyond these the inverses, or the energies of slow motion, are no floats.
SMALLEST_MASS, LARGEST_MASS = 1e-300, 1e300


def real_number(value: Any) -> float | None:
    """One real number of any type, infinite if no float is as large; None for all else, texts and truth values too."""
    if isinstance(value, (str, bytes, bool, np.bool_, complex, np.complexfloating)) or np.ndim(value) != 0:
        return None
    if isinstance(value, np.ndarray):
        return real_number(value[()])
    try:
        return float(value)
    except OverflowError:
        return math.inf if value > 0 else -math.inf
    except (TypeError, ValueError):
        return None


def whole_number(value: Any) -> int | None:
    """A whole number, of Python or NumPy; None for all else, truth values too."""
    return int(value) if isinstance(value, (int, np.integer)) and not isinstance(value, bool) else None


def real_array(value: ArrayLike) -> NDArray[np.float64]:
    """As float64, without a copy if it is that already; infinite where no float is as large.

    Raises:
        TypeError, ValueError: it holds texts or complex numbers, or is no array at all.
    """
    given = np.asarray(value)
    if given.dtype.kind in "biuf":
        return np.asarray(given, dtype=np.float64)
    if given.dtype.kind != "O":
        raise TypeError(f"{given.dtype} is not real")
    numbers = [math.nan if entry is None else real_number(entry) for entry in given.ravel().tolist()]
    if None in numbers:
        raise TypeError("holds what is no number")
    return np.array(numbers, dtype=np.float64).reshape(given.shape)
