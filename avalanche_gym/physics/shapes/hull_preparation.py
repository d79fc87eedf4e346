"""A convex hull made ready for contact, once: its plane faces as polygons, and its edges.

The triangles of a hull that lie in one plane are one face, whose normal is that of its largest extent, so that a hull
rests on a face and not on the triangles it was cut into.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..shape_rows import HULL_EDGE_ROW, HULL_FACE_ROW, HULL_ROW

# Faces with more corners than the clipping has room for keep this many, evenly chosen. The contacts then span a polygon
# inscribed in the face; the closest points are exact all the same.
MOST_CORNERS = 32

# Triangles whose corners lie in one plane within this fraction of the hull's size are one face.
IN_PLANE = 1e-9


class PreparedHull(NamedTuple):
    """Tables of one hull, with indices that count from its own first rows."""

    hull: NDArray[np.void]  # one HULL_ROW, its firsts zero
    points: NDArray[np.float64]  # (vertices, 3) [m]
    faces: NDArray[np.void]  # HULL_FACE_ROW
    corners: NDArray[np.int64]
    edges: NDArray[np.void]  # HULL_EDGE_ROW


def prepare_hull(vertices: NDArray[np.float64], triangles: NDArray[np.int64]) -> PreparedHull:
    """Join the triangles of a hull to plane faces.

    Args:
        vertices: (n, 3) [m], the corners of the hull.
        triangles: (m, 3), counter-clockwise seen from outside.
    """
    points = np.ascontiguousarray(vertices, dtype=np.float64)
    size = float(np.linalg.norm(np.ptp(points, axis=0)))
    a, b, c = (points[triangles[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    areas = np.linalg.norm(normals, axis=1)
    open_triangles = set(range(len(triangles)))
    rows: list[tuple[NDArray[np.float64], int, int]] = []
    corners: list[int] = []
    polygons: list[NDArray[np.int64]] = []
    # The largest triangle that is left has the best normal; all vertices in its plane are the corners of its face.
    for seed in np.argsort(-areas, kind="stable"):
        if seed not in open_triangles:
            continue
        normal = normals[seed] / areas[seed]
        heights = (points - points[triangles[seed, 0]]) @ normal
        flat = np.abs(heights) <= IN_PLANE * size
        members = [i for i in open_triangles if flat[triangles[i]].all() and (normals[i] @ normal) >= 0.0]
        open_triangles.difference_update(members)
        open_triangles.discard(seed)
        polygon = _around(points, np.flatnonzero(flat), normal)
        polygons.append(polygon)
        if len(polygon) > MOST_CORNERS:
            polygon = polygon[np.linspace(0, len(polygon), MOST_CORNERS, endpoint=False).astype(np.int64)]
        rows.append((normal, len(corners), len(polygon)))
        corners.extend(polygon.tolist())
    hull = np.zeros(1, HULL_ROW)
    row = hull[0]
    edges = _edges(points, polygons, [normal for normal, _, _ in rows])
    row["num_vertices"], row["num_faces"], row["num_edges"] = len(points), len(rows), len(edges)
    row["radius"] = np.linalg.norm(points, axis=1).max()
    row["center"] = points.mean(axis=0)
    row["half"] = np.abs(points - row["center"]).max(axis=0)
    return PreparedHull(hull, points, np.array(rows, HULL_FACE_ROW), np.array(corners, np.int64), edges)


def _edges(
    points: NDArray[np.float64], polygons: list[NDArray[np.int64]], normals: list[NDArray[np.float64]]
) -> NDArray[np.void]:
    """The edges of faces (counter-clockwise polygons of vertex numbers), each once, with the directions into both."""
    left_of = {
        (int(i), int(j)): face
        for face, polygon in enumerate(polygons)
        for i, j in zip(polygon, np.roll(polygon, -1), strict=True)
    }
    rows = np.zeros(len(left_of), HULL_EDGE_ROW)
    count = 0
    for (i, j), face in left_of.items():
        right = left_of.get((j, i))
        if i < j and right is not None:
            along = points[j] - points[i]
            along = along / np.linalg.norm(along)
            rows[count] = (i, j, np.cross(normals[face], along), np.cross(along, normals[right]))
            count += 1
    return rows[:count]


def _around(points: NDArray[np.float64], members: NDArray[np.int64], normal: NDArray[np.float64]) -> NDArray[np.int64]:
    """The corners of a convex face in counter-clockwise order about its normal, the one of lowest number first."""
    offsets = points[members] - points[members].mean(axis=0)
    u = offsets[np.argmax(np.linalg.norm(offsets, axis=1))]
    u = u / np.linalg.norm(u)
    v = np.cross(normal, u)
    order = members[np.argsort(np.arctan2(offsets @ v, offsets @ u), kind="stable")]
    return np.roll(order, -int(np.argmin(order)))
