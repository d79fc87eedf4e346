"""Repairs of a triangle mesh: what is torn, degenerate, double, unsplit or turned over.

1. *Weld* vertices that round-off or a file format tore apart (also along the seams of chunks).
2. *Drop* degenerate faces (no height) and duplicates.
3. *Split* faces at T-junctions, where a vertex lies on the edge of another face: then every edge has both its faces.
4. *Orient* faces that disagree with the rest of their piece.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

# Lengths relative to the diagonal of the mesh's box.
WELD_DISTANCE = 1e-9  # vertices closer than this are one; faces less high than this are degenerate
T_JUNCTION_DISTANCE = 1e-7  # a vertex closer than this to an edge lies on it (single-precision files)

# A unit vector along which vertices that share a coordinate, or are mirrored, do not meet.
OBLIQUE = np.array([0.4816, 0.6135, 0.6258]) / np.linalg.norm([0.4816, 0.6135, 0.6258])


def repair(points: Floats, triangles: Ints, name: str) -> tuple[Floats, Ints, dict[str, int]]:
    """Vertices (n, 3) [m] and faces (m, 3) after repair, and how often each was needed, by its name."""
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
    return points, triangles, repairs


def compact(points: Floats, triangles: Ints) -> tuple[Floats, Ints]:
    """Without vertices that no face uses."""
    used, inverse = np.unique(triangles, return_inverse=True)
    return points[used], inverse.reshape(triangles.shape)


# SciPy is imported where a mesh needs it: most never do, and it is a third of the time of a warm start.


def components(one: Ints, other: Ints, count: int) -> tuple[int, Ints]:
    """Number of connected components of a graph of ``count`` nodes, and the one of each node."""
    if len(one) == 0:
        return count, np.arange(count)
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    graph = coo_array((np.ones(len(one)), (one, other)), shape=(count, count))
    found, label = connected_components(graph, directed=False)
    return int(found), label


def _nearest(points: Floats) -> Any:
    """A tree that answers which points are near."""
    from scipy.spatial import cKDTree

    return cKDTree(points)


def _may_be_close(points: Floats, distance: float) -> bool:
    """False only if no two points (n, 3) are within ``distance`` [m] of each other.

    Two that are, are so along every direction, and so are all that lie between them along it.
    """
    along = np.sort(points @ OBLIQUE)
    round_off = 8.0 * np.finfo(np.float64).eps * float(np.abs(points).max())
    return bool((np.diff(along) <= distance + round_off).any())


def _weld(points: Floats, triangles: Ints, distance: float) -> tuple[Floats, Ints, int]:
    """Make vertices closer than ``distance`` [m] one."""
    points, triangles = compact(points, triangles)
    n = len(points)
    # First those that are the same to the bit, which files without indices repeat many times.
    keys = np.ascontiguousarray(points + 0.0).view(np.dtype((np.void, 24))).ravel()
    _, first, label = np.unique(keys, return_index=True, return_inverse=True)
    points, triangles = points[first], label.ravel()[triangles]
    if not _may_be_close(points, distance):
        return points, triangles, n - len(points)
    pairs = _nearest(points).query_pairs(distance, output_type="ndarray")
    if len(pairs):
        _, label = components(pairs[:, 0], pairs[:, 1], len(points))
        _, first = np.unique(label, return_index=True)
        points, triangles = points[first], label.astype(np.int64)[triangles]
    return points, triangles, n - len(points)


def scaled_normals(points: Floats, triangles: Ints) -> Floats:
    """(m, 3) normals times twice the areas."""
    a, b, c = (points[triangles[:, k]] for k in range(3))
    return np.cross(b - a, c - a)


def altitudes(points: Floats, triangles: Ints, scaled: Floats | None = None) -> Floats:
    """(m,) [m] smallest height of each face; ``scaled``: from scaled_normals."""
    longest = np.zeros(len(triangles))
    for k in range(3):
        side = points[triangles[:, (k + 1) % 3]] - points[triangles[:, k]]
        np.maximum(longest, np.einsum("ij,ij->i", side, side), out=longest)
    longest = np.sqrt(longest)
    twice = np.linalg.norm(scaled_normals(points, triangles) if scaled is None else scaled, axis=1)
    return twice / np.where(longest > 0.0, longest, 1.0)


def _drop_degenerate(points: Floats, triangles: Ints, height: float) -> tuple[Ints, int]:
    keep = altitudes(points, triangles) > height
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


def half_edges(triangles: Ints) -> tuple[Ints, Ints]:
    """(3 m,) a key of the undirected edge k of face f at 3 f + k, and +1 if it runs from the smaller index."""
    start, end = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    key = np.minimum(start, end) * (int(triangles.max()) + 1) + np.maximum(start, end)
    return key, np.where(start < end, 1, -1)


def _split_t_junctions(points: Floats, triangles: Ints, distance: float) -> tuple[Ints, int]:
    """Split faces at vertices that lie on an edge that has no other face."""
    splits = 0
    while True:
        key, _ = half_edges(triangles)
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
        triangles = triangles[altitudes(points, triangles) > 0.0]


def two_face_edges(triangles: Ints) -> tuple[Ints, Ints, Ints]:
    """Pairs of half edges (3 f + k) of the edges with exactly two faces, and +1 where the faces turn alike."""
    key, sign = half_edges(triangles)
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
    one, other, alike = two_face_edges(triangles)
    if (alike > 0).all():
        return triangles, 0
    m = len(triangles)
    f, g = one // 3, other // 3
    turned = np.where(alike > 0, 0, m)
    rows = np.concatenate([f, f + m])
    columns = np.concatenate([g + turned, g + m - turned])
    count, label = components(rows, columns, 2 * m)
    stuck = label[:m] == label[m:]
    if stuck.any():
        raise ValueError(
            f"{name}: {int(stuck.sum())} of {m} faces lie on a surface with one side only, like a Moebius strip, so no "
            "free side can be told. Repair the mesh, or cut the strip."
        )
    area = np.linalg.norm(scaled_normals(points, triangles), axis=1)
    as_is = np.bincount(label[:m], weights=area, minlength=count)
    flip = as_is[label[:m]] < as_is[label[m:]]
    tie = as_is[label[:m]] == as_is[label[m:]]
    flip |= tie & (label[:m] > label[m:])
    triangles = triangles.copy()
    triangles[flip] = triangles[flip][:, ::-1]
    return triangles, int(flip.sum())
