"""A triangle mesh made ready for contact, once: welded, cleaned, oriented, with its neighbours and what sticks out.

1. *Weld* vertices that round-off or a file format tore apart (also along the seams of chunks).
2. *Drop* degenerate faces (no height) and duplicates.
3. *Split* faces at T-junctions, where a vertex lies on the edge of another face: then every edge has both its faces.
4. *Orient* faces that disagree with the rest of their piece.
5. *Adjacency*: across an edge of two faces the other one; where more faces meet, the one across the free space
   between them.
6. *What sticks out*: edges that are neither flat nor concave, vertices with three or more of them; each is owned by
   one face.

Faces that lie in one plane across flat edges share one normal, so a needle among them is no bump.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..model import FACE_ROW, MESH_ROW, VERTEX_ROW
from .static_tree import build_static_tree

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

# Lengths relative to the diagonal of the mesh's box.
WELD_DISTANCE = 1e-9  # vertices closer than this are one; faces less high than this are degenerate
T_JUNCTION_DISTANCE = 1e-7  # a vertex closer than this to an edge lies on it (single-precision files)

# [rad] An edge is flat below this angle. What is lost is a bend that lets a body sink by this much of a face.
FLAT_ANGLE = 1e-9
# ... plus what this many units of round-off of the coordinates can tilt a face.
FLAT_ROUND_OFF = 8.0 * float(np.finfo(np.float64).eps)


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
    given = len(triangles)
    used = points[np.unique(triangles)]
    diagonal = float(np.linalg.norm(np.ptp(used, axis=0)))
    repairs: dict[str, int] = {}

    points, triangles, repairs["welded vertices"] = _weld(points, triangles, WELD_DISTANCE * diagonal)
    triangles, repairs["degenerate faces"] = _drop_degenerate(points, triangles, WELD_DISTANCE * diagonal)
    triangles, repairs["duplicate faces"] = _drop_duplicates(triangles)
    if len(triangles) == 0:
        raise ValueError(
            f"{name}: none of {given} faces is left: {repairs['degenerate faces']} have no area and "
            f"{repairs['duplicate faces']} are duplicates. Check the unit of length and the indices."
        )
    triangles, repairs["T-junctions"] = _split_t_junctions(points, triangles, T_JUNCTION_DISTANCE * diagonal)
    triangles, repairs["flipped faces"] = _orient(points, triangles, name)
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


def _compact(points: Floats, triangles: Ints) -> tuple[Floats, Ints]:
    """Without vertices that no face uses."""
    used, inverse = np.unique(triangles, return_inverse=True)
    return points[used], inverse.reshape(triangles.shape)


# SciPy is imported where a mesh is prepared: most programs never do, and it is a third of the time of a warm start.


def _components(one: Ints, other: Ints, count: int) -> tuple[int, Ints]:
    """Number of connected components of a graph of ``count`` nodes, and the one of each node."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    graph = coo_array((np.ones(len(one)), (one, other)), shape=(count, count))
    found, label = connected_components(graph, directed=False)
    return int(found), label


def _nearest(points: Floats) -> Any:
    """A tree that answers which points are near."""
    from scipy.spatial import cKDTree

    return cKDTree(points)


def _weld(points: Floats, triangles: Ints, distance: float) -> tuple[Floats, Ints, int]:
    """Make vertices closer than ``distance`` [m] one."""
    points, triangles = _compact(points, triangles)
    n = len(points)
    # First those that are the same to the bit, which files without indices repeat many times.
    keys = np.ascontiguousarray(points + 0.0).view(np.dtype((np.void, 24))).ravel()
    _, first, label = np.unique(keys, return_index=True, return_inverse=True)
    points, triangles = points[first], label.ravel()[triangles]
    pairs = _nearest(points).query_pairs(distance, output_type="ndarray")
    if len(pairs):
        _, label = _components(pairs[:, 0], pairs[:, 1], len(points))
        _, first = np.unique(label, return_index=True)
        points, triangles = points[first], label.astype(np.int64)[triangles]
    return points, triangles, n - len(points)


def _normals(points: Floats, triangles: Ints) -> Floats:
    """(m, 3) normals times twice the areas."""
    a, b, c = (points[triangles[:, k]] for k in range(3))
    return np.cross(b - a, c - a)


