"""Two meshes: the leaves of the one (mesh_pieces.py) against the faces of the other, found by its tree.

The larger mesh, or the one that is no solid, takes the part of the terrain. Subtrees of the moving one that meet no
face of the other are left out as a whole. What a node meets its parent meets too, so the search begins at the first
leaf that its parent met.

A vertex that seems to have come through a face belongs to the nearest point of the surface (mesh.py), and so does the
crossing of two edges: it counts only where the point of the moving one is inside. What lies deep is looked for where
something shallow tells of it (mesh_depth.py).
"""

from __future__ import annotations

import numpy as np

from ..jit import kernel
from ..maths import mat3, vec3
from .mesh import corners_against_mesh
from .mesh_depth import DEEPER, leaf_is_deep, leave_out_far, tells_of_depth, terrain_is_deep
from .mesh_edges import edges_of_leaf, vertices_beside_edges
from .mesh_faces import LISTED_FACES, leaves_near, list_near, listed_face, put_listed_face
from .mesh_features import list_features
from .mesh_pieces import depths, half_diagonal, lowest_corner, node_core, prospects, put_node, turn_round
from .mesh_side import side_of
from .mesh_surface import middle_behind
from .mesh_vertices import faces_of_leaf, list_vertices
from .path import NEAR_MOTIONS
from .terrain_candidates import emit_candidates
from .terrain_shape import CENTER_ROW, LEVELS, first_leaf_of, get, in_frame, put, set_first_leaf


@kernel
def _to_inside(mesh_a, node, origin, axes, deepest, scratch):
    """Move the middle of the leaf into the solid behind it: a sheet acts on the side on which that lies.

    Down to ``deepest`` [m], from where nothing is held any more (mesh_depth.py), or half of what is thinner.
    """
    vertices, faces, nodes = mesh_a
    middle = middle_behind(vertices, faces, nodes, int(node.first), deepest)
    put(scratch, CENTER_ROW, 0, vec3.add(origin, mat3.apply(axes, middle)))


@kernel
def _keep_near(mesh_a, node, core, origin, axes, other_vertices, other_faces, listed, two_sided, scratch):
    """Of the listed faces keep those to which the vertices of a leaf, not only its box, come near; return how many.

    A face counts as far as for ``list_near``.
    """
    vertices, faces, _ = mesh_a
    _, _, _, _, _, margin, path, rest, _, _ = core
    center = get(scratch, CENTER_ROW, 0)
    kept = 0
    for place in range(listed):
        index = listed_face(scratch, place)
        face = other_faces[index]
        n = vec3.scale(side_of(other_vertices, other_faces, index, two_sided, center), vec3.load(face.normal))
        a = vec3.load(other_vertices[face.vertices[0]].position)
        lowest = vec3.dot(n, vec3.sub(origin, a))
        lowest += lowest_corner(vertices, faces, node, mat3.apply_transposed(axes, n))
        if lowest <= min(margin, NEAR_MOTIONS * max(0.0, -vec3.dot(n, path)) + rest):
            put_listed_face(scratch, kept, index)
            kept += 1
    return kept


@kernel
def _leaf_on_mesh(
    mesh_a, node, core, origin, axes, second, deepest, mesh_b, place, end, two_sided, known, scratch, count
):
    """Contacts of one leaf of a mesh with another mesh; return the new count of candidates, and whether some lie deep.

    ``mesh_a``, ``mesh_b``: (vertices, faces, nodes) of the leaf's mesh and of the terrain, of which the nodes from
    ``place`` to ``end`` can be near; ``deepest``: of ``depths``; ``known``: whether it is known that some lie deep.
    """
    vertices, faces, nodes = mesh_a
    other_vertices, other_faces, other_nodes = mesh_b
    seen = core[7]
    deep = known
    while place < end:
        near, place = list_near(
            other_vertices, other_faces, other_nodes, place, end, two_sided, core, LISTED_FACES, scratch
        )
        if near == 0:
            continue
        middle = get(scratch, CENTER_ROW, 0)
        if two_sided:
            _to_inside(mesh_a, node, origin, axes, deepest, scratch)
        near = _keep_near(mesh_a, node, core, origin, axes, other_vertices, other_faces, near, two_sided, scratch)
        deep = deep or leaf_is_deep(
            (vertices, faces), node, origin, axes, other_vertices, other_faces, near, two_sided, scratch, seen
        )
        item = 0
        turn = 0
        while True:
            listed, item = list_vertices(vertices, faces, node, origin, axes, second, item, scratch)
            count = corners_against_mesh(
                other_vertices, other_faces, other_nodes, near, two_sided, listed, scratch, count
            )
            feature = 0
            while True:
                row, feature = list_features(other_vertices, other_faces, near, feature, two_sided, scratch)
                count = vertices_beside_edges(vertices, axes, listed, row, scratch, count)
                if turn == 0:
                    deep = deep or terrain_is_deep(vertices, faces, node, origin, axes, row, scratch, seen)
                    count = edges_of_leaf(
                        vertices, faces, nodes, node, origin, axes, second, mesh_b, two_sided, row, scratch, count
                    )
                    count = faces_of_leaf(vertices, faces, nodes, node, origin, axes, second, row, scratch, count)
                if feature == 0:
                    break
            turn += 1
            if item == 0:
                break
        put(scratch, CENTER_ROW, 0, middle)
    return count, deep


