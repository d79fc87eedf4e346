"""Box against box.

1. *Separating axes* (Gottschalk et al. 1996, sec. 5): the largest signed separation over 6 face normals and 9 cross
   products of edges. Overlapping, it is minus the depth, and its axis the contact normal. Apart, it is a lower bound of
   the distance, exact where the closest features are vertex and face, or two crossing edges.
2. Where that bound is not reached, the *distance* itself decides (box_distance.py): vertex against edge or vertex.
3. Along the normal, faces that look at each other are *clipped* (polytope.py); edges side by side get two contacts;
   anything else gets the closest pair alone.

Everything is computed relative to the first box's centre, so that it holds far from the origin.
"""

from __future__ import annotations

import math

import numpy as np

from ..jit import kernel
from ..maths import mat3, vec3
from .box_distance import EDGE_PAIR, edge_center, separated_boxes
from .manifold import emit
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
from .segment import closest_parameters, stretch_ends
from .sphere import point_box

# An axis replaces an earlier one only if it separates better by this fraction of the pair's size: equal faces don't
# alternate, and a face wins against the crossing of two edges that says the same.
AXIS_BIAS = 1e-10

# Cross products of unit edges shorter than this are no axes; what they would add is below this fraction of the size.
SHORTEST_CROSS = 1e-5

# Closest pairs nearer than this fraction of the pair's size have no direction; the separating axis gives the normal.
PAIR_TOUCHES = 1e-12

# Sine of the angle between edges, and between edge and normal, up to which edges count as side by side.
SIDE_BY_SIDE = 0.05

# Features beyond those of the 12 x 6 pairs of faces: closest pairs, then the ends of edges side by side.
PAIR_FEATURES = 72 * ROW_FEATURES
END_FEATURES = PAIR_FEATURES + 4096


@kernel
def _absolute(m):
    """Entry by entry."""
    return (abs(m[0]), abs(m[1]), abs(m[2]), abs(m[3]), abs(m[4]), abs(m[5]), abs(m[6]), abs(m[7]), abs(m[8]))


@kernel
def best_face_axis(along, half, extent):
    """Largest separation over the three face normals of a box, and its axis."""
    bias = AXIS_BIAS * (half[0] + half[1] + half[2])
    best = abs(along[0]) - half[0] - extent[0]
    axis = 0
    for k in range(1, 3):
        separation = abs(along[k]) - half[k] - extent[k]
        if separation > best + bias:
            best, axis = separation, k
    return best, axis


@kernel
def best_edge_axis(rotation, offset, half_a, half_b):
    """Largest separation over the nine cross products of edges, and its pair i * 3 + j (-1: all are parallel).

    ``rotation``, ``offset``: b in the frame of a.
    """
    best = -math.inf
    pair = -1
    for i in range(3):
        i1, i2 = (i + 1) % 3, (i + 2) % 3
        for j in range(3):
            c1, c2 = rotation[3 * i1 + j], rotation[3 * i2 + j]
            length_squared = c1 * c1 + c2 * c2
            if length_squared > SHORTEST_CROSS * SHORTEST_CROSS:
                j1, j2 = (j + 1) % 3, (j + 2) % 3
                reach = half_a[i1] * abs(c2) + half_a[i2] * abs(c1)
                reach += half_b[j1] * abs(rotation[3 * i + j2]) + half_b[j2] * abs(rotation[3 * i + j1])
                separation = (abs(offset[i2] * c1 - offset[i1] * c2) - reach) / math.sqrt(length_squared)
                if separation > best:
                    best, pair = separation, 3 * i + j
    return best, pair


