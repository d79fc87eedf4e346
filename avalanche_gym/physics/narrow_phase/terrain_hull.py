"""A convex hull against the edges and vertices of a terrain that stick out.

The same rules as for a box (feature_contacts.py), with the hull's own edges and faces. A feature of the terrain is
taken to the frame of the hull, where vertices, edges and faces lie in their tables. ``hull`` is (its HULL_ROW as
an array of one, its points (n, 3), its HULL_FACE_ROW, the corners of these, its HULL_EDGE_ROW).
"""

from __future__ import annotations

import math

from ..jit import kernel
from ..maths import mat3, vec3
from .terrain_candidates import (
    CROSSING,
    EDGE_PLACE,
    PARTS,
    POINT,
    TERRAIN_VERTEX,
    VERTEX_PLACE,
    add_candidate,
    feature_of,
)
from .terrain_features import (
    PARALLEL,
    TILT,
    can_turn_to,
    in_edge_cone,
    in_vertex_cone,
    into_edge_cone,
    meet_along,
    star_depth,
)
from .terrain_shape import FIRST_FEATURE_ROW, get, in_frame, margin_of, put_core, put_corner, scale_of
from .triangle import REGION_SLACK

# Corners that one turn lists.
CORNERS_A_TURN = 8

# Edges and corners of a hull are this part against a vertex of the terrain; its faces have their numbers.
EDGE_PART = PARTS - 1


@kernel
def hull_tables(rows, number, points, faces, corners, edges):
    """``hull`` from its row number and the pools."""
    row = rows[number]
    return (
        rows[number : number + 1],
        points[row.first_vertex : row.first_vertex + row.num_vertices],
        faces[row.first_face : row.first_face + row.num_faces],
        corners,
        edges[row.first_edge : row.first_edge + row.num_edges],
    )


@kernel
def put_hull(hull, position_a, rotation_a, position_b, rotation_b, margin, scratch):
    """Describe a hull in the scratch table; return its place in the terrain's frame: origin [m] and rotation."""
    origin, axes = in_frame(position_a, rotation_a, position_b, rotation_b)
    center = vec3.add(origin, mat3.apply(axes, vec3.load(hull[0][0].center)))
    put_core(center, axes, vec3.load(hull[0][0].half), 0.0, margin, scratch)
    return origin, axes


@kernel
def list_corners(hull, origin, axes, number, highest, scratch):
    """List corners from ``number`` on that are not above ``highest`` [m]; return how many, and the next number."""
    count = 0
    points = hull[1]
    while number < points.shape[0] and count < CORNERS_A_TURN:
        point = vec3.add(origin, mat3.apply(axes, vec3.load_row(points, number)))
        if point[2] <= highest:
            put_corner(scratch, count, point, number)
            count += 1
        number += 1
    return count, number


@kernel
def _depth_in_hull(hull, p):
    """[m] from a point in the hull's frame to the nearest plane of a face around it; 0 outside."""
    _, points, faces, corners, _ = hull
    depth = math.inf
    for face in range(faces.shape[0]):
        above = vec3.sub(p, vec3.load_row(points, corners[faces[face].first_corner]))
        depth = min(depth, -vec3.dot(vec3.load(faces[face].normal), above))
    return max(depth, 0.0)


