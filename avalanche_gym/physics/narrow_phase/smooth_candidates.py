"""Candidates of contacts between a body and the smooth surface of a height field, and how they are named.

A candidate holds the number of the part of the body in place of its feature, and whether the ground is flat there: its
normal does not depend on the place, and what it says holds as long as on a plane. In the end it becomes a feature.
"""

from __future__ import annotations

from ..jit import kernel
from ..maths import vec3
from .terrain_candidates import FACE_PLACE, POINT, VERTEX_PLACE, add_candidate, feature_of, is_on
from .terrain_shape import CENTER_ROW, FIRST_FREE_ROW, margin_of, rank_by_motion, set_scale, stand_still

# A slope along a curve below this is none: it lies on the surface, and its ends hold it.
# Where the normal turns by less than that within reach, the ground is flat.
FLAT_SLOPE = 1e-9

# The kind of place of a contact with flat ground; all others are of FACE_PLACE.
FLAT_PLACE = VERTEX_PLACE

# Normals of contacts of one part are ordered along this direction, which is aligned with nothing in particular.
GENERIC_DIRECTION = (0.2391, 0.5137, 0.8240)


@kernel
def prepare_scratch(scratch, margin, scale):
    """What terrain_candidates.py asks of the scratch table: margin and size of the shape [m]."""
    scratch[CENTER_ROW, 7] = margin
    set_scale(scale, scratch)
    rank_by_motion(margin, scratch)
    stand_still(margin, scratch)


@kernel
def numbered(part, flat):
    """What a candidate holds in place of its feature: the number of the part, and whether the ground is flat there."""
    return 2 * part + (1 if flat else 0)


@kernel
def is_on_flat(feature):
    """Whether a contact with a smooth field has a normal that does not depend on its place."""
    return is_on(feature, FLAT_PLACE)


@kernel
def number_alike(scratch, count):
    """Turn the candidates' numbers of parts, from numbered, into features: where one part touches in several places,
    these are numbered in the order of their normals.
    """
    for i in range(count):
        rank = 0
        part, flat = int(scratch[i, 7]) >> 1, int(scratch[i, 7]) & 1
        for j in range(count):
            if int(scratch[j, 7]) >> 1 == part and j != i:
                ahead = 0.0
                for k in range(3):
                    ahead += GENERIC_DIRECTION[k] * (scratch[j, 3 + k] - scratch[i, 3 + k])
                if ahead > 0.0 or (ahead == 0.0 and j < i):
                    rank += 1
        scratch[FIRST_FREE_ROW + i, 0] = feature_of(POINT, part, FLAT_PLACE if flat == 1 else FACE_PLACE, rank)
    for i in range(count):
        scratch[i, 7] = scratch[FIRST_FREE_ROW + i, 0]


@kernel
def add_touch(scratch, count, p, radius, distance, normal, feature):
    """Append the contact of a ball about p whose centre is at ``distance`` along the normal; return the new count."""
    gap = distance - radius
    if gap > margin_of(scratch):
        return count
    # Midway between the surfaces: the ball's is at p - radius n, the other one a gap below it.
    position = vec3.add_scaled(p, -(radius + 0.5 * gap), normal)
    return add_candidate(scratch, count, position, normal, gap, feature)
