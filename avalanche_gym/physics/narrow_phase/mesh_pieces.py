"""A moving mesh as terrain sees it: the leaves of its tree that are near, one after the other.

A leaf takes the place of the moving shape of terrain_shape.py: the box around its few faces, their vertices and edges
that stick out, and the faces themselves. Each vertex and edge belongs to one face, hence to one leaf, so nothing is
found twice. What a leaf lists of the terrain lies near the leaf: the cost is that of the triangles near the contact.

Contacts are pairs of features whose cones hold the normal, as everywhere on terrain:

    vertex of the mesh   over a face of the terrain (done by the terrain), beside an edge of the terrain
    edge of the mesh     across an edge of the terrain, beside a vertex of the terrain
    face of the mesh     over a vertex of the terrain

The cone of the terrain's feature holds the normal exactly. That of the mesh may miss it by ``TILT``, so that a mesh
that lies flat keeps all of its support whatever round-off does.

Features: a vertex that slides over faces is named by twice its number, plus one if it belongs to the second shape of
the pair; then the face turns the normal, and belongs to the other shape.
"""

from __future__ import annotations

import math

import numpy as np

from ..jit import kernel
from ..maths import mat3, vec3
from ..model import PLACE_BITS, SLIDING
from ..shapes.static_tree import box_distance_squared
from .mesh import over_face
from .mesh_surface import base_of, corners_of
from .path import NEAR_MOTIONS, displacement
from .terrain_candidates import (
    CROSSING,
    EDGE_PLACE,
    FACE_PLACE,
    PARTS,
    POINT,
    add_candidate,
    feature_of,
)
from .terrain_features import PARALLEL, TILT, in_edge_cone, in_vertex_cone
from .terrain_shape import (
    BOUNDS_ROW,
    CENTER_ROW,
    CORNER_ROW,
    FIRST_FEATURE_ROW,
    get,
    margin_of,
    put,
    put_core,
    put_corner,
    put_path,
    rank_by_motion,
    scale_of,
    set_scale,
)
from .triangle import REGION_SLACK, closest_point, in_prism

CORNERS_A_TURN = 8

# What is within this share of the margin is listed whatever moves; path.py says how much farther it counts. Larger:
# more triangles to look at; smaller: a mesh that is struck by another in the step may dip by that much.
NEAR_MARGIN = 0.25
# Share of the motion within a step by which impulses spoil what is foreseen of the gaps: contacts that are farther open
# than that count less. Larger: near contacts give way to far ones that do not close.
FORESEEN = 0.1

# How far to look for the surface near what seems to have come through a face or edge, in squares of its depth: a little
# more than that, to find at least the face or edge itself.
SEARCH_BEHIND = 1.01

# A point behind a sharp edge is nearer to the faces than to the edge; by more than this factor, and the edge is not the
# way out. It is the sine of half the angle of the sharpest edge that counts when it has come through.
SHARPEST = 0.2
# How much nearer, as a share of the square, another face has to be than one of the edge's own.
OWN_FACE = 1e-6
# A way out that leads along a face at less than this angle [rad] is none: what lies on the face is far from its edge.
GRAZING = 0.02


@kernel
def half_diagonal(mesh):
    """[m] of the box around a mesh: the scale of its tolerances."""
    return 0.5 * vec3.norm(vec3.sub(vec3.load(mesh.upper), vec3.load(mesh.lower)))


@kernel
def near_margin(margin, loose):
    """[m] within which contacts are looked for first, beside what the path says."""
    return min(margin, NEAR_MOTIONS * loose + NEAR_MARGIN * margin)


@kernel
def far_margin(margin, motion, loose):
    """[m] the same where nothing is that near: another body may come and push."""
    return min(margin, margin - motion + NEAR_MOTIONS * loose)


@kernel
def falloff_by(margin, motion):
    """[m] from which on contacts that are open at the end of the step count less (terrain_candidates.py)."""
    return FORESEEN * motion + NEAR_MARGIN * margin


@kernel
def box_of(node):
    """Middle and half extents [m] of the box of a tree node, in the mesh's frame."""
    lower = (np.float64(node.lower[0]), np.float64(node.lower[1]), np.float64(node.lower[2]))
    upper = (np.float64(node.upper[0]), np.float64(node.upper[1]), np.float64(node.upper[2]))
    return vec3.scale(0.5, vec3.add(lower, upper)), vec3.scale(0.5, vec3.sub(upper, lower))


