"""What of its shape a collider does not hold in three numbers: the tables of height fields, convex hulls and meshes.

A collider names its row there. Hulls and meshes are prepared for contact once, however many bodies, worlds and rebuilds
share them.
"""

from __future__ import annotations

from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from ..shape_rows import (
    FACE_ROW,
    HEIGHT_FIELD_ROW,
    HULL_EDGE_ROW,
    HULL_FACE_ROW,
    HULL_ROW,
    MESH_ROW,
    NODE_ROW,
    VERTEX_ROW,
)
from ..shapes import ConvexHull, HeightField, TriangleMesh
from ..shapes.flatness import flattened
from ..shapes.height_spline import pool_of_field
from ..shapes.hull_preparation import PreparedHull, prepare_hull
from ..shapes.mesh_preparation import PreparedMesh, prepare_mesh


class ShapeTables:
    """Collects the height fields, hulls and meshes of a scene; ``arrays`` lays them out one behind the other."""

    def __init__(self) -> None:
        self.height_field_rows: dict[int, int] = {}
        self._height_fields: list[HeightField] = []
        self._hulls: list[ConvexHull] = []
        self._meshes: list[TriangleMesh] = []

    def knows(self, shape: Any) -> bool:
        """Whether a collider of this shape needs no new row."""
        if isinstance(shape, ConvexHull):
            return shape in self._hulls
        return shape in self._meshes if isinstance(shape, TriangleMesh) else not isinstance(shape, HeightField)

    def add(self, handle: int, shape: Any, collider: Any) -> None:
        """Give a collider its row in the table of its shape."""
        if isinstance(shape, HeightField):
            collider["data"] = self.height_field_rows[handle] = len(self._height_fields)
            self._height_fields.append(shape)
        elif isinstance(shape, ConvexHull):
            if shape not in self._hulls:
                self._hulls.append(shape)
            collider["data"] = self._hulls.index(shape)
        elif isinstance(shape, TriangleMesh):
            if shape not in self._meshes:
                self._meshes.append(shape)
            collider["data"] = self._meshes.index(shape)
            collider["two_sided"] = shape.two_sided

    def arrays(self) -> dict[str, NDArray[Any]]:
        rows = np.zeros(len(self._height_fields), HEIGHT_FIELD_ROW)
        pools = [
            pool_of_field(flattened(shape.heights, shape.extent), shape.surface == "smooth")
            for shape in self._height_fields
        ]
        first = 0
        for row, shape, pool in zip(rows, self._height_fields, pools, strict=True):
            row["rows"], row["columns"] = shape.heights.shape
            row["extent"] = shape.extent
            row["first"] = first
            row["smooth"] = shape.surface == "smooth"
            row["size"] = pool.size
            row["lowest"], row["highest"] = pool.min(), pool.max()
            first += pool.size
        heights = np.concatenate([np.zeros(0), *pools])
        return {
            "height_fields": rows,
            "heights": heights,
            **self._hull_tables(),
            **self._mesh_tables(),
        }

    def _hull_tables(self) -> dict[str, NDArray[Any]]:
        """Hulls, their plane faces found, one behind the other."""
        prepared = [_prepared_hull(shape) for shape in self._hulls]
        hulls = np.zeros(len(prepared), HULL_ROW)
        points, faces, corners, edges = 0, 0, 0, 0
        for index, one in enumerate(prepared):
            hulls[index] = one.hull[0]
            row = hulls[index]
            row["first_vertex"], row["first_face"], row["first_edge"] = points, faces, edges
            one.faces["first_corner"] += corners
            points, faces = points + len(one.points), faces + len(one.faces)
            corners, edges = corners + len(one.corners), edges + len(one.edges)
        return {
            "hulls": hulls,
            "hull_points": np.concatenate([np.zeros(0), *(one.points.ravel() for one in prepared)]),
            "hull_faces": np.concatenate([np.zeros(0, HULL_FACE_ROW), *(one.faces for one in prepared)]),
            "hull_corners": np.concatenate([np.zeros(0, np.int64), *(one.corners for one in prepared)]),
            "hull_edges": np.concatenate([np.zeros(0, HULL_EDGE_ROW), *(one.edges for one in prepared)]),
        }

    def _mesh_tables(self) -> dict[str, NDArray[Any]]:
        """Meshes, prepared for contact, one behind the other."""
        meshes = np.zeros(len(self._meshes), MESH_ROW)
        pools: dict[str, list[NDArray[Any]]] = {"vertex": [], "face": [], "node": []}
        for index, shape in enumerate(self._meshes):
            prepared = _prepared_mesh(shape)
            meshes[index] = prepared.mesh
            row = meshes[index]
            for name, part in zip(pools, (prepared.vertices, prepared.faces, prepared.nodes), strict=True):
                row[f"first_{name}"] = sum(map(len, pools[name]))
                pools[name].append(part)
        dtypes = {"mesh_vertices": VERTEX_ROW, "mesh_faces": FACE_ROW, "mesh_nodes": NODE_ROW}
        joined = {
            name: np.concatenate([np.zeros(0, dtype), *parts])
            for (name, dtype), parts in zip(dtypes.items(), pools.values(), strict=True)
        }
        return {"meshes": meshes, **joined}


_PREPARED_HULLS: WeakKeyDictionary[ConvexHull, PreparedHull] = WeakKeyDictionary()


def _prepared_hull(shape: ConvexHull) -> PreparedHull:
    """The plane faces of a hull are found once, however often its world is built; the caller may shift their firsts."""
    if shape not in _PREPARED_HULLS:
        _PREPARED_HULLS[shape] = prepare_hull(shape.vertices, shape.faces)
    return _PREPARED_HULLS[shape]._replace(faces=_PREPARED_HULLS[shape].faces.copy())


_PREPARED_MESHES: WeakKeyDictionary[TriangleMesh, PreparedMesh] = WeakKeyDictionary()


def _prepared_mesh(shape: TriangleMesh) -> PreparedMesh:
    """Welding, adjacency and the tree of a mesh are made once, however many worlds use it."""
    if shape not in _PREPARED_MESHES:
        _PREPARED_MESHES[shape] = prepare_mesh(shape.vertices, shape.faces, two_sided=shape.two_sided)
    return _PREPARED_MESHES[shape]
