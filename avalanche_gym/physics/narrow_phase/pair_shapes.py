"""The shapes of a pair as its function takes them (pairs.py): placed, with the rows of their tables."""

from __future__ import annotations

import numpy as np

from ..jit import kernel
from ..memory import header_at, table
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
from .pair_query import contact_list, first_of, second_of
from .path import path_of
from .terrain_hull import hull_tables


@kernel
def opened(query):
    """Both placed shapes, the margin, and the list of contacts."""
    position_a, rotation_a, size_a = first_of(query)
    position_b, rotation_b, size_b = second_of(query)
    return position_a, rotation_a, size_a, position_b, rotation_b, size_b, query.margin, contact_list(query)


@kernel
def motion_of(query):
    """``motion``, ``path`` and ``loose`` as a mesh asks for them."""
    return query.motion, path_of(query), query.loose


@kernel
def height_field_pools(query):
    """Rows of all height fields, and their heights."""
    header = header_at(query.header)
    rows = table(header.height_fields, header.height_fields_size, HEIGHT_FIELD_ROW)
    return rows, table(query.heights, header.num_heights, np.float64)


@kernel
def mesh_of(query, number):
    """Tables of one mesh by its number: MESH_ROW (1), VERTEX_ROW, FACE_ROW, NODE_ROW."""
    header = header_at(query.header)
    rows = table(header.meshes, header.meshes_size, MESH_ROW)[number : number + 1]
    row = rows[0]
    vertices = table(header.mesh_vertices, header.mesh_vertices_size, VERTEX_ROW)
    faces = table(header.mesh_faces, header.mesh_faces_size, FACE_ROW)
    nodes = table(header.mesh_nodes, header.mesh_nodes_size, NODE_ROW)
    return (
        rows,
        vertices[row.first_vertex : row.first_vertex + row.num_vertices],
        faces[row.first_face : row.first_face + row.num_faces],
        nodes[row.first_node : row.first_node + row.num_nodes],
    )


@kernel
def hull_pools(query):
    """Rows, points, faces and corners of all hulls."""
    header = header_at(query.header)
    return (
        table(header.hulls, header.hulls_size, HULL_ROW),
        table(header.hull_points, (header.hull_points_size // 3, 3), np.float64),
        table(header.hull_faces, header.hull_faces_size, HULL_FACE_ROW),
        table(header.hull_corners, header.hull_corners_size, np.int64),
    )


@kernel
def hull_of(query):
    """``hull`` of terrain_hull.py for the first shape."""
    header = header_at(query.header)
    rows, points, faces, corners = hull_pools(query)
    edges = table(header.hull_edges, header.hull_edges_size, HULL_EDGE_ROW)
    return hull_tables(rows, query.data_a, points, faces, corners, edges)
