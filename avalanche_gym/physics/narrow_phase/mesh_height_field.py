"""A moving mesh against the facets of a height field, leaf by leaf (mesh_pieces.py)."""

from __future__ import annotations

import numpy as np

from ..jit import kernel
from ..maths import mat3, vec3
from .height_field import corners_against_faces, highest_below, highest_between
from .height_field_features import list_features
from .height_field_grid import cell_index, grid_of, sample, upward_normal
from .mesh_depth import DEEPER, leave_out_far, tells_of_depth, terrain_is_deep
from .mesh_edges import edges_of_leaf, vertices_beside_edges
from .mesh_pieces import (
    box_of,
    depths,
    half_diagonal,
    is_near_plane,
    lowest_corner,
    node_core,
    prospects,
    put_node,
    turn_round,
)
from .mesh_vertices import faces_of_leaf, list_vertices
from .terrain_candidates import emit_candidates
from .terrain_shape import in_frame

# Boxes over more cells than this are not compared with every facet: those of their subtrees are.
MOST_CELLS = 12
# ... and over more than this not even with the highest sample.
MOST_SAMPLES = 1 << 12


@kernel
def _meets_facets(vertices, faces, node, origin, axes, highest, grid, heights, rows, columns, core):
    """Whether a node, ``core`` of node_core, is not clear of every facet below or above its bounds, along that facet's
    normal.
    """
    _, _, half, _, _, margin, path, rest, lower, upper = core
    if lower[2] > highest:
        return False
    first_row = cell_index(lower[1] - grid[1], grid[5], rows - 1)
    last_row = cell_index(upper[1] - grid[1], grid[5], rows - 1)
    first_column = cell_index(lower[0] - grid[0], grid[4], columns - 1)
    last_column = cell_index(upper[0] - grid[0], grid[4], columns - 1)
    inside = lower[0] > grid[0] and lower[1] > grid[1] and upper[0] < -grid[0] and upper[1] < -grid[1]
    if not inside:
        return True
    cells = (last_row - first_row + 1) * (last_column - first_column + 1)
    if cells <= MOST_SAMPLES and lower[2] > highest_between(grid, heights, rows, columns, lower, upper):
        return False
    if cells > MOST_CELLS:
        return True
    middle, _ = box_of(node)
    for row in range(first_row, last_row + 1):
        v_low, v_high = (lower[1] - grid[1]) * grid[5] - row, (upper[1] - grid[1]) * grid[5] - row
        for column in range(first_column, last_column + 1):
            corner = row * columns + column
            u_low, u_high = (lower[0] - grid[0]) * grid[4] - column, (upper[0] - grid[0]) * grid[4] - column
            for facet in range(2):
                # ABC lies where v <= u in the cell, ACD where v >= u.
                if max(v_low, 0.0) > min(u_high, 1.0) if facet == 0 else min(v_high, 1.0) < max(u_low, 0.0):
                    continue
                n = upward_normal(grid, heights, corner, columns, facet)
                height = vec3.dot(n, vec3.sub(origin, sample(grid, heights, columns, row, column)))
                own = mat3.apply_transposed(axes, n)
                box = abs(own[0]) * half[0] + abs(own[1]) * half[1] + abs(own[2]) * half[2]
                if not is_near_plane(height + vec3.dot(own, middle) - box, n, path, margin, rest):
                    continue
                if node.count == 0:
                    return True
                if is_near_plane(height + lowest_corner(vertices, faces, node, own), n, path, margin, rest):
                    return True
    return False


@kernel
def _leaf_on_facets(
    vertices, faces, nodes, node, core, origin, axes, grid, heights, rows, columns, highest, known, scratch, count
):
    """Contacts of one leaf; return the new count of candidates, and whether some lie deep (mesh_depth.py).

    The mesh is the second shape of the pair. ``known``: whether it is known that some lie deep.
    """
    deep = known
    second = 1
    item = 0
    turn = 0
    while True:
        listed, item = list_vertices(vertices, faces, node, origin, axes, second, item, scratch)
        count = corners_against_faces(grid, heights, rows, columns, listed, highest, scratch, count)
        sample = 0
        while True:
            end, sample = list_features(grid, heights, rows, columns, scratch, sample)
            count = vertices_beside_edges(vertices, axes, listed, end, scratch, count)
            if turn == 0:
                deep = deep or terrain_is_deep(vertices, faces, node, origin, axes, end, scratch, core[7])
                no_mesh = (vertices[:0], faces[:0], nodes[:0])
                count = edges_of_leaf(
                    vertices, faces, nodes, node, origin, axes, second, no_mesh, False, end, scratch, count
                )
                count = faces_of_leaf(vertices, faces, nodes, node, origin, axes, second, end, scratch, count)
            if sample == 0:
                break
        turn += 1
        if item == 0:
            return count, deep


@kernel
def collide_mesh_height_field(
    position_a,
    rotation_a,
    field,
    heights,
    position_b,
    rotation_b,
    mesh,
    margin,
    flight,
    contacts,
    count,
    scratch,
):
    """Append the contacts of a height field (a) with a moving mesh (b); return the new count.

    Args:
        position_a, rotation_a: place of the field [m].
        field: its HEIGHT_FIELD_ROW.
        heights: pool of samples [m].
        position_b, rotation_b: place of the mesh.
        mesh, margin, flight: as in mesh_mesh.py.
        contacts, count: as in ``manifold.emit``.
        scratch: (264, 8), overwritten.
    """
    origin, axes = in_frame(position_b, rotation_b, position_a, rotation_a)
    rows, vertices, faces, nodes = mesh
    scale = half_diagonal(rows[0])
    grid = grid_of(field)
    rows = field.rows
    columns = field.columns
    heights = heights[field.first : field.first + rows * columns]
    seen, falloff, rest, far = prospects(margin, flight, 1.0, position_a, rotation_a)
    skin, deepest = depths(scale, flight)
    margin = max(margin, skin)
    asked = margin
    rest = max(rest, skin)
    while True:
        found = np.int64(0)
        deep = not rest < deepest
        node = 0
        while node < nodes.shape[0]:
            here = nodes[node]
            core = node_core(vertices, faces, here, origin, axes, margin, rest, seen)
            if not _meets_facets(
                vertices, faces, here, origin, axes, field.highest, grid, heights, rows, columns, core
            ):
                node = int(here.skip)
                continue
            if here.count > 0:
                put_node(core, seen, scale, falloff, scratch)
                highest = highest_below(grid, heights, rows, columns, scratch)
                found, deep = _leaf_on_facets(
                    vertices, faces, nodes, here, core, origin, axes, grid, heights, rows, columns, highest, deep,
                    scratch, found,
                )  # fmt: skip
            node += 1
        if rest < deepest and (deep or tells_of_depth(scratch, found, rest)):
            rest = min(DEEPER * rest, deepest)
            margin = max(margin, rest)
            continue
        if found > 0 or not rest < far:
            break
        rest = far
    found = leave_out_far(scratch, found, asked)
    first = count
    count = emit_candidates(scratch, found, position_a, rotation_a, contacts, count)
    turn_round(contacts, first, count)
    return count
