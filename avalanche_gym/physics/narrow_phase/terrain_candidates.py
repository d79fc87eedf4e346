"""Candidates of one pair of shape and terrain: collected, merged, reduced and handed over.

A candidate is a row of the scratch table (terrain_shape.py): position (3) and outward normal (3) in the terrain's
frame, gap, feature. "Outward" is from the terrain to the shape, against the normal of the contact.

**Merging.** Neighbouring regions of the terrain overlap by round-off (triangle.py), so one contact can be found from
two faces. Two candidates at one place with one normal are one.

**Reduction.** A rigid body is held by few contacts: those that span the others. The deepest is kept, then again and
again the one that could dip farthest below the surface with all kept ones on it. A kept one at a gap e_j in the end of
the step is brought to 0; that lifts what is beside it by as much, but for the distance d times the angle a by which the
body may tilt as well, so it is at most

    min over kept j of (e_j - e_i + a d_ij),    a = (max(-e, 0) + falloff) / scale,

below. The tilt is what lifting the deepest, at e, and what is not foreseen make of the shape's size (scale). Distance
counts position, and the normal times a part of the size. Where all touch alike the farthest from all kept ones comes
next (Gonzalez 1985, "Clustering to minimize the maximum intercluster distance"): the extremes of the support, and one
of each direction. What opens counts the less the more it does, and of two neighbours the deeper one counts.

"In the end" is as the motion of the step leads, if nothing touches (path.py): a corner that strikes in this step must
be among them; what leaves is taken as it is now.
Of a shape that turns by more than ``BEYOND_PATH``, to which a path of first order says nothing, it is the deepest now.

**Feature ids.** A contact belongs to a point of the moving shape (a corner, the end of a capsule, a sphere), to the
crossing of two edges, or to a vertex of the terrain. Crossings and vertices have one number for all their life. A
point slides from facet to facet, and may touch several: its feature has the number of the point in front of that of
the facet (model.SLIDING), so that one step knows each facet again, and the next one the point.
"""

from __future__ import annotations

import math

import numpy as np

from ..jit import kernel
from ..maths import mat3, vec3
from ..model import MOST_ON_TERRAIN, PLACE_BITS, SLIDING
from .manifold import emit
from .path import displacement
from .terrain_shape import SCORE_ROW, falloff_of, path_in, put, scale_of

# Rows of the scratch table (terrain_shape.py) that hold candidates.
CAPACITY = 64
# What a difference of unit normals counts against one of positions in units of the shape's size.
NORMAL_WEIGHT = 0.3

# So many of the contacts of a pair are chosen among those that touch, as long as there are any: a body has as many
# degrees of freedom, and is not held by others that are near.
HOLDING = 6
# A contact open by less than this share of the shape's size touches: what bears in the end of a step is left closed
# to 1e-9 of it. Larger: what is open takes the place of what bears, and the body settles by that much, on and on.
TOUCHING = 1e-8

# [rad] From here on a path to first order in the turn (path.py) does not tell what will strike.
BEYOND_PATH = 0.5

# Candidates closer than this in position, relative to the shape's size, and in unit normal are one contact.
MERGE_DISTANCE = 1e-6
SAME_NORMAL = 1e-6

# Features. A part of the terrain is its kind and number; numbers beyond this one wrap around, which only the warm start
# would notice.
FACE_PLACE, EDGE_PLACE, VERTEX_PLACE, WALL_PLACE = 0, 1, 2, 3
PLACE_NUMBERS = 1 << 24
# What a contact belongs to, above the number of the part of the moving shape and its place.
POINT, CROSSING, TERRAIN_VERTEX = 0, 1, 2
PARTS = 1 << 24


@kernel
def _score(scratch, number):
    return scratch[SCORE_ROW + (number >> 3), number & 7]


@kernel
def _put_score(scratch, number, value):
    scratch[SCORE_ROW + (number >> 3), number & 7] = value


