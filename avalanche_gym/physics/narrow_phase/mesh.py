"""Sphere, capsule and box against a triangle mesh.

The same three kinds of contact as for a height field (height_field.py), with the faces found by the mesh's tree.

**Beyond a concave edge** a face counts for a corner that can come over it within the step, as for a height field.

**A corner behind a face** may have come through it or lie beyond a thin wall: mesh_surface.py tells. The contacts of a
corner that has come through are those of the nearest point of the surface, with its depth.
"""

from __future__ import annotations

import math

import numpy as np

from ..jit import kernel
from ..maths import vec3
from ..shapes.flatness import FLAT_HEIGHT
from .feature_contacts import collide_features
from .mesh_faces import list_faces, listed_face
from .mesh_features import list_features
from .mesh_side import corners_of, side_of
from .mesh_surface import base_of, is_inside, push_out
from .terrain_candidates import FACE_PLACE, POINT, add_candidate, emit_candidates, feature_of
from .terrain_shape import (
    CENTER_ROW,
    CORNER_ROW,
    FIRST_FREE_ROW,
    get,
    margin_of,
    motion_of,
    put,
    put_shape,
    radius_of,
    set_motion,
    set_turned,
)
from .triangle import REGION_SLACK, closest_point, in_prism

# Rows of the scratch table, eight: for each corner the nearest point of the surface if the corner is inside, else the
# corner; the square of the distance to the surface; whether the corner is behind a face; whether it is inside.
BASE_ROW = FIRST_FREE_ROW

# Faces that bend by less than this sine are one.
FLAT = 1e-9

MARK, NEAREST, TOUCH = 0, 1, 2

# The list of faces was too short for all of them, and is made anew in pieces.
IN_PIECES = -1


@kernel
def off_plane(nodes):
    """[m] by which a point of a face may be off the plane through a corner of it with the normal that it shares with
    others (shapes/mesh_preparation.py): twice what two corners are off, one to either side.
    """
    root = nodes[0]
    extent = max(root.upper[0] - root.lower[0], root.upper[1] - root.lower[1], root.upper[2] - root.lower[2])
    return 4.0 * FLAT_HEIGHT * extent


@kernel
def over_face(vertices, face, n, base, off):
    """Whether the foot of ``base`` lies on a face, on the side of its normal n; mirrored for a sheet.

    ``off`` [m]: of ``off_plane``, by which a base on the face itself may be behind that plane.
    """
    a, b, c = corners_of(vertices, face)
    over = vec3.dot(n, vec3.sub(base, a))
    if over < -off and over * over > REGION_SLACK * REGION_SLACK * vec3.norm_squared(vec3.sub(b, a)):
        return False
    return in_prism(base, a, b, c, vec3.load(face.normal))


@kernel
def comes_over_face(vertices, faces, face, side, p, motion):
    """Whether the foot of p, beside a face and above its plane, can come over the face across a concave edge.

    p must be above the plane of the face beyond that edge too: behind a wall the plane of the floor in front of it
    holds nothing. ``side``: of a sheet's face, side_of; ``motion`` [m]: how far p can come.
    """
    n = vec3.load(face.normal)
    found = False
    for k in range(3):
        start = vec3.load(vertices[face.vertices[k]].position)
        e = vec3.sub(vec3.load(vertices[face.vertices[(k + 1) % 3]].position), start)
        outward = vec3.cross(e, n)
        square = vec3.norm_squared(e)
        r = vec3.sub(p, start)
        beyond = vec3.dot(outward, r)
        if beyond <= REGION_SLACK * square:
            continue
        if face.neighbours[k] < 0 or beyond * beyond > motion * motion * square:
            return False
        other = vec3.scale(side, vec3.load(faces[face.neighbours[k]].normal))
        rise = -vec3.dot(other, outward)
        if rise < 0.0 and rise * rise > FLAT * FLAT * square:
            return False
        if rise * rise > FLAT * FLAT * square:
            if vec3.dot(other, r) < 0.0:
                return False
            found = True
    return found


