"""Terrain around a centre: a star-shaped closed surface, given by its radius in every direction."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import checks
from .icosphere import MOST_SUBDIVISIONS, icosphere
from .triangle_mesh import TriangleMesh

Radii = Callable[[NDArray[np.float64]], ArrayLike]


class RadialTerrain(TriangleMesh):
    """A planet: the vertices of an icosphere, each moved along its direction to its own radius.

    Args:
        radii: (10 * 4^subdivisions + 2,) [m] one for each row of ``directions(subdivisions)``; or a function that
            takes directions (n, 3) and returns radii (n,) [m].
        subdivisions: 20 * 4^subdivisions triangles; found from the length of ``radii`` by default, 5 for a function.

    Attributes:
        radii: (n,) [m] of the vertices, read-only.
        subdivisions: of the icosphere.
    """

    radii: NDArray[np.float64]
    subdivisions: int

    def __init__(self, radii: ArrayLike | Radii, subdivisions: int | None = None) -> None:
        if callable(radii):
            level = 5 if subdivisions is None else _checked_level(subdivisions)
            given: ArrayLike = radii(self.directions(level))
        else:
            given = radii
            level = _level_of(len(np.atleast_1d(np.asarray(given)))) if subdivisions is None else subdivisions
            level = _checked_level(level)
        count = 10 * 4**level + 2
        what = f"the {count} radii in m of an icosphere of {level} subdivisions"
        checked = checks.finite_array("RadialTerrain(radii)", given, (count,), what)
        if not (checked > 0.0).all():
            raise ValueError(
                f"RadialTerrain(radii) has {int((checked <= 0.0).sum())} radii that are not positive; "
                "the surface must not reach the centre. Lessen the relief."
            )
        directions, faces = icosphere(level)
        super().__init__(directions * checked[:, None], faces)
        object.__setattr__(self, "radii", checked)
        object.__setattr__(self, "subdivisions", level)

    @staticmethod
    def directions(subdivisions: int) -> NDArray[np.float64]:
        """(10 * 4^subdivisions + 2, 3) unit vectors to the vertices, in the order of ``radii``."""
        return icosphere(_checked_level(subdivisions))[0]


def _checked_level(subdivisions: int) -> int:
    most = MOST_SUBDIVISIONS
    if (
        isinstance(subdivisions, bool)
        or not isinstance(subdivisions, (int, np.integer))
        or not 0 <= subdivisions <= most
    ):
        raise ValueError(
            f"RadialTerrain(subdivisions)={subdivisions!r}; allowed are whole numbers from 0 to {most} "
            "(1.3 million triangles)."
        )
    return int(subdivisions)


def _level_of(count: int) -> int:
    """Subdivisions of the icosphere with so many vertices."""
    for level in range(MOST_SUBDIVISIONS + 1):
        if 10 * 4**level + 2 == count:
            return level
    raise ValueError(
        f"RadialTerrain(radii) has {count} values; give 10 * 4^k + 2 of them (12, 42, 162, 642, 2562 ...), one for "
        "each row of RadialTerrain.directions(k), or a function of directions."
    )
