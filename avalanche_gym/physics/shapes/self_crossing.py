"""Whether a mesh crosses itself: pairs of its faces of which an edge of the one pierces the other.

Pairs come from the tree of the faces (static_tree.py) against itself, level by level, as arrays. Faces that share a
vertex touch there and are left out, and so are faces that only lie on each other.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .static_tree import build_static_tree

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

# Share of an edge or face by which a crossing must be inside: what touches up to round-off does not cross.
INSIDE = 1e-9


def crossing_faces(points: Floats, triangles: Ints) -> Ints:
    """(k, 2) numbers of faces that cross each other.

    Args:
        points: (n, 3) [m], equal places merged.
        triangles: (m, 3) indices.
    """
    corners = points[triangles]
    first, second = _near_pairs(corners.min(axis=1), corners.max(axis=1))
    shared = (triangles[first][:, :, None] == triangles[second][:, None, :]).any(axis=(1, 2))
    first, second = first[~shared], second[~shared]
    crosses = np.zeros(len(first), bool)
    for one, other in ((first, second), (second, first)):
        for k in range(3):
            crosses |= _pierces(corners[one, k], corners[one, (k + 1) % 3], corners[other])
    return np.stack([first[crosses], second[crosses]], axis=1)


def _near_pairs(lower: Floats, upper: Floats) -> tuple[Ints, Ints]:
    """Pairs of different faces whose boxes meet."""
    nodes, order = build_static_tree(lower, upper)
    low, high = nodes["lower"].astype(float), nodes["upper"].astype(float)
    a = b = np.zeros(1, np.int64)
    while nodes["count"][a[0]] == 0:
        left_a, left_b = a + 1, b + 1
        right_a, right_b = nodes["skip"][left_a].astype(np.int64), nodes["skip"][left_b].astype(np.int64)
        apart = a != b
        a, b = (
            np.concatenate([left_a, left_a, right_a, right_a[apart]]),
            np.concatenate([left_b, right_b, right_b, left_b[apart]]),
        )
        meets = (low[a] <= high[b]).all(axis=1) & (low[b] <= high[a]).all(axis=1)
        a, b = a[meets], b[meets]
    most = int(nodes["count"].max())
    i, j = (grid.ravel() for grid in np.meshgrid(np.arange(most), np.arange(most)))
    real = (i < nodes["count"][a][:, None]) & (j < nodes["count"][b][:, None])
    first = order[np.where(real, nodes["first"][a][:, None] + i, 0)[real]]
    second = order[np.where(real, nodes["first"][b][:, None] + j, 0)[real]]
    first, second = np.minimum(first, second), np.maximum(first, second)
    meets = (first < second) & (lower[first] <= upper[second]).all(axis=1) & (lower[second] <= upper[first]).all(axis=1)
    pairs = np.unique(first[meets] * len(lower) + second[meets])
    return pairs // len(lower), pairs % len(lower)


def _pierces(start: Floats, end: Floats, triangle: Floats) -> NDArray[np.bool_]:
    """(k,) whether each segment pierces its triangle (k, 3, 3): Moeller and Trumbore 1997, section 2."""
    a = triangle[:, 0]
    u, v = triangle[:, 1] - a, triangle[:, 2] - a
    d = end - start
    p = np.cross(d, v)
    determinant = np.einsum("ij,ij->i", u, p)
    across = np.linalg.norm(d, axis=1) * np.linalg.norm(np.cross(u, v), axis=1)
    steep = np.abs(determinant) > INSIDE * across
    scale = 1.0 / np.where(steep, determinant, 1.0)
    r = start - a
    s = scale * np.einsum("ij,ij->i", r, p)
    q = np.cross(r, u)
    t = scale * np.einsum("ij,ij->i", d, q)
    w = scale * np.einsum("ij,ij->i", v, q)
    inside = (s > INSIDE) & (t > INSIDE) & (s + t < 1.0 - INSIDE) & (w > INSIDE) & (w < 1.0 - INSIDE)
    result: NDArray[np.bool_] = steep & inside
    return result
