"""Shapes against the smooth surface of a height field.

Sphere: the nearest points of the surface. Capsule: those of its two ends and of the points between them where its axis
is nearest. Box and hull: their vertices, the points of their edges that are nearest, hilltops in front of their faces.
A cylinder has a file of its own (smooth_cylinder.py). smooth_balls.py, smooth_curves.py and smooth_faces.py say what is
exact and what may be missed.

Features name the part of the moving shape, so a contact keeps its name while the shape slides or rolls.
"""

from __future__ import annotations

import math

from ..jit import kernel
from ..maths import mat3, vec3
from ..model import CAPSULE
from .smooth_balls import bounds_around, collide_ball
from .smooth_candidates import number_alike, prepare_scratch
from .smooth_curves import LINE, collide_curve
from .smooth_faces import collide_face, put_corner
from .smooth_surface import coefficients_of, patch_of
from .terrain_candidates import emit_candidates
from .terrain_shape import in_frame, margin_of

# Features of a box: vertices 0 to 7, then edges, then faces.
BOX_EDGE, BOX_FACE = 8, 20


@kernel
def collide_rounded(
    shape, position_a, rotation_a, size_a, position_b, rotation_b, field, pool, margin, contacts, count, scratch
):
    """Append the contacts of a sphere or capsule; return the new count.

    Args:
        shape: its code.
        position_a, rotation_a, size_a: its place [m], body-to-world matrix and size.
        position_b, rotation_b: place of the field.
        field: its HEIGHT_FIELD_ROW.
        pool: of heights [m].
        margin: [m] contacts farther apart are left out.
        contacts, count: as in ``manifold.emit``.
        scratch: (264, 8), overwritten.
    """
    center, axes = in_frame(position_a, rotation_a, position_b, rotation_b)
    patch = patch_of(field)
    c = coefficients_of(field, pool)
    radius = size_a[0]
    half = size_a[1] if shape == CAPSULE else 0.0
    axis = mat3.column(axes, 2)
    if center[2] - radius - margin - abs(axis[2]) * half > field.highest:
        return count
    prepare_scratch(scratch, margin, radius + half)
    found = 0
    for end in range(2 if shape == CAPSULE else 1):
        p = vec3.add_scaled(center, half if end == 1 else -half, axis)
        found = collide_ball(patch, c, p, radius, end, scratch, found)
    if shape == CAPSULE:
        found = collide_curve(patch, c, LINE, center, axis, axis, half, 2.0 * half, radius, 2, scratch, found)
    number_alike(scratch, found)
    return emit_candidates(scratch, found, position_b, rotation_b, contacts, count)


@kernel
def _edge(patch, c, a, b, highest, feature, scratch, count):
    """Contacts of the inside of the edge from a to b."""
    if min(a[2], b[2]) - margin_of(scratch) > highest:
        return count
    d = vec3.sub(b, a)
    length = vec3.norm(d)
    center = vec3.add_scaled(a, 0.5, d)
    u = vec3.scale(1.0 / length, d)
    return collide_curve(patch, c, LINE, center, u, u, 0.5 * length, length, 0.0, feature, scratch, count)


@kernel
def _box_corner(center, axes, half, corner):
    signs = (2.0 * (corner & 1) - 1.0, (corner & 2) - 1.0, 0.5 * (corner & 4) - 1.0)
    return vec3.add(center, mat3.apply(axes, vec3.multiply(signs, half)))


