"""Checks of what a user gives to a shape: every error names the argument, the value, what is allowed and what to do."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..given import real_array, real_number

# A quaternion this close to unit norm is normalised: round-off of a user's arithmetic. Others are refused as mistakes.
UNIT_NORM_TOLERANCE = 1e-6
NORM_ROUND_OFF = 4.0 * 2.0**-52  # of the norm itself: 0.999999 is within 1e-6


def positive_number(name: str, value: Any) -> float:
    """``value`` as a finite positive float; ``name`` is "Shape(argument)"."""
    number = finite_number(name, value)
    if not number > 0.0:
        raise ValueError(f"{name}={value!r}; allowed is a positive length in m. Give a value above zero.")
    return number


def non_negative_number(name: str, value: Any) -> float:
    """``value`` as a finite float of at least zero."""
    number = finite_number(name, value)
    if number < 0.0:
        raise ValueError(f"{name}={value!r}; allowed is a length in m of at least zero. Give its absolute value.")
    return number


def finite_number(name: str, value: Any) -> float:
    """``value`` as a finite float."""
    number = real_number(value)
    if number is None:
        raise TypeError(f"{name}={value!r} is a {type(value).__name__}; allowed is one real number. Give a float.")
    if not math.isfinite(number):
        raise ValueError(f"{name}={value!r}; allowed is a finite number. Replace the NaN or infinity.")
    return number


def truth(name: str, value: Any) -> bool:
    """``value`` as a bool; ``name`` is "Shape(argument)"."""
    if not isinstance(value, (bool, np.bool_)):
        raise TypeError(f"{name}={value!r}; give True or False.")
    return bool(value)


def finite_array(name: str, value: Any, shape: tuple[int | None, ...], what: str) -> NDArray[np.float64]:
    """A read-only float64 copy of ``value``.

    Args:
        name: "Shape(argument)".
        value: anything NumPy takes as an array.
        shape: the shape it must have; ``None`` for any length.
        what: the array in words, with its unit, for the text of the error.
    """
    try:
        array = np.array(real_array(value), order="C")
    except (TypeError, ValueError):
        raise TypeError(f"{name} is a {type(value).__name__} that is not numeric; give {what}.") from None
    fits = array.ndim == len(shape) and all(want in (None, got) for want, got in zip(shape, array.shape, strict=True))
    if not fits:
        raise ValueError(f"{name} has shape {array.shape}; give {what}.")
    if not np.isfinite(array).all():
        where = tuple(int(i) for i in np.argwhere(~np.isfinite(array))[0])
        raise ValueError(f"{name} is {array[where]!r} at index {where}; all values must be finite. Give {what}.")
    array.flags.writeable = False
    return array


def unit_quaternion(name: str, value: Any) -> NDArray[np.float64]:
    """A read-only (4,) wxyz quaternion of unit norm; the given one may miss it by ``UNIT_NORM_TOLERANCE``."""
    given = finite_array(name, value, (4,), "a unit quaternion (w, x, y, z)")
    with np.errstate(over="ignore"):
        norm = float(np.linalg.norm(given))
    if not abs(norm - 1.0) <= UNIT_NORM_TOLERANCE + NORM_ROUND_OFF:
        raise ValueError(
            f"{name}={given.tolist()} has norm {norm:.9g}; allowed is a unit quaternion (w, x, y, z), within "
            f"{UNIT_NORM_TOLERANCE:g}. Divide it by its norm, and check the order: w comes first."
        )
    quaternion = given / norm if norm != 1.0 else given.copy()
    quaternion.flags.writeable = False
    return quaternion
