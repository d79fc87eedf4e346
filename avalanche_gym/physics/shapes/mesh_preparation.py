"""A triangle mesh made ready for contact, once: repaired (mesh_repair.py), with its neighbours and what sticks out.

* *Adjacency*: across an edge of two faces the other one; where more faces meet, the one across the free space between
  them.
* *What sticks out*: edges that are neither flat nor concave, vertices with three or more of them; each is owned by one
  face.

Faces that lie in one plane across flat edges share one normal, so a needle among them is no bump.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..shape_rows import FACE_ROW, MESH_ROW, VERTEX_ROW
from .flatness import FLAT_HEIGHT
from .mesh_repair import (
    Floats,
    Ints,
    altitudes,
    compact,
    components,
    half_edges,
    repair,
    scaled_normals,
    two_face_edges,
)
from .static_tree import build_static_tree

# [rad] An edge is flat below this angle. What is lost is a bend that lets a body sink by this much of a face.
FLAT_ANGLE = 1e-9
# ... plus what this many units of round-off of the coordinates can tilt a face,
FLAT_ROUND_OFF = 8.0 * float(np.finfo(np.float64).eps)
# ... and vertices that are off its plane by FLAT_HEIGHT of the size of the mesh.


@dataclass
class PreparedMesh:
    """Tables of one mesh, with indices that count from its own first rows."""

    mesh: NDArray[np.void]  # one MESH_ROW, its firsts zero
    vertices: NDArray[np.void]  # VERTEX_ROW
    faces: NDArray[np.void]  # FACE_ROW, in the order of the tree
    nodes: NDArray[np.void]  # NODE_ROW
    repairs: dict[str, int] = field(default_factory=dict)  # what was done, by name


def prepare_mesh(vertices: ArrayLike, faces: ArrayLike, *, two_sided: bool = False, name: str = "mesh") -> PreparedMesh:
    """Prepare a mesh for contact.

    Args:
        vertices: (n, 3) [m], finite.
        faces: (m, 3) indices, counter-clockwise seen from the free side.
        two_sided: a sheet that acts on both sides.
        name: of the body, for errors.

    Raises:
        ValueError: nothing is left of the mesh, it can't be oriented, or it is closed and inside out; the text gives
        counts.
    """
    points = np.array(vertices, dtype=np.float64).reshape(-1, 3)
    triangles = np.array(faces, dtype=np.int64).reshape(-1, 3)
    if not np.isfinite(points).all():
        bad = int((~np.isfinite(points)).any(axis=1).sum())
        raise ValueError(f"{name}: {bad} of {len(points)} vertices are not finite; remove or replace them.")
    if len(triangles) == 0:
        raise ValueError(f"{name}: a mesh without faces; give at least one triangle.")
    points, triangles, repairs = repair(points, triangles, name)
    neighbours = _adjacency(points, triangles)
    closed = bool((neighbours >= 0).all())
    if closed and not two_sided:
        a, b, c = (points[triangles[:, k]] - points[triangles[0, 0]] for k in range(3))
        if float(np.einsum("ij,ij->", a, np.cross(b, c))) < 0.0:
            raise ValueError(
                f"{name}: the closed mesh of {len(triangles)} faces is inside out: they run clockwise seen from "
                "outside. Reverse them (faces[:, ::-1]); for a hollow room give two_sided=True."
            )
    return _tables(points, triangles, neighbours, closed, two_sided, repairs)


def _adjacency(points: Floats, triangles: Ints) -> Ints:
    """(m, 3) the face across the edge from vertex k to k + 1; -1 at a rim."""
    across = np.full(triangles.size, -1, np.int64)
    one, other, alike = two_face_edges(triangles)
    one, other = one[alike > 0], other[alike > 0]
    across[one], across[other] = other // 3, one // 3
    key, sign = half_edges(triangles)
    _, inverse, count = np.unique(key, return_inverse=True, return_counts=True)
    inverse = inverse.ravel()
    for edge in np.flatnonzero(count > 2):
        halves = np.flatnonzero(inverse == edge)
        for half, partner in _pair_around_edge(points, triangles, halves, sign[halves]):
            across[half], across[partner] = partner // 3, half // 3
    return across.reshape(-1, 3)


def _pair_around_edge(points: Floats, triangles: Ints, halves: Ints, sign: Ints) -> list[tuple[int, int]]:
    """Faces that bound the same free wedge at an edge of three or more faces.

    Seen along the edge from its smaller index, the free side of a face that runs along is counter-clockwise of it,
    that of a face that runs against is clockwise. So a free wedge begins at one that runs along and ends at the next
    one, which runs against.
    """
    first = triangles[halves // 3, halves % 3]
    second = triangles[halves // 3, (halves % 3 + 1) % 3]
    apex = points[triangles[halves // 3, (halves % 3 + 2) % 3]]
    start = points[min(first[0], second[0])]
    e = points[max(first[0], second[0])] - start
    e /= np.linalg.norm(e)
    x = apex[0] - start
    x -= (x @ e) * e
    y = np.cross(e, x)
    angle = np.arctan2((apex - start) @ y, (apex - start) @ x)
    order = np.argsort(angle, kind="stable")
    pairs = []
    for i, here in enumerate(order):
        following = order[(i + 1) % len(order)]
        if sign[here] > 0 > sign[following]:
            pairs.append((int(halves[here]), int(halves[following])))
    return pairs


def _flat_parts(points: Floats, triangles: Ints, neighbours: Ints) -> tuple[Floats, Floats, Floats, NDArray[np.bool_]]:
    """Faces that lie in one plane share its normal, and vertices of such faces alone are put into it.

    Returns:
        points (n, 3) [m]; normals (m, 3); for each edge of each face, (m, 3), the sine of its bend, positive where the
        neighbour falls away from the plane of the face, and whether it is flat.
    """
    m = len(triangles)
    scaled = scaled_normals(points, triangles)
    area = np.linalg.norm(scaled, axis=1)
    normals = scaled / area[:, None]
    noise = FLAT_ROUND_OFF * float(np.abs(points).max())
    off = FLAT_HEIGHT * float(np.ptp(points, axis=0).max()) + noise
    tilt = off / altitudes(points, triangles, scaled)
    bend = np.zeros((m, 3))
    is_flat = np.zeros((m, 3), bool)
    for side in range(3):
        f = np.flatnonzero(neighbours[:, side] >= 0)
        g = neighbours[f, side]
        m1 = np.cross(normals[f], points[triangles[f, (side + 1) % 3]] - points[triangles[f, side]])
        sine = -np.einsum("ij,ij->i", m1, normals[g]) / np.linalg.norm(m1, axis=1)
        alike = np.einsum("ij,ij->i", normals[f], normals[g]) > 0.0
        bend[f, side] = sine
        is_flat[f, side] = alike & (np.abs(sine) <= FLAT_ANGLE + tilt[f] + tilt[g])
    f, k = np.nonzero(is_flat)
    count, group = components(f, neighbours[f, k], m)
    if count < m:
        shared = np.stack([np.bincount(group, weights=scaled[:, i], minlength=count) for i in range(3)], axis=1)
        shared = shared / np.linalg.norm(shared, axis=1)[:, None]
        lies_in = np.linalg.norm(shared[group] - normals, axis=1) <= 2.0 * (FLAT_ANGLE + tilt)
        normals = np.where(lies_in[:, None], shared[group], normals)
        points = _flattened(points, triangles, np.where(lies_in, group, -1), shared, area, noise, off)
    return points, normals, bend, is_flat


def _flattened(
    points: Floats, triangles: Ints, plane: Ints, normals: Floats, area: Floats, noise: float, off: float
) -> Floats:
    """The points (n, 3), those that are ``off`` [m] at most, and more than ``noise`` [m], the one plane of all their
    faces put into it.

    ``plane``: (m,) number of that of each face, -1 if it has none; ``normals``: of the planes.
    """
    count = len(normals)
    own = plane >= 0
    middle = points[triangles[own]].mean(axis=1)
    weight = np.bincount(plane[own], weights=area[own], minlength=count)
    level = np.einsum("ij,ij->i", middle, normals[plane[own]])
    moment = np.bincount(plane[own], weights=area[own] * level, minlength=count)
    height = moment / np.where(weight > 0.0, weight, 1.0)
    lowest = np.full(len(points), count, np.int64)
    highest = np.full(len(points), -2, np.int64)
    np.minimum.at(lowest, triangles.ravel(), np.repeat(plane, 3))
    np.maximum.at(highest, triangles.ravel(), np.repeat(plane, 3))
    inside = np.flatnonzero((lowest == highest) & (lowest >= 0))
    n = normals[lowest[inside]]
    above = np.einsum("ij,ij->i", points[inside], n) - height[lowest[inside]]
    moved = (np.abs(above) > noise) & (np.abs(above) <= off)
    if not moved.any():
        return points
    points = points.copy()
    points[inside[moved]] -= above[moved, None] * n[moved]
    return points


def _tables(
    points: Floats, triangles: Ints, neighbours: Ints, closed: bool, two_sided: bool, repairs: dict[str, int]
) -> PreparedMesh:
    """Normals, what sticks out, the tree, and all of it as tables."""
    points, triangles = compact(points, triangles)
    points, normals, bend, is_flat = _flat_parts(points, triangles, neighbours)
    corners = points[triangles]
    nodes, order = build_static_tree(corners.min(axis=1), corners.max(axis=1))
    triangles, normals, bend, is_flat = triangles[order], normals[order], bend[order], is_flat[order]
    place = np.empty(len(order) + 1, np.int64)
    place[order] = np.arange(len(order))
    place[-1] = -1
    neighbours = place[neighbours[order]]
    m = len(triangles)
    rim = neighbours < 0

    sticks_out = rim | (~is_flat if two_sided else (bend > 0.0) & ~is_flat)
    owned = sticks_out & (rim | (np.arange(m)[:, None] < neighbours))
    starts, ends = triangles, np.roll(triangles, -1, axis=1)
    # Each edge of two faces is counted from both.
    weight = np.where(rim, 2, 1) * sticks_out
    tally = np.bincount(starts.ravel(), weights=weight.ravel(), minlength=len(points))
    tally += np.bincount(ends.ravel(), weights=weight.ravel(), minlength=len(points))
    on_rim = np.zeros(len(points), bool)
    on_rim[starts[rim]] = on_rim[ends[rim]] = True
    pointed = tally + 2 * on_rim >= 6
    used, first = np.unique(triangles.ravel(), return_index=True)
    owns_vertex = np.zeros(triangles.size, bool)
    owns_vertex[first[pointed[used]]] = True

    face_table = np.zeros(m, FACE_ROW)
    face_table["vertices"] = triangles
    face_table["neighbours"] = neighbours
    face_table["normal"] = normals
    bits = np.array([1, 2, 4])
    face_table["flags"] = owned @ bits + 8 * (owns_vertex.reshape(-1, 3) @ bits)

    vertex_table = np.zeros(len(points), VERTEX_ROW)
    vertex_table["position"] = points
    vertex_table["normal"] = _pseudo_normals(points, triangles, normals)
    vertex_table["rim"] = on_rim

    mesh = np.zeros(1, MESH_ROW)
    mesh["num_vertices"], mesh["num_faces"], mesh["num_nodes"] = len(points), m, len(nodes)
    mesh["closed"], mesh["two_sided"] = closed and not two_sided, two_sided
    mesh["lower"], mesh["upper"] = points.min(axis=0), points.max(axis=0)
    return PreparedMesh(mesh, vertex_table, face_table, nodes, {what: n for what, n in repairs.items() if n})


def _pseudo_normals(points: Floats, triangles: Ints, normals: Floats) -> Floats:
    """(n, 3) unit normals of vertices: the sum of those of the faces, weighted by their angles there."""
    total = np.zeros((len(points), 3))
    for k in range(3):
        here = points[triangles[:, k]]
        u = points[triangles[:, (k + 1) % 3]] - here
        v = points[triangles[:, (k + 2) % 3]] - here
        angle = np.arctan2(np.linalg.norm(np.cross(u, v), axis=1), np.einsum("ij,ij->i", u, v))
        for i in range(3):
            total[:, i] += np.bincount(triangles[:, k], weights=angle * normals[:, i], minlength=len(points))
    length = np.linalg.norm(total, axis=1)
    return total / np.where(length > 0.0, length, 1.0)[:, None]
