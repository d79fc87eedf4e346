"""The faces of a mesh near a shape, found in its tree and listed in the scratch table.

Numbers of faces lie there from LIST_ROW on, eight a row.
"""

from __future__ import annotations

import math

from ..jit import kernel
from ..maths import vec3
from ..shapes.static_tree import FACES_OF_LEAF, is_clear
from .mesh_side import corners_of
from .path import NEAR_MOTIONS
from .terrain_shape import (
    BOUNDS_ROW,
    CENTER_ROW,
    END_FREE_ROW,
    FIRST_FREE_ROW,
    axes_of,
    core_path_of,
    get,
    girth_of,
    margin_of,
    radius_of,
    rest_of,
)

# Eight rows before are for the corners of the shape (mesh.py).
LIST_ROW = FIRST_FREE_ROW + 8
# A list with more faces than this has no room for those of another leaf.
LISTED_FACES = 8 * (END_FREE_ROW - LIST_ROW) - FACES_OF_LEAF


@kernel
def listed_face(scratch, item):
    """Number of the face at this place of the list."""
    return int(scratch[LIST_ROW + (item >> 3), item & 7])


@kernel
def put_listed_face(scratch, item, index):
    """Put a face at this place of the list."""
    scratch[LIST_ROW + (item >> 3), item & 7] = index


@kernel
def core_of(scratch):
    """The shape as ``list_near`` asks for it; see there."""
    return (
        get(scratch, CENTER_ROW, 0),
        axes_of(scratch),
        get(scratch, CENTER_ROW, 3),
        girth_of(scratch),
        radius_of(scratch),
        margin_of(scratch),
        core_path_of(scratch),
        rest_of(scratch),
        get(scratch, BOUNDS_ROW, 0),
        get(scratch, BOUNDS_ROW, 3),
    )


@kernel
def _extent(axes, half, girth, n):
    """How far [m, times the length of n] the core reaches along n."""
    x = axes[0] * n[0] + axes[3] * n[1] + axes[6] * n[2]
    y = axes[1] * n[0] + axes[4] * n[1] + axes[7] * n[2]
    z = axes[2] * n[0] + axes[5] * n[1] + axes[8] * n[2]
    return min(abs(x) * half[0] + abs(y) * half[1], girth * math.sqrt(x * x + y * y)) + abs(z) * half[2]


@kernel
def _meets_core(node, center, axes, half, girth, reach):
    """Whether the box of a tree node comes within reach of the core, along the axes of the core and from its third.

    Separating axes of two boxes (Gottschalk et al. 1996, "OBBTree", sec. 5) without those across their edges.
    """
    low = vec3.load(node.lower)
    high = vec3.load(node.upper)
    r = vec3.sub(vec3.scale(0.5, vec3.add(low, high)), center)
    extent = vec3.scale(0.5, vec3.sub(high, low))
    x = abs(vec3.dot((axes[0], axes[3], axes[6]), r))
    x -= abs(axes[0]) * extent[0] + abs(axes[3]) * extent[1] + abs(axes[6]) * extent[2]
    if x > half[0] + reach:
        return False
    y = abs(vec3.dot((axes[1], axes[4], axes[7]), r))
    y -= abs(axes[1]) * extent[0] + abs(axes[4]) * extent[1] + abs(axes[7]) * extent[2]
    if y > half[1] + reach:
        return False
    z = abs(vec3.dot((axes[2], axes[5], axes[8]), r))
    z -= abs(axes[2]) * extent[0] + abs(axes[5]) * extent[1] + abs(axes[8]) * extent[2]
    if z > half[2] + reach:
        return False
    x = max(x, 0.0)
    y = max(y, 0.0)
    return x * x + y * y <= (girth + reach) * (girth + reach)


@kernel
def _is_beside(a, b, n, core):
    """Whether the core stays beyond the edge from a to b of a face with normal n, seen along the face."""
    center, axes, half, girth, radius, margin, path, rest, _, _ = core
    m = vec3.cross(vec3.sub(b, a), n)
    length = vec3.norm(m)
    far = NEAR_MOTIONS * max(0.0, -vec3.dot(m, path)) + rest * length
    reach = radius * length + min(margin * length, far)
    return vec3.dot(m, vec3.sub(center, a)) > _extent(axes, half, girth, m) + reach


@kernel
def leaves_near(nodes, core):
    """The first leaf of a tree that the shape can touch, and the node behind the last one; both 0 if there is none.

    ``core``: see ``list_near``.
    """
    center, axes, half, girth, radius, margin, _, _, lower, upper = core
    first = 0
    end = 0
    node = 0
    while node < nodes.shape[0]:
        here = nodes[node]
        if is_clear(here, lower, upper) or not _meets_core(here, center, axes, half, girth, radius + margin):
            node = int(here.skip)
            continue
        if here.count > 0:
            first = node if end == 0 else first
            end = node + 1
        node += 1
    return first, end


@kernel
def list_near(vertices, faces, nodes, node, end, two_sided, core, capacity, scratch):
    """List the faces that a shape can touch, of the nodes from ``node`` to ``end``, until there are over ``capacity``.

    A face counts as far from its plane, and from those through its edges at right angles to it, as the motion of the
    step can carry the core towards them (path.py): what stays beyond one of them touches neither face nor edges.

    Args:
        core: center [m], rotation and half extents [m] of the box of the core, in the mesh's frame; how far [m] it
            reaches from its third axis; radius, margin [m]; how its middle moves [m], and how near [m] counts whatever
            moves; bounds, lower and upper [m].

    Returns:
        Their number, and the node to go on with; ``end`` or beyond when all are listed. With capacity 0 it is the node
        behind the leaf of the first face.
    """
    center, axes, half, girth, radius, margin, path, rest, lower, upper = core
    count = 0
    while node < end and count <= capacity:
        here = nodes[node]
        if is_clear(here, lower, upper) or not _meets_core(here, center, axes, half, girth, radius + margin):
            node = int(here.skip)
            continue
        for index in range(here.first, here.first + here.count):
            face = faces[index]
            n = vec3.load(face.normal)
            a, b, c = corners_of(vertices, face)
            height = vec3.dot(n, vec3.sub(center, a))
            toward = -vec3.dot(n, path)
            if two_sided:
                # On whichever side: mesh_side.py asks for more than the plane of the face.
                height, toward = abs(height), abs(toward)
            closing = NEAR_MOTIONS * max(0.0, toward) + rest
            if height > _extent(axes, half, girth, n) + radius + min(margin, closing):
                continue
            low = vec3.min_(vec3.min_(a, b), c)
            high = vec3.max_(vec3.max_(a, b), c)
            if (
                low[0] > upper[0]
                or low[1] > upper[1]
                or low[2] > upper[2]
                or high[0] < lower[0]
                or high[1] < lower[1]
                or high[2] < lower[2]
            ):
                continue
            if _is_beside(a, b, n, core) or _is_beside(b, c, n, core) or _is_beside(c, a, n, core):
                continue
            put_listed_face(scratch, count, index)
            count += 1
        node += 1
    return count, node


@kernel
def list_faces(vertices, faces, nodes, node, two_sided, scratch):
    """``list_near`` for the shape in the scratch table, in the whole tree, as many as fit into the table."""
    return list_near(vertices, faces, nodes, node, nodes.shape[0], two_sided, core_of(scratch), LISTED_FACES, scratch)
