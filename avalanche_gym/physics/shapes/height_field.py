"""Terrain given by heights on a grid."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import mass_properties, model
from . import checks
from .shape import Shape

SURFACES = ("facets", "smooth")


@dataclass(frozen=True, eq=False, init=False)
class HeightField(Shape):
    """Solid below a surface z(x, y) over a rectangle centred on its origin, without a bottom.

    Its sides are upright walls, and nothing is outside.

    Args:
        heights: (rows, columns) [m], at least 2 x 2; rows along y, columns along x, row 0 at -y, column 0 at -x.
        size: (extent along x, extent along y) [m], positive.
        surface: "facets": two triangles a cell, the diagonal joins (row, column) and (row + 1, column + 1); "smooth": a
            bicubic spline through the samples, with continuous slope and curvature (height_spline.py).
    """

    heights: NDArray[np.float64]  # (rows, columns) [m], read-only
    extent: tuple[float, float]  # [m] along x, along y
    surface: str

    def __init__(self, heights: ArrayLike, size: Sequence[float], surface: str = "facets") -> None:
        what = "heights of shape (rows, columns), at least 2 x 2, in m"
        checked = checks.finite_array("HeightField(heights)", heights, (None, None), what)
        if min(checked.shape) < 2:
            raise ValueError(f"HeightField(heights) has shape {checked.shape}; give {what}.")
        extent = checks.finite_array("HeightField(size)", size, (2,), "(extent along x, extent along y) in m")
        if not (extent > 0.0).all():
            raise ValueError(f"HeightField(size)={extent.tolist()}; allowed are positive extents in m along x and y.")
        if surface not in SURFACES:
            raise ValueError(f"HeightField(surface)={surface!r}; allowed are {', '.join(map(repr, SURFACES))}.")
        object.__setattr__(self, "heights", checked)
        object.__setattr__(self, "extent", (float(extent[0]), float(extent[1])))
        object.__setattr__(self, "surface", surface)

    @property
    def code(self) -> int:
        return model.SMOOTH_FIELD if self.surface == "smooth" else model.HEIGHT_FIELD

    @property
    def size(self) -> tuple[float, float, float]:
        """[m] extent along x, extent along y, and zero."""
        return (*self.extent, 0.0)

    @property
    def bounding_radius(self) -> float:
        """[m] of the sphere about its origin that holds the samples; the solid below them has no bound."""
        return math.hypot(0.5 * self.extent[0], 0.5 * self.extent[1], float(np.abs(self.heights).max()))

    @property
    def smallest_half_extent(self) -> float:
        return 0.5 * min(self.extent)

    def mass_properties(self) -> mass_properties.MassProperties:
        raise ValueError(
            'HeightField has no bottom, so no mass: give its body motion="static" or "kinematic", '
            "or use a closed TriangleMesh."
        )
