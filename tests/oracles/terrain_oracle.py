"""Slow, obvious twins of the terrain contacts: each triangle against each feature of the shape; callers of kernels."""

from __future__ import annotations

import itertools

import numpy as np
from scipy.spatial import Delaunay
from scipy.spatial.transform import Rotation

from avalanche_gym.physics.model import (
    BOX,
    CAPSULE,
    CONTACT,
    PLACE_BITS,
    SLIDING,
    SPHERE,
)
from avalanche_gym.physics.narrow_phase.height_field import collide_height_field
from avalanche_gym.physics.narrow_phase.height_field_solids import (
    collide_cylinder_height_field,
    collide_hull_height_field,
)
from avalanche_gym.physics.narrow_phase.mesh import collide_mesh
from avalanche_gym.physics.narrow_phase.mesh_solids import collide_cylinder_mesh, collide_hull_mesh
from avalanche_gym.physics.narrow_phase.pair_query import SCRATCH_ROWS
from avalanche_gym.physics.shape_rows import HEIGHT_FIELD_ROW
from avalanche_gym.physics.shapes import ConvexHull
from avalanche_gym.physics.shapes.hull_preparation import prepare_hull

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


def _kernel_contacts(kernel, shape, position, rotation, size, terrain, margin, place, moves):
    contacts, scratch = np.zeros(64, CONTACT), np.zeros((SCRATCH_ROWS, 8))
    count = kernel(
        shape,
        floats(position),
        rotation,
        floats(size),
        *place,
        *terrain,
        float(margin),
        *moves,
        contacts,
        0,
        scratch,
    )
    return contacts[:count]


def field_contacts(shape, position, rotation, size, terrain, margin, place=(ORIGIN, IDENTITY), motion=0.0):
    """Contacts (n,) of CONTACT with ``height_field(...)``."""
    field, heights = terrain
    tables = (field[0], heights)
    return _kernel_contacts(
        collide_height_field, shape, position, rotation, size, tables, margin, place, (float(motion),)
    )


def mesh_contacts(shape, position, rotation, size, prepared, margin, place=(ORIGIN, IDENTITY), turned=0.0):
    """Contacts (n,) of CONTACT with ``prepare_mesh(...)``, which turns by ``turned`` [rad] within the step."""
    terrain = _tables(prepared)
    return _kernel_contacts(collide_mesh, shape, position, rotation, size, terrain, margin, place, (0.0, turned))


def point_of(contact):
    """Number of the point of the moving shape that a contact belongs to; None for crossings and terrain vertices."""
    feature = int(contact["feature"])
    return (feature ^ SLIDING) >> PLACE_BITS if feature & SLIDING else None


def core(shape, size):
    """Half extents of the core box of a shape, and radius."""
    if shape == SPHERE:
        return np.zeros(3), size[0]
    if shape == CAPSULE:
        return np.array([0.0, 0.0, size[1]]), size[0]
    assert shape == BOX
    return np.array(size, float), 0.0


def _dot(a, b):
    return (a * b).sum(axis=-1)


def _point_segment(p, a, b):
    """Distances of points from segments; the leading dimensions are broadcast."""
    edge = b - a
    length = _dot(edge, edge)
    t = np.clip(_dot(p - a, edge) / np.where(length > 0.0, length, 1.0), 0.0, 1.0)
    return np.linalg.norm(p - a - t[..., None] * edge, axis=-1)


def _point_triangle(p, triangles):
    """Distances of points (n, 1, 3) from triangles (m, 3, 3): over the inside its plane, else the nearest edge."""
    a, b, c = (triangles[:, k] for k in range(3))
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=-1)[:, None]
    height = _dot(p - a, normal)
    foot = p - height[..., None] * normal
    inside = np.ones(height.shape, bool)
    best = np.full(height.shape, np.inf)
    for start, end in ((a, b), (b, c), (c, a)):
        inside &= _dot(np.cross(end - start, foot - start), normal) >= 0.0
        best = np.minimum(best, _point_segment(p, start, end))
    return np.where(inside, np.abs(height), best)


