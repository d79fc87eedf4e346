"""Inside or outside of a mesh, and the way to its surface.

The nearest point of the surface decides: a point is inside if the pseudo-normal there says so (Baerentzen and Aanaes
2005, "Signed distance computation using the angle weighted pseudonormal"); a rim has no inside.

A sheet (``two_sided``) acts on the side on which the middle of the shape is (mesh_side.py).
"""

from __future__ import annotations

from ..jit import kernel
from ..maths import vec3
from ..shapes.static_tree import leaf_near, leaf_within
from .mesh_side import corners_of, side_of
from .terrain_candidates import add_candidate
from .terrain_shape import CENTER_ROW, axis_of, get, radius_of
from .triangle import EDGE, REGION_SLACK, VERTEX, closest_point

# A ball that is left with so much of its radius is as good as empty.
SMALLER = 0.95


@kernel
def is_inside(vertices, faces, face, side, p, nearest, lies_on):
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
def nearest_face(vertices, faces, nodes, p, best):
    """The face nearest to p, if one is nearer than the square root of ``best`` [m^2].

    Returns:
        Its index, or -1; the nearest point and what it lies on.
    """
    found = -1
    point = p
    feature = 0
    node = leaf_within(nodes, 0, p, best)
    while node < nodes.shape[0]:
        here = nodes[node]
        for index in range(here.first, here.first + here.count):
            a, b, c = corners_of(vertices, faces[index])
            nearest, lies_on = closest_point(p, a, b, c)
            square = vec3.norm_squared(vec3.sub(p, nearest))
            if square < best:
                best = square
                found = index
                point = nearest
                feature = lies_on
        node = leaf_within(nodes, node + 1, p, best)
    return found, point, feature


@kernel
def middle_behind(vertices, faces, nodes, index, size):
    """The middle [m] of the largest ball in a solid, up to a radius of ``size`` [m], that touches a face at its middle.

    Balls that touch there shrink until nothing of the surface is in them (Ma, Bae and Choi 2012, "3D medial axis point
    approximation using nearest neighbors and the normal field"): the one that touches at b with the normal n and goes
    through q has the radius |b - q|^2 / (2 n . (b - q)).
    """
    a, b, c = corners_of(vertices, faces[index])
    touches = vec3.scale(1.0 / 3.0, vec3.add(vec3.add(a, b), c))
    n = vec3.load(faces[index].normal)
    radius = size
    while True:
        middle = vec3.add_scaled(touches, -radius, n)
        found, nearest, _ = nearest_face(vertices, faces, nodes, middle, (SMALLER * radius) ** 2)
        if found < 0:
            return middle
        chord = vec3.sub(touches, nearest)
        radius = 0.5 * vec3.norm_squared(chord) / vec3.dot(n, chord)


@kernel
def base_of(vertices, faces, nodes, two_sided, center, p, bound):
    """The nearest point of the surface if p is inside, not farther than the square root of ``bound`` [m^2]; else p."""
    index, nearest, lies_on = nearest_face(vertices, faces, nodes, p, bound)
    if index < 0:
        return p
    side = side_of(vertices, faces, index, two_sided, center)
    return nearest if is_inside(vertices, faces, faces[index], side, p, nearest, lies_on) else p


@kernel
def depth_squared(vertices, faces, nodes, two_sided, center, p, bound):
    """How far p is from the surface, squared, at most ``bound`` [m^2]; and whether it is inside."""
    index, nearest, lies_on = nearest_face(vertices, faces, nodes, p, bound)
    if index < 0:
        return bound, False
    side = side_of(vertices, faces, index, two_sided, center)
    inside = is_inside(vertices, faces, faces[index], side, p, nearest, lies_on)
    return vec3.norm_squared(vec3.sub(p, nearest)), inside


@kernel
def _any_nearer(vertices, faces, nodes, p, square):
    """Whether a face is nearer to p than the square root of ``square`` [m^2]."""
    node = leaf_within(nodes, 0, p, square)
    while node < nodes.shape[0]:
        here = nodes[node]
        for index in range(here.first, here.first + here.count):
            a, b, c = corners_of(vertices, faces[index])
            nearest, _ = closest_point(p, a, b, c)
            if vec3.norm_squared(vec3.sub(p, nearest)) < square:
                return True
        node = leaf_within(nodes, node + 1, p, square)
    return False


@kernel
def is_way_out(vertices, faces, nodes, face, side, p):
    """Whether p, behind a face, is inside, and this face is as near to it as any."""
    a, b, c = corners_of(vertices, face)
    nearest, lies_on = closest_point(p, a, b, c)
    if not is_inside(vertices, faces, face, side, p, nearest, lies_on):
        return False
    square = vec3.norm_squared(vec3.sub(p, nearest))
    return not _any_nearer(vertices, faces, nodes, p, square * (1.0 - REGION_SLACK))


@kernel
def push_out(mesh, vertices, faces, nodes, scratch):
    """A shape with its middle deep in a solid: one candidate, towards the nearest point of the surface.

    Returns the number of candidates, 0 if it is elsewhere.
    """
    center = get(scratch, CENTER_ROW, 0)
    if mesh.closed == 0:
        return 0
    for axis in range(3):
        if not mesh.lower[axis] < center[axis] < mesh.upper[axis]:
            return 0
    # Any vertex near by gives the search its bound; a little more, to find at least that one.
    near = vertices[faces[nodes[leaf_near(nodes, center)].first].vertices[0]]
    bound = 1.001 * vec3.norm_squared(vec3.sub(center, vec3.load(near.position)))
    index, nearest, lies_on = nearest_face(vertices, faces, nodes, center, bound)
    if index < 0 or not is_inside(vertices, faces, faces[index], 1.0, center, nearest, lies_on):
        return 0
    normal = vec3.sub(nearest, center)
    depth = vec3.norm(normal)
    normal = vec3.scale(1.0 / depth, normal)
    reach = radius_of(scratch)
    for axis in range(3):
        reach += abs(vec3.dot(axis_of(scratch, axis), normal)) * scratch[CENTER_ROW, 3 + axis]
    position = vec3.add_scaled(center, 0.5 * (depth - reach), normal)
    return add_candidate(scratch, 0, position, normal, -depth - reach, 0)
