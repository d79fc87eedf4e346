"""The faces of a mesh near a shape, and the edges and vertices of theirs that stick out.

What sticks out was found when the mesh was prepared (shapes/mesh_preparation.py); the cones are read off the adjacent
faces here. Numbers of faces lie in the scratch table from FACE_ROW on, eight a row.
"""

from __future__ import annotations

from ..jit import kernel
from ..maths import vec3
from ..shapes.static_tree import faces_in_box
from .mesh_surface import corners_of, side_of
from .terrain_features import MOST_SPOKES, put_edge
from .terrain_shape import (
    BOUNDS_ROW,
    CENTER_ROW,
    END_FEATURE_ROW,
    END_FREE_ROW,
    FIRST_FEATURE_ROW,
    FIRST_FREE_ROW,
    axis_of,
    get,
    margin_of,
    put,
    radius_of,
)

# Eight rows before are for the corners of the shape (mesh.py).
FACE_ROW = FIRST_FREE_ROW + 8
# Most rows that an edge and a vertex add to the list of features.
ROWS_OF_CORNER = 3 + 1 + MOST_SPOKES


@kernel
def listed_face(scratch, item):
    """Number of the face at this place of the list."""
    return int(scratch[FACE_ROW + (item >> 3), item & 7])


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
def list_faces(vertices, faces, nodes, node, two_sided, scratch):
    """List the faces that the shape can touch, from a node of the tree on.

    Returns:
        Their number, and the node to go on with; ``nodes.shape[0]`` when all are listed.
    """
    center = get(scratch, CENTER_ROW, 0)
    lower = get(scratch, BOUNDS_ROW, 0)
    upper = get(scratch, BOUNDS_ROW, 3)
    reach = radius_of(scratch) + margin_of(scratch)
    listed, node = faces_in_box(nodes, node, lower, upper, scratch, FACE_ROW, END_FREE_ROW)
    kept = 0
    for item in range(listed):
        index = listed_face(scratch, item)
        face = faces[index]
        n = vec3.load(face.normal)
        height = vec3.dot(n, vec3.sub(center, vec3.load(vertices[face.vertices[0]].position)))
        extent = reach
        for axis in range(3):
            extent += abs(vec3.dot(axis_of(scratch, axis), n)) * scratch[CENTER_ROW, 3 + axis]
        if side_of(vertices, face, two_sided, center) * height <= extent and _meets_bounds(vertices, face, scratch):
            scratch[FACE_ROW + (kept >> 3), kept & 7] = index
            kept += 1
    return kept, node


@kernel
def list_features(vertices, faces, listed, item, two_sided, scratch):
    """List what sticks out of the listed faces, from corner ``item`` of theirs on.

    Returns:
        End of the list, and the item to go on with; 0 when all are listed.
    """
    center = get(scratch, CENTER_ROW, 0)
    end = FIRST_FEATURE_ROW
    while item < 3 * listed:
        if end + ROWS_OF_CORNER > END_FEATURE_ROW:
            return end, item
        index = listed_face(scratch, item // 3)
        k = item % 3
        flags = faces[index].flags
        if flags >> k & 1:
            end = _list_edge(vertices, faces, index, k, two_sided, center, scratch, end)
        if flags >> (3 + k) & 1:
            end = _list_vertex(vertices, faces, index, k, two_sided, center, scratch, end)
        item += 1
    return end, 0
