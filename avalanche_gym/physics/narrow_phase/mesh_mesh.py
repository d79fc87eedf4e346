"""Two meshes: the leaves of the one (mesh_pieces.py) against the faces of the other, found by its tree.

The larger mesh, or the one that is no solid, takes the part of the terrain. Subtrees of the moving one that meet no
face of the other are left out as a whole.

A vertex that seems to have come through a face belongs to the nearest point of the surface (mesh.py), and so does the
crossing of two edges: it counts only where the point of the moving one is inside.
"""

from __future__ import annotations

import numpy as np

from ..jit import kernel
from ..maths import mat3, vec3
from ..shapes.static_tree import is_clear
from .mesh import corners_against_mesh, tables_of
from .mesh_features import list_faces, list_features
from .mesh_pieces import (
    bounds_of,
    box_of,
    edges_of_leaf,
    faces_of_leaf,
    half_diagonal,
    list_vertices,
    near_margin,
    put_node,
    turn_round,
    vertices_beside_edges,
)
from .terrain_candidates import emit_candidates
from .terrain_shape import CENTER_ROW, get, in_frame, put


@kernel
def _meets_any(nodes, lower, upper):
    """Whether a leaf of the terrain's tree meets a box [m]."""
    node = 0
    while node < nodes.shape[0]:
        here = nodes[node]
        if is_clear(here, lower, upper):
            node = int(here.skip)
            continue
        if here.count > 0:
            return True
        node += 1
    return False


@kernel
def _to_inside(faces, node, axes, scale, scratch):
    """Move the middle of the leaf into the solid behind it: a sheet acts on the side on which that lies."""
    out = vec3.ZERO
    for index in range(node.first, node.first + node.count):
        out = vec3.add(out, vec3.load(faces[index].normal))
    put(scratch, CENTER_ROW, 0, vec3.add_scaled(get(scratch, CENTER_ROW, 0), -scale, mat3.apply(axes, out)))


@kernel
def _leaf_on_mesh(mesh_a, node, origin, axes, second, scale, mesh_b, two_sided, scratch, count):
    """Contacts of one leaf of a mesh with another mesh; return the new count of candidates.

    ``mesh_a``, ``mesh_b``: (vertices, faces, nodes) of the leaf's mesh and of the terrain.
    """
    vertices, faces, nodes = mesh_a
    other_vertices, other_faces, other_nodes = mesh_b
    place = 0
    while place < other_nodes.shape[0]:
        near, place = list_faces(other_vertices, other_faces, other_nodes, place, two_sided, scratch)
        if near == 0:
            continue
        middle = get(scratch, CENTER_ROW, 0)
        if two_sided:
            _to_inside(faces, node, axes, scale, scratch)
        item = 0
        turn = 0
        while True:
            listed, item = list_vertices(vertices, faces, node, origin, axes, second, item, scratch)
            count = corners_against_mesh(
                other_vertices, other_faces, other_nodes, near, two_sided, listed, scratch, count
            )
            feature = 0
            while True:
                end, feature = list_features(other_vertices, other_faces, near, feature, two_sided, scratch)
                count = vertices_beside_edges(vertices, axes, listed, end, scratch, count)
                if turn == 0:
                    count = edges_of_leaf(
                        vertices, faces, node, origin, axes, second, mesh_b, two_sided, end, scratch, count
                    )
                    count = faces_of_leaf(vertices, faces, nodes, node, origin, axes, second, end, scratch, count)
                if feature == 0:
                    break
            turn += 1
            if item == 0:
                break
        put(scratch, CENTER_ROW, 0, middle)
    return count


@kernel
def _collide(
    position_a,
    rotation_a,
    mesh_a,
    second,
    position_b,
    rotation_b,
    mesh_b,
    vertices,
    faces,
    nodes,
    margin,
    motion,
    contacts,
    count,
    scratch,
):
    """Append the contacts of mesh a, taken leaf by leaf, with mesh b; normals from a to b."""
    origin, axes = in_frame(position_a, rotation_a, position_b, rotation_b)
    scale = half_diagonal(mesh_a)
    own = tables_of(mesh_a, vertices, faces, nodes)
    other = tables_of(mesh_b, vertices, faces, nodes)
    reach = near_margin(margin, motion)
    found = np.int64(0)
    while True:
        node = 0
        while node < own[2].shape[0]:
            here = own[2][node]
            middle, half = box_of(here)
            if not _meets_any(other[2], *bounds_of(middle, half, origin, axes, reach)):
                node = int(here.skip)
                continue
            if here.count > 0:
                put_node(here, origin, axes, scale, reach, motion, scratch)
                found = _leaf_on_mesh(
                    own, here, origin, axes, second, scale, other, mesh_b.two_sided == 1, scratch, found
                )
            node += 1
        if found > 0 or not reach < margin:
            break
        reach = margin
    return emit_candidates(scratch, found, position_b, rotation_b, contacts, count)


@kernel
def collide_meshes(
    position_a,
    rotation_a,
    mesh_a,
    position_b,
    rotation_b,
    mesh_b,
    vertices,
    faces,
    nodes,
    margin,
    motion,
    contacts,
    count,
    scratch,
):
    """Append the contacts of two meshes, of which one moves; return the new count.

    Args:
        position_a, rotation_a, position_b, rotation_b: their places [m] and body-to-world matrices.
        mesh_a, mesh_b: their MESH_ROW.
        vertices, faces, nodes: pools of VERTEX_ROW, FACE_ROW, NODE_ROW.
        margin: [m] contacts farther apart are left out.
        motion: [m] bound of how far the two come closer by themselves.
        contacts, count: as in ``manifold.emit``.
        scratch: (264, 8), overwritten.
    """
    first = count
    is_terrain = half_diagonal(mesh_a) > half_diagonal(mesh_b)
    if mesh_a.closed != mesh_b.closed:
        is_terrain = mesh_a.closed == 0
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
        vertices,
        faces,
        nodes,
        margin,
        motion,
        contacts,
        count,
        scratch,
    )
    if swap == 1:
        turn_round(contacts, first, count)
    return count
