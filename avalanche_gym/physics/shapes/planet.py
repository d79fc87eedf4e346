"""Small planets, made at random: closed concave meshes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from . import checks
from .radial_terrain import RadialTerrain
from .terrain import crater_profile


def bumpy_planet(
    radius: float,
    generator: np.random.Generator,
    *,
    subdivisions: int = 4,
    amplitude: float = 0.05,
    bumps: int = 60,
    width: float = 0.25,
) -> RadialTerrain:
    """A sphere raised and lowered by smooth hills and hollows at random places.

    Each bump is a Gaussian of the angle from its centre; their sum is scaled so that the largest departure from the
    sphere is ``amplitude``, and each vertex is moved along its radius, so the mesh stays closed and star-shaped.

    Args:
        radius: [m] of the sphere.
        generator: source of randomness.
        subdivisions: 20 x 4^subdivisions triangles.
        amplitude: largest height or depth of a bump, in radii; 0 leaves the sphere.
        bumps: how many hills and hollows.
        width: [rad] of a bump, as seen from the centre, from its top to 60 % of its height.
    """
    radius = checks.positive_number("bumpy_planet(radius)", radius)
    amplitude = checks.non_negative_number("bumpy_planet(amplitude)", amplitude)
    if amplitude >= 1.0:
        raise ValueError(
            f"bumpy_planet(amplitude)={amplitude!r}; a hollow must not reach the centre. Give less than 1."
        )
    if not 0 <= subdivisions <= 8:
        raise ValueError(f"bumpy_planet(subdivisions)={subdivisions!r}; allowed are 0 to 8 (1.3 million triangles).")
    centers = _random_directions(bumps, generator)
    sharpness = width * (0.5 + generator.uniform(size=bumps))
    heights = generator.uniform(-1.0, 1.0, bumps)
    # 1 - cos(angle) = angle^2 / 2 near the centre of a bump.
    relief = np.exp((RadialTerrain.directions(subdivisions) @ centers.T - 1.0) / sharpness**2) @ heights
    largest = np.abs(relief).max(initial=0.0)
    scale = amplitude / largest if largest > 0.0 else 0.0
    return RadialTerrain(radius * (1.0 + scale * relief), subdivisions)


def _random_directions(count: int, generator: np.random.Generator) -> NDArray[np.float64]:
    """(count, 3) unit vectors, evenly distributed."""
    directions = generator.normal(size=(count, 3))
    return directions / np.linalg.norm(directions, axis=1, keepdims=True)


def cratered_planet(
    radius: float,
    generator: np.random.Generator,
    *,
    subdivisions: int = 5,
    count: int = 60,
    size: tuple[float, float] = (0.05, 0.3),
    depth: float = 0.3,
    rim: float = 0.25,
) -> RadialTerrain:
    """A sphere with craters: bowls with a raised rim that falls off outside, as ``terrain.craters`` on a plane.

    Args:
        radius: [m] of the sphere.
        generator: source of randomness.
        subdivisions: 20 x 4^subdivisions triangles.
        count: of craters, spread evenly at random.
        size: [rad] smallest and largest radius, seen from the centre; small ones are more frequent.
        depth: of the bowl's centre below the sphere, in radii of the crater.
        rim: height of the rim above the sphere, as a share of the depth.
    """
    radius = checks.positive_number("cratered_planet(radius)", radius)
    directions = RadialTerrain.directions(subdivisions)
    relief = np.zeros(len(directions))
    centers = _random_directions(count, generator)
    sizes = size[0] + (size[1] - size[0]) * generator.uniform(size=count) ** 2
    for center, r in zip(centers, sizes, strict=True):
        relief += depth * r * crater_profile(np.arccos(np.clip(directions @ center, -1.0, 1.0)) / r, rim)
    return RadialTerrain(radius * (1.0 + relief), subdivisions)
