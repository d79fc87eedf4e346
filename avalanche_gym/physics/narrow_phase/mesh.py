"""Sphere, capsule and box against a triangle mesh.

The same three kinds of contact as for a height field (height_field.py), with the faces found by the mesh's tree. What
sticks out was found when the mesh was prepared (shapes/mesh_preparation.py); the cones are read off the adjacent
faces here.

**A corner behind a face** may have come through it or lie beyond a thin wall. The nearest point of the surface
decides: it is inside if the pseudo-normal there says so (Baerentzen and Aanaes 2005, "Signed distance computation
using the angle weighted pseudonormal"); a rim has no inside. The contacts of a corner that has come through are those
of the nearest point, with its depth.

A sheet (``two_sided``) acts on the side on which the middle of the shape is, face by face.
"""

from __future__ import annotations

import math

from ..jit import kernel
from ..maths import vec3
from ..shapes.static_tree import box_distance_squared, faces_in_box, leaf_near
from .terrain_candidates import FACE_PLACE, POINT, add_candidate, emit_candidates, feature_of
from .terrain_features import MOST_SPOKES, collide_features, put_edge
from .terrain_shape import (
    BOUNDS_ROW,
    CENTER_ROW,
    CORNER_ROW,
    END_FEATURE_ROW,
    END_FREE_ROW,
    FIRST_FEATURE_ROW,
    FIRST_FREE_ROW,
    axis_of,
    get,
    margin_of,
    put,
    put_shape,
    radius_of,
)
from .triangle import EDGE, REGION_SLACK, VERTEX, closest_point, in_prism

# Rows of the scratch table: for each corner the nearest point of the surface if the corner is inside, else the
# corner; the square of the distance to the surface; whether the corner is behind a face; whether it is inside. Then
# faces, eight a row.
BASE_ROW = FIRST_FREE_ROW
FACE_ROW = FIRST_FREE_ROW + 8
# Most rows that an edge and a vertex add to the list of features.
ROWS_OF_CORNER = 3 + 1 + MOST_SPOKES

MARK, NEAREST, TOUCH = 0, 1, 2


@kernel
def corners_of(vertices, face):
    """The three corners of a face [m]."""
    return (
        vec3.load(vertices[face.vertices[0]].position),
        vec3.load(vertices[face.vertices[1]].position),
        vec3.load(vertices[face.vertices[2]].position),
    )


@kernel
def _list_edge(vertices, faces, index, k, two_sided, center, scratch, end):
    """Append edge k of a face to the list of features; return the new end."""
    face = faces[index]
    start = vec3.load(vertices[face.vertices[k]].position)
    e = vec3.sub(vec3.load(vertices[face.vertices[(k + 1) % 3]].position), start)
    length = vec3.norm(e)
    e = vec3.scale(1.0 / length, e)
    n = vec3.load(face.normal)
    m1 = vec3.cross(n, e)
    if face.neighbours[k] >= 0:
        m2 = vec3.cross(e, vec3.load(faces[face.neighbours[k]].normal))
        out = vec3.add(n, vec3.load(faces[face.neighbours[k]].normal))
    else:
        # A rim: from the face to its plane's outside, or all around on a sheet.
        m2 = m1 if two_sided else vec3.neg(n)
        out = vec3.sub(n, m1)
    if two_sided:
        out = vec3.sub(center, start)
        out = vec3.add_scaled(out, -vec3.dot(out, e), e)
    return put_edge(scratch, end, start, e, length, m1, m2, out, 3 * index + k)


@kernel
def _put_spoke(vertices, other, v, scratch, row):
    put(scratch, row, 0, vec3.sub(vec3.load(vertices[other].position), v))


