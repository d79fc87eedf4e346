"""A rabbit: a round, concave body with ears, made of ellipsoids that melt into one another."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from . import checks
from .surface_nets import surface_nets
from .triangle_mesh import TriangleMesh

# Centre and half extents of body, head, ears, feet, tail, and the lean of the part towards x [rad], in heights.
PARTS = (
    ((-0.04, 0.0, 0.27), (0.27, 0.21, 0.25), 0.0),
    ((0.17, 0.0, 0.55), (0.16, 0.14, 0.15), 0.0),
    ((0.08, 0.085, 0.80), (0.045, 0.055, 0.20), -0.35),
    ((0.08, -0.085, 0.80), (0.045, 0.055, 0.20), -0.35),
    ((0.12, 0.13, 0.07), (0.16, 0.065, 0.065), 0.0),
    ((0.12, -0.13, 0.07), (0.16, 0.065, 0.065), 0.0),
    ((-0.32, 0.0, 0.20), (0.075, 0.075, 0.075), 0.0),
)
# How far parts melt into one another, in heights; smaller leaves sharper creases.
MELT = 0.03
# A rabbit of this many cells from foot to ear has this many triangles; their number grows as the square.
CELLS, TRIANGLES = 40.0, 6049.0

# Places of the grid, in cells, to try: where two parts of the surface pass one cell the mesh would not be closed.
SHIFTS = np.linspace(0.37, 1.25, 9)


def rabbit(
    height: float, generator: np.random.Generator | None = None, *, triangles: int = 5000, variation: float = 0.1
) -> TriangleMesh:
    """A rabbit that looks along x and sits on z = 0, with its ears up.

    Args:
        height: [m] from the feet to the tips of the ears, about.
        generator: source of randomness for the proportions; ``None`` for the plain rabbit.
        triangles: about how many.
        variation: standard deviation of the sizes of its parts, relative.

    Raises:
        ValueError: so few triangles that its ears or feet do not come out.
    """
    height = checks.positive_number("rabbit(height)", height)
    if not 600 <= triangles <= 1_000_000:
        raise ValueError(f"rabbit(triangles)={triangles!r}; allowed are 600 (below, ears break) to 1,000,000.")
    variation = checks.non_negative_number("rabbit(variation)", variation)
    centers = np.array([part[0] for part in PARTS])
    halves = np.array([part[1] for part in PARTS])
    leans = np.array([part[2] for part in PARTS])
    if generator is not None:
        halves = halves * np.exp(variation * generator.normal(size=(len(PARTS), 1)).clip(-2.0, 2.0))
    sines, cosines = np.sin(leans), np.cos(leans)

    def field(points: NDArray[np.float64]) -> NDArray[np.float64]:
        """About the distance from the surface: the parts' own ones, joined by a smooth minimum."""
        total = np.zeros(len(points))
        for center, half, sine, cosine in zip(centers, halves, sines, cosines, strict=True):
            offset = points - center
            x, z = cosine * offset[:, 0] - sine * offset[:, 2], sine * offset[:, 0] + cosine * offset[:, 2]
            local = np.stack([x, offset[:, 1], z], axis=1) / half
            radius = np.linalg.norm(local, axis=1)
            slope = np.linalg.norm(local / half, axis=1)
            # Ellipsoid: k0 (k0 - 1) / k1 has the distance's slope at the surface.
            distance = radius * (radius - 1.0) / np.where(slope > 0.0, slope, 1.0)
            total += np.exp(-np.minimum(distance, 1.0) / MELT)
        return -MELT * np.log(total)

    cell = float(np.sqrt(TRIANGLES / triangles)) / CELLS
    for shift in SHIFTS:
        # A grid that is aligned with nothing.
        lower = np.array([-0.61, -0.517, -0.213]) - shift * cell
        vertices, faces = surface_nets(field, lower, np.array([0.6, 0.52, 1.25]), cell)
        vertices[:, 2] -= vertices[:, 2].min()
        mesh = TriangleMesh(height * vertices, faces)
        if mesh.is_closed:
            return mesh
    raise ValueError(f"rabbit(triangles)={triangles!r} is too coarse for this variation={variation!r}; give more.")
