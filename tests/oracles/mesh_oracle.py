"""Slow, obvious twins for meshes: signed distance by all triangles and the solid angle; callers of the kernels."""

from __future__ import annotations

import numpy as np

from avalanche_gym.physics.model import CONTACT
from avalanche_gym.physics.narrow_phase.mesh_height_field import collide_mesh_height_field
from avalanche_gym.physics.narrow_phase.mesh_mesh import collide_meshes
from avalanche_gym.physics.narrow_phase.mesh_smooth_field import collide_mesh_smooth_field
from avalanche_gym.physics.narrow_phase.pair_query import SCRATCH_ROWS
from avalanche_gym.physics.narrow_phase.path import STILL
from avalanche_gym.physics.shapes.mesh_preparation import prepare_mesh
from tests.oracles.terrain_oracle import floats

IDENTITY = (np.zeros(3), np.eye(3))


def segment_points(p, a, b):
    """Closest points (n, m, 3) of segments a b (m, 3) to points p (n, 3)."""
    d = b - a
    t = np.einsum("nmk,mk->nm", p[:, None] - a, d) / np.einsum("mk,mk->m", d, d)
    return a + t.clip(0.0, 1.0)[..., None] * d


def distances(points, triangles):
    """(n,) [m] of points (n, 3) from the nearest of triangles (m, 3, 3), without sign."""
    a, b, c = (triangles[:, k] for k in range(3))
    n = np.cross(b - a, c - a)
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    best = np.full(len(points), np.inf)
    inside = np.ones((len(points), len(triangles)), bool)
    for start, end in ((a, b), (b, c), (c, a)):
        near = segment_points(points, start, end)
        best = np.minimum(best, np.linalg.norm(points[:, None] - near, axis=2).min(axis=1))
        outward = np.cross(end - start, n)
        inside &= np.einsum("nmk,mk->nm", points[:, None] - start, outward) <= 0.0
    height = np.abs(np.einsum("nmk,mk->nm", points[:, None] - a, n))
    return np.minimum(best, np.where(inside, height, np.inf).min(axis=1))


def is_inside(points, triangles):
    """(n,) whether the triangles surround a point: the solid angle (van Oosterom and Strackee 1983)."""
    r = triangles[None] - points[:, None, None]
    length = np.linalg.norm(r, axis=3)
    a, b, c = (r[:, :, k] for k in range(3))
    la, lb, lc = (length[:, :, k] for k in range(3))
    top = np.einsum("nmk,nmk->nm", a, np.cross(b, c))
    bottom = la * lb * lc
    for x, y, z in ((a, b, lc), (b, c, la), (c, a, lb)):
        bottom = bottom + np.einsum("nmk,nmk->nm", x, y) * z
    return np.arctan2(top, bottom).sum(axis=1) > np.pi


def edge_distance(first, second):
    """[m] least distance of the insides of edges (n, 2, 3) from those of (m, 2, 3) where both have it inside."""
    p, d = first[:, None, 0], (first[:, 1] - first[:, 0])[:, None]
    q, e = second[None, :, 0], (second[:, 1] - second[:, 0])[None]
    r = p - q
    dd, ee, de = (np.einsum("nmk,nmk->nm", x, y) for x, y in ((d, d), (e + 0 * d, e + 0 * d), (d + 0 * e, e + 0 * d)))
    dr, er = np.einsum("nmk,nmk->nm", d + 0 * r, r), np.einsum("nmk,nmk->nm", e + 0 * r, r)
    determinant = dd * ee - de * de
    good = determinant > 1e-12 * dd * ee
    safe = np.where(good, determinant, 1.0)
    s, t = (de * er - ee * dr) / safe, (dd * er - de * dr) / safe
    good &= (s >= 0.0) & (s <= 1.0) & (t >= 0.0) & (t <= 1.0)
    apart = np.linalg.norm(r + s[..., None] * d - t[..., None] * e, axis=2)
    return np.where(good, apart, np.inf).min()


def edges(triangles):
    """(3 m, 2, 3) all sides of triangles (m, 3, 3)."""
    return np.concatenate([triangles[:, [k, (k + 1) % 3]] for k in range(3)])


def mesh_distance(first, second):
    """[m] between two surfaces of triangles (n, 3, 3), (m, 3, 3)."""
    return min(
        distances(first.reshape(-1, 3), second).min(),
        distances(second.reshape(-1, 3), first).min(),
        edge_distance(edges(first), edges(second)),
    )


def placed(mesh, place):
    """Triangles (m, 3, 3) of a TriangleMesh at (position, rotation matrix)."""
    return (mesh.vertices @ place[1].T + place[0])[mesh.faces]


def tables(mesh):
    """Row, vertices, faces and nodes of a TriangleMesh, as the narrow phase asks for them."""
    one = prepare_mesh(mesh.vertices, mesh.faces, two_sided=mesh.two_sided)
    return one.mesh[:1], one.vertices, one.faces, one.nodes


def _place(place):
    return floats(place[0]), floats(np.asarray(place[1]).ravel())


def meshes_contacts(first, place_a, second, place_b, margin, motion=None, path=STILL, loose=None):
    """Contacts (n,) of CONTACT of two TriangleMesh, normals from the first to the second."""
    contacts, scratch = np.zeros(64, CONTACT), np.zeros((SCRATCH_ROWS, 8))
    motion = margin if motion is None else motion
    loose = motion if loose is None else loose
    count = collide_meshes(
        *_place(place_a), tables(first), *_place(place_b), tables(second), float(margin),
        (float(motion), path, float(loose)), contacts, 0, scratch,
    )  # fmt: skip
    return contacts[:count]


def field_mesh_contacts(field, mesh, place, margin, motion=None, path=STILL, loose=None):
    """Contacts (n,) of CONTACT of ``terrain_oracle.height_field(...)`` with a TriangleMesh, normals to the mesh."""
    contacts, scratch = np.zeros(64, CONTACT), np.zeros((SCRATCH_ROWS, 8))
    motion = margin if motion is None else motion
    loose = motion if loose is None else loose
    count = collide_mesh_height_field(
        *_place(IDENTITY), field[0][0], field[1], *_place(place), tables(mesh), float(margin),
        (float(motion), path, float(loose)), contacts, 0, scratch,
    )  # fmt: skip
    return contacts[:count]


def smooth_mesh_contacts(field, mesh, place, margin, motion=None, path=STILL, loose=None):
    """Contacts (n,) of CONTACT of a TriangleMesh with ``smooth_oracle.smooth_terrain(...)``, normals to the field."""
    contacts, scratch = np.zeros(64, CONTACT), np.zeros((SCRATCH_ROWS, 8))
    motion = margin if motion is None else motion
    loose = motion if loose is None else loose
    count = collide_mesh_smooth_field(
        *_place(place), tables(mesh), *_place(IDENTITY), field[0][0], field[1], float(margin),
        (float(motion), path, float(loose)), contacts, 0, scratch,
    )  # fmt: skip
    return contacts[:count]