def _segment_segment(p, q, a, b):
    """Distances of segments: the nearest of the four ends, and of the inner points if they face each other."""
    u, v = q - p, b - a
    best = np.minimum(
        np.minimum(_point_segment(p, a, b), _point_segment(q, a, b)),
        np.minimum(_point_segment(a, p, q), _point_segment(b, p, q)),
    )
    normal = np.cross(u, v)
    squared = _dot(normal, normal)
    crossing = squared > 1e-24
    squared = np.where(crossing, squared, 1.0)
    s = _dot(np.cross(a - p, v), normal) / squared
    t = _dot(np.cross(a - p, u), normal) / squared
    crossing &= (s >= 0.0) & (s <= 1.0) & (t >= 0.0) & (t <= 1.0)
    return np.where(crossing, np.minimum(best, np.abs(_dot(a - p, normal)) / np.sqrt(squared)), best)


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
    start, end = (np.array([edge[k] for edge in edges])[:, None] for k in range(2))
    local = (triangles.reshape(-1, 3) - position) @ frame
    sides = np.roll(triangles, -1, axis=1)
    return -radius + min(
        _point_triangle(points[:, None], triangles).min(),
        np.linalg.norm(local - np.clip(local, -half, half), axis=1).min(),
        _segment_segment(start, end, triangles.reshape(-1, 3), sides.reshape(-1, 3)).min(),
    )


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


def _solid_contacts(kernel, position, rotation, solid, terrain, margin, place):
    """``solid``: (radius, half length, 0) of a cylinder, or ``hull(...)``."""
    contacts, scratch = np.zeros(64, CONTACT), np.zeros((SCRATCH_ROWS, 8))
    moves = (0.0, 0.0) if kernel in (collide_cylinder_mesh, collide_hull_mesh) else (0.0,)
    count = kernel(floats(position), rotation, solid, *place, *terrain, float(margin), *moves, contacts, 0, scratch)
    return contacts[:count]


def hull(vertices):
    """``hull`` of narrow_phase/terrain_hull.py for the hull of some points."""
    shape = ConvexHull(vertices)
    prepared = prepare_hull(shape.vertices, shape.faces)
    return (prepared.hull, prepared.points, prepared.faces, prepared.corners, prepared.edges)


def cylinder_contacts(position, rotation, size, terrain, margin, place=(ORIGIN, IDENTITY)):
    """Contacts of a cylinder with ``height_field(...)`` or ``prepare_mesh(...)``."""
    kernel = collide_cylinder_height_field if isinstance(terrain, tuple) else collide_cylinder_mesh
    return _solid_contacts(kernel, position, rotation, floats(size), _tables(terrain), margin, place)


def hull_contacts(position, rotation, solid, terrain, margin, place=(ORIGIN, IDENTITY)):
    """Contacts of ``hull(...)`` with ``height_field(...)`` or ``prepare_mesh(...)``."""
    kernel = collide_hull_height_field if isinstance(terrain, tuple) else collide_hull_mesh
    return _solid_contacts(kernel, position, rotation, solid, _tables(terrain), margin, place)


def _tables(terrain):
    if isinstance(terrain, tuple):
        return (terrain[0][0], terrain[1])
    return ((terrain.mesh[:1], terrain.vertices, terrain.faces, terrain.nodes),)


def _cylinder_gap(p, radius, half_length):
    """Signed distances of points in the frame of a cylinder."""
    side = np.hypot(p[..., 0], p[..., 1]) - radius
    cap = np.abs(p[..., 2]) - half_length
    return np.hypot(np.maximum(side, 0.0), np.maximum(cap, 0.0)) + np.minimum(np.maximum(side, cap), 0.0)


def cylinder_distance(position, rotation, radius, half_length, triangles):
    """Distance [m] of a cylinder from triangles (m, 3, 3), to 1e-8: convex on each, so a shrinking star finds it."""
    local = (triangles - position) @ np.reshape(rotation, (3, 3))
    reach = _cylinder_gap(local, radius, half_length).min(axis=1)
    longest = np.linalg.norm(local - np.roll(local, 1, axis=1), axis=2).max()
    local = local[reach <= reach.min() + longest]
    weights = np.full((len(local), 3), 1.0 / 3.0)
    # Towards and away from each corner, and along each side.
    star = np.array([(1, 0, -1), (-1, 0, 1), (0, 1, -1), (0, -1, 1), (1, -1, 0), (-1, 1, 0), (2, -1, -1), (-1, 2, -1)])
    star = np.concatenate([star, [(-1, -1, 2), (0, 0, 0)]])
    best = np.full(len(local), np.inf)
    step = 0.3
    while step > 1e-9:
        tried = np.maximum(weights[:, None] + step * star, 0.0)
        tried /= tried.sum(axis=2, keepdims=True)
        gaps = _cylinder_gap(tried @ local, radius, half_length)
        chosen = gaps.argmin(axis=1)
        rows = np.arange(len(local))
        better = gaps[rows, chosen] < best - 1e-12
        weights = np.where(better[:, None], tried[rows, chosen], weights)
        best = np.minimum(best, gaps[rows, chosen])
        if not better.any():
            step *= 0.6
    return best.min()
