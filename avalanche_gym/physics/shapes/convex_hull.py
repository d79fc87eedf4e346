"""The convex hull of points."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import mass_properties, model
from . import checks
from .shape import Shape


@dataclass(frozen=True, eq=False, init=False)
class ConvexHull(Shape):
    """Convex hull of points, in the frame they were given in.

    Args:
        vertices: (n, 3) [m], at least four that do not lie in one plane. Points inside the hull are dropped.
    """

    vertices: NDArray[np.float64]  # (n, 3) [m] the corners of the hull, read-only
    faces: NDArray[np.int64]  # (m, 3) triangles, counter-clockwise seen from outside, read-only
    half_width: float  # [m] half of its smallest width across a face

    code: ClassVar[int] = model.HULL

    def __init__(self, vertices: ArrayLike) -> None:
        from scipy.spatial import ConvexHull as Hull  # here, since importing SciPy costs more than the engine
        from scipy.spatial import QhullError

        points = checks.finite_array("ConvexHull(vertices)", vertices, (None, 3), "points of shape (n, 3) in m")
        if len(points) < 4:
            raise ValueError(f"ConvexHull(vertices) has {len(points)} points; a solid needs at least 4. Add points.")
        try:
            hull = Hull(points)
        except QhullError:
            raise ValueError(
                f"ConvexHull(vertices): the {len(points)} points lie in one plane or on one line; a solid needs four "
                "that do not. Add a point off the plane, or use a thin Box."
            ) from None
        renumbered = np.full(len(points), -1, dtype=np.int64)
        renumbered[hull.vertices] = np.arange(len(hull.vertices))
        corners = points[hull.vertices]
        faces = renumbered[hull.simplices]
        a, b, c = (corners[faces[:, i]] for i in range(3))
        inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), hull.equations[:, :3]) < 0.0
        faces[inward] = faces[inward][:, ::-1]
        corners.flags.writeable = faces.flags.writeable = False
        object.__setattr__(self, "vertices", corners)
        object.__setattr__(self, "faces", faces)
        object.__setattr__(self, "half_width", 0.5 * smallest_width(corners, hull.equations[:, :3]))

    @property
    def size(self) -> tuple[float, float, float]:
        return (0.0, 0.0, 0.0)

    @property
    def bounding_radius(self) -> float:
        return float(np.linalg.norm(self.vertices, axis=1).max())

    @property
    def smallest_half_extent(self) -> float:
        """Half of the smallest width across a face of the hull."""
        return self.half_width

    def mass_properties(self) -> mass_properties.MassProperties:
        return mass_properties.of_mesh(self.vertices, self.faces)


def smallest_width(points: NDArray[np.float64], directions: NDArray[np.float64]) -> float:
    """[m] the smallest extent of ``points`` (n, 3) along any of the unit ``directions`` (m, 3)."""
    widths = [
        np.ptp(points @ block.T, axis=0).min() for block in np.array_split(directions, 1 + len(directions) // 256)
    ]
    return float(min(widths))