@kernel
def _list_vertex(vertices, faces, index, k, two_sided, center, scratch, end):
    """Append vertex k of a face to the list of features, walking around it; return the new end."""
    number = faces[index].vertices[k]
    v = vec3.load(vertices[number].position)
    row = end + 1
    last = end + MOST_SPOKES
    # Counter-clockwise; if that ends at a rim, clockwise from the first face too. Every face gives the edge that
    # leaves v.
    clockwise = False
    here = int(index)
    corner = k
    while row < last:
        face = faces[here]
        _put_spoke(vertices, face.vertices[(corner + 1) % 3], v, scratch, row)
        row += 1
        following = int(face.neighbours[corner if clockwise else (corner + 2) % 3])
        if following < 0 and not clockwise:
            _put_spoke(vertices, face.vertices[(corner + 2) % 3], v, scratch, row)
            row += 1
            clockwise = True
            following = int(faces[index].neighbours[k])
        if following < 0 or following == index:
            break
        here = following
        corner = 0
        while faces[here].vertices[corner] != number:
            corner += 1
    out = vec3.sub(center, v) if two_sided else vec3.load(vertices[number].normal)
    scratch[end, 0] = row - end - 1
    put(scratch, end, 1, v)
    put(scratch, end, 4, out)
    scratch[end, 7] = number
    return row


@kernel
def _is_inside(vertices, faces, face, side, p, nearest, lies_on):
    """Whether p is on the solid side of the surface, given the point of a face nearest to it and what that lies on."""
    n = vec3.load(face.normal)
    if lies_on >= VERTEX:
        vertex = vertices[face.vertices[lies_on - VERTEX]]
        if vertex.rim == 1:
            return False
        n = vec3.load(vertex.normal)
    elif lies_on >= EDGE:
        across = face.neighbours[lies_on - EDGE]
        if across < 0:
            return False
        n = vec3.add(n, vec3.load(faces[across].normal))
    return side * vec3.dot(n, vec3.sub(p, nearest)) < 0.0


@kernel
def _corners_against_face(vertices, faces, index, side, stage, num_corners, scratch, count):
    """One stage for the corners of the shape and one face; return the count of candidates.

    MARK notes that a corner is behind a face, NEAREST looks for the nearest point of the surface, TOUCH adds the
    contacts.
    """
    face = faces[index]
    a, b, c = corners_of(vertices, face)
    n = vec3.scale(side, vec3.load(face.normal))
    radius = radius_of(scratch)
    reach = radius + margin_of(scratch)
    for corner in range(num_corners):
        p = get(scratch, CORNER_ROW + corner, 0)
        row = BASE_ROW + corner
        height = vec3.dot(n, vec3.sub(p, a))
        if stage == MARK:
            if height < 0.0:
                scratch[row, 4] = 1.0
        elif stage == NEAREST:
            if scratch[row, 4] == 1.0 and height * height < scratch[row, 3]:
                nearest, lies_on = closest_point(p, a, b, c)
                square = vec3.norm_squared(vec3.sub(p, nearest))
                if square < scratch[row, 3]:
                    scratch[row, 3] = square
                    inside = _is_inside(vertices, faces, face, side, p, nearest, lies_on)
                    put(scratch, row, 0, nearest if inside else p)
                    scratch[row, 5] = 1.0 if inside else 0.0
        elif height <= reach:
            base = get(scratch, row, 0)
            over = vec3.dot(n, vec3.sub(base, a))
            if over >= 0.0 or over * over <= REGION_SLACK * REGION_SLACK * vec3.norm_squared(vec3.sub(b, a)):
                if in_prism(base, a, b, c, vec3.load(face.normal)):
                    gap = height - radius
                    position = vec3.add_scaled(p, -(radius + 0.5 * gap), n)
                    feature = feature_of(POINT, int(scratch[CORNER_ROW + corner, 3]), FACE_PLACE, index)
                    count = add_candidate(scratch, count, position, n, gap, feature)
    return count


