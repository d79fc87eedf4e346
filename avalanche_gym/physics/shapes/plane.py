"""The half space below a plane."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from .. import mass_properties, model
from .shape import Shape


@dataclass(frozen=True)
class Plane(Shape):
    """Everything below z = 0 of its frame is solid. For static and kinematic bodies."""

    code: ClassVar[int] = model.PLANE

    @property
    def size(self) -> tuple[float, float, float]:
        return (0.0, 0.0, 0.0)

    @property
    def bounding_radius(self) -> float:
        return math.inf

    @property
    def smallest_half_extent(self) -> float:
        return math.inf

    def mass_properties(self) -> mass_properties.MassProperties:
        raise ValueError(
            'Plane has no finite volume, so no mass: give its body motion="static" or "kinematic", or use a flat Box.'
        )
