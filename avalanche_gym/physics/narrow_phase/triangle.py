"""Geometry of one triangle and of its edges.

The *normal cone* of a feature of a surface holds the directions in which that feature is the nearest one: a point ``p
= q + s d`` with small ``s > 0`` has ``q`` as a closest point exactly if ``d . t <= 0`` for every direction ``t`` that
leads from ``q`` along the surface. For a point inside an edge with unit direction ``e`` these are ``+-e`` and the two
directions ``m1``, ``m2`` that lead from the edge into its two faces, at right angles to it; for a vertex they are the
edges that leave it. The cone of a flat edge is a single line and that of a concave one is empty, on the free side:
nothing can catch on them.
"""

from __future__ import annotations

from ..jit import kernel
from ..maths import vec3

# Slack of a test "inside a triangle" or "inside a cone", relative to the lengths in it. Neighbouring regions overlap by
# this much, so that round-off opens no gap between them; the contact found twice there is merged.
REGION_SLACK = 1e-9

# What a closest point lies on: the inside, edge k (from vertex k to k + 1) as 1 + k, vertex k as 4 + k.
INSIDE, EDGE, VERTEX = 0, 1, 4


@kernel
def closest_point(p, a, b, c):
    """Closest point of a triangle to p, and what it lies on.

    Ericson 2005, "Real-Time Collision Detection", section 5.1.5: signs of the barycentric coordinates, from six
    products.
    """
    ab = vec3.sub(b, a)
    ac = vec3.sub(c, a)
    ap = vec3.sub(p, a)
    d1 = vec3.dot(ab, ap)
    d2 = vec3.dot(ac, ap)
    if d1 <= 0.0 and d2 <= 0.0:
        return a, VERTEX
    bp = vec3.sub(p, b)
    d3 = vec3.dot(ab, bp)
    d4 = vec3.dot(ac, bp)
    if d3 >= 0.0 and d4 <= d3:
        return b, VERTEX + 1
    vc = d1 * d4 - d3 * d2
    if vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        return vec3.add_scaled(a, d1 / (d1 - d3), ab), EDGE
    cp = vec3.sub(p, c)
    d5 = vec3.dot(ab, cp)
    d6 = vec3.dot(ac, cp)
    if d6 >= 0.0 and d5 <= d6:
        return c, VERTEX + 2
    vb = d5 * d2 - d1 * d6
    if vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        return vec3.add_scaled(a, d2 / (d2 - d6), ac), EDGE + 2
    va = d3 * d6 - d5 * d4
    if va <= 0.0 and d4 - d3 >= 0.0 and d5 - d6 >= 0.0:
        w = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        return vec3.add_scaled(b, w, vec3.sub(c, b)), EDGE + 1
    # The foot on the plane: barycentric coordinates of a needle are off by the round-off of its length over its width.
    n = vec3.cross(ab, ac)
    return vec3.add_scaled(p, -vec3.dot(n, ap) / vec3.norm_squared(n), n), INSIDE


@kernel
def beyond_edge(p, a, b, normal):
    """Whether p lies beyond the edge from a to b, seen along the unit normal of its face, by more than the slack."""
    e = vec3.sub(b, a)
    return vec3.dot(vec3.cross(e, normal), vec3.sub(p, a)) > REGION_SLACK * vec3.norm_squared(e)


@kernel
def in_prism(p, a, b, c, normal):
    """Whether p lies over (or under) the triangle, along its unit normal, up to the slack."""
    return not (beyond_edge(p, a, b, normal) or beyond_edge(p, b, c, normal) or beyond_edge(p, c, a, normal))