@kernel
def nearest_face(vertices, faces, nodes, p, best):
    """The face nearest to p, if one is nearer than the square root of ``best`` [m^2].

    Returns:
        Its index, or -1; the nearest point and what it lies on.
    """
    found = -1
    point = p
    feature = 0
    node = 0
    while node < nodes.shape[0]:
        here = nodes[node]
        if box_distance_squared(here, p) >= best:
            node = int(here.skip)
            continue
        for index in range(here.first, here.first + here.count):
            a, b, c = corners_of(vertices, faces[index])
            nearest, lies_on = closest_point(p, a, b, c)
            square = vec3.norm_squared(vec3.sub(p, nearest))
            if square < best:
                best = square
                found = index
                point = nearest
                feature = lies_on
        node += 1
    return found, point, feature


@kernel
def _confirm_inside(vertices, faces, nodes, two_sided, num_corners, scratch):
    """Corners that seem to be inside from the listed faces: the nearest face may not be among these."""
    center = get(scratch, CENTER_ROW, 0)
    for corner in range(num_corners):
        row = BASE_ROW + corner
        if scratch[row, 5] == 1.0:
            p = get(scratch, CORNER_ROW + corner, 0)
            index, nearest, lies_on = nearest_face(vertices, faces, nodes, p, scratch[row, 3])
            if index >= 0:
                face = faces[index]
                a = vec3.load(vertices[face.vertices[0]].position)
                behind = two_sided and vec3.dot(vec3.load(face.normal), vec3.sub(center, a)) < 0.0
                inside = _is_inside(vertices, faces, face, -1.0 if behind else 1.0, p, nearest, lies_on)
                put(scratch, row, 0, nearest if inside else p)


@kernel
def _push_out(vertices, faces, nodes, scratch):
    """A shape with its middle deep in a solid: one candidate, towards the nearest point of the surface."""
    center = get(scratch, CENTER_ROW, 0)
    # Any vertex near by gives the search its bound; a little more, to find at least that one.
    near = vertices[faces[nodes[leaf_near(nodes, center)].first].vertices[0]]
    bound = 1.001 * vec3.norm_squared(vec3.sub(center, vec3.load(near.position)))
    index, nearest, lies_on = nearest_face(vertices, faces, nodes, center, bound)
    if index < 0 or not _is_inside(vertices, faces, faces[index], 1.0, center, nearest, lies_on):
        return 0
    normal = vec3.sub(nearest, center)
    depth = vec3.norm(normal)
    normal = vec3.scale(1.0 / depth, normal)
    reach = radius_of(scratch)
    for axis in range(3):
        reach += abs(vec3.dot(axis_of(scratch, axis), normal)) * scratch[CENTER_ROW, 3 + axis]
    position = vec3.add_scaled(center, 0.5 * (depth - reach), normal)
    return add_candidate(scratch, 0, position, normal, -depth - reach, 0)


@kernel
def _meets_bounds(vertices, face, scratch):
    """Whether the box of a face meets that of the shape."""
    a, b, c = corners_of(vertices, face)
    low = vec3.min_(vec3.min_(a, b), c)
    high = vec3.max_(vec3.max_(a, b), c)
    return (
        low[0] <= scratch[BOUNDS_ROW, 3]
        and low[1] <= scratch[BOUNDS_ROW, 4]
        and low[2] <= scratch[BOUNDS_ROW, 5]
        and high[0] >= scratch[BOUNDS_ROW, 0]
        and high[1] >= scratch[BOUNDS_ROW, 1]
        and high[2] >= scratch[BOUNDS_ROW, 2]
    )


