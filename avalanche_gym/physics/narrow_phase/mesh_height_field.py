"""A moving mesh against the facets or the smooth surface of a height field, leaf by leaf (mesh_pieces.py)."""

from __future__ import annotations

import math

import numpy as np

from ..jit import kernel
from ..maths import mat3, vec3
from .height_field import corners_against_faces, highest_below
from .height_field_grid import cell_index, grid_of, list_features, sample, upward_normal
from .mesh import tables_of
from .mesh_pieces import (
    bounds_of,
    box_of,
    edges_of_leaf,
    faces_of_leaf,
    half_diagonal,
    list_vertices,
    near_margin,
    put_node,
    turn_round,
    vertices_beside_edges,
)
from .smooth_contacts import LINE, bounds_around, collide_ball, collide_curve, number_alike, prepare_scratch
from .smooth_faces import collide_face, put_corner
from .smooth_surface import coefficients_of, patch_of
from .terrain_candidates import PARTS, emit_candidates
from .terrain_shape import BOUNDS_ROW, in_frame, margin_of, rank_by_motion

# Boxes over more cells than this are not compared with every facet: those of their subtrees are.
MOST_CELLS = 12


@kernel
def _lowest(vertices, faces, node, middle, half, n):
    """The lowest a node reaches along n, in the mesh's frame [m, times the length of n]: its box; of a leaf its
    vertices.
    """
    reach = vec3.dot(n, middle) - abs(n[0]) * half[0] - abs(n[1]) * half[1] - abs(n[2]) * half[2]
    if node.count > 0:
        reach = math.inf
        for index in range(node.first, node.first + node.count):
            for k in range(3):
                reach = min(reach, vec3.dot(n, vec3.load(vertices[faces[index].vertices[k]].position)))
    return reach


@kernel
def _meets_facets(vertices, faces, node, origin, axes, highest, grid, heights, rows, columns, margin):
    """Whether a node is not clear of every facet below or above its bounds, along that facet's normal."""
    middle, half = box_of(node)
    lower, upper = bounds_of(middle, half, origin, axes, margin)
    if lower[2] > highest:
        return False
    first_row = cell_index(lower[1] - grid[1], grid[5], rows - 1)
    last_row = cell_index(upper[1] - grid[1], grid[5], rows - 1)
    first_column = cell_index(lower[0] - grid[0], grid[4], columns - 1)
    last_column = cell_index(upper[0] - grid[0], grid[4], columns - 1)
    inside = lower[0] > grid[0] and lower[1] > grid[1] and upper[0] < -grid[0] and upper[1] < -grid[1]
    if not inside or (last_row - first_row + 1) * (last_column - first_column + 1) > MOST_CELLS:
        return True
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
                height += _lowest(vertices, faces, node, middle, half, mat3.apply_transposed(axes, n))
                if height <= 0.0 or height * height <= margin * margin * vec3.norm_squared(n):
                    return True
    return False


@kernel
def _leaf_on_facets(vertices, faces, nodes, node, origin, axes, grid, heights, rows, columns, highest, scratch, count):
    """Contacts of one leaf; return the new count of candidates. The mesh is the second shape of the pair."""
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
                no_mesh = (vertices[:0], faces[:0], nodes[:0])
                count = edges_of_leaf(vertices, faces, node, origin, axes, second, no_mesh, False, end, scratch, count)
                count = faces_of_leaf(vertices, faces, nodes, node, origin, axes, second, end, scratch, count)
            if sample == 0:
                break
        turn += 1
        if item == 0:
            return count


