"""Procedural terrain: arrays of heights to add up and hand to HeightField.

Every generator returns heights (rows, columns) [m], rows along y, columns along x, on a grid that covers ``size``
centred on the origin, as HeightField has it. Randomness comes from the generator the caller passes, and only from it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Heights = NDArray[np.float64]


def grid(rows: int, columns: int, size: Sequence[float]) -> tuple[Heights, Heights]:
    """x and y [m] of the samples, each (rows, columns)."""
    x = np.linspace(-0.5 * size[0], 0.5 * size[0], columns)
    y = np.linspace(-0.5 * size[1], 0.5 * size[1], rows)
    return np.meshgrid(x, y, indexing="xy")


def _fade(t: Heights) -> Heights:
    """Perlin 2002, "Improving noise": 6 t^5 - 15 t^4 + 10 t^3, flat to second order at 0 and 1."""
    return t * t * t * (t * (6.0 * t - 15.0) + 10.0)


def value_noise(x: Heights, y: Heights, period: float, generator: np.random.Generator) -> Heights:
    """Random values in [-1, 1] on a lattice of this period [m], blended in between."""
    return _lattice_noise(x, y, period, generator, gradients=False)


def gradient_noise(x: Heights, y: Heights, period: float, generator: np.random.Generator) -> Heights:
    """Random slopes on a lattice of this period [m], zero at its nodes, within [-1, 1]; Perlin 2002."""
    return _lattice_noise(x, y, period, generator, gradients=True)


def _lattice_noise(x: Heights, y: Heights, period: float, generator: np.random.Generator, gradients: bool) -> Heights:
    u = (x - x.min()) / period + generator.uniform()
    v = (y - y.min()) / period + generator.uniform()
    i, j = np.floor(u).astype(np.int64), np.floor(v).astype(np.int64)
    u, v = u - i, v - j
    nodes = (int(j.max()) + 2, int(i.max()) + 2)
    random = generator.uniform(-1.0, 1.0, nodes)

    def corner(down: int, right: int) -> Heights:
        value: Heights = random[j + down, i + right]
        if not gradients:
            return value
        angle = np.pi * value
        # sqrt(2): the largest magnitude of the blend of unit slopes is then 1.
        return np.sqrt(2.0) * (np.cos(angle) * (u - right) + np.sin(angle) * (v - down))

    a, b = _fade(u), _fade(v)
    low = corner(0, 0) * (1.0 - a) + corner(0, 1) * a
    high = corner(1, 0) * (1.0 - a) + corner(1, 1) * a
    return low * (1.0 - b) + high * b


def octaves(
    rows: int,
    columns: int,
    size: Sequence[float],
    generator: np.random.Generator,
    *,
    amplitude: float,
    period: float,
    count: int = 4,
    persistence: float = 0.5,
    ridged: bool = False,
    gradients: bool = True,
) -> Heights:
    """A sum of noises, each of half the period of the one before.

    Args:
        rows: samples along y.
        columns: samples along x.
        size: extent [m] along x and y.
        generator: source of randomness.
        amplitude: [m] the first noise lies within this of zero.
        period: [m] of the first noise: the distance between hills.
        count: of noises; the last one's period should stay above two cells.
        persistence: factor of the amplitude from each noise to the next.
        ridged: fold each noise at zero, so that its zero lines become sharp ridges.
        gradients: gradient noise; otherwise value noise, with rounder and less even hills.
    """
    x, y = grid(rows, columns, size)
    total = np.zeros((rows, columns))
    for octave in range(count):
        noise = _lattice_noise(x, y, period * 0.5**octave, generator, gradients)
        if ridged:
            noise = 1.0 - 2.0 * np.abs(noise)
        total += amplitude * persistence**octave * noise
    return total


def crater_profile(distance: Heights, rim: float) -> Heights:
    """Height of a crater in units of its depth, at a distance in units of its radius: a bowl, its rim, the slope."""
    bowl = (1.0 + rim) * distance**2 - 1.0
    slope = rim * np.exp(-4.0 * np.maximum(distance - 1.0, 0.0))
    return np.where(distance < 1.0, bowl, slope)


def craters(
    rows: int,
    columns: int,
    size: Sequence[float],
    generator: np.random.Generator,
    *,
    count: int,
    radius: tuple[float, float],
    depth: float = 0.3,
    rim: float = 0.25,
) -> Heights:
    """Bowls with a raised rim that falls off outside.

    Args:
        rows: samples along y.
        columns: samples along x.
        size: extent [m] along x and y.
        generator: source of randomness.
        count: of craters, spread evenly at random.
        radius: [m] smallest and largest; small ones are more frequent.
        depth: of the bowl's centre below the plain, in radii.
        rim: height of the rim above the plain, as a share of the depth.
    """
    x, y = grid(rows, columns, size)
    total = np.zeros((rows, columns))
    centers = generator.uniform(-0.5, 0.5, (count, 2)) * np.asarray(size, dtype=np.float64)
    radii = radius[0] + (radius[1] - radius[0]) * generator.uniform(size=count) ** 2
    for (cx, cy), r in zip(centers, radii, strict=True):
        distance = np.hypot(x - cx, y - cy) / r
        total += depth * r * crater_profile(distance, rim)
    return total


def valley(
    rows: int,
    columns: int,
    size: Sequence[float],
    generator: np.random.Generator,
    *,
    depth: float,
    width: float,
    meander: float = 0.0,
) -> Heights:
    """One valley in a random direction through the middle, a Gaussian across, that may wind.

    Args:
        rows: samples along y.
        columns: samples along x.
        size: extent [m] along x and y.
        generator: source of randomness.
        depth: [m] below the plain; negative raises a dam.
        width: [m] from the floor to where it has risen to 40 % of the depth.
        meander: [m] by which the floor winds to either side.
    """
    x, y = grid(rows, columns, size)
    heading, phase = generator.uniform(0.0, 2.0 * np.pi, 2)
    along = x * np.cos(heading) + y * np.sin(heading)
    across = y * np.cos(heading) - x * np.sin(heading)
    across = across - meander * np.sin(2.0 * np.pi * along / (0.5 * max(size)) + phase)
    return -depth * np.exp(-0.5 * (across / width) ** 2)


def ridges(
    rows: int,
    columns: int,
    size: Sequence[float],
    generator: np.random.Generator,
    *,
    amplitude: float,
    period: float,
    count: int = 3,
) -> Heights:
    """Sharp crests with gullies between them: folded noise (see ``octaves``)."""
    return octaves(rows, columns, size, generator, amplitude=amplitude, period=period, count=count, ridged=True)
