"""The capsule: all points within a radius of a segment."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from .. import mass_properties, model
from . import checks
from .shape import Shape


@dataclass(frozen=True)
class Capsule(Shape):
    """Capsule along z of its frame.

    Args:
        radius: [m], positive.
        half_length: [m], positive: half the segment between the centres of the caps, which lie beyond it.
    """

    radius: float
    half_length: float

    code: ClassVar[int] = model.CAPSULE

    def __post_init__(self) -> None:
        object.__setattr__(self, "radius", checks.positive_number("Capsule(radius)", self.radius))
        object.__setattr__(self, "half_length", checks.positive_number("Capsule(half_length)", self.half_length))

    @property
    def size(self) -> tuple[float, float, float]:
        return (self.radius, self.half_length, 0.0)

    @property
    def bounding_radius(self) -> float:
        return self.radius + self.half_length

    @property
    def smallest_half_extent(self) -> float:
        return self.radius

    def mass_properties(self) -> mass_properties.MassProperties:
        return mass_properties.of_capsule(self.radius, self.half_length)
