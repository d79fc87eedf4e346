"""Slow, obvious twins of the narrow phase: signed distances by brute force.

The signed distance of two convex polytopes is that of the origin from their Minkowski difference {b - a}: outside, the
smallest distance to one of its triangles; inside, minus the distance to the nearest facet plane (Cameron & Culley
1986).
"""

from __future__ import annotations

import itertools
from typing import NamedTuple

import numpy as np
from scipy.spatial import ConvexHull

from avalanche_gym.physics.model import (
    BOX,
    CAPSULE,
    CONTACT,
    CYLINDER,
    HULL,
    PLANE,
    SPHERE,
)
from avalanche_gym.physics.narrow_phase.box import box_box
from avalanche_gym.physics.narrow_phase.capsule import capsule_capsule
from avalanche_gym.physics.narrow_phase.capsule_box import capsule_box
from avalanche_gym.physics.narrow_phase.cylinder import cylinder_plane, sphere_cylinder
from avalanche_gym.physics.narrow_phase.hull import collide_convex
from avalanche_gym.physics.narrow_phase.hull_plane import hull_plane
from avalanche_gym.physics.narrow_phase.pair_query import SCRATCH_ROWS
from avalanche_gym.physics.narrow_phase.plane import box_plane, capsule_plane, sphere_plane
from avalanche_gym.physics.narrow_phase.sphere import sphere_box, sphere_capsule, sphere_sphere
from avalanche_gym.physics.shape_rows import HULL_FACE_ROW, HULL_ROW
from avalanche_gym.physics.shapes.hull_preparation import PreparedHull, prepare_hull

# Corners of the prism that stands for a cylinder: it lies within 0.9 % of the radius inside.
RIM_POINTS = 24


def place(position, rotation, points):
    """Points (n, 3) of a body frame in the world; ``rotation`` as nine floats."""
    return np.asarray(points, float) @ np.reshape(rotation, (3, 3)).T + np.asarray(position, float)


def box_vertices(position, rotation, half):
    """The eight corners (8, 3)."""
    return place(position, rotation, np.array(list(itertools.product((-1.0, 1.0), repeat=3))) * half)


def segment_ends(position, rotation, half_length):
    """The two ends (2, 3) of a segment along body z."""
    return place(position, rotation, [[0.0, 0.0, -half_length], [0.0, 0.0, half_length]])


def _distance_to_triangle(triangle):
    """Distance of the origin from one triangle (3, 3): the nearest of its interior, edges and corners."""
    a, b, c = triangle
    normal = np.cross(b - a, c - a)
    best = np.inf
    squared = normal @ normal
    if squared > 0.0:
        foot = normal * (a @ normal) / squared
        inside = all(normal @ np.cross(q - p, foot - p) >= 0.0 for p, q in ((a, b), (b, c), (c, a)))
        if inside:
            best = abs(a @ normal) / np.sqrt(squared)
    for p, q in ((a, b), (b, c), (c, a)):
        edge = q - p
        length = edge @ edge
        t = np.clip(-(p @ edge) / length, 0.0, 1.0) if length > 0.0 else 0.0
        best = min(best, np.linalg.norm(p + t * edge))
    return best


def polytope_distance(vertices_a, vertices_b):
    """Signed distance [m] of the convex hulls of two sets of points; their difference must have a volume."""
    difference = (vertices_b[None, :, :] - vertices_a[:, None, :]).reshape(-1, 3)
    hull = ConvexHull(difference)
    offset = hull.equations[:, 3].max()
    if offset <= 0.0:
        return offset
    return min(_distance_to_triangle(difference[simplex]) for simplex in hull.simplices)


def segment_distance(ends_a, ends_b):
    """Distance [m] of two segments (2, 3): the best of all ways to hold either parameter at an end or free."""
    u, v = ends_a[1] - ends_a[0], ends_b[1] - ends_b[0]
    r = ends_b[0] - ends_a[0]
    best = np.inf
    for s_fixed, t_fixed in itertools.product((None, 0.0, 1.0), repeat=2):
        columns = [axis for axis, fixed in ((u, s_fixed), (-v, t_fixed)) if fixed is None]
        target = r - (s_fixed or 0.0) * u + (t_fixed or 0.0) * v
        free = list(np.linalg.lstsq(np.array(columns).T, target, rcond=None)[0]) if columns else []
        s = free.pop(0) if s_fixed is None else s_fixed
        t = free.pop(0) if t_fixed is None else t_fixed
        if 0.0 <= s <= 1.0 and 0.0 <= t <= 1.0:
            best = min(best, np.linalg.norm(r + t * v - s * u))
    return best


def point_box_distance(point, position, rotation, half):
    """Signed distance [m] of a point from a box."""
    local = np.reshape(rotation, (3, 3)).T @ (np.asarray(point) - position)
    beyond = np.abs(local) - half
    return np.linalg.norm(np.maximum(beyond, 0.0)) + min(beyond.max(), 0.0)


class Placed(NamedTuple):
    """A shape in the world, as the pair functions take it."""

    shape: int
    size: tuple
    position: np.ndarray = np.zeros(3)
    rotation: np.ndarray = np.eye(3)
    hull: PreparedHull | None = None

    def moved(self, offset):
        return self._replace(position=self.position + offset)

    @property
    def extent(self):
        """Scale of its round-off [m]."""
        return float(self.hull.hull["radius"][0] if self.hull else np.sum(self.size))

    def core(self):
        """Vertices (n, 3) of the polytope and the radius around it [m]; a cylinder as an inscribed prism."""
        if self.shape == BOX:
            return box_vertices(self.position, self.rotation, self.size), 0.0
        if self.shape == HULL:
            return place(self.position, self.rotation, self.hull.points), 0.0
        if self.shape == CYLINDER:
            angles = 2 * np.pi * np.arange(RIM_POINTS) / RIM_POINTS
            rim = [
                (self.size[0] * np.cos(angle), self.size[0] * np.sin(angle), end)
                for angle in angles
                for end in (-self.size[1], self.size[1])
            ]
            return place(self.position, self.rotation, rim), 0.0
        half_length = self.size[1] if self.shape == CAPSULE else 0.0
        return segment_ends(self.position, self.rotation, half_length), self.size[0]


