"""Convex hull and cylinder against a triangle mesh: as mesh.py, with their own corners, edges and rims."""

from __future__ import annotations

import numpy as np

from ..jit import kernel
from ..maths import mat3, vec3
from .cylinder import FLAT_POINTS, toward_plane
from .mesh import IN_PIECES, comes_over_face, corners_against_mesh, off_plane, open_mesh, over_face
from .mesh_faces import list_faces, listed_face
from .mesh_features import list_features
from .mesh_side import side_of
from .mesh_surface import is_way_out, push_out
from .terrain_candidates import FACE_PLACE, POINT, add_candidate, emit_candidates, feature_of
from .terrain_cylinder import cylinder_features, put_cylinder
from .terrain_hull import hull_features, list_corners, put_hull
from .terrain_shape import CENTER_ROW, get, margin_of, motion_of, scale_of
from .triangle import REGION_SLACK


@kernel
def _cylinder_against_face(vertices, faces, nodes, index, two_sided, radius, half_length, axes, scratch, count):
    """Contacts of one face with a cylinder: the points of it that would touch the face's plane."""
    face = faces[index]
    center = get(scratch, CENTER_ROW, 0)
    margin = margin_of(scratch)
    motion = motion_of(scratch)
    scale = scale_of(scratch)
    side = side_of(vertices, faces, index, two_sided, center)
    n = vec3.scale(side, vec3.load(face.normal))
    height = vec3.dot(n, vec3.sub(center, vec3.load(vertices[face.vertices[0]].position)))
    down = vec3.neg(mat3.apply_transposed(axes, n))
    for k in range(FLAT_POINTS):
        local, feature, exists = toward_plane(radius, half_length, down, k)
        gap = height - vec3.dot(down, local)
        if not exists or gap > margin:
            continue
        p = vec3.add(center, mat3.apply(axes, local))
        if gap < -REGION_SLACK * scale:
            counts = is_way_out(vertices, faces, nodes, face, side, p)
        else:
            counts = over_face(vertices, face, n, p, off_plane(nodes))
        if not counts and motion > 0.0 and gap >= 0.0:
            counts = comes_over_face(vertices, faces, face, side, p, motion)
        if counts:
            position = vec3.add_scaled(p, -0.5 * gap, n)
            count = add_candidate(scratch, count, position, n, gap, feature_of(POINT, feature, FACE_PLACE, index))
    return count


@kernel
def collide_cylinder_mesh(
    position_a,
    rotation_a,
    size_a,
    position_b,
    rotation_b,
    mesh,
    margin,
    motion,
    turned,
    contacts,
    count,
    scratch,
):
    """Append the contacts of a cylinder with a mesh; return the new count. Arguments as in mesh.py."""
    radius, half_length = size_a[0], size_a[1]
    _, axes = put_cylinder(size_a, position_a, rotation_a, position_b, rotation_b, margin, scratch)
    vertices, faces, nodes, two_sided = open_mesh(mesh, motion, turned, scratch)
    found = np.int64(0)
    node = 0
    while node < nodes.shape[0]:
        listed, node = list_faces(vertices, faces, nodes, node, two_sided, scratch)
        for place in range(listed):
            found = _cylinder_against_face(
                vertices,
                faces,
                nodes,
                listed_face(scratch, place),
                two_sided,
                radius,
                half_length,
                axes,
                scratch,
                found,
            )
        item = 0
        while True:
            end, item = list_features(vertices, faces, listed, item, two_sided, scratch)
            found = cylinder_features(scratch, end, radius, half_length, found)
            if item == 0:
                break
    if found == 0:
        found = push_out(mesh[0][0], vertices, faces, nodes, scratch)
    return emit_candidates(scratch, found, position_b, rotation_b, contacts, count)


@kernel
def collide_hull_mesh(
    position_a,
    rotation_a,
    hull,
    position_b,
    rotation_b,
    mesh,
    margin,
    motion,
    turned,
    contacts,
    count,
    scratch,
):
    """Append the contacts of a hull (terrain_hull.py) with a mesh; return the new count."""
    origin, axes = put_hull(hull, position_a, rotation_a, position_b, rotation_b, margin, scratch)
    vertices, faces, nodes, two_sided = open_mesh(mesh, motion, turned, scratch)
    found = np.int64(0)
    listed = 0
    node = 0
    pieces = 0
    while node < nodes.shape[0]:
        listed, node = list_faces(vertices, faces, nodes, node, two_sided, scratch)
        pieces += 1
        item = 0
        while True:
            end, item = list_features(vertices, faces, listed, item, two_sided, scratch)
            found = hull_features(scratch, end, hull, origin, axes, found)
            if item == 0:
                break
    if pieces > 1:
        listed = IN_PIECES
    number = np.int64(0)
    while listed != 0 and number < hull[0][0].num_vertices:
        num_corners, number = list_corners(hull, origin, axes, number, mesh[0][0].upper[2] + margin, scratch)
        found = corners_against_mesh(vertices, faces, nodes, listed, two_sided, num_corners, scratch, found)
    if found == 0:
        found = push_out(mesh[0][0], vertices, faces, nodes, scratch)
    return emit_candidates(scratch, found, position_b, rotation_b, contacts, count)
