"""Spheres of triangles: the icosahedron, subdivided."""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray

# 1.3 million triangles.
MOST_SUBDIVISIONS = 8


def icosphere_levels(subdivisions: int) -> tuple[NDArray[np.float64], list[NDArray[np.int64]]]:
    """Unit sphere of triangles, with all coarser spheres it was made from.

    The icosahedron's edges are halved again and again and the new vertices put on the sphere.

    Returns:
        vertices (n, 3), and the faces (20 * 4^k, 3) of level k = 0 ... subdivisions, counter-clockwise from outside.
        Face f of a level with n faces becomes faces f, n + f and 2n + f at its corners 0, 1 and 2, and 3n + f in its
        middle, of the next.
    """
    g = 0.5 * (1.0 + np.sqrt(5.0))
    # The twelve corners (0, +-1, +-g) and their cyclic permutations.
    corners = np.array([(0.0, a, b * g) for a in (-1.0, 1.0) for b in (-1.0, 1.0)])
    vertices = np.concatenate([np.roll(corners, shift, axis=1) for shift in range(3)])
    # Faces join three corners whose mutual distance is the edge length, 2.
    near = np.abs(np.linalg.norm(vertices[:, None] - vertices[None], axis=2) - 2.0) < 1e-9
    triples = itertools.combinations(range(12), 3)
    faces = np.array([(i, j, k) for i, j, k in triples if near[i, j] and near[j, k] and near[k, i]])
    a, b, c = (vertices[faces[:, corner]] for corner in range(3))
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), a) < 0.0
    faces[inward] = faces[inward][:, ::-1]
    vertices /= np.linalg.norm(vertices, axis=1, keepdims=True)
    levels = [faces]
    for _ in range(subdivisions):
        edges = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
        unique, index = np.unique(edges, axis=0, return_inverse=True)
        middle = len(vertices) + index.reshape(-1, 3)  # of the edges (0, 1), (1, 2), (2, 0) of each face
        new = vertices[unique].sum(axis=1)
        vertices = np.concatenate([vertices, new / np.linalg.norm(new, axis=1, keepdims=True)])
        a, b, c = faces.T
        ab, bc, ca = middle.T
        triangles = [(a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca)]
        faces = np.concatenate([np.stack(triangle, axis=1) for triangle in triangles])
        levels.append(faces)
    return vertices, [level.astype(np.int64) for level in levels]


def icosphere(subdivisions: int) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Unit sphere of 20 x 4^subdivisions triangles: vertices (n, 3), faces (m, 3) counter-clockwise from outside."""
    vertices, levels = icosphere_levels(subdivisions)
    return vertices, levels[-1]
