"""A moving mesh as terrain sees it: the leaves of its tree that are near, one after the other.

A leaf takes the place of the moving shape of terrain_shape.py: the box around its few faces, their vertices and edges
that stick out, and the faces themselves. Each vertex and edge belongs to one face, hence to one leaf, so nothing is
found twice. What a leaf lists of the terrain lies near the leaf: the cost is that of the triangles near the contact.

Contacts are pairs of features whose cones hold the normal, as everywhere on terrain (mesh_vertices.py, mesh_edges.py):

    vertex of the mesh   over a face of the terrain (done by the terrain), beside an edge of the terrain
    edge of the mesh     across an edge of the terrain, beside a vertex of the terrain
    face of the mesh     over a vertex of the terrain

The cone of the terrain's feature holds the normal exactly. That of the mesh may miss it by ``TILT``, so that a mesh
that lies flat keeps all of its support whatever round-off does.

Features: a vertex that slides over faces is named by twice its number, plus one if it belongs to the second shape of
the pair; then the face turns the normal, and belongs to the other shape.
"""

from __future__ import annotations

import math

import numpy as np

from ..jit import kernel
from ..maths import mat3, vec3
from ..model import PLACE_BITS, SLIDING
from .path import NEAR_MOTIONS, displacement, seen_from
from .terrain_candidates import CROSSING, PARTS
from .terrain_shape import BOUNDS_ROW, put, put_core, put_path, rank_by_motion, set_motion, set_scale

# Whatever is asked for, a mesh sees as deep into itself as this share of its size. Larger: more triangles to look at;
# smaller: more often those have to be looked at that DEEPEST says.
SKIN = 1e-3
# Where bodies overlap they see down to this share of the smaller one, or as far as they move. Larger: more triangles
# to look at then; smaller: what a step failed to stop may stay where it is.
DEEPEST = 0.03
# What is within this share of the margin is listed whatever moves; path.py says how much farther it counts. Larger:
# more triangles to look at; smaller: a mesh that is struck by another in the step may dip by that much.
NEAR_MARGIN = 0.25
# Share of the motion within a step by which impulses spoil what is foreseen of the gaps: contacts that are farther open
# than that count less. Larger: near contacts give way to far ones that do not close.
FORESEEN = 0.1


@kernel
def half_diagonal(mesh):
    """[m] of the box around a mesh: the scale of its tolerances."""
    return 0.5 * vec3.norm(vec3.sub(vec3.load(mesh.upper), vec3.load(mesh.lower)))


@kernel
def near_margin(margin, loose):
    """[m] within which contacts are looked for first, beside what the path says."""
    return min(margin, NEAR_MOTIONS * loose + NEAR_MARGIN * margin)


@kernel
def far_margin(margin, motion, loose):
    """[m] the same where nothing is that near: another body may come and push."""
    return min(margin, margin - motion + NEAR_MOTIONS * loose)


@kernel
def falloff_by(margin, motion):
    """[m] from which on contacts that are open at the end of the step count less (terrain_candidates.py)."""
    return FORESEEN * motion + NEAR_MARGIN * margin


@kernel
def prospects(margin, flight, sense, position, rotation):
    """What a mesh that moves against terrain at this place may meet within the step.

    Args:
        margin: [m] of the query.
        flight: ``motion`` [m], ``path`` and ``loose`` [m] of the query.
        sense: 1.0 if the mesh is the second shape of the pair, -1.0 if it is the first.

    Returns:
        Its path in the terrain's frame (path.py), the falloff, and the margins to look within: first, and then.
    """
    motion, path, loose = flight
    near = near_margin(margin, loose)
    far = far_margin(margin, motion, loose)
    return seen_from(path, sense, position, rotation), falloff_by(margin, motion), near, far


@kernel
def depths(scale, flight):
    """[m] how deep bodies of this size [m] see into each other: always, and where they overlap."""
    return SKIN * scale, max(DEEPEST * scale, flight[0])


@kernel
def box_of(node):
    """Middle and half extents [m] of the box of a tree node, in the mesh's frame."""
    lower = (np.float64(node.lower[0]), np.float64(node.lower[1]), np.float64(node.lower[2]))
    upper = (np.float64(node.upper[0]), np.float64(node.upper[1]), np.float64(node.upper[2]))
    return vec3.scale(0.5, vec3.add(lower, upper)), vec3.scale(0.5, vec3.sub(upper, lower))