@kernel
def aligned_face(rotation, direction):
    """The face of a box that looks most along a unit direction: 2 * axis + (1 on the positive side), and the cosine."""
    local = mat3.apply_transposed(rotation, direction)
    axis = 0
    for k in range(1, 3):
        if abs(local[k]) > abs(local[axis]) + AXIS_BIAS:
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
def side_by_side(position_a, rotation_a, half_a, rotation_b, half_b, r, normal, margin, contacts, count):
    """Contacts at both ends of the common stretch of two nearly parallel edges; the new count and the smaller gap.

    Each end is a corner of one box, whose contact with the other box has its own exact normal and gap. No contact and
    an infinite gap if there are no such edges. ``r``: centre of b seen from a.
    """
    least = math.inf
    touch = PAIR_TOUCHES * (half_a[0] + half_a[1] + half_a[2] + half_b[0] + half_b[1] + half_b[2])
    local_a = mat3.apply_transposed(rotation_a, normal)
    local_b = mat3.apply_transposed(rotation_b, normal)
    for pair in range(9):
        i, j = pair // 3, pair % 3
        axis_a = mat3.column(rotation_a, i)
        axis_b = mat3.column(rotation_b, j)
        cosine = vec3.dot(axis_a, axis_b)
        if max(abs(local_a[i]), abs(local_b[j]), math.sqrt(max(0.0, 1.0 - cosine * cosine))) < SIDE_BY_SIDE:
            center_a = mat3.apply(rotation_a, edge_center(half_a, local_a, i))
            center_b = vec3.sub(r, mat3.apply(rotation_b, edge_center(half_b, local_b, j)))
            lower, upper = stretch_ends(vec3.dot(axis_a, vec3.sub(center_b, center_a)), half_a[i], cosine, half_b[j])
            for end in range(2):
                limit = upper if end == 1 else lower
                if abs(limit) < half_a[i]:
                    side = half_b[j] if (end == 1) == (cosine > 0.0) else -half_b[j]
                    point = vec3.add_scaled(center_b, side, axis_b)
                    gap, outward = point_box(mat3.apply_transposed(rotation_a, point), half_a)
                    direction = mat3.apply(rotation_a, outward)
                    point = vec3.add_scaled(point, -0.5 * gap, direction)
                else:
                    point = vec3.add_scaled(center_a, limit, axis_a)
                    gap, outward = point_box(mat3.apply_transposed(rotation_b, vec3.sub(point, r)), half_b)
                    direction = vec3.neg(mat3.apply(rotation_b, outward))
                    point = vec3.add_scaled(point, 0.5 * gap, direction)
                if lower < upper and gap <= margin:
                    least = min(least, gap)
                    if gap <= touch:
                        direction = normal
                    count = emit(
                        contacts, count, vec3.add(position_a, point), direction, gap, END_FEATURES + pair * 2 + end
                    )
    return count, least


@kernel
def edge_crossing(rotation_a, half_a, rotation_b, half_b, r, pair, sense_of):
    """Normal, signed gap and points (seen from a's centre) of the supporting edges i, j of pair = 3 i + j.

    The last value tells whether the lines are closest within both edges. ``sense_of``: the normal's half space.
    """
    i, j = pair // 3, pair % 3
    axis_a, axis_b = mat3.column(rotation_a, i), mat3.column(rotation_b, j)
    normal = vec3.normalize(vec3.cross(axis_a, axis_b))
    if vec3.dot(normal, sense_of) < 0.0:
        normal = vec3.neg(normal)
    center_a = mat3.apply(rotation_a, edge_center(half_a, mat3.apply_transposed(rotation_a, normal), i))
    center_b = mat3.apply(rotation_b, edge_center(half_b, mat3.apply_transposed(rotation_b, normal), j))
    center_b = vec3.sub(r, center_b)
    between = vec3.sub(center_b, center_a)
    s, t = closest_parameters(between, axis_a, half_a[i], axis_b, half_b[j])
    point_a, point_b = vec3.add_scaled(center_a, s, axis_a), vec3.add_scaled(center_b, t, axis_b)
    gap = vec3.dot(normal, between)
    # Within both edges the connecting vector is the normal times the gap; at an end it is longer.
    slip = vec3.add_scaled(vec3.sub(point_b, point_a), -gap, normal)
    size = half_a[i] + half_b[j]
    crosses = vec3.norm_squared(slip) <= (AS_CLOSE * size) ** 2
    return normal, gap, point_a, point_b, crosses


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


