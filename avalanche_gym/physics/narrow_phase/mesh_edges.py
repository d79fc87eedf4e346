"""The edges of a moving mesh against terrain, and its vertices against the edges of that.

    vertex of the mesh   beside an edge of the terrain
    edge of the mesh     across an edge of the terrain, beside a vertex of the terrain

Two edges that cross behind each other have come through only if the crossing is inside; the nearest point of the
surface tells (mesh_surface.py).
"""

from __future__ import annotations

import math

from ..jit import kernel
from ..maths import mat3, vec3
from .mesh_surface import depth_squared
from .terrain_candidates import CROSSING, EDGE_PLACE, PARTS, POINT, add_candidate, feature_of
from .terrain_features import PARALLEL, TILT, in_edge_cone, in_vertex_cone, into_edge_cone, meet_along
from .terrain_shape import CENTER_ROW, CORNER_ROW, FIRST_FEATURE_ROW, get, margin_of, scale_of
from .triangle import REGION_SLACK

# How far to look for the surface near what seems to have come through a face or edge, in squares of its depth: a little
# more than that, to find at least the face or edge itself.
SEARCH_BEHIND = 1.01

# A point behind a sharp edge is nearer to the faces than to the edge; by more than this factor, and the edge is not the
# way out. It is the sine of half the angle of the sharpest edge that counts when it has come through.
SHARPEST = 0.2
# How much nearer, as a share of the square, another face has to be than one of the edge's own.
OWN_FACE = 1e-6
# A way out that leads along a face at less than this angle [rad] is none for what lies on the face, far from its edge.
GRAZING = 0.02


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
    inside, d = into_edge_cone(scratch, row, d)
    if not inside or not _is_turned_to(d, m1, m2, out, TILT):
        return False, start, d, 0.0
    t, u, gap = meet_along(vec3.sub(p, start), e, b, d)
    if gap > margin_of(scratch):
        return False, start, d, gap
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
def _enters_beside(d, e, m1, m2, square, gap, point, across):
    """Whether what crosses behind an edge along e gets behind both of its faces, though the ``point`` of it that is
    ``-gap`` behind the edge, straight against the way out d, is outside.

    So where the faces meet at less than a right angle and d leads away from the one, along the other. That one has to
    be as near to the point as the edge says, and the edge ``across`` must reach behind it before it leaves the other.
    ``square`` [m^2]: of the distance of the point from the surface.
    """
    n = vec3.cross(e, m1)
    other = vec3.cross(m2, e)
    if vec3.dot(other, d) < vec3.dot(n, d):
        n, other = other, n
    beside = gap * vec3.dot(n, d)
    if beside <= 0.0 or square < (1.0 - OWN_FACE) * beside * beside:
        return False
    begin, b, length = across
    along = vec3.dot(vec3.sub(point, begin), b)
    slope = vec3.dot(n, b)
    if slope > 0.0:
        b = vec3.neg(b)
        along = length - along
    way = length - along
    return beside < way * abs(slope) and gap * vec3.dot(other, d) * abs(slope) + beside * vec3.dot(other, b) < 0.0


@kernel
def _cuts_wedge(d, edge, m1, m2, depth, gap, point, across, slack):
    """Whether a point ``-gap`` behind an edge is nearest to a face of that edge, of which the way out d keeps clear.

    d is at right angles to the edge: how far the point is behind a face is the sine of the angle between d and the
    direction m along that face. Where d leads along the face, the edge across it may lie on the face, or end just
    behind it, as that of a peg against a wall: then the face is the way out. It is none for what reaches farther behind
    the face than d leads, as the edge of a box on the rim of another.

    Args:
        d: unit, from the edge outwards.
        edge, across: (start [m], direction, length [m]) of the edge, and of the one that has crossed it.
        depth: of ``depth_squared`` at the ``point`` [m] of that one.
        slack: [m] below which the point may be on either side of the face.
    """
    square, inside = depth
    start, e, _ = edge
    if not inside and square > slack * slack:
        return _enters_beside(d, e, m1, m2, square, gap, point, across)
    along_1 = vec3.dot(d, m1) ** 2
    along_2 = vec3.dot(d, m2) ** 2
    clear = 1.0 - max(along_1, along_2)
    if clear > GRAZING * GRAZING:
        return inside and square > min(SHARPEST * SHARPEST, (1.0 - OWN_FACE) * clear) * gap * gap
    n = vec3.cross(e, m1) if along_1 > along_2 else vec3.cross(m2, e)
    height = vec3.dot(n, vec3.sub(across[0], start))
    return min(height, height + across[2] * vec3.dot(n, across[1])) < gap


@kernel
def _is_through(row, foot, d, gap, edge, m1, m2, other, two_sided, own, origin, axes, scratch):
    """Whether the crossing of an edge of the mesh ``-gap`` behind one of the terrain means that it has come through.

    Else the terrain's edge bounds a thin wall with the mesh beyond it, or is the next turn of a thread. ``other`` holds
    vertices, faces and nodes of a terrain that is a mesh; a height field has no thin walls, and no nodes. ``own``: the
    same of the mesh; ``edge``, ``m1``, ``m2``: of its edge, as in _cuts_wedge.

    Where the way out leads almost along a face of the edge, that face is near: it is no other way out if the terrain's
    edge is inside the mesh as well, so that each cuts the wedge of the other.
    """
    slack = REGION_SLACK * scale_of(scratch)
    if gap >= -slack or other[2].shape[0] == 0:
        return True
    p = vec3.add_scaled(foot, gap, d)
    middle = get(scratch, CENTER_ROW, 0)
    bound = SEARCH_BEHIND * gap * gap
    depth = depth_squared(other[0], other[1], other[2], two_sided, middle, p, bound)
    if depth[1] and depth[0] > SHARPEST * SHARPEST * gap * gap:
        return True
    across = (get(scratch, row, 1), get(scratch, row, 4), scratch[row, 7])
    if not _cuts_wedge(d, across, get(scratch, row + 1, 0), get(scratch, row + 1, 3), depth, gap, p, edge, slack):
        return False
    q = mat3.apply_transposed(axes, vec3.sub(foot, origin))
    depth = depth_squared(own[0], own[1], own[2], False, q, q, bound)
    return _cuts_wedge(vec3.neg(d), edge, m1, m2, depth, gap, foot, across, slack)


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
                edge = (p, b, own_length)
                own = (vertices, faces, nodes)
                if meets and _is_through(row, foot, d, gap, edge, m1, m2, other, two_sided, own, origin, axes, scratch):
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