@kernel
def lowest_corner(vertices, faces, node, n):
    """The lowest that the vertices of a leaf reach along n, in the mesh's frame [m, times the length of n]."""
    reach = math.inf
    for index in range(node.first, node.first + node.count):
        for k in range(3):
            reach = min(reach, vec3.dot(n, vec3.load(vertices[faces[index].vertices[k]].position)))
    return reach


@kernel
def is_near_plane(height, n, path, margin, rest):
    """Whether what is this high [m, times the length of n] above a plane with normal n counts as near to it."""
    if height <= 0.0:
        return True
    beyond = max(0.0, height - NEAR_MOTIONS * max(0.0, -vec3.dot(n, path)))
    square = vec3.norm_squared(n)
    return beyond * beyond <= rest * rest * square and height * height <= margin * margin * square


@kernel
def node_core(vertices, faces, node, origin, axes, margin, rest, seen):
    """A node of the moving mesh as ``list_near`` (mesh_faces.py) asks for it, the bounds drawn to what it can meet.

    Args:
        node: NODE_ROW of the mesh.
        origin, axes: place of the mesh in the terrain's frame.
        margin: [m] of the query.
        rest: [m] how near counts whatever moves.
        seen: path of the mesh in the terrain's frame (path.py).
    """
    middle, half = box_of(node)
    center = vec3.add(origin, mat3.apply(axes, middle))
    path = displacement(seen, center)
    rest = min(margin, rest + NEAR_MOTIONS * math.sqrt(vec3.norm_squared(seen[1]) * vec3.norm_squared(half)))
    far = NEAR_MOTIONS * vec3.norm(path)
    margin = min(margin, far + rest)
    low = center
    high = center
    if node.count > 0:
        for index in range(node.first, node.first + node.count):
            face = faces[index]
            for k in range(3):
                local = vec3.load(vertices[face.vertices[k]].position)
                p = vec3.add(origin, mat3.apply(axes, local))
                low = vec3.min_(low, p)
                high = vec3.max_(high, p)
    else:
        extent = (
            abs(axes[0]) * half[0] + abs(axes[1]) * half[1] + abs(axes[2]) * half[2],
            abs(axes[3]) * half[0] + abs(axes[4]) * half[1] + abs(axes[5]) * half[2],
            abs(axes[6]) * half[0] + abs(axes[7]) * half[1] + abs(axes[8]) * half[2],
        )
        low = vec3.sub(center, extent)
        high = vec3.add(center, extent)
    # The ball of path.py, and the margin where that is less.
    ball = 0.5 * far + rest
    ahead = vec3.scale(0.5 * NEAR_MOTIONS, path)
    reach = (margin, margin, margin)
    lower = vec3.max_(vec3.sub(low, reach), vec3.sub(vec3.add(low, ahead), (ball, ball, ball)))
    upper = vec3.min_(vec3.add(high, reach), vec3.add(vec3.add(high, ahead), (ball, ball, ball)))
    girth = math.sqrt(half[0] * half[0] + half[1] * half[1])
    return center, axes, half, girth, 0.0, margin, path, rest, lower, upper


@kernel
def put_node(core, seen, scale, falloff, scratch):
    """Describe a node, ``core`` of node_core, in the scratch table; ``scale`` [m] is the size of the mesh."""
    center, axes, half, _, _, margin, path, rest, lower, upper = core
    put_core(center, axes, half, 0.0, margin, scratch)
    put(scratch, BOUNDS_ROW, 0, lower)
    put(scratch, BOUNDS_ROW, 3, upper)
    put_path(seen, path, rest, scratch)
    set_scale(scale, scratch)
    # Its parts go no farther than its middle and the turn about that lead; impulses only shorten the way (path.py).
    sway = math.sqrt(vec3.norm_squared(seen[1]) * vec3.norm_squared(half))
    set_motion(vec3.norm(path) + sway, scratch)
    rank_by_motion(falloff, scratch)


@kernel
def turn_round(contacts, first, count):
    """Reverse the normals of the contacts from ``first`` on: the terrain was the first shape of the pair."""
    for index in range(first, min(count, contacts.shape[0])):
        vec3.store(contacts[index].normal, vec3.neg(vec3.load(contacts[index].normal)))


@kernel
def is_crossing(feature):
    """Whether a contact of a mesh belongs to two crossing edges."""
    return feature < SLIDING and (feature >> PLACE_BITS) // PARTS == CROSSING


@kernel
def is_of_second(feature):
    """Whether the vertex of a contact belongs to the second shape of the pair, so that the first carries the normal."""
    return feature >> PLACE_BITS & 1 == 1
