"""Any two convex solids: what cylinders and hulls need beyond the closed forms.

1. *Axes that are likely*: the normals of boxes and caps, and the cross products of straight edges and axes. The largest
   separation over them is a lower bound of the distance. If the faces that look along that axis attain it, it is the
   distance, and their contacts are complete; this is how things rest on one another.
2. *Distance* of the cores (gjk.py), or their depth if they overlap (epa.py). At smooth shapes a depth is made exact by
   moving b out along the normal and asking for the distance again, until the normal no longer changes.
3. *Contacts* along the normal (convex_manifold.py).
"""

from __future__ import annotations

import math

import numpy as np

from ..jit import kernel
from ..maths import mat3, vec3
from ..model import BOX, CAPSULE, CYLINDER, HULL
from .convex_manifold import PAIR_FEATURE, UNKNOWN, face_contacts, line_contacts
from .epa import FLAT, deepest_points
from .gjk import TOUCHING, closest_points
from .manifold import emit
from .solid import facing, rounding, separation_along

# An axis replaces an earlier one only if it separates better by this fraction of the pair's size.
AXIS_BIAS = 1e-10

# Cross products of unit axes shorter than this are no axes.
SHORTEST_CROSS = 1e-5

# Overlaps up to this fraction of the pair's size are taken from the likely axes if a face attains them. In a deeper one
# another way out may be shorter, and all are asked.
SHALLOW = 1e-3

# The likely axis is the normal if it separates as well as the closest points do within this fraction of the pair's
# size.
AS_GOOD = 1e-12

# Distance [of the pair's size] by which overlapping smooth shapes are moved apart to find their normal; how often at
# most; and the change of the normal that ends it.
MOVED_APART = 1e-2
MOST_MOVES = 20

# Depth of smooth shapes, as a fraction of the pair's size, to which the search for the way out is exact before that.
START_ACCURACY = 1e-5

SAME_NORMAL = 1e-9


@kernel
def _likely_axis(placed, number):
    """Kind of axis 0, 1 or 2 of a shape (0 none, 1 an edge's direction, 2 also a face's normal), and the unit axis."""
    shape = placed[0][0]
    axis = mat3.column(placed[2], 2 if shape != BOX else number)
    kind = 0
    if shape == BOX or (shape == CYLINDER and number == 0):
        kind = 2
    elif shape == CAPSULE and number == 0:
        kind = 1
    return kind, axis


@kernel
def likely_separation(a, b, points, toward, size, margin):
    """The largest separation of the cores over the likely axes [m], that axis from a to b, and whether it is a face's.

    ``toward``: from a to b. Ends early beyond ``margin``.
    """
    best = -math.inf
    normal = toward
    of_face = False
    for i in range(-1, 3):
        for j in range(-1, 3):
            kind_a, axis_a = _likely_axis(a, max(i, 0))
            kind_b, axis_b = _likely_axis(b, max(j, 0))
            axis = axis_a
            valid = False
            if j == -1 and i >= 0:
                valid = kind_a == 2
            elif i == -1 and j >= 0:
                axis = axis_b
                valid = kind_b == 2
            elif i >= 0 and j >= 0 and kind_a > 0 and kind_b > 0:
                axis = vec3.cross(axis_a, axis_b)
                length = math.sqrt(vec3.norm_squared(axis))
                valid = length > SHORTEST_CROSS
                if valid:
                    axis = vec3.scale(1.0 / length, axis)
            if valid:
                if vec3.dot(axis, toward) < 0.0:
                    axis = vec3.neg(axis)
                separation = separation_along(a, b, points, axis)
                if separation > best + AXIS_BIAS * size:
                    best, normal = separation, axis
                    of_face = i == -1 or j == -1
                    if best > margin:
                        return best, normal, of_face
    return best, normal, of_face


