"""The box."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from .. import mass_properties, model
from . import checks
from .shape import Shape


@dataclass(frozen=True, init=False)
class Box(Shape):
    """Box about the origin, edges along the axes of its frame.

    Args:
        half_extents: (hx, hy, hz) [m], positive: half of each edge.
    """

    half_extents: tuple[float, float, float]

    code: ClassVar[int] = model.BOX

    def __init__(self, half_extents: Sequence[float]) -> None:
        given = checks.finite_array("Box(half_extents)", half_extents, (3,), "three half edges (hx, hy, hz) in m")
        if not (given > 0.0).all():
            raise ValueError(
                f"Box(half_extents)={given.tolist()}; allowed are positive lengths in m. Give half of each edge."
            )
        object.__setattr__(self, "half_extents", tuple(given.tolist()))

    @property
    def size(self) -> tuple[float, float, float]:
        return self.half_extents

    @property
    def bounding_radius(self) -> float:
        return math.hypot(*self.half_extents)

    @property
    def smallest_half_extent(self) -> float:
        return min(self.half_extents)

    def mass_properties(self) -> mass_properties.MassProperties:
        return mass_properties.of_box(self.half_extents)
