"""Rows of the tables of shapes: height fields, meshes and convex hulls, as kernels read them.

The names end in _ROW: the bare names are the codes of the shapes (model.py). tables/shape_tables.py fills them.
"""

from __future__ import annotations

import numpy as np

HEIGHT_FIELD_ROW = np.dtype(  # (height fields,)
    [
        ("rows", np.int64),  # along y
        ("columns", np.int64),  # along x
        ("extent", np.float64, 2),  # [m] along x, along y; centred on the collider
        ("first", np.int64),  # of its samples in the pool of heights, row by row
        ("smooth", np.int64),  # 1: its spline coefficients (rows + 2, columns + 2) follow the samples; 0: facets
        ("size", np.int64),  # of its part of the pool: samples and coefficients
        ("lowest", np.float64),  # [m] over all worlds
        ("highest", np.float64),
    ],
    align=True,
)

MESH_ROW = np.dtype(  # (meshes,)
    [
        ("first_vertex", np.int64),  # in the pool of vertices; indices in FACE_ROW and NODE_ROW count from the firsts
        ("num_vertices", np.int64),
        ("first_face", np.int64),
        ("num_faces", np.int64),
        ("first_node", np.int64),
        ("num_nodes", np.int64),
        ("closed", np.int64),  # 1: it bounds a solid
        ("two_sided", np.int64),  # 1: a sheet that acts on both sides
        ("lower", np.float64, 3),  # [m] bounds, mesh frame
        ("upper", np.float64, 3),
    ],
    align=True,
)

VERTEX_ROW = np.dtype(  # (vertices of all meshes,)
    [
        ("position", np.float64, 3),  # [m] mesh frame
        ("normal", np.float64, 3),  # unit, angle-weighted pseudo-normal: its sign tells inside from outside
        ("rim", np.int64),  # 1: on the border of an open mesh
    ],
    align=True,
)

FACE_ROW = np.dtype(  # (faces of all meshes,), in the order of the tree's leaves
    [
        ("vertices", np.int32, 3),  # counter-clockwise from the free side
        ("neighbours", np.int32, 3),  # face across the edge from vertex k to k + 1; -1 at a rim
        ("flags", np.int32),  # bit k: answers for edge k, which sticks out; bit 3 + k: answers for vertex k
        ("normal", np.float64, 3),  # unit, into the free side
    ],
    align=True,
)

NODE_ROW = np.dtype(  # (tree nodes of all meshes,), depth first
    [
        ("lower", np.float32, 3),  # [m] bounds, rounded outwards
        ("upper", np.float32, 3),
        ("skip", np.int32),  # the node that follows this subtree
        ("first", np.int32),  # leaf: its first face
        ("count", np.int32),  # leaf: number of faces; 0 for an inner node
    ]
)

HULL_ROW = np.dtype(  # (hulls,)
    [
        ("first_vertex", np.int64),  # in the pool of points
        ("num_vertices", np.int64),
        ("first_face", np.int64),  # in the pool of faces
        ("num_faces", np.int64),
        ("radius", np.float64),  # [m] of the smallest sphere about the origin of its frame that holds it
        ("first_edge", np.int64),  # in the pool of edges
        ("num_edges", np.int64),
        ("center", np.float64, 3),  # [m] mean of its vertices, inside of it
        ("half", np.float64, 3),  # [m] half extents of a box about ``center`` that holds it
    ],
    align=True,
)

HULL_FACE_ROW = np.dtype(  # (faces of all hulls,)
    [
        ("normal", np.float64, 3),  # unit, outward, hull frame
        ("first_corner", np.int64),  # in the pool of corners: vertex numbers that count from the hull's first vertex
        ("num_corners", np.int64),  # at most MOST_CORNERS
    ],
    align=True,
)

HULL_EDGE_ROW = np.dtype(  # (edges of all hulls,)
    [
        ("start", np.int64),  # vertices, counted from the hull's first one
        ("end", np.int64),
        ("into_left", np.float64, 3),  # unit, at right angles to the edge into its one face, hull frame
        ("into_right", np.float64, 3),  # ... into its other face
    ],
    align=True,
)
