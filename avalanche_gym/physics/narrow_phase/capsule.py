"""Capsule against capsule; capsule_box.py chooses its contacts in the same way.

Every point of a capsule's axis carries a ball, and a ball against the other shape is a contact in closed form. A
manifold is therefore a choice of points on the axis: the closest one, and the two ends of the stretch that lies beside
the other shape's edge or face. Each has its own exact normal and gap; the closest one is left out where an end is as
close, so that a capsule at rest keeps its two contacts.

Only where the axes themselves cross is there no such ball, and the normal is at right angles to both.
"""

from __future__ import annotations

import math

import numpy as np

from ..jit import kernel
from ..maths import mat3, vec3
from .segment import clamp, closest_parameters, stretch_ends
from .sphere import CORES_TOUCH, emit_round

# Features: the lower and the upper end of the common stretch, measured along the first capsule, and the closest point.
LOWER_END, UPPER_END, CLOSEST = 0, 1, 2

# Sine of the angle between two axes, or an axis and a face or edge, below which the ends of the stretch get contacts.
# Above it the ends rise so steeply that the closest point alone supports the capsule.
STRETCH_SLOPE = 0.05


# A stretch must be this much longer than nothing, relative to the pair's size, to have two ends.
SHORTEST_STRETCH = 1e-3

# An end counts as close as the closest point if it is so within this fraction of the pair's size.
AS_CLOSE = 1e-10

# Cross products of unit vectors shorter than this are no axes: the faces decide.
SHORTEST_CROSS = 1e-6


@kernel
def emit_stretch_ends(
    origin, r, u, length_a, radius_a, v, length_b, radius_b, fallback, size, margin, first_feature, contacts, count
):
    """Contacts at both ends of the common stretch of two nearly parallel rounded lines; new count, smaller gap.

    The lines are (0, u, length_a) and (r, v, length_b): centre, unit axis, half length; ``origin`` is the centre of the
    first in the world. Too short a stretch has no ends: no contact, infinite gap.
    """
    cosine = vec3.dot(u, v)
    lower, upper = stretch_ends(vec3.dot(u, r), length_a, cosine, length_b)
    least = math.inf
    if upper - lower > SHORTEST_STRETCH * size:
        for end in range(2):
            limit = upper if end == UPPER_END else lower
            if abs(limit) < length_a:
                # An end of b: which one follows from the sense of its axis.
                side = length_b if (end == UPPER_END) == (cosine > 0.0) else -length_b
                end_b = vec3.add_scaled(r, side, v)
                end_a = vec3.scale(clamp(vec3.dot(u, end_b), length_a), u)
            else:
                end_a = vec3.scale(limit, u)
                end_b = vec3.add_scaled(r, clamp(vec3.dot(v, vec3.sub(end_a, r)), length_b), v)
            apart = math.sqrt(vec3.norm_squared(vec3.sub(end_b, end_a)))
            least = min(least, apart - radius_a - radius_b)
            count = emit_round(
                origin,
                end_a,
                radius_a,
                end_b,
                radius_b,
                CORES_TOUCH * size,
                fallback,
                margin,
                first_feature + end,
                contacts,
                count,
            )
    return count, least


@kernel
def capsule_capsule(position_a, rotation_a, size_a, position_b, rotation_b, size_b, margin, contacts, count):
    """One contact; side by side two, and a third where nearly parallel axes cross between them."""
    u = mat3.column(rotation_a, 2)
    v = mat3.column(rotation_b, 2)
    radius_a, length_a = size_a[0], size_a[1]
    radius_b, length_b = size_b[0], size_b[1]
    r = vec3.sub(position_b, position_a)
    size = radius_a + length_a + radius_b + length_b
    if vec3.norm_squared(r) > (size + margin) ** 2:
        return count
    s, t = closest_parameters(r, u, length_a, v, length_b)
    core_a = vec3.scale(s, u)
    core_b = vec3.add_scaled(r, t, v)
    gap = math.sqrt(vec3.norm_squared(vec3.sub(core_b, core_a))) - radius_a - radius_b
    if gap > margin:
        return count
    across = vec3.cross(u, v)
    sine = math.sqrt(vec3.norm_squared(across))
    if sine > SHORTEST_CROSS:
        across = vec3.scale(1.0 / sine, across)
    else:
        across, _ = vec3.tangents(u)
    least = math.inf
    if sine < STRETCH_SLOPE:
        count, least = emit_stretch_ends(
            position_a,
            r,
            u,
            length_a,
            radius_a,
            v,
            length_b,
            radius_b,
            across,
            size,
            margin,
            np.int64(LOWER_END),
            contacts,
            count,
        )
    if least > gap + AS_CLOSE * size:
        count = emit_round(
            position_a,
            core_a,
            radius_a,
            core_b,
            radius_b,
            CORES_TOUCH * size,
            across,
            margin,
            np.int64(CLOSEST),
            contacts,
            count,
        )
    return count
