"""Depth of two overlapping convex cores: the face of their Minkowski difference nearest to the origin.

A polytope inside the difference b - a grows by the support point over its face of least distance from the origin, until
that face is one of the difference itself (van den Bergen 2001, "Proximity queries and penetration depth computation on
3D game objects"). It starts from four extreme points rather than from the simplex of GJK: so it needs no origin inside,
and serves for cores that just touch, too. Distances are then signed.

Scratch rows: 0 to 63 the points (columns as in gjk.py), from 64 the faces (outward normal, distance, three corners),
from 192 the edges of the hole that a new point tears.
"""

from __future__ import annotations

import math

from ..jit import kernel
from ..maths import vec3
from .gjk import nearest_on_triangle, store_support

MOST_POINTS, FIRST_FACE, MOST_FACES, FIRST_EDGE, MOST_EDGES = 64, 64, 128, 192, 64

NORMAL, DISTANCE, CORNER = 0, 3, 4

# A support point this close to a face, as a fraction of the pair's size, is in its plane: the face is final.
FLAT = 1e-13

# Faces this close to the nearest one, as a fraction of the pair's size, may be parts of the same face of the
# difference.
SAME_PLANE = 1e-10

# Triangles of less area than this fraction of the squared size have no normal and are passed over.
NO_AREA = 1e-13


@kernel
def _add_face(scratch, row, i, j, k, size):
    """Write the face with corners i, j, k, counter-clockwise from outside."""
    p = vec3.load_row(scratch, i)
    normal = vec3.cross(vec3.sub(vec3.load_row(scratch, j), p), vec3.sub(vec3.load_row(scratch, k), p))
    area = math.sqrt(vec3.norm_squared(normal))
    face = scratch[row]
    face[DISTANCE] = math.inf
    if area > NO_AREA * size * size:
        normal = vec3.scale(1.0 / area, normal)
        face[DISTANCE] = vec3.dot(normal, p)
    vec3.store(face, normal)
    face[CORNER] = i
    face[CORNER + 1] = j
    face[CORNER + 2] = k


@kernel
def _extreme_points(a, b, points, scratch, size):
    """Write four points of the difference that span a volume into rows 0 to 3; whether they exist."""
    shift = vec3.ZERO
    low = store_support(scratch, 0, a, b, points, (1.0, 0.0, 0.0), shift)
    high = store_support(scratch, 1, a, b, points, (-1.0, 0.0, 0.0), shift)
    along = vec3.sub(high, low)
    side, other = vec3.tangents(vec3.normalize(along))
    # The one of four sides on which the difference reaches furthest from the line.
    best = 0.0
    chosen = side
    for turn in range(4):
        direction = side if turn < 2 else other
        if turn % 2 == 1:
            direction = vec3.neg(direction)
        point = store_support(scratch, 2, a, b, points, direction, shift)
        reach = vec3.dot(direction, vec3.sub(low, point))
        if reach > best:
            best, chosen = reach, direction
    third = store_support(scratch, 2, a, b, points, chosen, shift)
    normal = vec3.normalize(vec3.cross(along, vec3.sub(third, low)))
    point = store_support(scratch, 3, a, b, points, normal, shift)
    below = vec3.dot(normal, vec3.sub(low, point))
    point = store_support(scratch, 3, a, b, points, vec3.neg(normal), shift)
    above = vec3.dot(normal, vec3.sub(point, low))
    if below > above:
        store_support(scratch, 3, a, b, points, normal, shift)
    return max(below, above) > FLAT * size, below > above


@kernel
def _toggle_edge(scratch, edges, i, j):
    """Add the edge i -> j to the rim of the hole, or remove j -> i from it; return the new number of edges."""
    for row in range(FIRST_EDGE, FIRST_EDGE + edges):
        if scratch[row, 0] == j and scratch[row, 1] == i:
            last = FIRST_EDGE + edges - 1
            scratch[row, 0] = scratch[last, 0]
            scratch[row, 1] = scratch[last, 1]
            return edges - 1
    scratch[FIRST_EDGE + edges, 0] = i
    scratch[FIRST_EDGE + edges, 1] = j
    return edges + 1


@kernel
def _nearest_face(scratch, faces):
    """Row of the face of least distance."""
    nearest = FIRST_FACE
    for row in range(FIRST_FACE, FIRST_FACE + faces):
        if scratch[row, DISTANCE] < scratch[nearest, DISTANCE]:
            nearest = row
    return nearest


@kernel
def _on_rim(scratch, edges, i, j):
    """Whether the edge i -> j, seen from inside the hole, is part of its rim."""
    for row in range(FIRST_EDGE, FIRST_EDGE + edges):  # noqa: SIM110  (kernels have no generators)
        if scratch[row, 0] == j and scratch[row, 1] == i:
            return True
    return False