@kernel
def collide_mesh_height_field(
    position_a,
    rotation_a,
    field,
    heights,
    position_b,
    rotation_b,
    mesh,
    vertices,
    faces,
    nodes,
    margin,
    motion,
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
        mesh: its MESH_ROW.
        vertices, faces, nodes: pools of VERTEX_ROW, FACE_ROW, NODE_ROW.
        margin: [m] contacts farther apart are left out.
        motion: [m] bound of how far the two come closer by themselves.
        contacts, count: as in ``manifold.emit``.
        scratch: (264, 8), overwritten.
    """
    origin, axes = in_frame(position_b, rotation_b, position_a, rotation_a)
    scale = half_diagonal(mesh)
    vertices, faces, nodes = tables_of(mesh, vertices, faces, nodes)
    grid = grid_of(field)
    rows = field.rows
    columns = field.columns
    heights = heights[field.first : field.first + rows * columns]
    reach = near_margin(margin, motion)
    found = np.int64(0)
    while True:
        node = 0
        while node < nodes.shape[0]:
            here = nodes[node]
            if not _meets_facets(
                vertices, faces, here, origin, axes, field.highest, grid, heights, rows, columns, reach
            ):
                node = int(here.skip)
                continue
            if here.count > 0:
                put_node(here, origin, axes, scale, reach, motion, scratch)
                highest = highest_below(grid, heights, rows, columns, scratch)
                found = _leaf_on_facets(
                    vertices, faces, nodes, here, origin, axes, grid, heights, rows, columns, highest, scratch, found
                )
            node += 1
        if found > 0 or not reach < margin:
            break
        reach = margin
    first = count
    count = emit_candidates(scratch, found, position_a, rotation_a, contacts, count)
    turn_round(contacts, first, count)
    return count


@kernel
def _leaf_on_spline(vertices, faces, node, origin, axes, patch, c, highest, scratch, count):
    """Contacts of one leaf with the smooth surface; return the new count of candidates."""
    margin = margin_of(scratch)
    num_vertices = vertices.shape[0]
    num_faces = faces.shape[0]
    for index in range(node.first, node.first + node.count):
        face = faces[index]
        low, high = (math.inf, math.inf), (-math.inf, -math.inf)
        lowest = math.inf
        p = origin
        longest = 0.0
        for k in range(3):
            number = int(face.vertices[k])
            p = vec3.add(origin, mat3.apply(axes, vec3.load(vertices[number].position)))
            put_corner(scratch, k, p)
            low = (min(low[0], p[0]), min(low[1], p[1]))
            high = (max(high[0], p[0]), max(high[1], p[1]))
            lowest = min(lowest, p[2])
            if face.flags >> (3 + k) & 1 and p[2] - margin <= highest:
                count = collide_ball(patch, c, p, 0.0, number % PARTS, scratch, count)
            local = vec3.load(vertices[face.vertices[(k + 1) % 3]].position)
            b = vec3.sub(vec3.add(origin, mat3.apply(axes, local)), p)
            length = vec3.norm(b)
            longest = max(longest, length)
            if face.flags >> k & 1 and min(p[2], p[2] + b[2]) - margin <= highest:
                u = vec3.scale(1.0 / length, b)
                middle = vec3.add_scaled(p, 0.5, b)
                part = (num_vertices + 3 * index + k) % PARTS
                count = collide_curve(patch, c, LINE, middle, u, u, 0.5 * length, length, 0.0, part, scratch, count)
        if lowest - margin <= highest:
            n = mat3.apply(axes, vec3.load(face.normal))
            part = (num_vertices + 3 * num_faces + index) % PARTS
            count = collide_face(patch, c, n, p, low, high, 3, 0.0, longest, part, scratch, count)
    return count


@kernel
def collide_mesh_smooth_field(
    position_a,
    rotation_a,
    mesh,
    vertices,
    faces,
    nodes,
    position_b,
    rotation_b,
    field,
    pool,
    margin,
    motion,
    contacts,
    count,
    scratch,
):
    """Append the contacts of a moving mesh (a) with a smooth height field (b); return the new count.

    Arguments as above; smooth_contacts.py says what is exact and what may be missed.
    """
    origin, axes = in_frame(position_a, rotation_a, position_b, rotation_b)
    scale = half_diagonal(mesh)
    vertices, faces, nodes = tables_of(mesh, vertices, faces, nodes)
    patch = patch_of(field)
    c = coefficients_of(field, pool)
    reach = near_margin(margin, motion)
    found = 0
    while True:
        node = 0
        while node < nodes.shape[0]:
            here = nodes[node]
            put_node(here, origin, axes, scale, reach, motion, scratch)
            lowest = scratch[BOUNDS_ROW, 2]
            highest = -math.inf
            if lowest <= field.highest:
                middle = (
                    0.5 * (scratch[BOUNDS_ROW, 0] + scratch[BOUNDS_ROW, 3]),
                    0.5 * (scratch[BOUNDS_ROW, 1] + scratch[BOUNDS_ROW, 4]),
                    lowest,
                )
                around = 0.5 * max(
                    scratch[BOUNDS_ROW, 3] - scratch[BOUNDS_ROW, 0], scratch[BOUNDS_ROW, 4] - scratch[BOUNDS_ROW, 1]
                )
                highest, _ = bounds_around(patch, c, middle, around)
            if lowest > highest:
                node = int(here.skip)
                continue
            if here.count > 0:
                prepare_scratch(scratch, reach, scale)
                rank_by_motion(motion, scratch)
                found = _leaf_on_spline(vertices, faces, here, origin, axes, patch, c, highest, scratch, found)
            node += 1
        if found > 0 or not reach < margin:
            break
        reach = margin
    number_alike(scratch, found)
    return emit_candidates(scratch, found, position_b, rotation_b, contacts, count)
