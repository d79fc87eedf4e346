"""The edges and vertices that stick out of the listed faces of a mesh (mesh_faces.py).

What sticks out was found when the mesh was prepared (shapes/mesh_preparation.py); the cones are read off the adjacent
faces here.
"""

from __future__ import annotations

from ..jit import kernel
from ..maths import mat3, vec3
from .mesh_faces import listed_face
from .mesh_side import side_of
from .terrain_features import MOST_SPOKES, put_edge
from .terrain_shape import (
    CENTER_ROW,
    END_FEATURE_ROW,
    FIRST_FEATURE_ROW,
    axes_of,
    get,
    girth_of,
    margin_of,
    middle_of,
    motion_of,
    put,
    radius_of,
    scale_of,
)
from .triangle import REGION_SLACK

# An edge whose line enters the solid at less than this angle [rad] goes on straight.
BENT = 1e-9
# Most rows that an edge and a vertex add to the list of features.
ROWS_OF_CORNER = 3 + 1 + MOST_SPOKES


@kernel
def _list_edge(vertices, faces, index, k, two_sided, center, scratch, end):
    """Append edge k of a face to the list of features; return the new end.

    It goes on where its line enters the solid, which the pseudo-normals of its ends tell.
    """
    face = faces[index]
    start = vec3.load(vertices[face.vertices[k]].position)
    e = vec3.sub(vec3.load(vertices[face.vertices[(k + 1) % 3]].position), start)
    length = vec3.norm(e)
    e = vec3.scale(1.0 / length, e)
    n = vec3.load(face.normal)
    m1 = vec3.cross(n, e)
    if face.neighbours[k] >= 0:
        across = vec3.load(faces[face.neighbours[k]].normal)
        m2 = vec3.cross(e, across)
        out = vec3.scale(side_of(vertices, faces, index, two_sided, center), vec3.add(n, across))
    elif two_sided:
        # A rim of a sheet acts all around.
        m2 = m1
        out = vec3.sub(center, start)
        out = vec3.add_scaled(out, -vec3.dot(out, e), e)
    else:
        # A rim: from the face to its plane's outside.
        m2 = vec3.neg(n)
        out = vec3.sub(n, m1)
    following = put_edge(scratch, end, start, e, length, m1, m2, out, 3 * index + k)
    if not two_sided:
        if vec3.dot(e, vec3.load(vertices[face.vertices[k]].normal)) > BENT:
            scratch[end + 1, 6] = motion_of(scratch)
        if vec3.dot(e, vec3.load(vertices[face.vertices[(k + 1) % 3]].normal)) < -BENT:
            scratch[end + 1, 7] = motion_of(scratch)
    return following


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
    out = vec3.load(vertices[number].normal)
    if vertices[number].rim == 1 and two_sided:
        out = vec3.sub(center, v)
    else:
        out = vec3.scale(side_of(vertices, faces, index, two_sided, center), out)
    scratch[end, 0] = row - end - 1
    put(scratch, end, 1, v)
    put(scratch, end, 4, out)
    scratch[end, 7] = number
    return row


@kernel
def _is_near(middle, axes, half, girth, reach, p, e):
    """Whether the segment from p to p + e comes within reach of the box of the core and of its third axis."""
    x = mat3.apply_transposed(axes, vec3.sub(p, middle))
    y = mat3.apply_transposed(axes, e)
    for k in range(3):
        if abs(x[k] + 0.5 * y[k]) > half[k] + reach + 0.5 * abs(y[k]):
            return False
    along = -(x[0] * y[0] + x[1] * y[1])
    square = y[0] * y[0] + y[1] * y[1]
    t = min(max(along / square, 0.0), 1.0) if square > 0.0 else 0.0
    return (x[0] + t * y[0]) ** 2 + (x[1] + t * y[1]) ** 2 <= (girth + reach) * (girth + reach)


@kernel
def list_features(vertices, faces, listed, item, two_sided, scratch):
    """List what sticks out of the listed faces, from corner ``item`` of theirs on.

    Returns:
        End of the list, and the item to go on with; 0 when all are listed.
    """
    center = get(scratch, CENTER_ROW, 0)
    middle = middle_of(scratch)
    axes = axes_of(scratch)
    half = get(scratch, CENTER_ROW, 3)
    girth = girth_of(scratch)
    reach = radius_of(scratch) + margin_of(scratch)
    # With the slack of the regions beside edges and vertices (triangle.py), which the size of the shape covers.
    reach += REGION_SLACK * scale_of(scratch)
    end = FIRST_FEATURE_ROW
    while item < 3 * listed:
        if end + ROWS_OF_CORNER > END_FEATURE_ROW:
            return end, item
        index = listed_face(scratch, item // 3)
        k = item % 3
        flags = faces[index].flags
        if flags >> k & 1 or flags >> (3 + k) & 1:
            p = vec3.load(vertices[faces[index].vertices[k]].position)
            e = vec3.sub(vec3.load(vertices[faces[index].vertices[(k + 1) % 3]].position), p)
            if flags >> k & 1 and _is_near(middle, axes, half, girth, reach, p, e):
                end = _list_edge(vertices, faces, index, k, two_sided, center, scratch, end)
            if flags >> (3 + k) & 1 and _is_near(middle, axes, half, girth, reach, p, vec3.ZERO):
                end = _list_vertex(vertices, faces, index, k, two_sided, center, scratch, end)
        item += 1
    return end, 0