@kernel
def node_core(vertices, faces, node, origin, axes, margin, rest, seen):
    """A node of the moving mesh as ``list_near`` (mesh_features.py) asks for it, the bounds drawn to what it can meet.

    Args:
        node: NODE_ROW of the mesh.
        origin, axes: place of the mesh in the terrain's frame.
        margin: [m] of the query.
        rest: [m] how near counts whatever moves.
        seen: path of the mesh in the terrain's frame (path.py).
    """
    middle, half = box_of(node)
    center = vec3.add(origin, mat3.apply(axes, middle))
    path = displacement(seen, center)
    rest = min(margin, rest + NEAR_MOTIONS * math.sqrt(vec3.norm_squared(seen[1]) * vec3.norm_squared(half)))
    far = NEAR_MOTIONS * vec3.norm(path)
    margin = min(margin, far + rest)
    low = center
    high = center
    if node.count > 0:
        for index in range(node.first, node.first + node.count):
            face = faces[index]
            for k in range(3):
                local = vec3.load(vertices[face.vertices[k]].position)
                p = vec3.add(origin, mat3.apply(axes, local))
                low = vec3.min_(low, p)
                high = vec3.max_(high, p)
    else:
        extent = (
            abs(axes[0]) * half[0] + abs(axes[1]) * half[1] + abs(axes[2]) * half[2],
            abs(axes[3]) * half[0] + abs(axes[4]) * half[1] + abs(axes[5]) * half[2],
            abs(axes[6]) * half[0] + abs(axes[7]) * half[1] + abs(axes[8]) * half[2],
        )
        low = vec3.sub(center, extent)
        high = vec3.add(center, extent)
    # The ball of path.py, and the margin where that is less.
    ball = 0.5 * far + rest
    ahead = vec3.scale(0.5 * NEAR_MOTIONS, path)
    reach = (margin, margin, margin)
    lower = vec3.max_(vec3.sub(low, reach), vec3.sub(vec3.add(low, ahead), (ball, ball, ball)))
    upper = vec3.min_(vec3.add(high, reach), vec3.add(vec3.add(high, ahead), (ball, ball, ball)))
    girth = math.sqrt(half[0] * half[0] + half[1] * half[1])
    return center, axes, half, girth, 0.0, margin, path, rest, lower, upper


@kernel
def put_node(core, seen, scale, falloff, scratch):
    """Describe a node, ``core`` of node_core, in the scratch table; ``scale`` [m] is the size of the mesh."""
    center, axes, half, _, _, margin, path, rest, lower, upper = core
    put_core(center, axes, half, 0.0, margin, scratch)
    put(scratch, BOUNDS_ROW, 0, lower)
    put(scratch, BOUNDS_ROW, 3, upper)
    put_path(seen, path, rest, scratch)
    set_scale(scale, scratch)
    rank_by_motion(falloff, scratch)


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
def vertices_beside_edges(vertices, axes, num_corners, end, scratch, count):
    """Contacts of the listed vertices with listed edges of the terrain that are nearest to them."""
    margin = margin_of(scratch)
    row = FIRST_FEATURE_ROW
    while row < end:
        spokes = int(scratch[row, 0])
        if spokes > 0:
            row += 1 + spokes
            continue
        start = get(scratch, row, 1)
        e = get(scratch, row, 4)
        length = scratch[row, 7]
        for number in range(CORNER_ROW, CORNER_ROW + num_corners):
            p = get(scratch, number, 0)
            r = vec3.sub(p, start)
            t = vec3.dot(r, e)
            if abs(t - 0.5 * length) > (0.5 + REGION_SLACK) * length:
                continue
            d = vec3.add_scaled(r, -t, e)
            square = vec3.norm_squared(d)
            if square > margin * margin or square == 0.0:
                continue
            gap = math.sqrt(square)
            d = vec3.scale(1.0 / gap, d)
            if not in_edge_cone(scratch, row, d):
                continue
            out = mat3.apply(axes, vec3.load(vertices[int(scratch[number, 4])].normal))
            if vec3.dot(out, d) < 0.0:
                feature = feature_of(POINT, int(scratch[number, 3]), EDGE_PLACE, int(scratch[row + 2, 3]))
                count = add_candidate(scratch, count, vec3.add_scaled(p, -0.5 * gap, d), d, gap, feature)
        row += 3
    return count