@kernel
def _corners_against_face(vertices, faces, index, side, off, stage, num_corners, scratch, count):
    """One stage for the corners of the shape and one face; return the count of candidates.

    MARK notes that a corner is behind a face, NEAREST looks for the nearest point of the surface, TOUCH adds the
    contacts.
    """
    face = faces[index]
    a, b, c = corners_of(vertices, face)
    n = vec3.scale(side, vec3.load(face.normal))
    radius = radius_of(scratch)
    reach = radius + margin_of(scratch)
    motion = motion_of(scratch)
    for corner in range(num_corners):
        p = get(scratch, CORNER_ROW + corner, 0)
        row = BASE_ROW + corner
        height = vec3.dot(n, vec3.sub(p, a))
        if stage == MARK:
            if height < 0.0:
                scratch[row, 4] = 1.0
        elif stage == NEAREST:
            if scratch[row, 4] == 1.0 and height * height < scratch[row, 3]:
                nearest, lies_on = closest_point(p, a, b, c)
                square = vec3.norm_squared(vec3.sub(p, nearest))
                if square < scratch[row, 3]:
                    scratch[row, 3] = square
                    inside = is_inside(vertices, faces, face, side, p, nearest, lies_on)
                    put(scratch, row, 0, nearest if inside else p)
                    scratch[row, 5] = 1.0 if inside else 0.0
        elif height <= reach:
            counts = over_face(vertices, face, n, get(scratch, row, 0), off)
            if not counts and motion > 0.0 and height >= radius and scratch[row, 5] == 0.0:
                counts = comes_over_face(vertices, faces, face, side, p, motion)
            if counts:
                gap = height - radius
                position = vec3.add_scaled(p, -(radius + 0.5 * gap), n)
                feature = feature_of(POINT, int(scratch[CORNER_ROW + corner, 3]), FACE_PLACE, index)
                count = add_candidate(scratch, count, position, n, gap, feature)
    return count


@kernel
def _confirm_inside(vertices, faces, nodes, two_sided, num_corners, scratch):
    """Corners that seem to be inside from the listed faces: the nearest face may not be among these."""
    center = get(scratch, CENTER_ROW, 0)
    for corner in range(num_corners):
        row = BASE_ROW + corner
        if scratch[row, 5] == 1.0:
            p = get(scratch, CORNER_ROW + corner, 0)
            # A little more than the distance, to find at least the face that is known.
            put(scratch, row, 0, base_of(vertices, faces, nodes, two_sided, center, p, 1.000001 * scratch[row, 3]))


@kernel
def corners_against_mesh(vertices, faces, nodes, listed, two_sided, num_corners, scratch, count):
    """Contacts of the faces with the corners of the shape, or balls around them; return the new count of candidates.

    ``listed``: number of faces in the list, or IN_PIECES.
    """
    center = get(scratch, CENTER_ROW, 0)
    off = off_plane(nodes)
    for corner in range(num_corners):
        put(scratch, BASE_ROW + corner, 0, get(scratch, CORNER_ROW + corner, 0))
        scratch[BASE_ROW + corner, 3] = math.inf
        scratch[BASE_ROW + corner, 4] = 0.0
        scratch[BASE_ROW + corner, 5] = 0.0
    whole = listed != IN_PIECES
    for stage in range(3):
        behind = 0.0
        for corner in range(num_corners):
            behind += scratch[BASE_ROW + corner, 4]
        if stage == NEAREST and behind == 0.0:
            continue
        node = 0
        while True:
            if not whole:
                listed, node = list_faces(vertices, faces, nodes, node, two_sided, scratch)
            for item in range(listed):
                index = listed_face(scratch, item)
                side = side_of(vertices, faces, index, two_sided, center)
                count = _corners_against_face(vertices, faces, index, side, off, stage, num_corners, scratch, count)
            if whole or node == nodes.shape[0]:
                break
        if stage == NEAREST:
            _confirm_inside(vertices, faces, nodes, two_sided, num_corners, scratch)
    return count


@kernel
def open_mesh(mesh, motion, turned, scratch):
    """Before a shape in the scratch table meets a mesh: note how they move; see ``collide_mesh``.

    Returns:
        Its vertices, faces and nodes, and whether it is a sheet.
    """
    set_motion(motion, scratch)
    set_turned(turned, scratch)
    rows, vertices, faces, nodes = mesh
    return vertices, faces, nodes, rows[0].two_sided == 1


@kernel
def collide_mesh(
    shape_a,
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
    """Append the contacts of a sphere, capsule or box with a mesh; return the new count.

    Args:
        shape_a: code of the shape.
        position_a, rotation_a, size_a: its place [m], body-to-world matrix and size.
        position_b, rotation_b: place of the mesh.
        mesh: tables of it, MESH_ROW (1), VERTEX_ROW, FACE_ROW, NODE_ROW.
        margin: [m] contacts farther apart are left out.
        motion: [m] bound of how far the shape can come within the step.
        turned: [rad] how far the mesh turns within the step.
        contacts, count: as in ``manifold.emit``.
        scratch: (264, 8), overwritten.
    """
    num_corners = put_shape(shape_a, position_a, rotation_a, size_a, position_b, rotation_b, margin, scratch)
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
            found = collide_features(scratch, end, shape_a, found)
            if item == 0:
                break
    if pieces > 1:
        listed = IN_PIECES
    if listed != 0:
        found = corners_against_mesh(vertices, faces, nodes, listed, two_sided, num_corners, scratch, found)
    if found == 0:
        found = push_out(mesh[0][0], vertices, faces, nodes, scratch)
    return emit_candidates(scratch, found, position_b, rotation_b, contacts, count)
