"""The surface of the planet under a point: which facet of the bumpy icosphere a direction meets.

A subdivided icosphere is a tree: each facet of a level covers four of the next (shapes/planet.py), and moving vertices
along their radii keeps every facet in the cone of its directions. So the facet is found by descent: the nearest of the
20 faces of the icosahedron, then at each level three signs tell which of the four children holds the direction.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...physics.jit import kernel
from ...physics.maths import vec3
from ...physics.shapes import TriangleMesh
from ...physics.shapes.icosphere import icosphere_levels


class Ground:
    """Tables of a planet for ``facet_below``.

    Args:
        planet: made by bumpy_planet with this number of subdivisions.
        subdivisions: of the icosphere.

    Attributes:
        directions: (n, 3) unit vectors to the vertices.
        faces: (20 + 80 + ..., 3) of all levels, the coarsest first.
        centers: (20, 3) unit vectors to the middle of the coarsest faces.
        planes: (m, 4) of the finest facets: outward unit normal, and distance from the centre of the planet [m].
    """

    def __init__(self, planet: TriangleMesh, subdivisions: int) -> None:
        self.directions, levels = icosphere_levels(subdivisions)
        self.faces: NDArray[np.int64] = np.concatenate(levels)
        centers = self.directions[levels[0]].sum(axis=1)
        self.centers = centers / np.linalg.norm(centers, axis=1, keepdims=True)
        vertices: NDArray[np.float64] = np.asarray(planet.vertices)
        a, b, c = (vertices[levels[-1][:, corner]] for corner in range(3))
        normals = np.cross(b - a, c - a)
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        self.planes = np.column_stack([normals, np.einsum("ij,ij->i", normals, a)])


@kernel
def facet_below(point, directions, faces, centers, planes):
    """Index of the finest facet that the ray from the centre of the planet through a point meets."""
    face = 0
    best = -2.0
    for index in range(20):
        cosine = vec3.dot(vec3.load(centers[index]), point)
        if index == 0 or cosine > best:
            best = cosine
            face = index
    first = 0
    count = 20
    while count < planes.shape[0]:
        first += count
        # The middle child lies between the midpoints ab, bc, ca of the parent's edges; beyond its side from ab to bc
        # lies the child at corner b, and so on round.
        middle = faces[first + 3 * count + face]
        ab = vec3.load(directions[middle[0]])
        bc = vec3.load(directions[middle[1]])
        ca = vec3.load(directions[middle[2]])
        if vec3.dot(vec3.cross(ab, bc), point) < 0.0:
            face += count
        elif vec3.dot(vec3.cross(bc, ca), point) < 0.0:
            face += 2 * count
        elif vec3.dot(vec3.cross(ca, ab), point) >= 0.0:
            face += 3 * count
        count *= 4
    return face


@kernel
def altitude_of(point, plane):
    """[m] of a point above its facet, along the vertical through the centre of the planet."""
    normal = vec3.load(plane)
    radius = vec3.norm(point)
    return radius - plane[3] * radius / vec3.dot(normal, point)


@kernel
def clearance_of(point, plane):
    """[m] of a point above the plane of its facet, along the normal of the facet."""
    return vec3.dot(vec3.load(plane), point) - plane[3]
