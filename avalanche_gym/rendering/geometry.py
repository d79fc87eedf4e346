"""Meshes as they are drawn: vertices with normals and colours, and triangles.

A smooth surface shares its vertices between triangles, so the normal runs continuously across them. At a crease, each
side has a vertex of its own at the same place. This is the layout of every graphics card, so the web viewer sends the
same arrays.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray


@dataclass(frozen=True, eq=False)
class Geometry:
    """A mesh to be drawn; compared by identity, and shared between all bodies of the same form.

    Args:
        vertices: (n, 3) [m], body frame.
        faces: (m, 3) indices, counter-clockwise seen from the outside.
        normals: (n, 3) unit, body frame.
        colors: (n, 4) linear red, green, blue in [0, 1] and opacity, multiplied by the body's colour; None for white.
        two_sided: draw the inside too. For sheets.
        cells: (3,) [m] sides of the cells of a solid checker pattern of two shades, along each body axis from the
            origin on; infinite for none along that axis. Makes motion of a plain surface visible.
        contrast: half the relative difference of the two shades; 0 for no pattern.
        grid: (rows, columns) if the vertices are those of a height field, row by row; else None.
        unbounded: stands for an infinite surface: it does not count when a scene is measured.
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.integer]
    normals: NDArray[np.float64]
    colors: NDArray[np.floating] | None = None
    two_sided: bool = False
    cells: tuple[float, float, float] = (math.inf, math.inf, math.inf)
    contrast: float = 0.0
    grid: tuple[int, int] | None = None
    unbounded: bool = False

    def __post_init__(self) -> None:
        vertices = np.ascontiguousarray(self.vertices, dtype=np.float64)
        faces = np.ascontiguousarray(self.faces, dtype=np.int32)
        normals = np.ascontiguousarray(self.normals, dtype=np.float64)
        if vertices.ndim != 2 or vertices.shape[1] != 3 or normals.shape != vertices.shape:
            raise ValueError(
                f"Geometry has vertices of shape {vertices.shape} and normals of shape {normals.shape}; "
                "both must be (n, 3). Geometry.smoothed(vertices, faces) computes the normals."
            )
        if faces.ndim != 2 or faces.shape[1] != 3:
            raise ValueError(f"Geometry(faces) has shape {faces.shape}; allowed is (m, 3): split polygons up.")
        if faces.size and (faces.min() < 0 or faces.max() >= len(vertices)):
            raise ValueError(f"Geometry(faces) names a vertex outside 0 ... {len(vertices) - 1}; count from zero.")
        object.__setattr__(self, "vertices", vertices)
        object.__setattr__(self, "faces", faces)
        object.__setattr__(self, "normals", normals)
        if self.colors is not None:
            colors = np.ascontiguousarray(self.colors, dtype=np.float32)
            if colors.shape != (len(vertices), 4):
                raise ValueError(f"Geometry(colors) has shape {colors.shape}; allowed is {(len(vertices), 4)}.")
            object.__setattr__(self, "colors", colors)

    @classmethod
    def smoothed(cls, vertices: ArrayLike, faces: ArrayLike, crease: float = 35.0, **options: object) -> Geometry:
        """A mesh without normals gets them: smooth where faces meet at less than ``crease`` degrees, else with an edge.

        The normal at a corner of a face is the mean over the faces at that vertex that are turned by less than
        ``crease`` against it, each weighted by its angle there (Thürmer & Wüthrich 1998, "Computing vertex normals from
        polygonal facets", eq. 4), so it does not depend on how a polygon was split.

        Args:
            vertices: (n, 3) [m].
            faces: (m, 3) indices of vertices, counter-clockwise seen from the outside.
            crease: [degrees]; 0 shades every face flat, 180 shades the whole mesh smooth.
            options: further arguments of Geometry, without colours.
        """
        points = np.asarray(vertices, dtype=np.float64)
        triangles = np.asarray(faces, dtype=np.int64)
        corner_normals = _corner_normals(points, triangles, crease)
        # One vertex for each place and normal; rounding joins normals that differ by the order of summation only.
        keys = np.concatenate([triangles.reshape(-1, 1), np.round(corner_normals * 1e6).astype(np.int64)], axis=1)
        _, first, inverse = np.unique(keys, axis=0, return_index=True, return_inverse=True)
        return cls(
            points[triangles.reshape(-1)[first]],
            inverse.reshape(-1, 3).astype(np.int32),
            corner_normals[first],
            **options,  # type: ignore[arg-type]
        )

    @classmethod
    def merged(cls, parts: Iterable[tuple[Geometry, ArrayLike, ArrayLike]]) -> Geometry:
        """Several meshes as one; [(geometry, position (3,) [m], orientation (4,) wxyz), ...]. Patterns are left out."""
        vertices, faces, normals, colors, offset = [], [], [], [], 0
        members = list(parts)
        for geometry, position, orientation in members:
            rotation = rotation_matrix(orientation)
            vertices.append(geometry.vertices @ rotation.T + np.asarray(position, dtype=np.float64))
            normals.append(geometry.normals @ rotation.T)
            faces.append(geometry.faces + offset)
            colors.append(geometry.vertex_colors)
            offset += len(geometry.vertices)
        return cls(
            np.concatenate(vertices),
            np.concatenate(faces),
            np.concatenate(normals),
            np.concatenate(colors),
            two_sided=any(geometry.two_sided for geometry, _, _ in members),
        )

    @property
    def vertex_colors(self) -> NDArray[np.floating]:
        """(n, 4) the colours, or white."""
        return np.ones((len(self.vertices), 4), dtype=np.float32) if self.colors is None else self.colors

    def with_options(self, **options: object) -> Geometry:
        """A copy in which some arguments are replaced, for example ``contrast=0.0``."""
        return replace(self, **options)  # type: ignore[arg-type]


