"""A small planet: an icosphere with bumps, as a closed concave triangle mesh."""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray

from . import checks
from .triangle_mesh import TriangleMesh


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


def bumpy_planet(
    radius: float,
    generator: np.random.Generator,
    *,
    subdivisions: int = 4,
    amplitude: float = 0.05,
    bumps: int = 60,
    width: float = 0.25,
) -> TriangleMesh:
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
    vertices, faces = icosphere(subdivisions)
    centers = generator.normal(size=(bumps, 3))
    centers /= np.linalg.norm(centers, axis=1, keepdims=True)
    sharpness = width * (0.5 + generator.uniform(size=bumps))
    heights = generator.uniform(-1.0, 1.0, bumps)
    # 1 - cos(angle) = angle^2 / 2 near the centre of a bump.
    relief = np.exp((vertices @ centers.T - 1.0) / sharpness**2) @ heights
    largest = np.abs(relief).max(initial=0.0)
    scale = amplitude / largest if largest > 0.0 else 0.0
    return TriangleMesh(vertices * (radius * (1.0 + scale * relief))[:, None], faces)