def _altitudes(points: Floats, triangles: Ints, scaled: Floats | None = None) -> Floats:
    """(m,) [m] smallest height of each face; ``scaled``: from _normals."""
    longest = np.zeros(len(triangles))
    for k in range(3):
        side = points[triangles[:, (k + 1) % 3]] - points[triangles[:, k]]
        np.maximum(longest, np.einsum("ij,ij->i", side, side), out=longest)
    longest = np.sqrt(longest)
    twice = np.linalg.norm(_normals(points, triangles) if scaled is None else scaled, axis=1)
    return twice / np.where(longest > 0.0, longest, 1.0)


def _drop_degenerate(points: Floats, triangles: Ints, height: float) -> tuple[Ints, int]:
    keep = _altitudes(points, triangles) > height
    return triangles[keep], int((~keep).sum())


def _drop_duplicates(triangles: Ints) -> tuple[Ints, int]:
    """Keep the first of the faces with the same three vertices, whichever way they turn."""
    ordered = np.sort(triangles, axis=1)
    order = np.lexsort(ordered.T)
    same = (np.diff(ordered[order], axis=0) == 0).all(axis=1)
    drop = order[1:][same]
    keep = np.ones(len(triangles), bool)
    keep[drop] = False
    return triangles[keep], len(drop)


def _half_edges(triangles: Ints) -> tuple[Ints, Ints]:
    """(3 m,) a key of the undirected edge k of face f at 3 f + k, and +1 if it runs from the smaller index."""
    start, end = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    key = np.minimum(start, end) * (int(triangles.max()) + 1) + np.maximum(start, end)
    return key, np.where(start < end, 1, -1)


