"""Contacts of two solids along a known normal: what flat faces, caps and straight lines have in common.

One flat face that looks along the normal is the reference. The other solid's part that faces it is projected on its
plane along the normal, and the common part of both gives the contacts (convex_overlap.py).

Two parallel lines get a contact at both ends of their common stretch. What has none of these gets the closest pair
alone. Everything is in the frame of solid a; emit_rows brings it to the world.
"""

from __future__ import annotations

import math

import numpy as np

from ..jit import kernel
from ..maths import mat3, vec3
from ..model import CYLINDER, SPHERE
from .convex_overlap import REFERENCE_ROWS, cap_on_cap, clip_polygon, line_on_face, polygon_on_cap
from .cylinder import STANDING
from .manifold import emit
from .polytope import (
    AS_CLOSE,
    FACE_ALIGNED,
    FIRST_BUFFER,
    FLUSH,
    REFERENCE_BIAS,
    ROW_FEATURES,
    append,
    emit_rows,
    measure,
    project,
)
from .segment import stretch_ends
from .solid import facing, frame_of_face, load_face, straight_line

# Faces of one solid that features can tell apart; more faces share numbers, which only the warm start would notice.
FACES = 256

PAIR_FEATURE = 2 * FACES * FACES * ROW_FEATURES
FIRST_END_FEATURE = PAIR_FEATURE + 1

# A common stretch of two lines shorter than this fraction of the pair's size has no two ends.
SHORTEST_STRETCH = 1e-3

# An end stands for the closest pair only if its own normal is the same within this angle [rad]; round-off at rest is
# less.
SAME_NORMAL = 1e-7

# Instead of the feature of the closest pair: it has not been looked for.
UNKNOWN = -1

# Sine of the angle between a line and what it lies on, or along, up to which its ends get contacts.
LINE_SLOPE = 0.05


@kernel
def _into_frame(point, origin, u, v, w):
    """Coordinates of a point in a frame."""
    point = vec3.sub(point, origin)
    return (vec3.dot(u, point), vec3.dot(v, point), vec3.dot(w, point))


@kernel
def _project_point(point, normal):
    """Along the normal on the plane of the frame; the height stays."""
    t = point[2] / normal[2]
    return (point[0] - t * normal[0], point[1] - t * normal[1], point[2])


@kernel
def face_contacts(
    a,
    b,
    points,
    faces,
    corners,
    normal,
    gap,
    point,
    closest,
    size,
    margin,
    position,
    rotation,
    contacts,
    count,
    scratch,
):
    """Contacts of a flat face; the new count, and whether they describe the pair completely.

    They don't if no face is aligned with the normal, or if nothing over it is as close as ``gap``: then other
    features are closest. If they are known (``closest``: their feature, ``point``: the one on b), they are added.
    ``position``, ``rotation``: of a in the world; everything else is in the frame of a.
    """
    face_a, cosine_a = facing(a, faces, normal)
    face_b, cosine_b = facing(b, faces, vec3.neg(normal))
    if max(cosine_a, cosine_b) < FACE_ALIGNED or a[0][0] == SPHERE:
        return count, False
    by_a = cosine_b <= cosine_a + REFERENCE_BIAS
    # A cap is the reference of any face it stands on.
    if by_a and a[0][0] != CYLINDER and b[0][0] == CYLINDER and cosine_b >= STANDING:
        by_a = False
    elif not by_a and b[0][0] != CYLINDER and a[0][0] == CYLINDER and cosine_a >= STANDING:
        by_a = True
    tolerance = FLUSH * size
    if by_a:
        reference, face, other, sense = a, face_a, b, 1.0
        point = vec3.add_scaled(point, -gap, normal)
    else:
        reference, face, other, sense = b, face_b, a, -1.0
    origin, u, v, w = frame_of_face(reference, points, faces, corners, face)
    outward = vec3.scale(sense, normal)
    in_frame = (vec3.dot(u, outward), vec3.dot(v, outward), vec3.dot(w, outward))
    slope_u, slope_v = in_frame[0] / in_frame[2], in_frame[1] / in_frame[2]
    against = vec3.neg(outward)
    incident, cosine = facing(other, faces, vec3.neg(w))
    if other[0][0] == CYLINDER:
        incident, cosine = facing(other, faces, against)
    is_cap = reference[0][0] == CYLINDER
    radius = reference[0][1][0]
    sides = 0
    if not is_cap:
        sides = load_face(scratch, REFERENCE_ROWS, reference, points, faces, corners, face, origin, u, v, w)
    first = np.int64(FIRST_BUFFER)
    if other[0][0] == CYLINDER and cosine >= STANDING:
        center, _, _, axis = frame_of_face(other, points, faces, corners, incident)
        axis = (vec3.dot(u, axis), vec3.dot(v, axis), vec3.dot(w, axis))
        turned = mat3.multiply((u[0], u[1], u[2], v[0], v[1], v[2], w[0], w[1], w[2]), other[2])
        placed = (other[0], other[1], turned)
        local = mat3.apply_transposed(other[2], against)
        center = _into_frame(center, origin, u, v, w)
        rows = cap_on_cap(scratch, radius, placed, in_frame, local, center, axis, tolerance)
    elif cosine < 0.0 or other[0][0] == CYLINDER:
        center, axis, half, line_radius = straight_line(other, against, STANDING)
        if half == 0.0:
            return count, False
        # Which of its caps looks down is round-off.
        incident = 0
        toward = against
        if other[0][0] == CYLINDER:
            toward = vec3.normalize(vec3.add_scaled(against, -vec3.dot(against, axis), axis))
        center = vec3.add_scaled(center, line_radius, toward)
        start = _into_frame(vec3.add_scaled(center, -half, axis), origin, u, v, w)
        end = _into_frame(vec3.add_scaled(center, half, axis), origin, u, v, w)
        start, end = _project_point(start, in_frame), _project_point(end, in_frame)
        rows = line_on_face(scratch, start, end, sides, radius, tolerance)
    elif is_cap:
        rows = load_face(scratch, REFERENCE_ROWS, other, points, faces, corners, incident, origin, u, v, w)
        project(scratch, REFERENCE_ROWS, rows, slope_u, slope_v)
        local = mat3.apply_transposed(reference[2], outward)
        rows = polygon_on_cap(scratch, rows, radius, local, tolerance)
    else:
        rows = load_face(scratch, FIRST_BUFFER, other, points, faces, corners, incident, origin, u, v, w)
        project(scratch, FIRST_BUFFER, rows, slope_u, slope_v)
        first, rows = clip_polygon(scratch, rows, REFERENCE_ROWS, sides, tolerance)
    least = measure(scratch, first, rows, in_frame[2])
    lacks_closest = least > gap + AS_CLOSE * size
    if lacks_closest and closest == UNKNOWN:
        return count, False
    pair = ((0 if by_a else 1) * FACES + face % FACES) * FACES + incident % FACES
    feature = pair * ROW_FEATURES
    if lacks_closest:
        local = _into_frame(point, origin, u, v, w)
        rows = append(scratch, first, rows, local[0], local[1], gap, closest - feature)
    count = emit_rows(
        scratch,
        first,
        rows,
        vec3.add(position, mat3.apply(rotation, origin)),
        mat3.apply(rotation, u),
        mat3.apply(rotation, v),
        mat3.apply(rotation, normal),
        sense,
        size,
        margin,
        feature,
        contacts,
        count,
    )
    return count, True


