"""A triangle mesh against a plane: its vertices that stick out and are near the plane.

Vertices of a flat face, or of a valley, carry nothing that the others do not. The plane takes the part of the terrain
(terrain_candidates.py), with its normal reversed, for it is the first shape of the pair.
"""

from __future__ import annotations

import math

import numpy as np

from ..jit import kernel
from ..maths import mat3, vec3
from .mesh_pieces import box_of, prospects
from .path import NEAR_MOTIONS, displacement
from .terrain_candidates import TERRAIN_VERTEX, VERTEX_PLACE, add_candidate, emit_candidates, feature_of
from .terrain_shape import in_frame, put_core, put_path, rank_by_motion

DOWN = (0.0, 0.0, -1.0)


@kernel
def _lowest(node, down):
    """The largest coordinate [m] of a node's box along ``down``."""
    reach = 0.0
    for axis in range(3):
        reach += down[axis] * (node.upper[axis] if down[axis] > 0.0 else node.lower[axis])
    return reach


@kernel
def _falls(seen, origin, axes, node):
    """[m] how much a part of a node may come down within the step by itself."""
    middle, half = box_of(node)
    center = vec3.add(origin, mat3.apply(axes, middle))
    sway = math.sqrt(vec3.norm_squared(seen[1]) * vec3.norm_squared(half))
    return max(0.0, -displacement(seen, center)[2]) + sway


@kernel
def collide_plane_mesh(
    position_a,
    rotation_a,
    position_b,
    rotation_b,
    mesh,
    margin,
    flight,
    contacts,
    count,
    scratch,
):
    """Append the contacts of a plane (a) with a mesh (b); return the new count.

    Arguments as in mesh_mesh.py.
    """
    origin, axes = in_frame(position_b, rotation_b, position_a, rotation_a)
    rows, vertices, faces, nodes = mesh
    row = rows[0]
    half = vec3.scale(0.5, vec3.sub(vec3.load(row.upper), vec3.load(row.lower)))
    middle = vec3.scale(0.5, vec3.add(vec3.load(row.upper), vec3.load(row.lower)))
    put_core(vec3.add(origin, mat3.apply(axes, middle)), axes, half, 0.0, margin, scratch)
    seen, falloff, rest, far = prospects(margin, flight, 1.0, position_a, rotation_a)
    rank_by_motion(falloff, scratch)
    # With the normal reversed the motion is too.
    put_path((vec3.neg(seen[0]), vec3.neg(seen[1])), vec3.ZERO, margin, scratch)
    down = mat3.apply_transposed(axes, DOWN)
    found = np.int64(0)
    while True:
        node = 0
        while node < nodes.shape[0]:
            here = nodes[node]
            reach = min(margin, NEAR_MOTIONS * _falls(seen, origin, axes, here) + rest)
            if origin[2] - _lowest(here, down) > reach:
                node = int(here.skip)
                continue
            for index in range(here.first, here.first + here.count):
                face = faces[index]
                for k in range(3):
                    if face.flags >> (3 + k) & 1:
                        number = int(face.vertices[k])
                        place = vec3.add(origin, mat3.apply(axes, vec3.load(vertices[number].position)))
                        if place[2] <= reach:
                            feature = feature_of(TERRAIN_VERTEX, 0, VERTEX_PLACE, number)
                            position = (place[0], place[1], 0.5 * place[2])
                            found = add_candidate(scratch, found, position, DOWN, place[2], feature)
            node += 1
        if found > 0 or not rest < far:
            break
        rest = far
    return emit_candidates(scratch, found, position_a, rotation_a, contacts, count)
