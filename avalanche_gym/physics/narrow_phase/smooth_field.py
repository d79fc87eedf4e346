"""Shapes against the smooth surface of a height field.

Sphere: the nearest points of the surface. Capsule: those of its two ends and of the points between them where its axis
is nearest. Box and hull: their vertices, the points of their edges that are nearest, hilltops in front of their faces.
Cylinder: as on a plane (cylinder.py), eight points fixed to a cap that stands flat, and nothing else; else the nearest
points of its rims, hilltops in front of its caps, the points of its side where the axis is nearest, and points around
the rim of a cap that stands, which turn with where it leans to: it rolls about the lowest one, and comes down on the
others. smooth_balls.py, smooth_curves.py and smooth_faces.py say what is exact and what may be missed.

Features name the part of the moving shape, so a contact keeps its name while the shape slides or rolls.
"""

from __future__ import annotations

import math

from ..jit import kernel
from ..maths import mat3, vec3
from ..model import CAPSULE
from .cylinder import FLAT_POINTS, LEVEL, STANDING
from .smooth_balls import bounds_around, collide_ball
from .smooth_candidates import number_alike, numbered, prepare_scratch
from .smooth_curves import CIRCLE, LINE, collide_curve
from .smooth_faces import collide_face, put_corner
from .smooth_surface import coefficients_of, jet, normal_of, patch_of
from .terrain_candidates import emit_candidates
from .terrain_shape import get, margin_of

# Features of a cylinder: for each rim points fixed to it and those that turn with the tilt, then the lowest of a rim,
# side and caps.
RIM, SIDE, CAP = 4 * FLAT_POINTS, 4 * FLAT_POINTS + 2, 4 * FLAT_POINTS + 3
# ... and those that its rims turn to the four walls of the field.
TO_WALL = CAP + 2
# Features of a box: vertices 0 to 7, then edges, then faces.
BOX_EDGE, BOX_FACE = 8, 20


@kernel
def into_frame(position_a, rotation_a, position_b, rotation_b):
    """Position and rotation of the shape in the frame of the terrain."""
    center = mat3.apply_transposed(rotation_b, vec3.sub(position_a, position_b))
    return center, mat3.multiply(mat3.transpose(rotation_b), rotation_a)


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
    center, axes = into_frame(position_a, rotation_a, position_b, rotation_b)
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
    center, axes = into_frame(position_a, rotation_a, position_b, rotation_b)
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
def _over_field(patch, p):
    """x and y of p, or of the point of the rim of the field nearest to it."""
    return min(max(p[0], patch[0]), patch[6]), min(max(p[1], patch[1]), patch[7])


@kernel
def _stands_flat(scratch, first, count, m):
    """Whether a cap with outward normal m lies flat on the surface with all its fixed points, candidates[first:count].

    Which point of its rim is the lowest is then up to round-off, as on a plane (cylinder.py).
    """
    flat = count - first == FLAT_POINTS
    for i in range(first, count):
        flat = flat and vec3.norm_squared(vec3.add(get(scratch, i, 3), m)) <= LEVEL * LEVEL
    return flat


@kernel
def _rim_to_walls(patch, c, o, axes, radius, end, scratch, count):
    """Contacts of a rim about o with the upright walls of a field, whose rectangle it reaches beyond."""
    for way in range(4):
        axis = way // 2
        sign = 1.0 - 2.0 * (way % 2)
        beyond = (patch[0] - o[0], o[0] - patch[6], patch[1] - o[1], o[1] - patch[7])[way]
        local = (sign * axes[axis * 3], sign * axes[axis * 3 + 1])
        length = math.sqrt(local[0] * local[0] + local[1] * local[1])
        if beyond > -radius and length > 0.0:
            out = mat3.apply(axes, (local[0] / length, local[1] / length, 0.0))
            p = vec3.add_scaled(o, radius, out)
            count = collide_ball(patch, c, p, 0.0, TO_WALL + 4 * end + way, scratch, count)
    return count


@kernel
def collide_cylinder(
    position_a, rotation_a, size_a, position_b, rotation_b, field, pool, margin, contacts, count, scratch
):
    """Append the contacts of a cylinder; arguments as in collide_rounded."""
    center, axes = into_frame(position_a, rotation_a, position_b, rotation_b)
    patch = patch_of(field)
    c = coefficients_of(field, pool)
    radius, half = size_a[0], size_a[1]
    reach = math.sqrt(radius * radius + half * half)
    if center[2] - reach - margin > field.highest:
        return count
    prepare_scratch(scratch, margin, max(radius, half))
    highest, _ = bounds_around(patch, c, center, reach + margin)
    axis = mat3.column(axes, 2)
    u = vec3.scale(radius, mat3.column(axes, 0))
    v = vec3.scale(radius, mat3.column(axes, 1))
    across = radius * math.sqrt(max(1.0 - axis[2] * axis[2], 0.0))
    found = 0
    for end in range(2):
        m = axis if end == 1 else vec3.neg(axis)
        o = vec3.add_scaled(center, half, m)
        if o[2] - across - margin > highest:
            continue
        found = _rim_to_walls(patch, c, o, axes, radius, end, scratch, found)
        # How the cap leans against the surface below its middle.
        down = vec3.neg(normal_of(jet(patch, c, *_over_field(patch, o))))
        local = mat3.apply_transposed(axes, down)
        leans = local[0] * local[0] + local[1] * local[1] > LEVEL * LEVEL
        stands = vec3.dot(down, m) >= STANDING
        first = found
        for k in range(FLAT_POINTS if stands else 0):
            # Fixed to the cap, or turning with where it leans to, and then all but the lowest.
            angle = 2.0 * math.pi / FLAT_POINTS * k
            if leans:
                angle += math.atan2(local[1], local[0])
            if leans and k == 0:
                continue
            p = vec3.add_scaled(vec3.add_scaled(o, math.cos(angle), u), math.sin(angle), v)
            part = FLAT_POINTS * (2 * end + (1 if leans else 0)) + k
            before = found
            found = collide_ball(patch, c, p, 0.0, part, scratch, found)
            if leans and found > before:
                # It moves around the rim.
                scratch[before, 7] = numbered(part, False)
        if _stands_flat(scratch, first, found, m):
            continue
        around = 2.0 * math.pi * radius
        found = collide_curve(patch, c, CIRCLE, o, u, v, math.pi, around, 0.0, RIM + end, scratch, found)
        low, high = (o[0] - radius, o[1] - radius), (o[0] + radius, o[1] + radius)
        found = collide_face(patch, c, m, o, low, high, 0, radius, half, CAP + end, scratch, found)
    found = collide_curve(patch, c, LINE, center, axis, axis, half, 2.0 * half, radius, SIDE, scratch, found)
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
    center, axes = into_frame(position_a, rotation_a, position_b, rotation_b)
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