@kernel
def _is_turned_to(d, m1, m2, out, slack):
    """Whether an edge of the mesh, with these directions into its faces, can touch what lies along -d."""
    return vec3.dot(d, m1) >= -slack and vec3.dot(d, m2) >= -slack and vec3.dot(d, out) < 0.0


@kernel
def _cross(scratch, row, p, b, own_length, m1, m2, out):
    """An edge of the mesh across one of the terrain: whether they touch, the terrain's point, the normal, the gap."""
    start = get(scratch, row, 1)
    e = get(scratch, row, 4)
    length = scratch[row, 7]
    apart = vec3.sub(vec3.add_scaled(p, 0.5 * own_length, b), vec3.add_scaled(start, 0.5 * length, e))
    far = 0.5 * (length + own_length) + margin_of(scratch)
    d = vec3.cross(e, b)
    sine_squared = vec3.norm_squared(d)
    if vec3.norm_squared(apart) > far * far or sine_squared < PARALLEL * PARALLEL:
        return False, start, d, 0.0
    d = vec3.scale(math.copysign(1.0, vec3.dot(d, get(scratch, row + 2, 0))) / math.sqrt(sine_squared), d)
    r = vec3.sub(p, start)
    gap = vec3.dot(r, d)
    if gap > margin_of(scratch) or not _is_turned_to(d, m1, m2, out, TILT) or not in_edge_cone(scratch, row, d):
        return False, start, d, gap
    cosine = vec3.dot(e, b)
    along_e = vec3.dot(r, e)
    along_b = vec3.dot(r, b)
    t = (along_e - cosine * along_b) / sine_squared
    u = (cosine * along_e - along_b) / sine_squared
    meets = (
        abs(t - 0.5 * length) <= (0.5 + REGION_SLACK) * length
        and abs(u - 0.5 * own_length) <= (0.5 + REGION_SLACK) * own_length
    )
    return meets, vec3.add_scaled(start, t, e), d, gap


@kernel
def _beside_edge(scratch, row, p, b, own_length, m1, m2, out):
    """An edge of the mesh beside a vertex of the terrain: whether they touch, the normal, the gap."""
    v = get(scratch, row, 1)
    r = vec3.sub(p, v)
    t = -vec3.dot(r, b)
    if abs(t - 0.5 * own_length) > (0.5 + REGION_SLACK) * own_length:
        return False, r, 0.0
    d = vec3.add_scaled(r, t, b)
    square = vec3.norm_squared(d)
    margin = margin_of(scratch)
    if square > margin * margin or square == 0.0:
        return False, r, 0.0
    gap = math.sqrt(square)
    d = vec3.scale(1.0 / gap, d)
    meets = _is_turned_to(d, m1, m2, out, REGION_SLACK) and in_vertex_cone(scratch, row, d, REGION_SLACK)
    return meets, d, gap


@kernel
def _cuts_wedge(d, m1, m2, square, gap):
    """Whether a point ``-gap`` behind an edge, at this squared distance [m^2] from the surface around it, is nearest to
    a face of that edge, of which the way out d keeps clear.

    d is at right angles to the edge: how far the point is behind a face is the sine of the angle between d and the
    direction m along that face.
    """
    along = max(vec3.dot(d, m1) ** 2, vec3.dot(d, m2) ** 2)
    share = min(SHARPEST * SHARPEST, (1.0 - OWN_FACE) * (1.0 - along))
    return square > max(share, GRAZING * GRAZING) * gap * gap


@kernel
def _is_through(row, foot, d, gap, m1, m2, other, two_sided, own, origin, axes, scratch):
    """Whether the crossing of an edge of the mesh ``-gap`` behind one of the terrain means that it has come through.

    Else the terrain's edge bounds a thin wall with the mesh beyond it, or is the next turn of a thread. ``other`` holds
    vertices, faces and nodes of a terrain that is a mesh; a height field has no thin walls, and no nodes. ``own``: the
    same of the mesh; ``m1``, ``m2``: of its edge.

    Where the way out leads almost along a face of the edge, that face is near: it is no other way out if the terrain's
    edge is inside the mesh as well, so that each cuts the wedge of the other.
    """
    if gap >= -REGION_SLACK * scale_of(scratch) or other[2].shape[0] == 0:
        return True
    p = vec3.add_scaled(foot, gap, d)
    middle = get(scratch, CENTER_ROW, 0)
    bound = SEARCH_BEHIND * gap * gap
    base = base_of(other[0], other[1], other[2], two_sided, middle, p, bound)
    square = vec3.norm_squared(vec3.sub(base, p))
    if square > SHARPEST * SHARPEST * gap * gap:
        return True
    if not _cuts_wedge(d, get(scratch, row + 1, 0), get(scratch, row + 1, 3), square, gap):
        return False
    q = mat3.apply_transposed(axes, vec3.sub(foot, origin))
    base = base_of(own[0], own[1], own[2], False, q, q, bound)
    return _cuts_wedge(d, m1, m2, vec3.norm_squared(vec3.sub(base, q)), gap)


