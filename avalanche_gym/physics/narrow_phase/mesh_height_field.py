"""A moving mesh against the facets or the smooth surface of a height field, leaf by leaf (mesh_pieces.py)."""

from __future__ import annotations

import math

import numpy as np

from ..jit import kernel
from ..maths import mat3, vec3
from .height_field import corners_against_faces, highest_below, highest_between
from .height_field_features import list_features
from .height_field_grid import cell_index, grid_of, sample, upward_normal
from .mesh_depth import DEEPER, leave_out_far, tells_of_depth, terrain_is_deep
from .mesh_edges import edges_of_leaf, vertices_beside_edges
from .mesh_pieces import box_of, depths, half_diagonal, lowest_corner, node_core, prospects, put_node, turn_round
from .mesh_vertices import faces_of_leaf, list_vertices
from .path import NEAR_MOTIONS
from .smooth_balls import bounds_around, collide_ball
from .smooth_candidates import number_alike, prepare_scratch
from .smooth_curves import LINE, collide_curve
from .smooth_faces import collide_face, put_corner
from .smooth_surface import coefficients_of, jet, patch_of
from .terrain_candidates import PARTS, emit_candidates
from .terrain_shape import in_frame, put_path, rank_by_motion

# Boxes over more cells than this are not compared with every facet: those of their subtrees are.
MOST_CELLS = 12
# ... and over more than this not even with the highest sample.
MOST_SAMPLES = 1 << 12


@kernel
def _is_near(height, n, path, margin, rest):
    """Whether what is this high [m, times the length of n] above a plane with normal n counts as near to it."""
    if height <= 0.0:
        return True
    beyond = max(0.0, height - NEAR_MOTIONS * max(0.0, -vec3.dot(n, path)))
    square = vec3.norm_squared(n)
    return beyond * beyond <= rest * rest * square and height * height <= margin * margin * square


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
                if not _is_near(height + vec3.dot(own, middle) - box, n, path, margin, rest):
                    continue
                if node.count == 0:
                    return True
                if _is_near(height + lowest_corner(vertices, faces, node, own), n, path, margin, rest):
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


@kernel
def _above_spline(patch, c, top, core):
    """What the smooth surface below a node, ``core`` of node_core, does not reach.

    Within a distance r of a point, where the surface has height h, slope g and second derivatives of norm B at most,

        z(x) - h - g . x <= B r^2 / 2,    |n(x) - n| <= B r,

    so a point that is higher than B r^2 / 2 above the tangent plane, along (-g, 1), is at least the rest of it above
    the surface, and closes with it no faster than along n, but for B r times its way.

    Returns:
        Whether the node is not clear as a whole; the highest of the surface [m]; n = (-g, 1), how far along it the
        plane lies [m, times the length of n], and ``rest`` [m] with what the turn of the normal adds. Where nothing
        is known the plane is infinitely high.
    """
    _, _, _, _, _, _, path, rest, lower, upper = core
    level = math.inf
    if lower[2] > top:
        return False, top, vec3.ZERO, level, rest
    middle = (0.5 * (lower[0] + upper[0]), 0.5 * (lower[1] + upper[1]), 0.0)
    wide, deep = 0.5 * (upper[0] - lower[0]), 0.5 * (upper[1] - lower[1])
    highest, bend = bounds_around(patch, c, middle, max(wide, deep))
    if lower[2] > highest:
        return False, highest, vec3.ZERO, level, rest
    inside = lower[0] > patch[0] and lower[1] > patch[1] and upper[0] < patch[6] and upper[1] < patch[7]
    square = wide * wide + deep * deep
    bulge = 0.5 * bend * square
    if not inside or bulge > upper[2] - lower[2]:
        return True, highest, vec3.ZERO, level, rest
    j = jet(patch, c, middle[0], middle[1])
    n = (-j[1], -j[2], 1.0)
    level = vec3.dot(n, (middle[0], middle[1], j[0])) + bulge
    return True, highest, n, level, rest + NEAR_MOTIONS * bend * math.sqrt(square) * vec3.norm(path)


@kernel
def _lowest_of(vertices, faces, node, origin, axes, n):
    """The lowest that a node reaches along n, in the frame of the terrain [m, times the length of n]."""
    own = mat3.apply_transposed(axes, n)
    if node.count > 0:
        return vec3.dot(n, origin) + lowest_corner(vertices, faces, node, own)
    middle, half = box_of(node)
    box = abs(own[0]) * half[0] + abs(own[1]) * half[1] + abs(own[2]) * half[2]
    return vec3.dot(n, origin) + vec3.dot(own, middle) - box