@kernel
def box_box(position_a, rotation_a, size_a, position_b, rotation_b, size_b, margin, contacts, count, scratch):
    """Up to four contacts of two faces, two of edges side by side, one of a closest pair."""
    r = vec3.sub(position_b, position_a)
    rotation = mat3.multiply(mat3.transpose(rotation_a), rotation_b)
    offset = mat3.apply_transposed(rotation_a, r)
    extent = mat3.apply(_absolute(rotation), size_b)
    separation_a, axis_a = best_face_axis(offset, size_a, extent)
    if separation_a > margin:
        return count
    offset_b = mat3.apply_transposed(rotation_b, r)
    extent = mat3.apply_transposed(_absolute(rotation), size_a)
    separation_b, axis_b = best_face_axis(offset_b, size_b, extent)
    if separation_b > margin:
        return count
    separation_edges, pair = best_edge_axis(rotation, offset, size_a, size_b)
    if separation_edges > margin:
        return count

    size = size_a[0] + size_a[1] + size_a[2] + size_b[0] + size_b[1] + size_b[2]
    if separation_b > separation_a + AXIS_BIAS * size:
        distance = separation_b
        normal = vec3.scale(math.copysign(1.0, offset_b[axis_b]), mat3.column(rotation_b, axis_b))
    else:
        distance = separation_a
        normal = vec3.scale(math.copysign(1.0, offset[axis_a]), mat3.column(rotation_a, axis_a))
    point_a = point_b = r
    code = np.int64(-1)
    if separation_edges > distance + AXIS_BIAS * size:
        normal_edges, distance, point_a, point_b, crosses = edge_crossing(
            rotation_a, size_a, rotation_b, size_b, r, pair, r
        )
        if crosses or distance <= 0.0:
            normal = normal_edges
            code = EDGE_PAIR + pair
    else:
        count, complete = face_manifold(
            position_a,
            rotation_a,
            size_a,
            rotation_b,
            size_b,
            r,
            normal,
            distance,
            r,
            code,
            margin,
            contacts,
            count,
            scratch,
        )
        if complete:
            return count
        if distance <= 0.0:
            # Overlapping, the deepest corner of the one lies in the face of the other: this is round-off or a tie.
            local = mat3.apply_transposed(rotation_b, normal)
            deepest = (
                math.copysign(size_b[0], -local[0]),
                math.copysign(size_b[1], -local[1]),
                math.copysign(size_b[2], -local[2]),
            )
            point_b = vec3.add(r, mat3.apply(rotation_b, deepest))
            point_a = vec3.add_scaled(point_b, -distance, normal)
            code = EDGE_PAIR + 9
    if code < 0:
        point_a, point_b, code = separated_boxes(offset, rotation, size_a, size_b)
        point_a, point_b = mat3.apply(rotation_a, point_a), mat3.apply(rotation_a, point_b)
        between = vec3.sub(point_b, point_a)
        distance = math.sqrt(vec3.norm_squared(between))
        if distance > margin:
            return count
        if distance > PAIR_TOUCHES * size:
            normal = vec3.scale(1.0 / distance, between)
    count, complete = face_manifold(
        position_a,
        rotation_a,
        size_a,
        rotation_b,
        size_b,
        r,
        normal,
        distance,
        point_b,
        code,
        margin,
        contacts,
        count,
        scratch,
    )
    if complete:
        return count
    count, least = side_by_side(position_a, rotation_a, size_a, rotation_b, size_b, r, normal, margin, contacts, count)
    if least > distance + AS_CLOSE * size:
        position = vec3.add(position_a, vec3.scale(0.5, vec3.add(point_a, point_b)))
        count = emit(contacts, count, position, normal, distance, PAIR_FEATURES + code)
    return count