def rotation_matrix(orientation: ArrayLike) -> NDArray[np.float64]:
    """The rotation matrix (3, 3) of a quaternion (4,) wxyz."""
    w, x, y, z = np.asarray(orientation, dtype=np.float64) / np.linalg.norm(orientation)
    return np.array(
        [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
            [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
            [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
        ]
    )


def _corner_normals(points: NDArray[np.float64], triangles: NDArray[np.int64], crease: float) -> NDArray[np.float64]:
    """(3 m, 3) the normal at each corner of each face; faces without area take part with no weight."""
    corners = points[triangles]  # (m, 3, 3)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = np.divide(normals, lengths, out=np.zeros_like(normals), where=lengths > 0.0)
    ahead = np.roll(corners, -1, axis=1) - corners
    behind = np.roll(corners, 1, axis=1) - corners
    angles = np.arctan2(np.linalg.norm(np.cross(ahead, behind), axis=2), (ahead * behind).sum(axis=2)).reshape(-1)

    # All ordered pairs of corners at the same place: sort by place, then pair within each group.
    _, place = np.unique(points, axis=0, return_inverse=True)
    place = place.reshape(-1)[triangles.reshape(-1)]
    order = np.argsort(place, kind="stable")
    counts = np.bincount(place)
    starts = np.concatenate([[0], np.cumsum(counts)[:-1]])
    group = counts[place]
    to = np.repeat(np.arange(len(place)), group)
    step = np.arange(len(to)) - np.repeat(np.cumsum(group) - group, group)
    source = order[np.repeat(starts[place], group) + step]

    own, other = normals[to // 3], normals[source // 3]
    # The slack keeps coplanar triangles together at crease 0.
    weight = np.where((own * other).sum(axis=1) >= np.cos(np.radians(crease)) - 1e-9, angles[source], 0.0)
    total = np.zeros((len(place), 3))
    for axis in range(3):
        total[:, axis] = np.bincount(to, weight * other[:, axis], minlength=len(place))
    lengths = np.linalg.norm(total, axis=1, keepdims=True)
    return np.where(lengths > 0.0, total / np.where(lengths > 0.0, lengths, 1.0), np.repeat(normals, 3, axis=0))
