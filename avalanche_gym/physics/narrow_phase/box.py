"""Box against box.

1. *Separating axes* (Gottschalk et al. 1996, sec. 5): the largest signed separation over 6 face normals and 9 cross
   products of edges. Overlapping, it is minus the depth, and its axis the contact normal. Apart, it is a lower bound of
   the distance, exact where the closest features are vertex and face, or two crossing edges.
2. Where that bound is not reached, the *distance* itself decides (box_distance.py): vertex against edge or vertex.
3. Along the normal, faces that look at each other are *clipped* (box_faces.py); edges side by side get two contacts
   (box_edges.py); anything else gets the closest pair alone.

Everything is computed relative to the first box's centre, so that it holds far from the origin.
"""

from __future__ import annotations

import math

import numpy as np

from ..jit import kernel
from ..maths import mat3, vec3
from .box_distance import EDGE_PAIR, separated_boxes
from .box_edges import PAIR_TOUCHES, edge_crossing, side_by_side
from .box_faces import PAIR_FEATURES, face_manifold
from .manifold import emit
from .polytope import AS_CLOSE

# An axis replaces an earlier one only if it separates better by this fraction of the pair's size: equal axes don't
# alternate, and a face wins against the crossing of two edges that says the same.
AXIS_BIAS = 1e-10

# Cross products of unit edges shorter than this are no axes; what they would add is below this fraction of the size.
SHORTEST_CROSS = 1e-5


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
