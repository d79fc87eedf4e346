"""Sun, sky and haze: what lights a scene and what is seen behind it.

A surface of colour c with normal n is seen as c (hemisphere(n) + sun max(0, n.s) shadow): light from the sky above,
light thrown back from the ground below, blended by the tilt of the surface (hemisphere lighting), and one sun.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .color import Color, linear_color


@dataclass(frozen=True)
class Lighting:
    """What lights a scene.

    Args:
        sun: (3,) direction towards the sun.
        sun_color: sRGB, times ``sun_strength``.
        sun_strength: light of the sun on a surface that faces it.
        above: sRGB, light from the sky, times ``ambient_strength``.
        below: sRGB, light from the ground, times ``ambient_strength``.
        ambient_strength: light on a surface in the shade.
        zenith: sRGB, backdrop straight above.
        horizon: sRGB, backdrop at the horizon; what is far away fades into it.
        nadir: sRGB, backdrop straight below.
        glow: brightness of the halo about the sun.
        stars: brightness of the brightest star.
        haze: distance at which half of a colour has faded into the horizon, in sizes of the scene; infinite for none.
    """

    sun: tuple[float, float, float] = (-0.62, -0.28, 0.73)
    sun_color: Color = "#fff1dc"
    sun_strength: float = 0.92
    above: Color = "#c2d8f2"
    below: Color = "#b39d84"
    ambient_strength: float = 0.44
    zenith: Color = "#5b97d6"
    horizon: Color = "#dde8ef"
    nadir: Color = "#a9b8c4"
    glow: float = 0.35
    stars: float = 0.0
    haze: float = 16.0

    @property
    def direction(self) -> NDArray[np.float64]:
        """(3,) unit, towards the sun."""
        sun = np.asarray(self.sun, dtype=np.float64)
        return sun / np.linalg.norm(sun)

    def linear_colors(self) -> dict[str, NDArray[np.float64]]:
        """Each colour (3,) in linear light, times its strength."""
        strength = {"sun_color": self.sun_strength, "above": self.ambient_strength, "below": self.ambient_strength}
        names = ("sun_color", "above", "below", "zenith", "horizon", "nadir")
        return {name: np.array(linear_color(getattr(self, name), name)) * strength.get(name, 1.0) for name in names}


DAY = Lighting()

SPACE = Lighting(
    sun=(0.7, -0.6, 0.45),
    sun_color="#fff8ec",
    sun_strength=1.0,
    above="#7f93b8",
    below="#5e5a66",
    ambient_strength=0.32,
    zenith="#0a0d18",
    horizon="#111626",
    nadir="#080a12",
    glow=0.25,
    stars=0.9,
    haze=float("inf"),
)
