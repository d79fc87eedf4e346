"""Edges and vertices of a terrain, listed, and the normal cones that they own.

A kind of terrain (height field, mesh) lists the edges and vertices that stick out near the shape; feature_contacts.py,
terrain_cylinder.py and terrain_hull.py meet them with the shape. The list lies in the scratch table (terrain_shape.py)
from FIRST_FEATURE_ROW on:

    edge:    (0, start, direction e, length), (m1, m2, how far it counts before its start, beyond its end),
             (out, number, -, -, -, -)
    vertex:  (number of spokes, position, out, vertex number), then one row (t, -, -, -, -, -) a spoke

m1 and m2 lead from an edge into its two faces, the spokes t from a vertex along its edges (e is a unit
vector; m1 and m2 are at least that long), ``out`` points to the free side. They make the normal cone of triangle.py.
"""

from __future__ import annotations

import math

from ..jit import kernel
from ..maths import vec3
from .terrain_shape import get, put, turned_of
from .triangle import REGION_SLACK

# [rad] How far from flat a face of a box may lie on an edge or vertex of the terrain, and still be supported by all of
# its corners and not only by the lowest. Smaller: a resting box may rock; larger: contacts that carry nothing.
TILT = 0.02

# Two edges are parallel below this sine; their contact is that of the end points, which are vertices of one of them.
PARALLEL = 1e-7

MOST_SPOKES = 32  # of a vertex in the list; a mesh vertex with more takes its part with the first ones


@kernel
def put_edge(scratch, row, start, e, length, m1, m2, out, number):
    """Append an edge to the list of features; return the next free row."""
    scratch[row, 0] = 0.0
    put(scratch, row, 1, start)
    put(scratch, row, 4, e)
    scratch[row, 7] = length
    put(scratch, row + 1, 0, m1)
    put(scratch, row + 1, 3, m2)
    scratch[row + 1, 6] = 0.0
    scratch[row + 1, 7] = 0.0
    put(scratch, row + 2, 0, out)
    scratch[row + 2, 3] = number
    return row + 3


@kernel
def counts_there(scratch, row, t, gap):
    """Whether a part at t [m] along the line of an edge, and ``gap`` [m] off it, meets the edge.

    Where an edge ends in a concave bend its line goes on below the surface, and holds what is above as well as the edge
    itself does: what slides along one edge has to know the next before it gets there.
    """
    length = scratch[row, 7]
    if abs(t - 0.5 * length) <= (0.5 + REGION_SLACK) * length:
        return True
    return gap >= 0.0 and -scratch[row + 1, 6] <= t <= length + scratch[row + 1, 7]


@kernel
def in_edge_cone(scratch, row, d):
    return (
        vec3.dot(d, get(scratch, row + 1, 0)) <= REGION_SLACK
        and vec3.dot(d, get(scratch, row + 1, 3)) <= REGION_SLACK
        and vec3.dot(d, get(scratch, row + 2, 0)) > 0.0
    )


@kernel
def into_edge_cone(scratch, row, d):
    """Whether d, at right angles to an edge, is in its cone up to TILT; and the direction in the cone next to it."""
    if vec3.dot(d, get(scratch, row + 2, 0)) <= 0.0:
        return False, d
    m = get(scratch, row + 1, 0)
    beyond = vec3.dot(d, m)
    other = vec3.dot(d, get(scratch, row + 1, 3))
    if other > beyond:
        m = get(scratch, row + 1, 3)
        beyond = other
    if beyond <= REGION_SLACK:
        return True, d
    square = vec3.norm_squared(m)
    if beyond * beyond > TILT * TILT * square:
        return False, d
    d = vec3.normalize(vec3.add_scaled(d, -beyond / square, m))
    return in_edge_cone(scratch, row, d), d


@kernel
def meet_along(r, e, b, d):
    """Where two lines meet, seen along d, which is at right angles to e.

    The lines are t e and r + u b. Returns t, u and how far the second is beyond the first along d.
    """
    across = vec3.cross(e, d)
    u = -vec3.dot(r, across) / vec3.dot(b, across)
    meeting = vec3.add_scaled(r, u, b)
    return vec3.dot(meeting, e), u, vec3.dot(meeting, d)


@kernel
def can_turn_to(scratch, gap, slack):
    """Sine of the angle by which a normal may miss the cone of a vertex ``gap`` [m] off: ``slack``, or how it turns.

    A solid of many corners that turns far within the step strikes with one that is not its nearest now. Where it turns
    by less than TILT the next one is about as near, and is found in the next step.
    """
    turned = turned_of(scratch)
    if gap < 0.0 or turned <= TILT:
        return slack
    return max(slack, math.sin(turned)) if turned < 0.5 * math.pi else 1.0


@kernel
def in_vertex_cone(scratch, row, d, slack):
    """Whether d lies in the cone of a vertex, up to an angle of this sine; 1.0: on whatever side."""
    inside = slack >= 1.0 or vec3.dot(d, get(scratch, row, 4)) > 0.0
    for spoke in range(row + 1, row + 1 + int(scratch[row, 0])):
        t = get(scratch, spoke, 0)
        along = vec3.dot(d, t)
        if along > 0.0 and along * along > slack * slack * vec3.norm_squared(t):
            inside = False
            break
    return inside


@kernel
def star_depth(scratch, row, d):
    """How much farther [m] than a vertex its edges reach along d: where its cone does not hold d, they go deeper."""
    deepest = 0.0
    for spoke in range(row + 1, row + 1 + int(scratch[row, 0])):
        deepest = max(deepest, vec3.dot(d, get(scratch, spoke, 0)))
    return deepest
