"""What every shape answers, whatever its form."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..mass_properties import MassProperties

# A primitive, its position (3,) [m] and its orientation (4,) wxyz in the frame of the whole.
Part = tuple["Shape", NDArray[np.float64], NDArray[np.float64]]


class Shape(ABC):
    """An immutable solid or surface in its own frame; the frame is never moved to the centre of mass."""

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Arrays that come out of pickle or deepcopy are writable; those of a shape are not."""
        self.__dict__.update(state)
        _freeze(state.values())

    @property
    @abstractmethod
    def code(self) -> int:
        """Of the collider table (model.SPHERE ...); -1 for a compound, which has only parts."""

    @property
    @abstractmethod
    def size(self) -> tuple[float, float, float]:
        """[m] what the collider table stores: radius, half length; half extents; zeros where arrays hold the form."""

    @property
    @abstractmethod
    def bounding_radius(self) -> float:
        """[m] of the smallest sphere about the shape's own origin that holds it; infinite for a plane."""

    @property
    @abstractmethod
    def smallest_half_extent(self) -> float:
        """[m] half of its smallest width: the scale of tolerances, and the thickness a fast body could jump over."""

    @abstractmethod
    def mass_properties(self) -> MassProperties:
        """Volume, centre of mass and inertia at density 1.

        Raises:
            ValueError: the shape encloses no finite volume.
        """

    def parts(self) -> list[Part]:
        """The primitives it consists of, with their places; a primitive is its own only part."""
        position, orientation = np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0])
        position.flags.writeable = orientation.flags.writeable = False
        return [(self, position, orientation)]


def _freeze(values: Iterable[Any]) -> None:
    """Make arrays read-only, those in tuples too."""
    for value in values:
        if isinstance(value, np.ndarray):
            value.flags.writeable = False
        elif isinstance(value, tuple):
            _freeze(value)