@kernel
def _crossing(scratch, row, hull, origin, axes, count):
    """An edge of the terrain across the edges of the hull."""
    _, points, _, _, edges = hull
    start = mat3.apply_transposed(axes, vec3.sub(get(scratch, row, 1), origin))
    e = mat3.apply_transposed(axes, get(scratch, row, 4))
    out = mat3.apply_transposed(axes, get(scratch, row + 2, 0))
    center = vec3.load(hull[0][0].center)
    length = scratch[row, 7]
    margin = margin_of(scratch)
    best = -math.inf
    way_out = out
    found = False
    # First the way out, then all edges of about this direction.
    for attempt in range(2):
        for number in range(edges.shape[0]):
            edge = edges[number]
            p = vec3.load_row(points, edge.start)
            b = vec3.sub(vec3.load_row(points, edge.end), p)
            own_length = math.sqrt(vec3.norm_squared(b))
            b = vec3.scale(1.0 / own_length, b)
            d = vec3.cross(e, b)
            sine_squared = vec3.norm_squared(d)
            if sine_squared < PARALLEL * PARALLEL:
                continue
            d = vec3.scale(math.copysign(1.0, vec3.dot(d, out)) / math.sqrt(sine_squared), d)
            if vec3.dot(d, vec3.load(edge.into_left)) < -TILT or vec3.dot(d, vec3.load(edge.into_right)) < -TILT:
                continue
            if attempt == 1 and vec3.dot(d, way_out) < 1.0 - 0.5 * TILT * TILT:
                continue
            r = vec3.sub(p, start)
            # Up to TILT this is what it will be.
            if vec3.dot(r, d) > margin + TILT * scale_of(scratch):
                continue
            inside, turned = into_edge_cone(scratch, row, mat3.apply(axes, d))
            if not inside:
                continue
            d = mat3.apply_transposed(axes, turned)
            t, u, gap = meet_along(r, e, b, d)
            if gap > margin or (attempt == 0 and gap <= best):
                continue
            if abs(t - 0.5 * length) > (0.5 + REGION_SLACK) * length:
                continue
            if abs(u - 0.5 * own_length) > (0.5 + REGION_SLACK) * own_length:
                continue
            foot = vec3.add_scaled(start, t, e)
            if vec3.dot(vec3.sub(center, foot), d) <= 0.0 or -gap > _depth_in_hull(hull, foot) + length:
                continue
            if attempt == 0:
                best = gap
                way_out = d
                found = True
            else:
                position = vec3.add_scaled(
                    vec3.add_scaled(get(scratch, row, 1), t, get(scratch, row, 4)), 0.5 * gap, turned
                )
                feature = feature_of(CROSSING, number, EDGE_PLACE, int(scratch[row + 2, 3]))
                count = add_candidate(scratch, count, position, turned, gap, feature)
        if not found:
            break
    return count


@kernel
def _is_extreme(points, p, d, slack):
    """Whether no point of the hull lies lower along d than its corner p."""
    lowest = vec3.dot(p, d) - slack
    for number in range(points.shape[0]):  # noqa: SIM110  (kernels have no generators)
        if vec3.dot(vec3.load_row(points, number), d) < lowest:
            return False
    return True


@kernel
def _beside_corner(scratch, row, hull, origin, axes, count):
    """An edge of the terrain that passes by a corner of the hull: each is the nearest part of the other."""
    points = hull[1]
    start = mat3.apply_transposed(axes, vec3.sub(get(scratch, row, 1), origin))
    e = mat3.apply_transposed(axes, get(scratch, row, 4))
    length = scratch[row, 7]
    margin = margin_of(scratch)
    for number in range(points.shape[0]):
        p = vec3.load_row(points, number)
        t = vec3.dot(vec3.sub(p, start), e)
        d = vec3.sub(p, vec3.add_scaled(start, t, e))
        square = vec3.norm_squared(d)
        if square > margin * margin or square == 0.0 or abs(t - 0.5 * length) > (0.5 + REGION_SLACK) * length:
            continue
        gap = math.sqrt(square)
        d = vec3.scale(1.0 / gap, d)
        turned = mat3.apply(axes, d)
        if in_edge_cone(scratch, row, turned) and _is_extreme(points, p, d, REGION_SLACK * scale_of(scratch)):
            position = vec3.add_scaled(get(scratch, row, 1), t, get(scratch, row, 4))
            position = vec3.add_scaled(position, 0.5 * gap, turned)
            feature = feature_of(POINT, number, EDGE_PLACE, int(scratch[row + 2, 3]))
            count = add_candidate(scratch, count, position, turned, gap, feature)
    return count


