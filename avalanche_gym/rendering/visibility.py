"""Which triangle is seen at each pixel: the visibility buffer (Burns & Hunt 2013, "The visibility buffer").

A projection takes a point of the world to four numbers linear in it: the homogeneous pixel P = (X, Y, W), seen at
column X / W and row Y / W, and its nearness Q, of which Q / W is compared. Perspective has W = z, Q = 1; the parallel
rays of the sun have W = 1, Q = minus the distance along them, so a shadow map is drawn by the same code. For a
triangle with P_0, P_1, P_2 and a pixel p = (i, j, 1), the three numbers

    e_0 = p . (P_2 x P_1),   e_1 = p . (P_0 x P_2),   e_2 = p . (P_1 x P_0)

are not negative just where the pixel is covered; e_k / (e_0 + e_1 + e_2) are its perspective-correct barycentric
coordinates; and 1 / W = (e_0 + e_1 + e_2) / D, Q / W = (e_0 Q_0 + e_1 Q_1 + e_2 Q_2) / D with D = -P_0 . (P_1 x P_2),
positive if the front is seen (Olano & Greer 1997, "Triangle scan conversion using 2D homogeneous coordinates", secs. 3
and 4). This holds for triangles that reach behind the eye too, so none is split or dropped: the near plane is a test
of Q / W at each pixel. Two triangles with a common edge compute its e_k with opposite signs and the same rounding, so
there is no crack between them.
"""

from __future__ import annotations

import math

import numpy as np

from ..physics.jit import entry_point, kernel
from ..physics.maths import mat3, quat, vec3

PROJECTION = np.dtype(
    [
        ("rows", np.float64, (4, 3)),  # X, Y, W, Q of a point are rows . point + offsets; world frame
        ("offsets", np.float64, 4),
        ("near", np.float64),  # least W that is seen
        (
            "planes",
            np.float64,
            (5, 3),
        ),  # unit normals of the five sides of the space that is seen, inwards, world frame
        ("distances", np.float64, 5),  # [m] a point is inside where planes . point + distances >= 0
    ],
    align=True,
)

INSTANCE = np.dtype(  # one mesh at one place
    [
        ("position", np.float64, 3),  # [m] body frame -> world
        ("orientation", np.float64, 4),  # quaternion, body frame -> world
        ("center", np.float64, 3),  # [m] of a sphere that holds the mesh, body frame
        ("radius", np.float64),  # [m] of that sphere
        ("first_vertex", np.int64),  # in the pool
        ("num_vertices", np.int64),
        ("first_face", np.int64),
        ("num_faces", np.int64),
        ("first_projected", np.int64),  # where its projected vertices lie
        ("color", np.float32, 3),  # linear
        ("opacity", np.float32),
        ("gloss", np.float32),  # strength of the highlight
        ("contrast", np.float32),  # of the pattern, 0 for none
        ("pattern_scale", np.float64, 3),  # [1/m] inverse length of the pattern's cells along each body axis
        ("pattern_offset", np.float64, 3),  # [cells]
        ("two_sided", np.int64),
        ("unlit", np.int64),  # 1: shines by itself
        ("casts_shadow", np.int64),
        ("visible", np.int64),
    ],
    align=True,
)

VERTEX = np.dtype(
    [
        ("position", np.float64, 3),  # [m] body frame
        ("normal", np.float64, 3),  # unit, body frame
        ("color", np.float32, 4),  # linear red, green, blue, and opacity
    ],
    align=True,
)

PROJECTED = np.dtype(  # a vertex of an instance in this frame
    [
        ("pixel", np.float64, 3),  # X, Y, W
        ("nearness", np.float64),  # Q
        ("screen", np.float64, 2),  # [pixels] X / W and Y / W, where W is beyond the near plane
        ("normal", np.float32, 3),  # unit, world frame
    ],
    align=True,
)

TRIANGLE = np.dtype(  # of this frame, on the screen
    [
        ("edges", np.float64, 9),  # coefficients (of i, of j, constant) of e_0, e_1, e_2
        ("determinant", np.float64),  # D
        ("corners", np.int32, 3),  # vertices of the mesh, counted from its first
        ("instance", np.int32),
        ("side", np.float32),  # 1 if the front is seen, -1 if the back of a sheet
    ],
    align=True,
)


@kernel
def project(instance, projection, vertices, projected):
    """Project the vertices of an instance and turn their normals into the world frame.

    Returns:
        Whether any of it can be seen.
    """
    rotation = quat.to_matrix(quat.load(instance.orientation))
    position = vec3.load(instance.position)
    center = vec3.add(position, mat3.apply(rotation, vec3.load(instance.center)))
    for k in range(5):
        if not vec3.dot(vec3.load(projection.planes[k]), center) + projection.distances[k] >= -instance.radius:
            return False
    rows = projection.rows
    offsets = projection.offsets
    mx = mat3.apply_transposed(rotation, vec3.load(rows[0]))
    my = mat3.apply_transposed(rotation, vec3.load(rows[1]))
    mw = mat3.apply_transposed(rotation, vec3.load(rows[2]))
    mq = mat3.apply_transposed(rotation, vec3.load(rows[3]))
    tx = vec3.dot(vec3.load(rows[0]), position) + offsets[0]
    ty = vec3.dot(vec3.load(rows[1]), position) + offsets[1]
    tw = vec3.dot(vec3.load(rows[2]), position) + offsets[2]
    tq = vec3.dot(vec3.load(rows[3]), position) + offsets[3]
    for i in range(instance.num_vertices):
        vertex = vertices[instance.first_vertex + i]
        out = projected[instance.first_projected + i]
        v = vec3.load(vertex.position)
        x = vec3.dot(mx, v) + tx
        y = vec3.dot(my, v) + ty
        w = vec3.dot(mw, v) + tw
        vec3.store(out.pixel, (x, y, w))
        out.nearness = vec3.dot(mq, v) + tq
        vec3.store(out.normal, mat3.apply(rotation, vec3.load(vertex.normal)))
        if w >= projection.near:
            inverse = 1.0 / w
            out.screen[0] = x * inverse
            out.screen[1] = y * inverse
    return True


