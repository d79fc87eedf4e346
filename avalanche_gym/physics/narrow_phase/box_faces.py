"""Faces of boxes, and the contacts of two that look at each other: one clipped by the sides of the other (polytope.py).

Faces are numbered 2 * axis, plus one on the positive side.
"""

from __future__ import annotations

import numpy as np

from ..jit import kernel
from ..maths import mat3, vec3
from .polytope import (
    AS_CLOSE,
    FACE_ALIGNED,
    FIRST_BUFFER,
    FIRST_SIDE,
    FLUSH,
    REFERENCE_BIAS,
    ROW_FEATURES,
    append,
    clip,
    emit_rows,
    measure,
    project,
    set_vertex,
)

# A face looks more along a direction than an earlier one only by this difference of cosines: equals don't alternate.
FACE_BIAS = 1e-10

# Features beyond those of the 12 x 6 pairs of faces: closest pairs.
PAIR_FEATURES = 72 * ROW_FEATURES


@kernel
def aligned_face(rotation, direction):
    """The face of a box that looks most along a unit direction: 2 * axis + (1 on the positive side), and the cosine."""
    local = mat3.apply_transposed(rotation, direction)
    axis = 0
    for k in range(1, 3):
        if abs(local[k]) > abs(local[axis]) + FACE_BIAS:
            axis = k
    return 2 * axis + (1 if local[axis] > 0.0 else 0), abs(local[axis])


@kernel
def face_frame(center, rotation, half, face):
    """Origin, tangents u, v and outward normal w of a face, and the half extents along u and v."""
    axis = face // 2
    next_axis, last_axis = (axis + 1) % 3, (axis + 2) % 3
    w = mat3.column(rotation, axis)
    if face % 2 == 0:
        w = vec3.neg(w)
    origin = vec3.add_scaled(center, half[axis], w)
    u, v = mat3.column(rotation, next_axis), mat3.column(rotation, last_axis)
    return origin, u, v, w, half[next_axis], half[last_axis]


@kernel
def load_box_face(scratch, origin, u, v, w, center, rotation, half, face):
    """Write the four corners of a box's face as a polygon in the frame of a reference face."""
    middle, s, t, _, half_s, half_t = face_frame(center, rotation, half, face)
    middle = vec3.sub(middle, origin)
    s, t = vec3.scale(half_s, s), vec3.scale(half_t, t)
    for k in range(4):
        point = vec3.add_scaled(middle, 1.0 if k == 1 or k == 2 else -1.0, s)
        point = vec3.add_scaled(point, 1.0 if k >= 2 else -1.0, t)
        set_vertex(scratch, FIRST_BUFFER, k, vec3.dot(u, point), vec3.dot(v, point), vec3.dot(w, point))


@kernel
def clip_to_rectangle(scratch, count, half_u, half_v, tolerance):
    """Clip the polygon by the four sides of a box's face."""
    first = np.int64(FIRST_BUFFER)
    for side in range(4):
        nx = (1.0 - 2.0 * (side & 1)) if side < 2 else 0.0
        ny = (1.0 - 2.0 * (side & 1)) if side >= 2 else 0.0
        first, count = clip(scratch, first, count, nx, ny, half_u if side < 2 else half_v, tolerance, FIRST_SIDE + side)
    return first, count


@kernel
def face_manifold(
    position_a,
    rotation_a,
    half_a,
    rotation_b,
    half_b,
    r,
    normal,
    distance,
    point,
    code,
    margin,
    contacts,
    count,
    scratch,
):
    """Contacts of the two faces that look at each other along ``normal``; the new count, and whether it is complete.

    It is not if no face is aligned with the normal, if the faces don't overlap, or if they are apart and no vertex of
    the clipped polygon is as close as ``distance``: then other features are closest. Those are known if ``code`` is not
    negative (``point``: the one on b, seen from a), and are added to the polygon if it lacks them.
    """
    face_a, cosine_a = aligned_face(rotation_a, normal)
    face_b, cosine_b = aligned_face(rotation_b, vec3.neg(normal))
    if max(cosine_a, cosine_b) < FACE_ALIGNED:
        return count, False
    size = half_a[0] + half_a[1] + half_a[2] + half_b[0] + half_b[1] + half_b[2]
    tolerance = FLUSH * size
    center_a = vec3.ZERO
    if cosine_b > cosine_a + REFERENCE_BIAS:
        sense = -1.0
        origin, u, v, w, half_u, half_v = face_frame(r, rotation_b, half_b, face_b)
        incident, _ = aligned_face(rotation_a, vec3.neg(w))
        load_box_face(scratch, origin, u, v, w, center_a, rotation_a, half_a, incident)
        feature = ((6 + face_b) * 6 + incident) * ROW_FEATURES
    else:
        sense = 1.0
        origin, u, v, w, half_u, half_v = face_frame(center_a, rotation_a, half_a, face_a)
        incident, _ = aligned_face(rotation_b, vec3.neg(w))
        load_box_face(scratch, origin, u, v, w, r, rotation_b, half_b, incident)
        feature = (face_a * 6 + incident) * ROW_FEATURES
        point = vec3.add_scaled(point, -distance, normal)
    cosine = vec3.dot(w, normal)
    project(scratch, FIRST_BUFFER, 4, vec3.dot(u, normal) / cosine, vec3.dot(v, normal) / cosine)
    first, rows = clip_to_rectangle(scratch, np.int64(4), half_u, half_v, tolerance)
    least = measure(scratch, first, rows, sense * cosine)
    lacks_closest = least > distance + AS_CLOSE * size
    if code < 0 and (rows == 0 or (lacks_closest and distance > 0.0)):
        return count, False
    if code >= 0 and lacks_closest:
        local = vec3.sub(point, origin)
        rows = append(
            scratch,
            first,
            rows,
            vec3.dot(u, local),
            vec3.dot(v, local),
            distance,
            PAIR_FEATURES + code - feature,
        )
    count = emit_rows(
        scratch,
        first,
        rows,
        vec3.add(position_a, origin),
        u,
        v,
        normal,
        sense,
        size,
        margin,
        feature,
        contacts,
        count,
    )
    return count, True