@kernel
def _square_across(center, axis, radius, start, other_center, other_axis, other_radius):
    """Gap of two round lines along the ray from the first at ``start``, square to it, that meets the other axis.

    Also the ray's unit direction and the middle of the gap. ``start`` [m] along the first axis; a gap of infinity if
    there is no such ray.
    """
    point = vec3.add_scaled(center, start, axis)
    rate = vec3.dot(axis, other_axis)
    t = vec3.dot(axis, vec3.sub(point, other_center)) / rate
    ray = vec3.sub(vec3.add_scaled(other_center, t, other_axis), point)
    length = math.sqrt(vec3.norm_squared(ray))
    if length == 0.0:
        return math.inf, axis, point
    ray = vec3.scale(1.0 / length, ray)
    along = vec3.dot(ray, other_axis)
    gap = length - radius - other_radius / math.sqrt(1.0 - along * along)
    return gap, ray, vec3.add_scaled(point, radius + 0.5 * gap, ray)


@kernel
def line_contacts(a, b, normal, gap, size, margin, position, rotation, contacts, count):
    """Contacts at both ends of the common stretch of two parallel lines; the new count, and whether one is as close.

    Each lies on the ray that is square to the axis that ends there. Apart, that ray is its own normal.
    """
    center_a, u, length_a, radius_a = straight_line(a, normal, LINE_SLOPE)
    center_b, v, length_b, radius_b = straight_line(b, vec3.neg(normal), LINE_SLOPE)
    if length_a == 0.0 or length_b == 0.0 or vec3.norm_squared(vec3.cross(u, v)) > LINE_SLOPE * LINE_SLOPE:
        return count, False
    cosine = vec3.dot(u, v)
    lower, upper = stretch_ends(vec3.dot(u, vec3.sub(center_b, center_a)), length_a, cosine, length_b)
    if upper - lower < SHORTEST_STRETCH * size:
        return count, False
    least = math.inf
    for end in range(2):
        limit = upper if end == 1 else lower
        if abs(limit) < length_a:
            side = length_b if (end == 1) == (cosine > 0.0) else -length_b
            end_gap, ray, middle = _square_across(center_b, v, radius_b, side, center_a, u, radius_a)
            ray = vec3.neg(ray)
        else:
            end_gap, ray, middle = _square_across(center_a, u, radius_a, limit, center_b, v, radius_b)
        cosine_ray = vec3.dot(ray, normal)
        same = vec3.norm_squared(vec3.sub(ray, normal)) <= SAME_NORMAL * SAME_NORMAL
        if gap <= 0.0:
            # Overlapping, the least overlap is the measure: along its normal no depth exceeds it.
            ray = normal
            end_gap *= cosine_ray
        # Where the axes all but meet, the ray has no sense.
        if cosine_ray > FACE_ALIGNED and end_gap <= margin:
            if same:
                least = min(least, end_gap)
            middle = vec3.add(position, mat3.apply(rotation, middle))
            count = emit(contacts, count, middle, mat3.apply(rotation, ray), end_gap, FIRST_END_FEATURE + end)
    return count, least <= gap + AS_CLOSE * size
