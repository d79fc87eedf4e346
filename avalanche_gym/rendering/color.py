"""Colours: what users write, the linear light the renderer computes with, and the palette of the package.

Users write sRGB, as ``"#4f86c6"`` or as three numbers in [0, 1]. Light adds up linearly, so every colour is turned into
linear light once, when it enters, and back into sRGB once, when a pixel is written (IEC 61966-2-1).
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Color = str | Sequence[float]

# Of bodies without a colour of their own, in turn: distinct in hue and in lightness, calm beside grass, sand and snow.
PALETTE = ("#e8743b", "#3f8fd2", "#f2c14e", "#7d5ba6", "#4fb286", "#d1495b", "#2e6f95", "#f49fbc", "#a4c957", "#8c6a4f")

AGENT = "#ff8a1f"
GOAL = "#16d6f2"
DANGER = "#e5484d"
STATIC = "#b9b4a7"  # ground without a colour of its own

_HEX = re.compile(r"#[0-9a-fA-F]{6}")


def to_linear(srgb: NDArray[np.float64]) -> NDArray[np.float64]:
    """Linear light of sRGB values in [0, 1]."""
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)


def to_srgb(linear: NDArray[np.float64]) -> NDArray[np.float64]:
    """sRGB values in [0, 1] of linear light, clipped to [0, 1]."""
    linear = np.clip(linear, 0.0, 1.0)
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1.0 / 2.4) - 0.055)


def linear_color(color: Color, name: str = "color") -> tuple[float, float, float]:
    """Linear red, green and blue of a colour.

    Args:
        color: ``"#rrggbb"`` or three sRGB numbers in [0, 1].
        name: of the argument, for the error.

    Raises:
        ValueError: it is neither.
    """
    if isinstance(color, str):
        values = [int(color[i : i + 2], 16) / 255.0 for i in (1, 3, 5)] if _HEX.fullmatch(color) else []
    else:
        values = [float(value) for value in color]
    if len(values) != 3 or not all(math.isfinite(value) and 0.0 <= value <= 1.0 for value in values):
        raise ValueError(f'{name}={color!r}; give "#rrggbb" or three numbers in [0, 1], for example "#4f86c6".')
    red, green, blue = to_linear(np.array(values))
    return (float(red), float(green), float(blue))


def palette_color(index: int) -> str:
    """The colour of the body with this number."""
    return PALETTE[index % len(PALETTE)]