def _split_t_junctions(points: Floats, triangles: Ints, distance: float) -> tuple[Ints, int]:
    """Split faces at vertices that lie on an edge that has no other face."""
    splits = 0
    while True:
        key, _ = _half_edges(triangles)
        _, inverse, count = np.unique(key, return_inverse=True, return_counts=True)
        lonely = np.flatnonzero(count[inverse.ravel()] == 1)
        start, end = triangles.ravel()[lonely], np.roll(triangles, -1, axis=1).ravel()[lonely]
        rim = np.unique(np.concatenate([start, end]))
        if len(rim) == 0:
            return triangles, splits
        a, b = points[start], points[end]
        length = np.linalg.norm(b - a, axis=1)
        close = _nearest(points[rim]).query_ball_point(0.5 * (a + b), 0.5 * length)
        sizes = np.fromiter((len(c) for c in close), np.int64, len(close))
        edge = np.repeat(np.arange(len(lonely)), sizes)
        vertex = rim[np.concatenate([np.asarray(c, np.int64) for c in close])] if sizes.sum() else rim[:0]
        direction = (b - a) / length[:, None]
        offset = points[vertex] - a[edge]
        along = np.einsum("ij,ij->i", offset, direction[edge])
        off = np.linalg.norm(offset - along[:, None] * direction[edge], axis=1)
        on = (off <= distance) & (along > distance) & (along < length[edge] - distance)
        on &= (vertex != start[edge]) & (vertex != end[edge])
        edge, vertex, along = edge[on], vertex[on], along[on]
        # One edge of a face at a time; the others in the next round.
        _, chosen = np.unique(lonely[edge] // 3, return_index=True)
        of_chosen = np.isin(edge, edge[chosen])
        edge, vertex, along = edge[of_chosen], vertex[of_chosen], along[of_chosen]
        if len(edge) == 0:
            return triangles, splits
        order = np.lexsort((along, edge))
        edge, vertex = edge[order], vertex[order]
        groups = np.split(np.arange(len(edge)), np.flatnonzero(np.diff(edge)) + 1)
        added, removed = [], []
        for group in groups:
            half = int(lonely[edge[group[0]]])
            face = triangles[half // 3]
            apex = face[(half % 3 + 2) % 3]
            chain = [face[half % 3], *vertex[group], face[(half % 3 + 1) % 3]]
            removed.append(half // 3)
            added += [(chain[i], chain[i + 1], apex) for i in range(len(chain) - 1)]
            splits += len(group)
        triangles = np.concatenate([np.delete(triangles, removed, axis=0), np.array(added, np.int64)])
        triangles = triangles[_altitudes(points, triangles) > 0.0]


def _two_face_edges(triangles: Ints) -> tuple[Ints, Ints, Ints]:
    """Pairs of half edges (3 f + k) of the edges with exactly two faces, and +1 where the faces turn alike."""
    key, sign = _half_edges(triangles)
    order = np.argsort(key, kind="stable")
    ordered = key[order]
    first = np.flatnonzero(np.concatenate([[True], np.diff(ordered) > 0]))
    count = np.diff(np.concatenate([first, [len(ordered)]]))
    first = first[count == 2]
    one, other = order[first], order[first + 1]
    return one, other, -sign[one] * sign[other]


def _orient(points: Floats, triangles: Ints, name: str) -> tuple[Ints, int]:
    """Turn faces round that disagree with the larger part, by area, of their piece.

    A piece is a component of the graph of faces joined by edges of two faces. In its double cover, with a node for
    each face as it is and one for it turned round, a piece that can be oriented falls into two components.
    """
    one, other, alike = _two_face_edges(triangles)
    if (alike > 0).all():
        return triangles, 0
    m = len(triangles)
    f, g = one // 3, other // 3
    turned = np.where(alike > 0, 0, m)
    rows = np.concatenate([f, f + m])
    columns = np.concatenate([g + turned, g + m - turned])
    count, label = _components(rows, columns, 2 * m)
    stuck = label[:m] == label[m:]
    if stuck.any():
        raise ValueError(
            f"{name}: {int(stuck.sum())} of {m} faces lie on a surface with one side only, like a Moebius strip, so no "
            "free side can be told. Repair the mesh, or cut the strip."
        )
    area = np.linalg.norm(_normals(points, triangles), axis=1)
    as_is = np.bincount(label[:m], weights=area, minlength=count)
    flip = as_is[label[:m]] < as_is[label[m:]]
    tie = as_is[label[:m]] == as_is[label[m:]]
    flip |= tie & (label[:m] > label[m:])
    triangles = triangles.copy()
    triangles[flip] = triangles[flip][:, ::-1]
    return triangles, int(flip.sum())


def _adjacency(points: Floats, triangles: Ints) -> Ints:
    """(m, 3) the face across the edge from vertex k to k + 1; -1 at a rim."""
    across = np.full(triangles.size, -1, np.int64)
    one, other, alike = _two_face_edges(triangles)
    one, other = one[alike > 0], other[alike > 0]
    across[one], across[other] = other // 3, one // 3
    key, sign = _half_edges(triangles)
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


def _tables(
    points: Floats, triangles: Ints, neighbours: Ints, closed: bool, two_sided: bool, repairs: dict[str, int]
) -> PreparedMesh:
    """Normals, what sticks out, the tree, and all of it as tables."""
    points, triangles = _compact(points, triangles)
    corners = points[triangles]
    nodes, order = build_static_tree(corners.min(axis=1), corners.max(axis=1))
    triangles = triangles[order]
    place = np.empty(len(order) + 1, np.int64)
    place[order] = np.arange(len(order))
    place[-1] = -1
    neighbours = place[neighbours[order]]
    m = len(triangles)

    scaled = _normals(points, triangles)
    area = np.linalg.norm(scaled, axis=1)
    normals = scaled / area[:, None]
    rim = neighbours < 0
    round_off = FLAT_ROUND_OFF * float(np.abs(points).max()) / _altitudes(points, triangles, scaled)
    # The sine of the bend: positive where the neighbour falls away from the plane of the face.
    bend = np.zeros((m, 3))
    is_flat = np.zeros((m, 3), bool)
    for side in range(3):
        f = np.flatnonzero(~rim[:, side])
        g = neighbours[f, side]
        m1 = np.cross(normals[f], points[triangles[f, (side + 1) % 3]] - points[triangles[f, side]])
        sine = -np.einsum("ij,ij->i", m1, normals[g]) / np.linalg.norm(m1, axis=1)
        alike = np.einsum("ij,ij->i", normals[f], normals[g]) > 0.0
        bend[f, side] = sine
        is_flat[f, side] = alike & (np.abs(sine) <= FLAT_ANGLE + round_off[f] + round_off[g])
    f, k = np.nonzero(is_flat)
    count, group = _components(f, neighbours[f, k], m)
    if count < m:
        shared = np.stack([np.bincount(group, weights=scaled[:, i], minlength=count) for i in range(3)], axis=1)
        shared = (shared / np.linalg.norm(shared, axis=1)[:, None])[group]
        lies_in = np.linalg.norm(shared - normals, axis=1) <= 2.0 * (FLAT_ANGLE + round_off)
        normals = np.where(lies_in[:, None], shared, normals)

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
