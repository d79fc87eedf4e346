"""The ball."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from .. import mass_properties, model
from . import checks
from .shape import Shape


@dataclass(frozen=True)
class Sphere(Shape):
    """Ball about the origin of its frame.

    Args:
        radius: [m], positive.
    """

    radius: float

    code: ClassVar[int] = model.SPHERE

    def __post_init__(self) -> None:
        object.__setattr__(self, "radius", checks.positive_number("Sphere(radius)", self.radius))

    @property
    def size(self) -> tuple[float, float, float]:
        return (self.radius, 0.0, 0.0)

    @property
    def bounding_radius(self) -> float:
        return self.radius

    @property
    def smallest_half_extent(self) -> float:
        return self.radius

    def mass_properties(self) -> mass_properties.MassProperties:
        return mass_properties.of_sphere(self.radius)
