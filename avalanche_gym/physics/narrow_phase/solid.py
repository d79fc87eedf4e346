"""What the general convex test asks of a shape: its support point, its flat faces, its straight line of contact.

A *solid* is a tuple (shape code, size, first, last, first_face, last_face): a sphere, capsule, box, cylinder or hull in
its own frame; the numbers point into the tables of the hulls and are zero for the others. Spheres and capsules are
cores (a point, a segment) with a radius that the caller takes off the gap. A *placed* solid is (solid, position,
rotation).

Faces are numbered: box as in box_faces.py, cylinder 0 at -z and 1 at +z, hull as in its table.
"""

from __future__ import annotations

import math

from ..jit import kernel
from ..maths import mat3, vec3
from ..model import BOX, CAPSULE, CYLINDER, HULL, SPHERE
from .box_faces import aligned_face, face_frame
from .polytope import set_vertex


@kernel
def rounding(solid):
    """Radius around the core [m]."""
    if solid[0] == SPHERE or solid[0] == CAPSULE:
        return solid[1][0]
    return 0.0


@kernel
def support(solid, points, direction):
    """The point of a solid furthest in a direction, in its own frame. At right angles to a cap, the cap's centre."""
    shape, size = solid[0], solid[1]
    if shape == HULL:
        first = solid[2]
        best = first
        largest = -math.inf
        for i in range(first, solid[3]):
            along = points[i, 0] * direction[0] + points[i, 1] * direction[1] + points[i, 2] * direction[2]
            if along > largest:
                largest, best = along, i
        return (points[best, 0], points[best, 1], points[best, 2])
    if shape == BOX:
        return (
            math.copysign(size[0], direction[0]),
            math.copysign(size[1], direction[1]),
            math.copysign(size[2], direction[2]),
        )
    if shape == SPHERE:
        return vec3.ZERO
    end = math.copysign(size[1], direction[2])
    across = math.sqrt(direction[0] * direction[0] + direction[1] * direction[1])
    if shape == CAPSULE or across == 0.0:
        return (0.0, 0.0, end)
    scale = size[0] / across
    return (scale * direction[0], scale * direction[1], end)


@kernel
def placed_support(placed, points, direction):
    """The support point of a placed solid, in the frame it is placed in."""
    solid, position, rotation = placed
    return vec3.add(position, mat3.apply(rotation, support(solid, points, mat3.apply_transposed(rotation, direction))))


@kernel
def separation_along(a, b, points, normal):
    """Gap [m] between the cores along a unit normal from a to b: a lower bound of their distance."""
    highest = vec3.dot(normal, placed_support(a, points, normal))
    return vec3.dot(normal, placed_support(b, points, vec3.neg(normal))) - highest


@kernel
def facing(placed, faces, direction):
    """The flat face that looks most along a direction, and the cosine between them (-1: there is no face)."""
    solid, _, rotation = placed
    if solid[0] == BOX:
        return aligned_face(rotation, direction)
    local = mat3.apply_transposed(rotation, direction)
    best = solid[4]
    largest = -1.0
    if solid[0] == HULL:
        for i in range(solid[4], solid[5]):
            cosine = vec3.dot(vec3.load(faces[i].normal), local)
            if cosine > largest:
                largest, best = cosine, i
        return best - solid[4], largest
    if solid[0] == CYLINDER:
        return best + (1 if local[2] > 0.0 else 0), abs(local[2])
    return best, largest


@kernel
def frame_of_face(placed, points, faces, corners, face):
    """Origin, tangents u, v and outward normal w of a face."""
    solid, position, rotation = placed
    if solid[0] == BOX:
        origin, u, v, w, _, _ = face_frame(position, rotation, solid[1], face)
        return origin, u, v, w
    if solid[0] == HULL:
        row = faces[solid[4] + face]
        i = solid[2] + corners[row.first_corner]
        w = vec3.load(row.normal)
        u, v = vec3.tangents(w)
        origin = (points[i, 0], points[i, 1], points[i, 2])
        u, v, w = mat3.apply(rotation, u), mat3.apply(rotation, v), mat3.apply(rotation, w)
        return vec3.add(position, mat3.apply(rotation, origin)), u, v, w
    w = mat3.column(rotation, 2)
    if face == 0:
        w = vec3.neg(w)
    return vec3.add_scaled(position, solid[1][1], w), mat3.column(rotation, 0), mat3.column(rotation, 1), w


@kernel
def load_face(scratch, first, placed, points, faces, corners, face, origin, u, v, w):
    """Write the corners of a face of a box or hull as a polygon in the frame (origin, u, v, w); return how many."""
    solid, position, rotation = placed
    count = 4
    first_corner = 0
    middle, s, t = position, u, v
    if solid[0] == HULL:
        row = faces[solid[4] + face]
        count = row.num_corners
        first_corner = row.first_corner
    else:
        middle, s, t, _, half_s, half_t = face_frame(position, rotation, solid[1], face)
        s, t = vec3.scale(half_s, s), vec3.scale(half_t, t)
    for k in range(count):
        if solid[0] == HULL:
            i = solid[2] + corners[first_corner + k]
            point = vec3.add(position, mat3.apply(rotation, (points[i, 0], points[i, 1], points[i, 2])))
        else:
            point = vec3.add_scaled(middle, 1.0 if k == 1 or k == 2 else -1.0, s)
            point = vec3.add_scaled(point, 1.0 if k >= 2 else -1.0, t)
        point = vec3.sub(point, origin)
        set_vertex(scratch, first, k, vec3.dot(u, point), vec3.dot(v, point), vec3.dot(w, point))
    return count


@kernel
def straight_line(placed, direction, slope):
    """The line along which a solid can touch another one in a direction: centre, unit axis, half length, radius around
    it.

    The axis of a capsule or cylinder, or an edge of a box, if it is at right angles to the direction within ``slope``
    (a sine); otherwise a half length of zero.
    """
    solid, position, rotation = placed
    local = mat3.apply_transposed(rotation, direction)
    size = solid[1]
    axis = mat3.column(rotation, 2)
    if solid[0] == CAPSULE or solid[0] == CYLINDER:
        return position, axis, size[1] if abs(local[2]) < slope else 0.0, size[0]
    if solid[0] == BOX:
        k = 0
        if abs(local[1]) < abs(local[0]):
            k = 1
        if abs(local[2]) < min(abs(local[0]), abs(local[1])):
            k = 2
        middle = (
            0.0 if k == 0 else math.copysign(size[0], local[0]),
            0.0 if k == 1 else math.copysign(size[1], local[1]),
            0.0 if k == 2 else math.copysign(size[2], local[2]),
        )
        center = vec3.add(position, mat3.apply(rotation, middle))
        return center, mat3.column(rotation, k), size[k] if abs(local[k]) < slope else 0.0, 0.0
    return position, axis, 0.0, 0.0