@kernel
def draw_instance(instance, number, projection, faces, projected, triangles, count, depth, ids, box):
    """Enter the triangles of one projected instance; arguments as in draw_instances.

    Returns:
        The number of triangles in use.
    """
    height, width = depth.shape
    near = projection.near
    # Q / W grows to 1 / near under perspective; along parallel rays W is 1 and nothing is too close.
    nearest = np.float32(1.0 / near)
    keep = len(triangles) > 0
    base = instance.first_projected
    for k in range(instance.first_face, instance.first_face + instance.num_faces):
        ia = np.int64(faces[k, 0])
        ib = np.int64(faces[k, 1])
        ic = np.int64(faces[k, 2])
        a = projected[base + ia]
        b = projected[base + ib]
        c = projected[base + ic]
        beyond = int(a.pixel[2] >= near) + int(b.pixel[2] >= near) + int(c.pixel[2] >= near)
        if beyond == 0:
            continue
        # A triangle that the near plane cuts may lie anywhere: its edges decide, row by row.
        left, top, right, bottom = 0, 0, width - 1, height - 1
        if beyond == 3:
            low_x = min(a.screen[0], b.screen[0], c.screen[0])
            high_x = max(a.screen[0], b.screen[0], c.screen[0])
            low_y = min(a.screen[1], b.screen[1], c.screen[1])
            high_y = max(a.screen[1], b.screen[1], c.screen[1])
            # Written so that a NaN anywhere drops the triangle.
            if not (high_x >= 0.0 and high_y >= 0.0 and low_x <= width - 1.0 and low_y <= height - 1.0):
                continue
            left = int(math.ceil(max(low_x, 0.0)))
            right = int(min(high_x, width - 1.0))
            top = int(math.ceil(max(low_y, 0.0)))
            bottom = int(min(high_y, height - 1.0))
            if left > right or top > bottom:
                continue
        pa = vec3.load(a.pixel)
        pb = vec3.load(b.pixel)
        pc = vec3.load(c.pixel)
        e0 = vec3.cross(pc, pb)
        determinant = vec3.dot(pa, e0)
        side = 1.0
        if determinant < 0.0 and instance.two_sided == 1:
            side = -1.0
        scale = side / determinant
        if not scale > 0.0:
            continue
        e0 = vec3.scale(side, e0)
        e1 = vec3.scale(side, vec3.cross(pa, pc))
        e2 = vec3.scale(side, vec3.cross(pb, pa))
        qa, qb, qc = scale * a.nearness, scale * b.nearness, scale * c.nearness
        q_i = qa * e0[0] + qb * e1[0] + qc * e2[0]
        q_j = qa * e0[1] + qb * e1[1] + qc * e2[1]
        q_1 = qa * e0[2] + qb * e1[2] + qc * e2[2]
        found = 0
        for j in range(top, bottom + 1):
            r0 = e0[1] * j + e0[2]
            r1 = e1[1] * j + e1[2]
            r2 = e2[1] * j + e2[2]
            # An edge that lies off both ends of the row leaves nothing of it.
            if max(e0[0] * left, e0[0] * right) + r0 < 0.0:
                continue
            if max(e1[0] * left, e1[0] * right) + r1 < 0.0:
                continue
            if max(e2[0] * left, e2[0] * right) + r2 < 0.0:
                continue
            rest = q_j * j + q_1
            inside = False
            for i in range(left, right + 1):
                if e0[0] * i + r0 >= 0.0 and e1[0] * i + r1 >= 0.0 and e2[0] * i + r2 >= 0.0:
                    inside = True
                    q = np.float32(q_i * i + rest)
                    if q > depth[j, i] and q <= nearest:
                        depth[j, i] = q
                        found = 1
                        if keep:
                            ids[j, i] = count
                elif inside:
                    break
        if keep and found == 1:
            triangle = triangles[count]
            for axis in range(3):
                triangle.edges[axis] = e0[axis]
                triangle.edges[3 + axis] = e1[axis]
                triangle.edges[6 + axis] = e2[axis]
            triangle.determinant = side * determinant
            triangle.corners[0] = ia
            triangle.corners[1] = ib
            triangle.corners[2] = ic
            triangle.instance = number
            triangle.side = side
            box[0] = min(box[0], left)
            box[1] = min(box[1], top)
            box[2] = max(box[2], right)
            box[3] = max(box[3], bottom)
            count += 1
    return count


@entry_point
def draw_instances(instances, order, projections, vertices, faces, projected, triangles, depth, ids, box):
    """Enter the instances numbered in ``order`` into the visibility buffer.

    Args:
        projections: (1,) PROJECTION.
        triangles: TRIANGLE for each face of these instances, filled with those on the screen; empty where only depth
            is wanted.
        depth: (height, width) float32, Q / W of what is closest.
        ids: (height, width) int32, the triangle that is seen.
        box: (4,) int64, widened to hold the pixels visited: first column, first row, last column, last row.
    """
    projection = projections[0]
    count = np.int64(0)
    for k in range(len(order)):
        number = order[k]
        instance = instances[number]
        if project(instance, projection, vertices, projected):
            count = draw_instance(instance, number, projection, faces, projected, triangles, count, depth, ids, box)