@kernel
def _meet(vertices, faces, listed, stage, two_sided, shape, num_corners, scratch, count):
    """One stage for the listed faces; the first one handles edges and vertices as well, and thins out the list.

    Returns:
        Number of faces still listed, and the new count of candidates.
    """
    center = get(scratch, CENTER_ROW, 0)
    reach = radius_of(scratch) + margin_of(scratch)
    end = FIRST_FEATURE_ROW
    kept = 0
    for item in range(listed):
        index = int(scratch[FACE_ROW + (item >> 3), item & 7])
        face = faces[index]
        n = vec3.load(face.normal)
        height = vec3.dot(n, vec3.sub(center, vec3.load(vertices[face.vertices[0]].position)))
        side = -1.0 if two_sided and height < 0.0 else 1.0
        if stage == MARK:
            extent = reach
            for axis in range(3):
                extent += abs(vec3.dot(axis_of(scratch, axis), n)) * scratch[CENTER_ROW, 3 + axis]
            if side * height > extent or not _meets_bounds(vertices, face, scratch):
                continue
            scratch[FACE_ROW + (kept >> 3), kept & 7] = index
            for k in range(3):
                if face.flags >> k & 1:
                    end = _list_edge(vertices, faces, index, k, two_sided, center, scratch, end)
                if face.flags >> (3 + k) & 1:
                    end = _list_vertex(vertices, faces, index, k, two_sided, center, scratch, end)
                if end + ROWS_OF_CORNER > END_FEATURE_ROW:
                    count = collide_features(scratch, end, shape, count)
                    end = FIRST_FEATURE_ROW
        kept += 1
        count = _corners_against_face(vertices, faces, index, side, stage, num_corners, scratch, count)
    if stage == MARK:
        count = collide_features(scratch, end, shape, count)
    return kept, count


@kernel
def collide_mesh(
    shape_a,
    position_a,
    rotation_a,
    size_a,
    position_b,
    rotation_b,
    mesh,
    vertices,
    faces,
    nodes,
    margin,
    contacts,
    count,
    scratch,
):
    """Append the contacts of a sphere, capsule or box with a mesh; return the new count.

    Args:
        shape_a: code of the shape.
        position_a, rotation_a, size_a: its place [m], body-to-world matrix and size.
        position_b, rotation_b: place of the mesh.
        mesh: its MESH_ROW.
        vertices, faces, nodes: pools of VERTEX_ROW, FACE_ROW, NODE_ROW.
        margin: [m] contacts farther apart are left out.
        contacts, count: as in ``manifold.emit``.
        scratch: (256, 8), overwritten.
    """
    num_corners = put_shape(shape_a, position_a, rotation_a, size_a, position_b, rotation_b, margin, scratch)
    center = get(scratch, CENTER_ROW, 0)
    lower = get(scratch, BOUNDS_ROW, 0)
    upper = get(scratch, BOUNDS_ROW, 3)
    vertices = vertices[mesh.first_vertex : mesh.first_vertex + mesh.num_vertices]
    faces = faces[mesh.first_face : mesh.first_face + mesh.num_faces]
    nodes = nodes[mesh.first_node : mesh.first_node + mesh.num_nodes]
    two_sided = mesh.two_sided == 1
    for corner in range(num_corners):
        put(scratch, BASE_ROW + corner, 0, get(scratch, CORNER_ROW + corner, 0))
        scratch[BASE_ROW + corner, 3] = math.inf
        scratch[BASE_ROW + corner, 4] = 0.0
        scratch[BASE_ROW + corner, 5] = 0.0
    found = 0
    listed = 0
    node = 0
    complete = False
    for stage in range(3):
        behind = 0.0
        for corner in range(num_corners):
            behind += scratch[BASE_ROW + corner, 4]
        if (stage == NEAREST and behind == 0.0) or (complete and listed == 0):
            continue
        if not complete:
            node = 0
        while True:
            if not complete:
                complete = node == 0
                listed, node = faces_in_box(nodes, node, lower, upper, scratch, FACE_ROW, END_FREE_ROW)
                complete &= node == nodes.shape[0]
            kept, found = _meet(vertices, faces, listed, stage, two_sided, shape_a, num_corners, scratch, found)
            listed = kept
            if node == nodes.shape[0]:
                break
        if stage == NEAREST:
            _confirm_inside(vertices, faces, nodes, two_sided, num_corners, scratch)
    if (
        found == 0
        and mesh.closed == 1
        and mesh.lower[0] < center[0] < mesh.upper[0]
        and mesh.lower[1] < center[1] < mesh.upper[1]
        and mesh.lower[2] < center[2] < mesh.upper[2]
    ):
        found = _push_out(vertices, faces, nodes, scratch)
    return emit_candidates(scratch, found, position_b, rotation_b, contacts, count)