@kernel
def _level(number, node):
    """How many levels of its tree, which is perfect, lie below a node: its subtree has 2^(level + 1) - 1 nodes."""
    size = int(node.skip) - number
    level = 0
    while (2 << level) <= size:
        level += 1
    return level


@kernel
def _collide(
    position_a,
    rotation_a,
    mesh_a,
    second,
    position_b,
    rotation_b,
    mesh_b,
    margin,
    flight,
    contacts,
    count,
    scratch,
):
    """Append the contacts of mesh a, taken leaf by leaf, with mesh b; normals from a to b."""
    origin, axes = in_frame(position_a, rotation_a, position_b, rotation_b)
    scale = half_diagonal(mesh_a[0][0])
    own = mesh_a[1:]
    other = mesh_b[1:]
    two_sided = mesh_b[0][0].two_sided == 1
    sense = 1.0 if second == 1 else -1.0
    seen, falloff, rest, far = prospects(margin, flight, sense, position_b, rotation_b)
    skin, deepest = depths(min(scale, half_diagonal(mesh_b[0][0])), flight)
    margin = max(margin, skin)
    asked = margin
    rest = max(rest, skin)
    while True:
        found = np.int64(0)
        deep = not rest < deepest
        node = 0
        first, end = leaves_near(other[2], node_core(own[0], own[1], own[2][0], origin, axes, margin, rest, seen))
        if end == 0:
            node = own[2].shape[0]
        while node < own[2].shape[0]:
            here = own[2][node]
            core = node_core(own[0], own[1], here, origin, axes, margin, rest, seen)
            level = _level(node, here)
            place = first_leaf_of(scratch, level + 1) if level < LEVELS - 1 and node > 0 else first
            near, place = list_near(other[0], other[1], other[2], place, end, two_sided, core, 0, scratch)
            if near == 0:
                node = int(here.skip)
                continue
            place -= 1
            if level < LEVELS:
                set_first_leaf(scratch, level, place)
            if here.count > 0:
                put_node(core, seen, scale, falloff, scratch)
                found, deep = _leaf_on_mesh(
                    own, here, core, origin, axes, second, deepest, other, place, end, two_sided, deep, scratch, found
                )
            node += 1
        if rest < deepest and (deep or tells_of_depth(scratch, found, rest)):
            rest = min(DEEPER * rest, deepest)
            margin = max(margin, rest)
            continue
        if found > 0 or not rest < far:
            break
        rest = far
    found = leave_out_far(scratch, found, asked)
    return emit_candidates(scratch, found, position_b, rotation_b, contacts, count)


@kernel
def collide_meshes(
    position_a,
    rotation_a,
    mesh_a,
    position_b,
    rotation_b,
    mesh_b,
    margin,
    flight,
    contacts,
    count,
    scratch,
):
    """Append the contacts of two meshes, of which one moves; return the new count.

    Args:
        position_a, rotation_a, position_b, rotation_b: their places [m] and body-to-world matrices.
        mesh_a, mesh_b: tables of each, MESH_ROW (1), VERTEX_ROW, FACE_ROW, NODE_ROW.
        margin: [m] contacts farther apart are left out.
        flight: bound [m] of how far the two come closer by themselves; how b moves against a, and what of the motion
            [m] that leaves out (path.py).
        contacts, count: as in ``manifold.emit``.
        scratch: (264, 8), overwritten.
    """
    first = count
    is_terrain = half_diagonal(mesh_a[0][0]) > half_diagonal(mesh_b[0][0])
    if mesh_a[0][0].closed != mesh_b[0][0].closed:
        is_terrain = mesh_a[0][0].closed == 0
    # One call, so that the function is there once.
    swap = 1 if is_terrain else 0
    if swap == 1:
        position_a, position_b = position_b, position_a
        rotation_a, rotation_b = rotation_b, rotation_a
        mesh_a, mesh_b = mesh_b, mesh_a
    count = _collide(
        position_a,
        rotation_a,
        mesh_a,
        swap,
        position_b,
        rotation_b,
        mesh_b,
        margin,
        flight,
        contacts,
        count,
        scratch,
    )
    if swap == 1:
        turn_round(contacts, first, count)
    return count
