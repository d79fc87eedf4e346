"""The vertices of a moving mesh, and its faces against the vertices of terrain.

A vertex of the terrain that seems to have come through a face belongs to the nearest point of the surface that it can
have come through.
"""

from __future__ import annotations

import math

from ..jit import kernel
from ..maths import mat3, vec3
from ..shapes.static_tree import leaf_within
from .mesh import off_plane, over_face
from .mesh_edges import SEARCH_BEHIND
from .mesh_side import corners_of
from .mesh_surface import base_of
from .terrain_candidates import FACE_PLACE, PARTS, POINT, add_candidate, feature_of
from .terrain_features import TILT, in_vertex_cone
from .terrain_shape import CORNER_ROW, FIRST_FEATURE_ROW, get, margin_of, put_corner, scale_of
from .triangle import REGION_SLACK, closest_point, in_prism

CORNERS_A_TURN = 8


@kernel
def list_vertices(vertices, faces, node, origin, axes, second, item, scratch):
    """List the vertices of a leaf that stick out as corners, from ``item`` on, in the terrain's frame.

    Args:
        second: 1 if the mesh is the second shape of the pair, else 0.

    Returns:
        How many, and the item to go on with; 0 when all are listed.
    """
    count = 0
    while item < 3 * node.count:
        face = faces[node.first + item // 3]
        k = item % 3
        if face.flags >> (3 + k) & 1:
            if count == CORNERS_A_TURN:
                return count, item
            number = int(face.vertices[k])
            point = vec3.add(origin, mat3.apply(axes, vec3.load(vertices[number].position)))
            put_corner(scratch, count, point, (2 * number + second) % PARTS)
            scratch[CORNER_ROW + count, 4] = number
            count += 1
        item += 1
    return count, 0


@kernel
def _comes_from_nearer(vertices, faces, nodes, axes, v, bound, row, scratch):
    """Whether a listed vertex of the terrain, at v inside the mesh, may have come through a face that is nearer than
    the square root of ``bound`` [m^2]: one whose way out its cone holds.

    Beside a rim the side wall is near, but what lies flat on the face has not come through that.
    """
    node = leaf_within(nodes, 0, v, bound)
    while node < nodes.shape[0]:
        here = nodes[node]
        for index in range(here.first, here.first + here.count):
            a, b, c = corners_of(vertices, faces[index])
            nearest, _ = closest_point(v, a, b, c)
            d = vec3.sub(v, nearest)
            square = vec3.norm_squared(d)
            if 0.0 < square < bound:
                d = mat3.apply(axes, vec3.scale(1.0 / math.sqrt(square), d))
                if in_vertex_cone(scratch, row, d, TILT):
                    return True
        node = leaf_within(nodes, node + 1, v, bound)
    return False


@kernel
def faces_of_leaf(vertices, faces, nodes, node, origin, axes, second, end, scratch, count):
    """Contacts of the faces of a leaf with the listed vertices of the terrain."""
    margin = margin_of(scratch)
    scale = scale_of(scratch)
    row = FIRST_FEATURE_ROW
    while row < end:
        spokes = int(scratch[row, 0])
        if spokes == 0:
            row += 3
            continue
        v = mat3.apply_transposed(axes, vec3.sub(get(scratch, row, 1), origin))
        for index in range(node.first, node.first + node.count):
            face = faces[index]
            n = vec3.load(face.normal)
            gap = vec3.dot(n, vec3.sub(v, vec3.load(vertices[face.vertices[0]].position)))
            if gap > margin:
                continue
            a, b, c = corners_of(vertices, face)
            if not in_prism(v, a, b, c, n):
                continue
            if gap < -REGION_SLACK * scale:
                # Behind the face: this one is the way out only if nothing of the surface is nearer that the vertex
                # could come from.
                bound = SEARCH_BEHIND * gap * gap
                base = base_of(vertices, faces, nodes, False, v, v, bound)
                if not over_face(vertices, face, n, base, off_plane(nodes)):
                    if vec3.norm_squared(vec3.sub(base, v)) == 0.0:
                        continue
                    bound = (1.0 - REGION_SLACK) * gap * gap
                    if _comes_from_nearer(vertices, faces, nodes, axes, v, bound, row, scratch):
                        continue
            d = mat3.apply(axes, vec3.neg(n))
            if in_vertex_cone(scratch, row, d, TILT):
                number = (2 * int(scratch[row, 7]) + 1 - second) % PARTS
                feature = feature_of(POINT, number, FACE_PLACE, index)
                position = vec3.add_scaled(get(scratch, row, 1), 0.5 * gap, d)
                count = add_candidate(scratch, count, position, d, gap, feature)
        row += 1 + spokes
    return count