@kernel
def reduce_candidates(scratch, count, most):
    """Keep ``most`` candidates, the deepest first; return how many there are."""
    if count == most:
        return count
    scale = scale_of(scratch)
    normal_weight = (NORMAL_WEIGHT * scale) ** 2
    seen = path_in(scratch)
    if vec3.norm_squared(seen[1]) > BEYOND_PATH * BEYOND_PATH:
        seen = (vec3.ZERO, vec3.ZERO)
    tilt = 0.0
    last = 0.0
    touching = TOUCHING * scale
    for kept in range(most):
        chosen = kept
        best = -math.inf
        bears = -math.inf
        holding = kept
        lowest = 0.0
        lowest_bearing = 0.0
        for i in range(kept, count):
            out = (scratch[i, 3], scratch[i, 4], scratch[i, 5])
            way = vec3.dot(out, displacement(seen, (scratch[i, 0], scratch[i, 1], scratch[i, 2])))
            end = scratch[i, 6] + min(way, 0.0)
            score = -end
            if kept > 0:
                # How far it may come below the last one kept; all others were looked at before.
                position = 0.0
                normal = 0.0
                for k in range(3):
                    position += (scratch[i, k] - scratch[kept - 1, k]) ** 2
                    normal += (scratch[i, 3 + k] - scratch[kept - 1, 3 + k]) ** 2
                score += last + tilt * math.sqrt(position + normal_weight * normal)
                if kept > 1:
                    score = min(score, _score(scratch, i))
                _put_score(scratch, i, score)
            if score > best:
                best = score
                chosen = i
                lowest = end
            if kept < HOLDING and scratch[i, 6] <= touching and score > bears:
                bears = score
                holding = i
                lowest_bearing = end
        if kept > 0 and bears > 0.0:
            chosen = holding
            lowest = lowest_bearing
        last = lowest
        if kept == 0:
            tilt = (max(falloff_of(scratch), MERGE_DISTANCE * scale) - min(lowest, 0.0)) / scale
        if chosen != kept:
            for k in range(8):
                other = scratch[kept, k]
                scratch[kept, k] = scratch[chosen, k]
                scratch[chosen, k] = other
            _put_score(scratch, chosen, _score(scratch, kept))
    return most


@kernel
def feature_of(owner, part, kind, number):
    """The feature of part number ``part`` of the moving shape with one of the terrain, below 2^52.

    ``owner``: POINT, CROSSING or TERRAIN_VERTEX; ``kind``, ``number``: of the part of the terrain.
    """
    return (((owner * PARTS + part) << 2) + kind) * PLACE_NUMBERS + number % PLACE_NUMBERS


@kernel
def is_terrain_vertex(feature):
    """Whether a contact belongs to a vertex of the terrain, and the moving shape carries the normal."""
    return feature < SLIDING and (feature >> PLACE_BITS) // PARTS == TERRAIN_VERTEX


@kernel
def is_on(feature, kind):
    """Whether the part of the terrain that a feature names is of this kind."""
    return (feature // PLACE_NUMBERS) & 3 == kind


@kernel
def is_point_on_face(feature):
    """Whether a candidate, not yet emitted, belongs to a point over a face."""
    return feature >> PLACE_BITS < PARTS and is_on(feature, FACE_PLACE)


@kernel
def add_candidate(scratch, count, position, out, gap, feature):
    """Append a candidate unless it is there already; return the new count.

    Args:
        scratch: (264, 8).
        count: number of candidates.
        position: [m] midway between the surfaces, terrain frame.
        out: unit, from the terrain to the shape.
        gap: [m].
        feature: see above.
    """
    near = MERGE_DISTANCE * scale_of(scratch)
    for i in range(count):
        if (
            abs(scratch[i, 0] - position[0]) <= near
            and abs(scratch[i, 1] - position[1]) <= near
            and abs(scratch[i, 2] - position[2]) <= near
            and abs(scratch[i, 3] - out[0]) + abs(scratch[i, 4] - out[1]) + abs(scratch[i, 5] - out[2]) <= SAME_NORMAL
        ):
            scratch[i, 6] = min(scratch[i, 6], gap)
            scratch[i, 7] = min(scratch[i, 7], feature)
            return count
    if count == CAPACITY:
        count = reduce_candidates(scratch, count, count >> 1)
    put(scratch, count, 0, position)
    put(scratch, count, 3, out)
    scratch[count, 6] = gap
    scratch[count, 7] = feature
    return count + 1


@kernel
def emit_candidates(scratch, num_candidates, position_b, rotation_b, contacts, count):
    """Reduce the candidates and emit them in the world frame; return the new count of contacts."""
    num_candidates = reduce_candidates(scratch, num_candidates, min(num_candidates, MOST_ON_TERRAIN))
    done = -1
    for _ in range(num_candidates):
        # In the order of their features, which stays from step to step and does not depend on the triangulation.
        i = -1
        for j in range(num_candidates):
            later = done < 0 or scratch[j, 7] > scratch[done, 7] or (scratch[j, 7] == scratch[done, 7] and j > done)
            if later and (i < 0 or scratch[j, 7] < scratch[i, 7]):
                i = j
        done = i
        feature = np.int64(scratch[i, 7])
        if feature >> PLACE_BITS < PARTS:
            feature += SLIDING
        here = vec3.add(position_b, mat3.apply(rotation_b, (scratch[i, 0], scratch[i, 1], scratch[i, 2])))
        into = mat3.apply(rotation_b, (-scratch[i, 3], -scratch[i, 4], -scratch[i, 5]))
        count = emit(contacts, count, here, into, scratch[i, 6], feature)
    return count
