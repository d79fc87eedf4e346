"""Ground coloured by its height and its slope, as one expects a landscape to look.

A palette is a ramp of colours from the lowest to the highest ground and the colour of steep ground; a grain that
depends on the vertex number breaks up even areas.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .color import linear_color
from .geometry import Geometry


@dataclass(frozen=True)
class TerrainPalette:
    """The colours of a kind of ground.

    Args:
        ramp: colours from the lowest to the highest ground, evenly spaced.
        steep: colour of rock where nothing holds.
        slopes: cosines of the slopes at which ground is all steep, and no longer steep.
        grain: relative variation of brightness from vertex to vertex.
    """

    ramp: tuple[str, ...]
    steep: str
    slopes: tuple[float, float] = (0.5, 0.8)
    grain: float = 0.06


MEADOW = TerrainPalette(("#c9b583", "#8fae5c", "#6f9c4f", "#7f9a58", "#a59b7c", "#e9ecef"), "#8a7d6d")
SNOW = TerrainPalette(("#b4c6d4", "#cfdce6", "#dee8ef", "#eef3f7"), "#7d8792", (0.45, 0.75), 0.025)
MOON = TerrainPalette(("#6f7076", "#8b8b90", "#a3a2a4", "#bdbbb8"), "#77716c", (0.6, 0.9), 0.08)
DUNES = TerrainPalette(("#b9834e", "#d3a565", "#e3be84", "#f0d9a8"), "#a8713f", (0.6, 0.95), 0.03)


def terrain_colors(heights: ArrayLike, steepness: ArrayLike, palette: TerrainPalette = MEADOW) -> NDArray[np.float32]:
    """(n, 4) vertex colours of ground.

    Args:
        heights: (n,) in any unit: only their order within their own range counts.
        steepness: (n,) cosine between normal and vertical; 1 is level.
        palette: of the ground.
    """
    z = np.asarray(heights, dtype=np.float64)
    span = float(np.ptp(z))
    level = (z - z.min()) / span if span > 0.0 else np.full_like(z, 0.4)
    # Integer hash of the vertex number (Steele et al. 2014, the mixer of SplitMix64): random looking, always the same.
    bits = (np.arange(len(z), dtype=np.uint64) + np.uint64(1)) * np.uint64(0x9E3779B97F4A7C15)
    bits = (bits ^ (bits >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    bits = (bits ^ (bits >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    grain = (bits >> np.uint64(40)).astype(np.float64) / 2.0**23 - 1.0
    level = np.clip(level + 0.04 * grain, 0.0, 1.0)

    stops = np.linspace(0.0, 1.0, len(palette.ramp))
    ramp = np.array([linear_color(color) for color in palette.ramp])
    base = np.stack([np.interp(level, stops, ramp[:, channel]) for channel in range(3)], axis=1)
    low, high = palette.slopes
    steep = np.clip((high - np.asarray(steepness, dtype=np.float64)) / (high - low), 0.0, 1.0)
    steep = (steep * steep * (3.0 - 2.0 * steep))[:, None]
    color = base * (1.0 - steep) + np.array(linear_color(palette.steep)) * steep
    color *= 1.0 + palette.grain * grain[:, None]
    return np.concatenate([np.clip(color, 0.0, 1.0), np.ones((len(z), 1))], axis=1).astype(np.float32)


def as_terrain(geometry: Geometry, palette: TerrainPalette = MEADOW) -> Geometry:
    """A height field coloured as ground, z being up."""
    rows, columns = geometry.grid or (len(geometry.vertices), 1)
    colors = np.ones((len(geometry.vertices), 4), dtype=np.float32)
    top = slice(rows * columns)
    colors[top] = terrain_colors(geometry.vertices[top, 2], geometry.normals[top, 2], palette)
    colors[rows * columns :, :3] = linear_color(palette.steep)  # its sides
    return geometry.with_options(colors=colors)


def as_planet(geometry: Geometry, palette: TerrainPalette = MOON) -> Geometry:
    """A closed mesh coloured as the ground of a planet, the direction away from its origin being up."""
    heights = np.linalg.norm(geometry.vertices, axis=1)
    up = geometry.vertices / np.where(heights > 0.0, heights, 1.0)[:, None]
    return geometry.with_options(colors=terrain_colors(heights, (up * geometry.normals).sum(axis=1), palette))
