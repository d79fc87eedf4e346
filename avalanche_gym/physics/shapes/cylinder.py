"""The right circular cylinder."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from .. import mass_properties, model
from . import checks
from .shape import Shape


@dataclass(frozen=True)
class Cylinder(Shape):
    """Cylinder along z of its frame.

    Args:
        radius: [m], positive.
        half_length: [m], positive: half the distance between the flat ends.
    """

    radius: float
    half_length: float

    code: ClassVar[int] = model.CYLINDER

    def __post_init__(self) -> None:
        object.__setattr__(self, "radius", checks.positive_number("Cylinder(radius)", self.radius))
        object.__setattr__(self, "half_length", checks.positive_number("Cylinder(half_length)", self.half_length))

    @property
    def size(self) -> tuple[float, float, float]:
        return (self.radius, self.half_length, 0.0)

    @property
    def bounding_radius(self) -> float:
        return math.hypot(self.radius, self.half_length)

    @property
    def smallest_half_extent(self) -> float:
        return min(self.radius, self.half_length)

    def mass_properties(self) -> mass_properties.MassProperties:
        return mass_properties.of_cylinder(self.radius, self.half_length)