@kernel
def _over_face(hull, face, v, height, slack):
    """Whether the foot of a point on the plane of a face, ``height`` [m] below it, lies on the hull."""
    _, points, faces, corners, _ = hull
    foot = vec3.add_scaled(v, -height, vec3.load(faces[face].normal))
    for other in range(faces.shape[0]):
        n = vec3.load(faces[other].normal)
        if vec3.dot(n, vec3.sub(foot, vec3.load_row(points, corners[faces[other].first_corner]))) > slack:
            return False
    return True


@kernel
def _beside_hull(scratch, row, hull, v, axes, count):
    """A vertex of the terrain outside a hull, with an edge or a corner of the hull nearest to it."""
    _, points, _, _, edges = hull
    best = math.inf
    nearest = v
    for number in range(edges.shape[0]):
        p = vec3.load_row(points, edges[number].start)
        b = vec3.sub(vec3.load_row(points, edges[number].end), p)
        t = min(max(vec3.dot(vec3.sub(v, p), b) / vec3.norm_squared(b), 0.0), 1.0)
        q = vec3.add_scaled(p, t, b)
        square = vec3.norm_squared(vec3.sub(q, v))
        if square < best:
            best = square
            nearest = q
    gap = math.sqrt(best)
    if gap > margin_of(scratch) or gap == 0.0:
        return count
    d = mat3.apply(axes, vec3.scale(1.0 / gap, vec3.sub(nearest, v)))
    if not in_vertex_cone(scratch, row, d, can_turn_to(scratch, gap, REGION_SLACK)):
        return count
    feature = feature_of(TERRAIN_VERTEX, EDGE_PART, VERTEX_PLACE, int(scratch[row, 7]))
    return add_candidate(scratch, count, vec3.add_scaled(get(scratch, row, 1), 0.5 * gap, d), d, gap, feature)


@kernel
def _under_hull(scratch, row, hull, origin, axes, count):
    """A vertex of the terrain against a hull: the part nearest to it, or the face through which it leaves soonest."""
    _, points, faces, corners, _ = hull
    v = mat3.apply_transposed(axes, vec3.sub(get(scratch, row, 1), origin))
    beyond = vec3.sub(v, vec3.load(hull[0][0].center))
    slack = REGION_SLACK * scale_of(scratch)
    highest = -math.inf
    nearest = 0
    chosen = -1
    chosen_height = -math.inf
    limit = math.inf
    for face in range(faces.shape[0]):
        n = vec3.load(faces[face].normal)
        height = vec3.dot(n, vec3.sub(v, vec3.load_row(points, corners[faces[face].first_corner])))
        if height > margin_of(scratch):
            return count
        if height > highest:
            highest = height
            nearest = face
        if height <= chosen_height or vec3.dot(n, beyond) <= 0.0:
            continue
        if in_vertex_cone(scratch, row, mat3.apply(axes, vec3.neg(n)), can_turn_to(scratch, height, TILT)):
            chosen = face
            chosen_height = height
        else:
            limit = min(limit, star_depth(scratch, row, mat3.apply(axes, vec3.neg(n))) - height)
    if highest > slack:
        if not _over_face(hull, nearest, v, highest, slack):
            return _beside_hull(scratch, row, hull, v, axes, count)
        if chosen_height < highest:
            return count
    # As for a box.
    if chosen < 0 or -chosen_height > limit:
        return count
    d = mat3.apply(axes, vec3.neg(vec3.load(faces[chosen].normal)))
    feature = feature_of(TERRAIN_VERTEX, chosen, VERTEX_PLACE, int(scratch[row, 7]))
    position = vec3.add_scaled(get(scratch, row, 1), 0.5 * chosen_height, d)
    return add_candidate(scratch, count, position, d, chosen_height, feature)


@kernel
def hull_features(scratch, end, hull, origin, axes, count):
    """Contacts of the listed features, up to row ``end``, with a hull; return the new count of candidates."""
    row = FIRST_FEATURE_ROW
    while row < end:
        spokes = int(scratch[row, 0])
        if spokes > 0:
            count = _under_hull(scratch, row, hull, origin, axes, count)
            row += 1 + spokes
        else:
            count = _crossing(scratch, row, hull, origin, axes, count)
            count = _beside_corner(scratch, row, hull, origin, axes, count)
            row += 3
    return count
