"""Several shapes that move as one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from .. import mass_properties
from . import checks
from .height_field import HeightField
from .plane import Plane
from .shape import Part, Shape

_REMEDY = "Give [(shape, position, orientation), ...] with position (x, y, z) in m and a unit quaternion (w, x, y, z)."


def _quaternion_product(a: Any, b: Any) -> Any:
    w = a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3]
    x = a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2]
    y = a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1]
    z = a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]
    return np.array([w, x, y, z])


@dataclass(frozen=True, eq=False, init=False)
class Compound(Shape):
    """Shapes fixed to one another; compounds may hold compounds, but neither planes nor height fields.

    Args:
        members: [(shape, position, orientation), ...]: position (3,) [m] and unit quaternion (4,) wxyz of each shape in
            the frame of the compound.
    """

    members: tuple[Part, ...]

    code: ClassVar[int] = -1

    def __init__(self, members: Sequence[tuple[Shape, ArrayLike, ArrayLike]]) -> None:
        if isinstance(members, Shape) or not np.iterable(members):
            raise TypeError(f"Compound(members) is a {type(members).__name__}. {_REMEDY}")
        checked = []
        for index, member in enumerate(members):
            name = f"Compound(members)[{index}]"
            if not isinstance(member, (tuple, list)) or len(member) != 3 or not isinstance(member[0], Shape):
                raise TypeError(f"{name}={member!r} is not a (shape, position, orientation). {_REMEDY}")
            shape, position, orientation = member
            if isinstance(shape, (Plane, HeightField)):
                raise ValueError(
                    f"{name} is a {type(shape).__name__}, which has no bounds; allowed are all other shapes. "
                    "Add it as a body of its own."
                )
            place = checks.finite_array(f"{name} position", position, (3,), "(x, y, z) in m")
            checked.append((shape, place, checks.unit_quaternion(f"{name} orientation", orientation)))
        if not checked:
            raise ValueError(f"Compound(members) is empty; allowed is one shape or more. {_REMEDY}")
        object.__setattr__(self, "members", tuple(checked))

    def parts(self) -> list[Part]:
        found: list[Part] = []
        for shape, position, orientation in self.members:
            rotation = mass_properties.rotation_matrix(orientation)
            for part, inner_position, inner_orientation in shape.parts():
                place = position + rotation @ inner_position
                turn = _quaternion_product(orientation, inner_orientation)
                turn /= np.linalg.norm(turn)
                place.flags.writeable = turn.flags.writeable = False
                found.append((part, place, turn))
        return found

    @property
    def size(self) -> tuple[float, float, float]:
        return (0.0, 0.0, 0.0)

    @property
    def bounding_radius(self) -> float:
        """[m] an upper bound: each part by its own sphere."""
        return max(float(np.linalg.norm(position)) + part.bounding_radius for part, position, _ in self.parts())

    @property
    def smallest_half_extent(self) -> float:
        """[m] of its thinnest part."""
        return min(part.smallest_half_extent for part, _, _ in self.parts())

    def mass_properties(self) -> mass_properties.MassProperties:
        """The sum of its parts; where parts overlap, the volume counts twice."""
        return mass_properties.combined(
            part.mass_properties().moved(position, orientation) for part, position, orientation in self.parts()
        )
