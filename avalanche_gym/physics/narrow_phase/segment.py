"""Closest points of two segments: the heart of every pair of edges and of capsules.

A segment is a centre, a unit direction and a half length. With centres ``r`` apart, directions u and v and parameters
s and t, the connecting vector is r + t v - s u. The lines are closest where it is parallel to w = u x v, hence

    s = (r x v) . w / |w|^2,    t = (r x u) . w / |w|^2.

The triple products keep full relative accuracy when w is small, where the usual (u.r - (u.v)(v.r)) / (1 - (u.v)^2)
loses it twice. Clamping s, then t, then s again gives the closest points of the segments (Ericson 2005, sec. 5.1.9).
"""

from __future__ import annotations

from ..jit import kernel
from ..maths import vec3

# Sine of the angle below which two lines count as parallel: their crossing then lies further away than the lengths in
# use can tell from infinity, and any point of the common stretch is closest to within this fraction of the length.
PARALLEL_LINES = 1e-14


@kernel
def clamp(value, limit):
    """``value`` within [-limit, limit]."""
    return min(max(value, -limit), limit)


@kernel
def stretch_ends(along, length_a, cosine, length_b):
    """The parameters of a, lower and upper, between which b lies beside it; empty if lower > upper.

    ``along`` is the centre of b measured along a [m], ``cosine`` the one between the directions.
    """
    reach = abs(cosine) * length_b
    return max(-length_a, along - reach), min(length_a, along + reach)


@kernel
def closest_parameters(r, u, length_a, v, length_b):
    """Parameters (s, t) [m] of the closest points u s of the first segment and r + v t of the second.

    ``r`` centre of the second seen from the first [m]; ``u``, ``v`` unit directions; ``length_a``, ``length_b`` half
    lengths.
    """
    w = vec3.cross(u, v)
    sine_squared = vec3.norm_squared(w)
    cosine = vec3.dot(u, v)
    along_u = vec3.dot(u, r)
    along_v = vec3.dot(v, r)
    if sine_squared > PARALLEL_LINES * PARALLEL_LINES:
        s = clamp(vec3.dot(vec3.cross(r, v), w) / sine_squared, length_a)
    else:
        lower, upper = stretch_ends(along_u, length_a, cosine, length_b)
        s = clamp(0.5 * (lower + upper), length_a)
    t = clamp(cosine * s - along_v, length_b)
    s = clamp(cosine * t + along_u, length_a)
    return s, t
