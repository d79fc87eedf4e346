"""The shapes of a pair as its function takes them (pairs.py): placed, with the rows of their tables."""

from __future__ import annotations

import numpy as np

from ..jit import kernel
from ..memory import header_at, height_field_of, hulls_of, mesh_of, table
from ..shape_rows import HULL_EDGE_ROW
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
def first_height_field(query):
    return height_field_of(header_at(query.header), query.data_a)


@kernel
def second_height_field(query):
    return height_field_of(header_at(query.header), query.data_b)


@kernel
def pool_of_heights(query):
    """The pool of heights [m] at the instant of the query."""
    return table(query.heights, header_at(query.header).num_heights, np.float64)


@kernel
def first_mesh(query):
    return mesh_of(header_at(query.header), query.data_a)


@kernel
def second_mesh(query):
    return mesh_of(header_at(query.header), query.data_b)


@kernel
def hull_pools(query):
    """Rows, points, faces and corners of all hulls."""
    return hulls_of(header_at(query.header))


@kernel
def hull_of(query):
    """``hull`` of terrain_hull.py for the first shape."""
    header = header_at(query.header)
    rows, points, faces, corners = hulls_of(header)
    edges = table(header.hull_edges, header.hull_edges_size, HULL_EDGE_ROW)
    return hull_tables(rows, query.data_a, points, faces, corners, edges)