@kernel
def _grow(scratch, faces, nearest, new, size):
    """Replace the faces that point ``new`` sees by a cone from it; the new number of faces, 0 if there is no room.

    The hole grows from the nearest face across shared edges only, so that it stays in one piece where round-off decides
    what is seen. Faces without an area have no side; they go with their neighbours.
    """
    point = vec3.load_row(scratch, new)
    edges = 0
    row = nearest
    grows = True
    while grows:
        grows = False
        while row < FIRST_FACE + faces:
            face = scratch[row]
            i, j, k = int(face[CORNER]), int(face[CORNER + 1]), int(face[CORNER + 2])
            seen = face[DISTANCE] == math.inf or vec3.dot(vec3.load(face), point) > face[DISTANCE] + 0.1 * FLAT * size
            if edges == 0 or (
                seen
                and (_on_rim(scratch, edges, i, j) or _on_rim(scratch, edges, j, k) or _on_rim(scratch, edges, k, i))
            ):
                if edges + 3 > MOST_EDGES:
                    return 0
                edges = _toggle_edge(scratch, edges, i, j)
                edges = _toggle_edge(scratch, edges, j, k)
                edges = _toggle_edge(scratch, edges, k, i)
                faces -= 1
                for column in range(CORNER + 3):
                    face[column] = scratch[FIRST_FACE + faces, column]
                grows = True
                row = FIRST_FACE
            else:
                row += 1
        row = FIRST_FACE
    if faces + edges > MOST_FACES:
        return 0
    for edge in range(FIRST_EDGE, FIRST_EDGE + edges):
        _add_face(scratch, FIRST_FACE + faces, int(scratch[edge, 0]), int(scratch[edge, 1]), new, size)
        faces += 1
    return faces


@kernel
def _point_on_a(scratch, faces, nearest, size):
    """The point of a under the nearest face: of all triangles in its plane, that on which the origin's foot lies."""
    smallest = math.inf
    on_a = vec3.ZERO
    for row in range(FIRST_FACE, FIRST_FACE + faces):
        face = scratch[row]
        if face[DISTANCE] <= scratch[nearest, DISTANCE] + SAME_PLANE * size:
            i, j, k = int(face[CORNER]), int(face[CORNER + 1]), int(face[CORNER + 2])
            p, q, r = vec3.load_row(scratch, i), vec3.load_row(scratch, j), vec3.load_row(scratch, k)
            w_i, w_j, w_k = nearest_on_triangle(p, q, r)
            foot = vec3.add_scaled(vec3.add_scaled(vec3.scale(w_i, p), w_j, q), w_k, r)
            if vec3.norm_squared(foot) < smallest:
                smallest = vec3.norm_squared(foot)
                on_a = vec3.scale(w_i, vec3.load(scratch[i, 3:]))
                on_a = vec3.add_scaled(on_a, w_j, vec3.load(scratch[j, 3:]))
                on_a = vec3.add_scaled(on_a, w_k, vec3.load(scratch[k, 3:]))
    return on_a


@kernel
def deepest_points(a, b, points, size, accuracy, scratch):
    """Signed distance of cores that touch or overlap, unit normal from a to b, and the point of a: the least overlap.

    Exact for polytopes if ``accuracy``, a fraction of ``size``, is FLAT. Smooth shapes have no last face: the search
    ends when the support point is no further than ``accuracy`` beyond the nearest face, or with 64 points.
    """
    spans, flipped = _extreme_points(a, b, points, scratch, size)
    if not spans:
        normal, _ = vec3.tangents((1.0, 0.0, 0.0))
        return 0.0, normal, vec3.ZERO
    for opposite in range(4):
        i, j, k = (opposite + 1) % 4, (opposite + 2) % 4, (opposite + 3) % 4
        if (opposite % 2 == 0) == flipped:
            j, k = k, j
        _add_face(scratch, FIRST_FACE + opposite, i, j, k, size)
    faces = 4
    count = 4
    nearest = FIRST_FACE
    while True:
        nearest = _nearest_face(scratch, faces)
        face = scratch[nearest]
        normal = vec3.load(face)
        if count == MOST_POINTS:
            break
        # The support of the difference along an outward normal is the one against its opposite.
        point = store_support(scratch, count, a, b, points, vec3.neg(normal), vec3.ZERO)
        if vec3.dot(normal, point) - face[DISTANCE] <= accuracy * size:
            break
        i, j, k = int(face[CORNER]), int(face[CORNER + 1]), int(face[CORNER + 2])
        grown = _grow(scratch, faces, nearest, count, size)
        if grown == 0:
            # No room for more: the last nearest face is as good as it gets, and the only one known to be whole.
            _add_face(scratch, FIRST_FACE, i, j, k, size)
            nearest, faces = FIRST_FACE, 1
            break
        faces = grown
        count += 1
    return (
        -scratch[nearest, DISTANCE],
        vec3.neg(vec3.load(scratch[nearest])),
        _point_on_a(scratch, faces, nearest, size),
    )
