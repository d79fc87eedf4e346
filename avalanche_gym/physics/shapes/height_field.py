"""Terrain given by heights on a grid."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

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
            Where they lie in one plane, but for 1e-9 of the size of the field, they are put into it (flatness.py).
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
        if not isinstance(surface, str) or surface not in SURFACES:
            raise ValueError(f"HeightField(surface)={surface!r}; allowed are {', '.join(map(repr, SURFACES))}.")
        object.__setattr__(self, "heights", checked)
        object.__setattr__(self, "extent", (float(extent[0]), float(extent[1])))
        object.__setattr__(self, "surface", surface)

    @classmethod
    def from_image(
        cls,
        image: ArrayLike | str | os.PathLike[str],
        size: Sequence[float],
        *,
        lowest: float = 0.0,
        highest: float = 1.0,
        surface: str = "facets",
    ) -> HeightField:
        """Terrain from a grey picture: black is low, white is high, its upper edge lies at +y.

        Args:
            image: (rows, columns) pixels, whole numbers that span their type (uint8, uint16) or floats from 0 to 1; or
                a file that Pillow reads (PNG, TIFF ...). Colours are turned to grey.
            size: (extent along x, extent along y) [m].
            lowest: [m] height of black.
            highest: [m] height of white.
            surface: as in HeightField.
        """
        pixels = _read_grey(image) if isinstance(image, (str, os.PathLike)) else np.asarray(image)
        if pixels.ndim != 2:
            raise ValueError(
                f"HeightField.from_image(image) has shape {pixels.shape}; give grey pixels of shape (rows, columns)."
            )
        if np.issubdtype(pixels.dtype, np.integer):
            grey = pixels.astype(np.float64) / np.iinfo(pixels.dtype).max
        else:
            grey = checks.finite_array("HeightField.from_image(image)", pixels, (None, None), "floats from 0 to 1")
        if grey.min() < 0.0 or grey.max() > 1.0:
            raise ValueError(
                f"HeightField.from_image(image) spans {grey.min():g} to {grey.max():g}; give uint8, uint16, or floats "
                "from 0 to 1. Heights in m go to HeightField itself."
            )
        low = checks.finite_number("HeightField.from_image(lowest)", lowest)
        high = checks.finite_number("HeightField.from_image(highest)", highest)
        return cls(low + (high - low) * grey[::-1], size, surface)

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


def _read_grey(path: str | os.PathLike[str]) -> NDArray[Any]:
    """Pixels of a picture as uint8 or, where it has 16 bits of grey, uint16."""
    if not os.path.isfile(path):
        raise ValueError(f"HeightField.from_image(image)={os.fspath(path)!r} is not a file. Check the path.")
    try:
        from PIL import Image
    except ImportError:
        raise ImportError(
            "HeightField.from_image(path) needs Pillow: pip install pillow, or give the pixels as an array."
        ) from None
    try:
        with Image.open(path) as picture:
            if picture.mode.startswith("I"):
                return np.asarray(picture).astype(np.uint16)
            return np.asarray(picture.convert("L"))
    except OSError as error:
        raise ValueError(
            f"HeightField.from_image(image)={os.fspath(path)!r} cannot be read: {error}. Give a file that Pillow "
            "reads, such as PNG or TIFF."
        ) from error
