"""A moving mesh against the smooth surface of a height field, leaf by leaf (mesh_pieces.py).

smooth_balls.py and smooth_curves.py say what is exact and what may be missed.
"""

from __future__ import annotations

import math

from ..jit import kernel
from ..maths import mat3, vec3
from .mesh_pieces import box_of, half_diagonal, is_near_plane, lowest_corner, node_core, prospects
from .path import NEAR_MOTIONS
from .smooth_balls import bounds_around, collide_ball
from .smooth_candidates import number_alike, prepare_scratch
from .smooth_curves import LINE, collide_curve
from .smooth_faces import collide_face, put_corner
from .smooth_surface import coefficients_of, jet, patch_of
from .terrain_candidates import PARTS, emit_candidates
from .terrain_shape import in_frame, put_path, rank_by_motion


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
            if face.flags >> (3 + k) & 1 and p[2] - margin <= highest and is_near_plane(above, n, path, margin, rest):
                count = collide_ball(patch, c, p, 0.0, number % PARTS, scratch, count)
            local = vec3.load(vertices[face.vertices[(k + 1) % 3]].position)
            b = vec3.sub(vec3.add(origin, mat3.apply(axes, local)), p)
            length = vec3.norm(b)
            longest = max(longest, length)
            low_end = min(above, above + vec3.dot(n, b))
            near = min(p[2], p[2] + b[2]) - margin <= highest and is_near_plane(low_end, n, path, margin, rest)
            if face.flags >> k & 1 and near:
                u = vec3.scale(1.0 / length, b)
                middle = vec3.add_scaled(p, 0.5, b)
                part = (num_vertices + 3 * index + k) % PARTS
                count = collide_curve(patch, c, LINE, middle, u, u, 0.5 * length, length, 0.0, part, scratch, count)
        if lowest - margin <= highest and is_near_plane(nearest, n, path, margin, rest):
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

    Arguments as in ``collide_mesh_height_field`` (mesh_height_field.py), the shapes in the other order.
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
                meets = is_near_plane(above, n, path_here, reach, near)
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