@kernel
def edges_of_leaf(vertices, faces, nodes, node, origin, axes, second, other, two_sided, end, scratch, count):
    """Contacts of the edges of a leaf with the listed edges and vertices of the terrain; ``other``: of _is_through."""
    if end == FIRST_FEATURE_ROW:
        return count
    for item in range(3 * node.count):
        index = node.first + item // 3
        face = faces[index]
        k = item % 3
        if not face.flags >> k & 1 or face.neighbours[k] < 0:
            continue
        local = vec3.load(vertices[face.vertices[k]].position)
        b = mat3.apply(axes, vec3.sub(vec3.load(vertices[face.vertices[(k + 1) % 3]].position), local))
        p = vec3.add(origin, mat3.apply(axes, local))
        own_length = vec3.norm(b)
        b = vec3.scale(1.0 / own_length, b)
        n1 = mat3.apply(axes, vec3.load(face.normal))
        n2 = mat3.apply(axes, vec3.load(faces[face.neighbours[k]].normal))
        m1 = vec3.cross(n1, b)
        m2 = vec3.cross(b, n2)
        out = vec3.add(n1, n2)
        part = (3 * index + k) % PARTS
        row = FIRST_FEATURE_ROW
        while row < end:
            spokes = int(scratch[row, 0])
            if spokes == 0:
                meets, foot, d, gap = _cross(scratch, row, p, b, own_length, m1, m2, out)
                if meets and _is_through(
                    row, foot, d, gap, m1, m2, other, two_sided, (vertices, faces, nodes), origin, axes, scratch
                ):
                    feature = feature_of(CROSSING, part, EDGE_PLACE, int(scratch[row + 2, 3]))
                    count = add_candidate(scratch, count, vec3.add_scaled(foot, 0.5 * gap, d), d, gap, feature)
                row += 3
                continue
            meets, d, gap = _beside_edge(scratch, row, p, b, own_length, m1, m2, out)
            if meets:
                number = int(scratch[row, 7])
                feature = feature_of(POINT, (2 * number + 1 - second) % PARTS, EDGE_PLACE, part)
                position = vec3.add_scaled(get(scratch, row, 1), 0.5 * gap, d)
                count = add_candidate(scratch, count, position, d, gap, feature)
            row += 1 + spokes
    return count


@kernel
def _comes_from_nearer(vertices, faces, nodes, axes, v, bound, row, scratch):
    """Whether a listed vertex of the terrain, at v inside the mesh, may have come through a face that is nearer than
    the square root of ``bound`` [m^2]: one whose way out its cone holds.

    Beside a rim the side wall is near, but what lies flat on the face has not come through that.
    """
    node = 0
    while node < nodes.shape[0]:
        here = nodes[node]
        if box_distance_squared(here, v) >= bound:
            node = int(here.skip)
            continue
        for index in range(here.first, here.first + here.count):
            a, b, c = corners_of(vertices, faces[index])
            nearest, _ = closest_point(v, a, b, c)
            d = vec3.sub(v, nearest)
            square = vec3.norm_squared(d)
            if 0.0 < square < bound:
                d = mat3.apply(axes, vec3.scale(1.0 / math.sqrt(square), d))
                if in_vertex_cone(scratch, row, d, TILT):
                    return True
        node += 1
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
                if not over_face(vertices, face, n, base):
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


@kernel
def turn_round(contacts, first, count):
    """Reverse the normals of the contacts from ``first`` on: the terrain was the first shape of the pair."""
    for index in range(first, min(count, contacts.shape[0])):
        vec3.store(contacts[index].normal, vec3.neg(vec3.load(contacts[index].normal)))


@kernel
def is_crossing(feature):
    """Whether a contact of a mesh belongs to two crossing edges."""
    return feature < SLIDING and (feature >> PLACE_BITS) // PARTS == CROSSING


@kernel
def is_of_second(feature):
    """Whether the vertex of a contact belongs to the second shape of the pair, so that the first carries the normal."""
    return feature >> PLACE_BITS & 1 == 1