@kernel
def _overlap(a, b, points, size, smooth, scratch):
    """Signed distance, normal and point of a, of cores that touch or overlap."""
    distance, normal, point = deepest_points(a, b, points, size, START_ACCURACY if smooth else FLAT, scratch)
    if not smooth:
        return separation_along(a, b, points, normal), normal, point
    distance = separation_along(a, b, points, normal)
    for _ in range(MOST_MOVES):
        shift = vec3.scale(MOVED_APART * size - distance, normal)
        status, _, turned, on_a = closest_points(a, b, points, shift, normal, size, math.inf, scratch)
        if status == TOUCHING:
            break
        separation = separation_along(a, b, points, turned)
        if separation < distance - AXIS_BIAS * size:
            break
        change = vec3.norm_squared(vec3.sub(turned, normal))
        distance, normal, point = separation, turned, on_a
        if change < SAME_NORMAL * SAME_NORMAL:
            break
    return distance, normal, point


@kernel
def convex_convex(
    solid_a,
    position_a,
    rotation_a,
    solid_b,
    position_b,
    rotation_b,
    size,
    points,
    faces,
    corners,
    margin,
    contacts,
    count,
    scratch,
):
    """Contacts of two solids (solid.py), at least one of them a cylinder or a hull; return the new count.

    ``size``: scale of the pair [m]; ``points`` (n, 3), ``faces``, ``corners``: the tables of all hulls (hull.py).
    """
    r = mat3.apply_transposed(rotation_a, vec3.sub(position_b, position_a))
    rotation = mat3.multiply(mat3.transpose(rotation_a), rotation_b)
    a = (solid_a, vec3.ZERO, mat3.IDENTITY)
    b = (solid_b, r, rotation)
    radii = rounding(solid_a) + rounding(solid_b)
    hulls = solid_a[0] == HULL or solid_b[0] == HULL
    smooth = solid_a[0] == CYLINDER or solid_b[0] == CYLINDER
    likely, normal, of_face = likely_separation(a, b, points, r, size, margin + radii)
    if likely - radii > margin:
        return count
    if of_face and (likely > 0.0 or (not hulls and likely > -SHALLOW * size)):
        count, complete = face_contacts(
            a,
            b,
            points,
            faces,
            corners,
            normal,
            likely - radii,
            r,
            np.int64(UNKNOWN),
            size,
            margin,
            position_a,
            rotation_a,
            contacts,
            count,
            scratch,
        )
        if complete:
            return count
    status, distance, turned, point = closest_points(a, b, points, vec3.ZERO, r, size, margin + radii, scratch)
    if status == TOUCHING:
        distance, turned, point = _overlap(a, b, points, size, smooth, scratch)
    if distance - radii > margin:
        return count
    if smooth and hulls:
        # The face of a hull on which the smooth shape may lie.
        on_a = solid_a[0] == HULL
        face, _ = facing(a if on_a else b, faces, turned if on_a else vec3.neg(turned))
        if on_a:
            axis = vec3.load(faces[solid_a[4] + face].normal)
        else:
            axis = vec3.neg(mat3.apply(rotation, vec3.load(faces[solid_b[4] + face].normal)))
        separation = separation_along(a, b, points, axis)
        if separation > likely:
            likely, normal = separation, axis
    if likely < distance - AS_GOOD * size:
        normal = turned
    else:
        distance = max(distance, likely)
    gap = distance - radii
    point = vec3.add_scaled(point, rounding(solid_a), normal)
    count, complete = face_contacts(
        a,
        b,
        points,
        faces,
        corners,
        normal,
        gap,
        vec3.add_scaled(point, gap, normal),
        np.int64(PAIR_FEATURE),
        size,
        margin,
        position_a,
        rotation_a,
        contacts,
        count,
        scratch,
    )
    if complete:
        return count
    count, complete = line_contacts(a, b, normal, gap, size, margin, position_a, rotation_a, contacts, count)
    if complete:
        return count
    middle = vec3.add_scaled(point, 0.5 * gap, normal)
    position = vec3.add(position_a, mat3.apply(rotation_a, middle))
    return emit(contacts, count, position, mat3.apply(rotation_a, normal), gap, np.int64(PAIR_FEATURE))