@kernel
def collide_box(position_a, rotation_a, size_a, position_b, rotation_b, field, pool, margin, contacts, count, scratch):
    """Append the contacts of a box; arguments as in collide_rounded."""
    center, axes = in_frame(position_a, rotation_a, position_b, rotation_b)
    patch = patch_of(field)
    c = coefficients_of(field, pool)
    reach = vec3.norm(size_a)
    if center[2] - reach - margin > field.highest:
        return count
    prepare_scratch(scratch, margin, max(size_a[0], size_a[1], size_a[2]))
    highest, _ = bounds_around(patch, c, center, reach + margin)
    found = 0
    for corner in range(8):
        p = _box_corner(center, axes, size_a, corner)
        if p[2] - margin <= highest:
            found = collide_ball(patch, c, p, 0.0, corner, scratch, found)
    for axis in range(3):
        step = 1 << axis
        number = 0
        for corner in range(8):
            if corner & step == 0:
                a = _box_corner(center, axes, size_a, corner)
                b = _box_corner(center, axes, size_a, corner | step)
                found = _edge(patch, c, a, b, highest, BOX_EDGE + 4 * axis + number, scratch, found)
                number += 1
    for face in range(6):
        axis = face >> 1
        m = mat3.column(axes, axis)
        if face & 1 == 0:
            m = vec3.neg(m)
        o = vec3.add_scaled(center, size_a[axis], m)
        # Around the face: the other two axes, in the order that turns counter-clockwise about m.
        j, k = (axis + 1) % 3, (axis + 2) % 3
        if face & 1 == 0:
            j, k = k, j
        low, high = (math.inf, math.inf), (-math.inf, -math.inf)
        lowest = math.inf
        for corner in range(4):
            side_j = 1.0 if corner == 1 or corner == 2 else -1.0
            side_k = 1.0 if corner >= 2 else -1.0
            p = vec3.add_scaled(o, side_j * size_a[j], mat3.column(axes, j))
            p = vec3.add_scaled(p, side_k * size_a[k], mat3.column(axes, k))
            put_corner(scratch, corner, p)
            low = (min(low[0], p[0]), min(low[1], p[1]))
            high = (max(high[0], p[0]), max(high[1], p[1]))
            lowest = min(lowest, p[2])
        if lowest - margin <= highest:
            found = collide_face(patch, c, m, o, low, high, 4, 0.0, size_a[axis], BOX_FACE + face, scratch, found)
    number_alike(scratch, found)
    return emit_candidates(scratch, found, position_b, rotation_b, contacts, count)


@kernel
def _hull_point(center, axes, points, i):
    return vec3.add(center, mat3.apply(axes, (points[i, 0], points[i, 1], points[i, 2])))


@kernel
def collide_hull(
    position_a,
    rotation_a,
    hull,
    points,
    faces,
    corners,
    position_b,
    rotation_b,
    field,
    pool,
    margin,
    contacts,
    count,
    scratch,
):
    """Append the contacts of a convex hull, given by its HULL_ROW and the pools of the hulls; return the new count."""
    center, axes = in_frame(position_a, rotation_a, position_b, rotation_b)
    patch = patch_of(field)
    c = coefficients_of(field, pool)
    if center[2] - hull.radius - margin > field.highest:
        return count
    prepare_scratch(scratch, margin, hull.radius)
    highest, _ = bounds_around(patch, c, center, hull.radius + margin)
    found = 0
    num_vertices = hull.num_vertices
    for vertex in range(num_vertices):
        p = _hull_point(center, axes, points, hull.first_vertex + vertex)
        if p[2] - margin <= highest:
            found = collide_ball(patch, c, p, 0.0, vertex, scratch, found)
    first_corner = faces[hull.first_face].first_corner
    last_face = faces[hull.first_face + hull.num_faces - 1]
    face_feature = num_vertices + last_face.first_corner + last_face.num_corners - first_corner
    for number in range(hull.num_faces):
        face = faces[hull.first_face + number]
        m = mat3.apply(axes, vec3.load(face.normal))
        low, high = (math.inf, math.inf), (-math.inf, -math.inf)
        lowest = math.inf
        for k in range(face.num_corners):
            i = corners[face.first_corner + k]
            following = corners[face.first_corner + (k + 1) % face.num_corners]
            p = _hull_point(center, axes, points, hull.first_vertex + i)
            put_corner(scratch, k, p)
            low = (min(low[0], p[0]), min(low[1], p[1]))
            high = (max(high[0], p[0]), max(high[1], p[1]))
            lowest = min(lowest, p[2])
            # Each edge has two faces; the one that goes up in number has it.
            if i < following:
                b = _hull_point(center, axes, points, hull.first_vertex + following)
                feature = num_vertices + face.first_corner + k - first_corner
                found = _edge(patch, c, p, b, highest, feature, scratch, found)
        if lowest - margin <= highest:
            depth = -vec3.dot(m, vec3.sub(center, _hull_point(center, axes, points, hull.first_vertex + i)))
            found = collide_face(
                patch,
                c,
                m,
                p,
                low,
                high,
                face.num_corners,
                0.0,
                max(depth, 0.0),
                face_feature + number,
                scratch,
                found,
            )
    number_alike(scratch, found)
    return emit_candidates(scratch, found, position_b, rotation_b, contacts, count)