def signed_distance(a, b):
    """Signed distance [m] of two placed shapes, cylinders as prisms; of two crossing axes, minus the radii."""
    core_a, radius_a = a.core()
    core_b, radius_b = b.core()
    if max(len(core_a), len(core_b)) > 2:
        return polytope_distance(core_a, core_b) - radius_a - radius_b
    return segment_distance(core_a, core_b) - radius_a - radius_b


def support(placed, direction):
    """The point furthest in a unit direction, of the true shape."""
    if placed.shape == CYLINDER:
        local = placed.rotation.T @ direction
        across = np.hypot(local[0], local[1])
        radial = local[:2] * (placed.size[0] / across if across > 0.0 else 0.0)
        return placed.position + placed.rotation @ [*radial, np.copysign(placed.size[1], local[2])]
    core, radius = placed.core()
    return core[np.argmax(core @ direction)] + radius * np.asarray(direction)


def separation(a, b, normal):
    """Gap [m] between two shapes along a unit normal from a to b: never more than their distance."""
    return normal @ (support(b, -normal) - support(a, normal))


def beyond_surface(placed, point):
    """How far [m] a point lies outside of a shape, at least; negative inside."""
    local = placed.rotation.T @ (point - placed.position)
    if placed.shape == CYLINDER:
        return max(np.hypot(local[0], local[1]) - placed.size[0], abs(local[2]) - placed.size[1])
    if placed.shape == HULL:
        rows = placed.hull.faces
        on_faces = placed.hull.points[placed.hull.corners[rows["first_corner"]]]
        return ((local - on_faces) * rows["normal"]).sum(axis=1).max()
    if placed.shape == BOX:
        return (np.abs(local) - placed.size).max()
    core, radius = placed.core()
    return segment_distance(core, np.array([point, point])) - radius


def hull_of(points):
    """A prepared hull of (n, 3) points."""
    points = np.asarray(points, float)
    hull = ConvexHull(points)
    renumbered = np.full(len(points), -1)
    renumbered[hull.vertices] = np.arange(len(hull.vertices))
    corners, triangles = points[hull.vertices], renumbered[hull.simplices]
    a, b, c = (corners[triangles[:, k]] for k in range(3))
    inward = (np.cross(b - a, c - a) * hull.equations[:, :3]).sum(axis=1) < 0.0
    triangles[inward] = triangles[inward][:, ::-1]
    return prepare_hull(corners, triangles)


def _hull_tables(a, b):
    """Tables of the hulls of a pair, one after the other, and the row of the second."""
    hulls = [placed.hull for placed in (a, b) if placed.hull]
    rows = np.zeros(max(len(hulls), 1), HULL_ROW)
    points, faces, corners = [np.zeros((0, 3))], [np.zeros(0, HULL_FACE_ROW)], [np.zeros(0, np.int64)]
    for index, hull in enumerate(hulls):
        rows[index] = hull.hull[0]
        rows[index]["first_vertex"] = sum(map(len, points))
        rows[index]["first_face"] = sum(map(len, faces))
        moved = hull.faces.copy()
        moved["first_corner"] += sum(map(len, corners))
        points.append(hull.points)
        faces.append(moved)
        corners.append(hull.corners)
    row_b = 1 if a.hull and b.hull else 0
    return (rows, np.concatenate(points), np.concatenate(faces), np.concatenate(corners)), row_b


PAIRS = {
    (SPHERE, SPHERE): sphere_sphere,
    (SPHERE, CAPSULE): sphere_capsule,
    (SPHERE, BOX): sphere_box,
    (SPHERE, CYLINDER): sphere_cylinder,
    (SPHERE, PLANE): sphere_plane,
    (CYLINDER, PLANE): cylinder_plane,
    (CAPSULE, CAPSULE): capsule_capsule,
    (CAPSULE, BOX): capsule_box,
    (CAPSULE, PLANE): capsule_plane,
    (BOX, BOX): box_box,
    (BOX, PLANE): box_plane,
}
NEED_SCRATCH = {(BOX, BOX)}


def collide(a, b, margin):
    """The contacts (n,) of CONTACT that the kernels find between two placed shapes."""
    contacts = np.zeros(16, CONTACT)
    arguments = []
    for placed in (a, b):
        for values in (placed.position, np.ravel(placed.rotation), (*placed.size, 0.0, 0.0)[:3]):
            arguments.append(tuple(float(value) for value in values))
    pair = (a.shape, b.shape)
    scratch = np.full((SCRATCH_ROWS, 8), np.nan)
    tables, row_b = _hull_tables(a, b)
    if pair == (HULL, PLANE):
        position, rotation, _ = arguments[:3]
        count = hull_plane(
            position, rotation, tables[0][0], tables[1], *arguments[3:5], float(margin), contacts, 0, scratch
        )
    elif pair in PAIRS:
        count = PAIRS[pair](*arguments, float(margin), contacts, 0, *((scratch,) if pair in NEED_SCRATCH else ()))
    else:
        count = collide_convex(
            a.shape, *arguments[:3], 0, b.shape, *arguments[3:], row_b, *tables, float(margin), contacts, 0, scratch
        )
    return contacts[:count]