@kernel
def _leaf_on_spline(vertices, faces, node, origin, axes, patch, c, core, highest, n, level, rest, scratch, count):
    """Contacts of one leaf with the smooth surface; return the new count of candidates.

    ``core``: of node_core; ``highest``, ``n``, ``level``, ``rest``: of _above_spline.
    """
    margin, path = core[5], core[6]
    num_vertices = vertices.shape[0]
    num_faces = faces.shape[0]
    for index in range(node.first, node.first + node.count):
        face = faces[index]
        low, high = (math.inf, math.inf), (-math.inf, -math.inf)
        lowest = math.inf
        p = origin
        longest = 0.0
        nearest = math.inf
        for k in range(3):
            number = int(face.vertices[k])
            p = vec3.add(origin, mat3.apply(axes, vec3.load(vertices[number].position)))
            put_corner(scratch, k, p)
            low = (min(low[0], p[0]), min(low[1], p[1]))
            high = (max(high[0], p[0]), max(high[1], p[1]))
            lowest = min(lowest, p[2])
            above = vec3.dot(n, p) - level
            nearest = min(nearest, above)
            if face.flags >> (3 + k) & 1 and p[2] - margin <= highest and _is_near(above, n, path, margin, rest):
                count = collide_ball(patch, c, p, 0.0, number % PARTS, scratch, count)
            local = vec3.load(vertices[face.vertices[(k + 1) % 3]].position)
            b = vec3.sub(vec3.add(origin, mat3.apply(axes, local)), p)
            length = vec3.norm(b)
            longest = max(longest, length)
            low_end = min(above, above + vec3.dot(n, b))
            near = min(p[2], p[2] + b[2]) - margin <= highest and _is_near(low_end, n, path, margin, rest)
            if face.flags >> k & 1 and near:
                u = vec3.scale(1.0 / length, b)
                middle = vec3.add_scaled(p, 0.5, b)
                part = (num_vertices + 3 * index + k) % PARTS
                count = collide_curve(patch, c, LINE, middle, u, u, 0.5 * length, length, 0.0, part, scratch, count)
        if lowest - margin <= highest and _is_near(nearest, n, path, margin, rest):
            own = mat3.apply(axes, vec3.load(face.normal))
            part = (num_vertices + 3 * num_faces + index) % PARTS
            count = collide_face(patch, c, own, p, low, high, 3, 0.0, longest, part, scratch, count)
    return count


@kernel
def collide_mesh_smooth_field(
    position_a,
    rotation_a,
    mesh,
    position_b,
    rotation_b,
    field,
    pool,
    margin,
    flight,
    contacts,
    count,
    scratch,
):
    """Append the contacts of a moving mesh (a) with a smooth height field (b); return the new count.

    Arguments as above; smooth_balls.py and smooth_curves.py say what is exact and what may be missed.
    """
    origin, axes = in_frame(position_a, rotation_a, position_b, rotation_b)
    rows, vertices, faces, nodes = mesh
    scale = half_diagonal(rows[0])
    patch = patch_of(field)
    c = coefficients_of(field, pool)
    seen, falloff, rest, far = prospects(margin, flight, -1.0, position_b, rotation_b)
    found = 0
    while True:
        node = 0
        while node < nodes.shape[0]:
            here = nodes[node]
            core = node_core(vertices, faces, here, origin, axes, margin, rest, seen)
            _, _, _, _, _, reach, path_here, rest_here, _, _ = core
            meets, highest, n, level, near = _above_spline(patch, c, field.highest, core)
            if meets:
                above = _lowest_of(vertices, faces, here, origin, axes, n) - level
                meets = _is_near(above, n, path_here, reach, near)
            if not meets:
                node = int(here.skip)
                continue
            if here.count > 0:
                prepare_scratch(scratch, reach, scale)
                put_path(seen, path_here, rest_here, scratch)
                rank_by_motion(falloff, scratch)
                found = _leaf_on_spline(
                    vertices, faces, here, origin, axes, patch, c, core, highest, n, level, near, scratch, found
                )
            node += 1
        if found > 0 or not rest < far:
            break
        rest = far
    number_alike(scratch, found)
    return emit_candidates(scratch, found, position_b, rotation_b, contacts, count)
