"""Slow, obvious twins of the terrain contacts: every triangle against every feature of the shape. Callers of kernels."""

from __future__ import annotations

import itertools

import numpy as np
from scipy.spatial import Delaunay
from scipy.spatial.transform import Rotation

from avalanche_gym.physics.model import BOX, CAPSULE, CONTACT, HEIGHT_FIELD_ROW, SPHERE
from avalanche_gym.physics.narrow_phase.height_field import collide_height_field
from avalanche_gym.physics.narrow_phase.mesh import collide_mesh

IDENTITY = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
ORIGIN = (0.0, 0.0, 0.0)


def rotation_matrix(vector):
    """Nine floats, row by row, of the rotation with this rotation vector [rad]."""
    return tuple(float(x) for x in Rotation.from_rotvec(vector).as_matrix().ravel())


def floats(values):
    return tuple(float(x) for x in values)


def height_field(heights, size):
    """A table of one HEIGHT_FIELD_ROW, and the pool of its samples."""
    heights = np.asarray(heights, float)
    field = np.zeros(1, HEIGHT_FIELD_ROW)
    field["rows"], field["columns"] = heights.shape
    field["extent"] = size
    field["lowest"], field["highest"] = heights.min(), heights.max()
    return field, heights.ravel().copy()


def grid_mesh(heights, size):
    """Vertices (n, 3) and faces (m, 3) of the facets of a height field."""
    rows, columns = heights.shape
    y, x = np.meshgrid(
        np.linspace(-0.5 * size[1], 0.5 * size[1], rows),
        np.linspace(-0.5 * size[0], 0.5 * size[0], columns),
        indexing="ij",
    )
    i, j = (index.ravel() for index in np.mgrid[: rows - 1, : columns - 1])
    a = i * columns + j
    b, c, d = a + 1, a + columns + 1, a + columns
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return np.stack([x, y, heights], axis=2).reshape(-1, 3), faces


def random_floor(rng, size=4.0, points=60):
    """A flat floor z = 0 over [-size/2, size/2]^2 cut at random, without shared vertices: a soup with needles."""
    corners = np.array(list(itertools.product((-0.5, 0.5), repeat=2))) * size
    inner = rng.uniform(-0.5 * size, 0.5 * size, (points, 2))
    plane = np.concatenate([corners, inner])
    triangles = Delaunay(plane).simplices
    u, v = (plane[triangles[:, k]] - plane[triangles[:, 0]] for k in (1, 2))
    turned = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    triangles[turned < 0.0] = triangles[turned < 0.0][:, ::-1]
    vertices = np.zeros((triangles.size, 3))
    vertices[:, :2] = plane[triangles.ravel()]
    return vertices, np.arange(triangles.size).reshape(-1, 3)


def _kernel_contacts(kernel, shape, position, rotation, size, terrain, margin, place):
    contacts, scratch = np.zeros(64, CONTACT), np.zeros((256, 8))
    count = kernel(
        shape, floats(position), rotation, floats(size), *place, *terrain, float(margin), contacts, 0, scratch
    )
    return contacts[:count]


def field_contacts(shape, position, rotation, size, terrain, margin, place=(ORIGIN, IDENTITY)):
    """Contacts (n,) of CONTACT with ``height_field(...)``."""
    field, heights = terrain
    return _kernel_contacts(collide_height_field, shape, position, rotation, size, (field[0], heights), margin, place)


def mesh_contacts(shape, position, rotation, size, prepared, margin, place=(ORIGIN, IDENTITY)):
    """Contacts (n,) of CONTACT with ``prepare_mesh(...)``."""
    terrain = (prepared.mesh[0], prepared.vertices, prepared.faces, prepared.nodes)
    return _kernel_contacts(collide_mesh, shape, position, rotation, size, terrain, margin, place)


def core(shape, size):
    """Half extents of the core box of a shape, and radius."""
    if shape == SPHERE:
        return np.zeros(3), size[0]
    if shape == CAPSULE:
        return np.array([0.0, 0.0, size[1]]), size[0]
    assert shape == BOX
    return np.array(size, float), 0.0


def _point_triangle(p, triangle):
    """Distance of points (n, 3) from a triangle (3, 3)."""
    a, b, c = triangle
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal)
    height = (p - a) @ normal
    foot = p - height[:, None] * normal
    inside = np.ones(len(p), bool)
    best = np.full(len(p), np.inf)
    for start, end in ((a, b), (b, c), (c, a)):
        edge = end - start
        inside &= np.cross(edge, foot - start) @ normal >= 0.0
        t = np.clip((p - start) @ edge / (edge @ edge), 0.0, 1.0)
        best = np.minimum(best, np.linalg.norm(p - start - t[:, None] * edge, axis=1))
    return np.where(inside, np.abs(height), best)


def _segment_segment(p, q, a, b):
    """Distance of two segments: the nearest of the four ends, and of the inner points if they face each other."""
    u, v = q - p, b - a
    best = np.inf
    for point, start, direction in ((p, a, v), (q, a, v), (a, p, u), (b, p, u)):
        length = direction @ direction
        t = np.clip((point - start) @ direction / length, 0.0, 1.0) if length > 0.0 else 0.0
        best = min(best, np.linalg.norm(point - start - t * direction))
    normal = np.cross(u, v)
    squared = normal @ normal
    if squared > 1e-24:
        s = np.cross(a - p, v) @ normal / squared
        t = np.cross(a - p, u) @ normal / squared
        if 0.0 <= s <= 1.0 and 0.0 <= t <= 1.0:
            best = min(best, abs((a - p) @ normal) / np.sqrt(squared))
    return best


def distance(shape, position, rotation, size, triangles):
    """Distance [m] of a shape from triangles (m, 3, 3) that it does not cut."""
    half, radius = core(shape, size)
    frame = np.reshape(rotation, (3, 3))
    corners = {signs: position + frame @ (half * signs) for signs in itertools.product((-1.0, 1.0), repeat=3)}
    points = np.array(list(corners.values()))
    edges = [
        (corners[s], corners[t])
        for s, t in itertools.combinations(corners, 2)
        if sum(x != y for x, y in zip(s, t, strict=True)) == 1
    ]
    best = np.inf
    for triangle in triangles:
        best = min(best, _point_triangle(points, triangle).min())
        local = (triangle - position) @ frame
        best = min(best, np.linalg.norm(local - np.clip(local, -half, half), axis=1).min())
        for (p, q), k in itertools.product(edges, range(3)):
            best = min(best, _segment_segment(p, q, triangle[k], triangle[(k + 1) % 3]))
    return best - radius


def plane_contacts(shape, position, rotation, size, margin):
    """Gap and position of the contacts with the plane z = 0: every corner of the core that is near."""
    half, radius = core(shape, size)
    frame = np.reshape(rotation, (3, 3))
    found = {}
    for corner, signs in enumerate(itertools.product((-1.0, 1.0), repeat=3)):
        p = np.asarray(position) + frame @ (half * signs[::-1])
        gap = p[2] - radius
        if gap <= margin and not any(b and half[k] == 0.0 for k, b in enumerate((corner & 1, corner & 2, corner & 4))):
            found[corner] = (gap, (p[0], p[1], 0.5 * gap))
    return found
