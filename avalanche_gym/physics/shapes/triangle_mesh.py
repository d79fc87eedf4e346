"""Triangle meshes: closed ones are solids, open ones are surfaces for static and kinematic bodies."""

from __future__ import annotations

import os
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import mass_properties, model
from . import checks
from .self_crossing import crossing_faces
from .shape import Shape


@dataclass(frozen=True, eq=False, init=False)
class TriangleMesh(Shape):
    """Triangles in the frame their vertices were given in; concave meshes welcome.

    Args:
        vertices: (n, 3) [m].
        faces: (m, 3) indices of vertices, counter-clockwise seen from the outside, the side that acts.
        two_sided: an open sheet that acts on both sides.
    """

    vertices: NDArray[np.float64]  # (n, 3) [m], read-only
    faces: NDArray[np.int64]  # (m, 3), read-only
    two_sided: bool

    code: ClassVar[int] = model.MESH

    def __init__(self, vertices: ArrayLike, faces: ArrayLike, two_sided: bool = False) -> None:
        points = checks.finite_array("TriangleMesh(vertices)", vertices, (None, 3), "points of shape (n, 3) in m")
        try:
            triangles: NDArray[np.int64] = np.array(faces).astype(np.int64, casting="same_kind", order="C")
        except (TypeError, ValueError):
            raise TypeError(
                "TriangleMesh(faces) must be integers; give indices of shape (m, 3) into vertices."
            ) from None
        if triangles.ndim != 2 or triangles.shape[1] != 3 or len(triangles) == 0:
            raise ValueError(
                f"TriangleMesh(faces) has shape {triangles.shape}; give at least one triangle, shape (m, 3)."
            )
        if triangles.min() < 0 or triangles.max() >= len(points):
            row = int(np.argwhere((triangles < 0) | (triangles >= len(points)))[0, 0])
            raise ValueError(
                f"TriangleMesh(faces)[{row}]={triangles[row].tolist()}; indices must lie in 0 ... {len(points) - 1}, "
                f"for there are {len(points)} vertices. Count from zero."
            )
        triangles.flags.writeable = False
        object.__setattr__(self, "vertices", points)
        object.__setattr__(self, "faces", triangles)
        object.__setattr__(self, "two_sided", checks.truth("TriangleMesh(two_sided)", two_sided))

    @classmethod
    def from_file(cls, path: str | os.PathLike[str], scale: float = 1.0, two_sided: bool = False) -> TriangleMesh:
        """Read any format trimesh knows (STL, OBJ, PLY, GLB ...); all bodies of the file become one mesh.

        Args:
            path: of the file.
            scale: factor that turns the file's unit of length into metres, for example 0.001 for millimetres.
            two_sided: an open sheet that acts on both sides.
        """
        import trimesh  # here, since few programs load files

        factor = checks.positive_number("TriangleMesh.from_file(scale)", scale)
        if not isinstance(path, (str, os.PathLike)):
            raise TypeError(f"TriangleMesh.from_file(path)={path!r}; give the path of a file as a str or a Path.")
        if not os.path.isfile(path):
            raise ValueError(f"TriangleMesh.from_file(path)={os.fspath(path)!r} is not a file. Check the path.")
        try:
            mesh = trimesh.load_mesh(path)
        except Exception as error:  # loaders of many formats, each with errors of its own
            raise ValueError(
                f"TriangleMesh.from_file(path)={os.fspath(path)!r} cannot be read: {error}. Give a file that trimesh "
                "reads, such as STL, OBJ, PLY or GLB."
            ) from error
        if not isinstance(mesh, trimesh.Trimesh) or len(mesh.faces) == 0:
            raise ValueError(
                f"TriangleMesh.from_file(path)={os.fspath(path)!r} holds no triangles. Export a triangle mesh."
            )
        return cls(mesh.vertices * factor, mesh.faces, two_sided)

    @cached_property
    def is_closed(self) -> bool:
        """Whether the surface has no border and a consistent inside.

        Every directed edge must occur once, and its reverse once; vertices at exactly the same point count as one.
        """
        _, merged = np.unique(self.vertices, axis=0, return_inverse=True)
        faces: NDArray[np.int64] = merged.reshape(-1)[self.faces]
        start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
        count = int(faces.max()) + 1
        forward = np.sort(start * count + end)
        backward = np.sort(end * count + start)
        return bool((np.diff(forward) > 0).all() and np.array_equal(forward, backward))

    @cached_property
    def crossing_faces(self) -> NDArray[np.int64]:
        """(k, 2) pairs of faces that cross each other; vertices at exactly the same point count as one."""
        points, merged = np.unique(self.vertices, axis=0, return_inverse=True)
        return crossing_faces(points, merged.reshape(-1)[self.faces])

    @property
    def size(self) -> tuple[float, float, float]:
        return (0.0, 0.0, 0.0)

    @property
    def bounding_radius(self) -> float:
        used = self.vertices[np.unique(self.faces)]
        return float(np.linalg.norm(used, axis=1).max())

    @cached_property
    def smallest_half_extent(self) -> float:
        """Half of its smallest width along an axis of inertia of its vertices.

        A flat sheet has no thickness; half of its smallest width within the sheet serves as scale.
        """
        points = self.vertices[np.unique(self.faces)]
        points = points - points.mean(axis=0)
        axes = np.linalg.svd(points, full_matrices=False)[2]
        widths = np.ptp(points @ axes.T, axis=0)
        return 0.5 * float(widths[widths > 1e-9 * widths.max()].min()) if widths.max() > 0.0 else 0.0

    def lever_about(self, point: ArrayLike) -> float:
        """[m] How far the surface moves along its normals at most, a radian of turning about ``point`` [m].

        That is the largest |p x n| of a point p of a face with normal n; on a face it is largest at a corner.
        """
        corners = (self.vertices - np.asarray(point))[self.faces]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        return float(np.linalg.norm(np.cross(corners, normals[:, None]), axis=2).max())

    def mass_properties(self) -> mass_properties.MassProperties:
        if not self.is_closed:
            raise ValueError(
                "TriangleMesh is open (an edge lacks its neighbour, or faces turn both ways), so it has no volume. "
                'Close it (trimesh.repair.fill_holes, fix_normals), use ConvexHull(vertices), or give motion="static".'
            )
        crossing = self.crossing_faces
        if len(crossing):
            pairs = "one pair" if len(crossing) == 1 else f"{len(crossing)} pairs"
            raise ValueError(
                f"TriangleMesh crosses itself: {pairs} of faces do, the first one {crossing[0].tolist()}, so it has no "
                "clear inside. Unite its parts (trimesh.boolean.union), make them parts of a Compound, or use "
                "ConvexHull(vertices)."
            )
        return mass_properties.of_mesh(self.vertices, self.faces)
