"""Whether a moving mesh and its terrain overlap deeper than what is listed near the leaves lets them see.

The leaves of a mesh are a thin shell: what the terrain has deep inside is as far from them as what it has far outside,
and is not listed with what is near. But every part that lies deep comes in through the surface somewhere. From
shallow to deep it either has a contact that is known, or an edge that leads there within a single face. So the shell is
made thicker only where one of these is found, as long as it is, and the search costs what really overlaps.
"""

from __future__ import annotations

from ..jit import kernel
from ..maths import mat3, vec3
from .mesh_faces import listed_face
from .mesh_side import corners_of, side_of
from .terrain_shape import CENTER_ROW, FIRST_FEATURE_ROW, get
from .triangle import in_prism

# A contact that is open by less than minus this share of how deep is seen, or an edge that is there and leads on to
# more than all of it, tells that more may lie deeper.
SHALLOW = 0.5
# So many times as deep the next search looks. Larger: more triangles at once; smaller: more searches.
DEEPER = 4.0


@kernel
def _leads_deep(p, q, a, b, c, n, seen):
    """Whether a segment from p to q, under a face with normal n, leads from shallow to deeper than ``seen`` [m]."""
    high = vec3.dot(n, vec3.sub(p, a))
    low = vec3.dot(n, vec3.sub(q, a))
    if high < low:
        high, low = low, high
        p, q = q, p
    level = -SHALLOW * seen
    if low >= -seen or high <= level:
        return False
    return in_prism(vec3.add_scaled(p, (high - level) / (high - low), vec3.sub(q, p)), a, b, c, n)


@kernel
def terrain_is_deep(vertices, faces, node, origin, axes, end, scratch, seen):
    """Whether a listed edge of the terrain, up to row ``end``, leads on deep behind a face of a leaf of the mesh."""
    row = FIRST_FEATURE_ROW
    while row < end:
        spokes = int(scratch[row, 0])
        if spokes > 0:
            row += 1 + spokes
            continue
        start = get(scratch, row, 1)
        stop = vec3.add_scaled(start, scratch[row, 7], get(scratch, row, 4))
        start = mat3.apply_transposed(axes, vec3.sub(start, origin))
        stop = mat3.apply_transposed(axes, vec3.sub(stop, origin))
        for index in range(node.first, node.first + node.count):
            a, b, c = corners_of(vertices, faces[index])
            if _leads_deep(start, stop, a, b, c, vec3.load(faces[index].normal), seen):
                return True
        row += 3
    return False


@kernel
def leaf_is_deep(mesh, node, origin, axes, other_vertices, other_faces, listed, two_sided, scratch, seen):
    """Whether an edge of a leaf that sticks out leads on deep behind a listed face of a terrain that is a mesh.

    ``mesh``: vertices and faces of the leaf.
    """
    vertices, faces = mesh
    center = get(scratch, CENTER_ROW, 0)
    for item in range(3 * node.count):
        face = faces[node.first + item // 3]
        k = item % 3
        if not face.flags >> k & 1:
            continue
        p = vec3.add(origin, mat3.apply(axes, vec3.load(vertices[face.vertices[k]].position)))
        q = vec3.add(origin, mat3.apply(axes, vec3.load(vertices[face.vertices[(k + 1) % 3]].position)))
        for place in range(listed):
            number = listed_face(scratch, place)
            a, b, c = corners_of(other_vertices, other_faces[number])
            side = side_of(other_vertices, other_faces, number, two_sided, center)
            n = vec3.scale(side, vec3.load(other_faces[number].normal))
            if _leads_deep(p, q, a, b, c, n, seen):
                return True
    return False


@kernel
def tells_of_depth(scratch, count, seen):
    """Whether one of the candidates is so deep that more may lie deeper than ``seen`` [m]."""
    lowest = 0.0
    for index in range(count):
        lowest = min(lowest, scratch[index, 6])
    return lowest < -SHALLOW * seen


@kernel
def leave_out_far(scratch, count, margin):
    """Keep the candidates that are open by ``margin`` [m] at most: a deep search finds others; return their number."""
    kept = 0
    for index in range(count):
        if scratch[index, 6] <= margin:
            for k in range(8):
                scratch[kept, k] = scratch[index, k]
            kept += 1
    return kept
