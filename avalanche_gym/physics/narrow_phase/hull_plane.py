"""Convex hull against a plane: its corners that are near, chosen as on terrain, so that a floor cut into triangles is
the same.
"""

from __future__ import annotations

import numpy as np

from ..jit import kernel
from ..maths import mat3, vec3
from .terrain_candidates import FACE_PLACE, POINT, add_candidate, emit_candidates, feature_of
from .terrain_shape import in_frame, put_core

UP = (0.0, 0.0, 1.0)


@kernel
def hull_plane(position_a, rotation_a, hull, points, position_b, rotation_b, margin, contacts, count, scratch):
    """A contact below each corner of a hull that is near; ``hull``: its row. Chosen as on terrain, so as on a floor."""
    origin, axes = in_frame(position_a, rotation_a, position_b, rotation_b)
    if origin[2] - hull.radius > margin:
        return count
    center = vec3.add(origin, mat3.apply(axes, vec3.load(hull.center)))
    put_core(center, axes, vec3.load(hull.half), 0.0, margin, scratch)
    found = np.int64(0)
    for number in range(hull.num_vertices):
        i = hull.first_vertex + number
        point = vec3.add(origin, mat3.apply(axes, (points[i, 0], points[i, 1], points[i, 2])))
        if point[2] <= margin:
            feature = feature_of(POINT, number, FACE_PLACE, 0)
            middle = (point[0], point[1], 0.5 * point[2])
            found = add_candidate(scratch, found, middle, UP, point[2], feature)
    return emit_candidates(scratch, found, position_b, rotation_b, contacts, count)
