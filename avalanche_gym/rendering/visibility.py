"""Which triangle is seen at each pixel: the visibility buffer (Burns & Hunt 2013, "The visibility buffer").

A vertex at camera coordinates (x, y, z) becomes the homogeneous pixel P = (f x + c_x z, f y + c_y z, z). For a triangle
with P_0, P_1, P_2 and a pixel p = (i, j, 1), the three numbers

    e_0 = p . (P_2 x P_1),   e_1 = p . (P_0 x P_2),   e_2 = p . (P_1 x P_0)

are not negative just where the pixel is covered, e_k / (e_0 + e_1 + e_2) are its perspective-correct barycentric
coordinates, and (e_0 + e_1 + e_2) / D is 1 / z, with D = -P_0 . (P_1 x P_2), positive if the viewer sees the front (Olano &
Greer 1997, "Triangle scan conversion using 2D homogeneous coordinates", secs. 3 and 4). This holds for triangles that
reach behind the eye too, so none is split: the near plane is a test of 1 / z at each pixel, and only the box of pixels to
visit is found by clipping. Two triangles with a common edge compute its e_k with opposite signs and the same rounding, so
there is no crack between them.
"""

from __future__ import annotations

import math

import numpy as np

from ..physics.jit import kernel
from ..physics.maths import mat3, quat, vec3

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
        ("pattern", np.int64),
        ("inverse_pattern_size", np.float64),  # [1/m]
        ("contrast", np.float32),  # of the pattern
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

PROJECTED = np.dtype(  # a vertex of an instance in this frame
    [
        ("pixel", np.float64, 3),  # homogeneous
        ("screen", np.float64, 2),  # [pixels] pixel / z, where z is beyond the near plane
        ("normal", np.float32, 3),  # unit, world frame
    ],
    align=True,
)

# [pixels] Rows at least this wide are narrowed to the covered span first; narrower ones are not worth its divisions.
NARROW = 12


@kernel
def is_outside(instance, camera, width, height):
    """Whether the sphere about an instance lies off the screen or behind the near plane."""
    center = vec3.add(
        vec3.load(instance.position), quat.rotate(quat.load(instance.orientation), vec3.load(instance.center))
    )
    offset = vec3.sub(center, vec3.load(camera.eye))
    radius = instance.radius
    depth = vec3.dot(offset, vec3.load(camera.forward))
    if not depth + radius > camera.near:
        return True
    # The side planes pass through the eye at half the picture's size, measured in focal lengths.
    for axis in range(2):
        half = 0.5 * (width if axis == 0 else height) / camera.focal
        across = abs(vec3.dot(offset, vec3.load(camera.right) if axis == 0 else vec3.load(camera.down)))
        if across - half * depth > radius * math.sqrt(1.0 + half * half):
            return True
    return False


@kernel
def project(instance, camera, vertices, projected):
    """Turn the vertices of an instance into homogeneous pixels, and their normals into the world frame."""
    rotation = quat.to_matrix(quat.load(instance.orientation))
    offset = vec3.sub(vec3.load(instance.position), vec3.load(camera.eye))
    right = vec3.load(camera.right)
    down = vec3.load(camera.down)
    forward = vec3.load(camera.forward)
    # The rows of the matrix from the body frame to homogeneous pixels.
    row_x = vec3.add_scaled(vec3.scale(camera.focal, right), camera.center[0], forward)
    row_y = vec3.add_scaled(vec3.scale(camera.focal, down), camera.center[1], forward)
    mx = mat3.apply_transposed(rotation, row_x)
    my = mat3.apply_transposed(rotation, row_y)
    mz = mat3.apply_transposed(rotation, forward)
    tx = vec3.dot(row_x, offset)
    ty = vec3.dot(row_y, offset)
    tz = vec3.dot(forward, offset)
    near = camera.near
    first = instance.first_vertex
    target = instance.first_projected
    for i in range(instance.num_vertices):
        vertex = vertices[first + i]
        out = projected[target + i]
        v = vec3.load(vertex.position)
        z = vec3.dot(mz, v) + tz
        pixel = (vec3.dot(mx, v) + tx, vec3.dot(my, v) + ty, z)
        vec3.store(out.pixel, pixel)
        vec3.store(out.normal, mat3.apply(rotation, vec3.load(vertex.normal)))
        if z >= near:
            inverse = 1.0 / z
            out.screen[0] = pixel[0] * inverse
            out.screen[1] = pixel[1] * inverse


@kernel
def clipped_box(a, b, c, near):
    """Least and greatest X / Z and Y / Z over the part of a triangle beyond the near plane; empty if there is none."""
    low_x, low_y, high_x, high_y = math.inf, math.inf, -math.inf, -math.inf
    for _ in range(3):
        if a[2] >= near:
            low_x = min(low_x, a[0] / a[2])
            high_x = max(high_x, a[0] / a[2])
            low_y = min(low_y, a[1] / a[2])
            high_y = max(high_y, a[1] / a[2])
        if (a[2] >= near) != (b[2] >= near):
            t = (near - a[2]) / (b[2] - a[2])
            x = (a[0] + t * (b[0] - a[0])) / near
            y = (a[1] + t * (b[1] - a[1])) / near
            low_x = min(low_x, x)
            high_x = max(high_x, x)
            low_y = min(low_y, y)
            high_y = max(high_y, y)
        a, b, c = b, c, a
    return low_x, low_y, high_x, high_y


@kernel
def fill(edges, row_low, row_high, low, high, scale, nearest, number, depth, ids):
    """Write a triangle into the pixels of a box where it is the closest so far."""
    e = (edges[0], edges[1], edges[2], edges[3], edges[4], edges[5], edges[6], edges[7], edges[8])
    depth_x = (e[0] + e[3] + e[6]) * scale
    depth_y = (e[1] + e[4] + e[7]) * scale
    depth_1 = (e[2] + e[5] + e[8]) * scale
    for j in range(row_low, row_high + 1):
        r0 = e[1] * j + e[2]
        r1 = e[4] * j + e[5]
        r2 = e[7] * j + e[8]
        z0 = depth_y * j + depth_1
        start = low
        stop = high
        if high - low >= NARROW:
            left = float(low)
            right = float(high)
            for k in range(3):
                slope = edges[3 * k]
                constant = edges[3 * k + 1] * j + edges[3 * k + 2]
                if slope > 0.0:
                    left = max(left, -constant / slope)
                elif slope < 0.0:
                    right = min(right, -constant / slope)
                elif constant < 0.0:
                    right = left - 2.0
            if right < left - 1.0:
                continue
            # One pixel more on each side: the exact test below decides, not these rounded quotients.
            start = max(low, int(left) - 1)
            stop = min(high, int(right) + 1)
        for i in range(start, stop + 1):
            if e[0] * i + r0 >= 0.0 and e[3] * i + r1 >= 0.0 and e[6] * i + r2 >= 0.0:
                z = np.float32(depth_x * i + z0)
                if z > depth[j, i] and z <= nearest:
                    depth[j, i] = z
                    ids[j, i] = number


@kernel
def draw_instance(instance, number, camera, faces, projected, triangles, count, depth, ids, box):
    """Enter the triangles of one projected instance into the visibility buffer.

    Args:
        number: of the instance.
        triangles: (capacity,) TRIANGLE, filled from ``count`` on.
        depth: (height, width) float32, 1 / z of what is closest [1/m], 0 for the sky.
        ids: (height, width) int32, the triangle that is seen.
        box: (4,) int64, widened to hold the pixels visited: first column, first row, last column, last row.

    Returns:
        The number of triangles in use.
    """
    height, width = depth.shape
    near = camera.near
    nearest = np.float32(1.0 / near)
    base = instance.first_projected
    for k in range(instance.first_face, instance.first_face + instance.num_faces):
        ia = np.int64(faces[k, 0])
        ib = np.int64(faces[k, 1])
        ic = np.int64(faces[k, 2])
        a = projected[base + ia]
        b = projected[base + ib]
        c = projected[base + ic]
        pa = vec3.load(a.pixel)
        pb = vec3.load(b.pixel)
        pc = vec3.load(c.pixel)
        if pa[2] >= near and pb[2] >= near and pc[2] >= near:
            low_x = min(a.screen[0], b.screen[0], c.screen[0])
            high_x = max(a.screen[0], b.screen[0], c.screen[0])
            low_y = min(a.screen[1], b.screen[1], c.screen[1])
            high_y = max(a.screen[1], b.screen[1], c.screen[1])
        elif pa[2] < near and pb[2] < near and pc[2] < near:
            continue
        else:
            low_x, low_y, high_x, high_y = clipped_box(pa, pb, pc, near)
        # Written so that a NaN anywhere drops the triangle.
        if not (high_x >= 0.0 and high_y >= 0.0 and low_x <= width - 1.0 and low_y <= height - 1.0):
            continue
        left = int(math.ceil(max(low_x, 0.0)))
        right = int(math.floor(min(high_x, width - 1.0)))
        top = int(math.ceil(max(low_y, 0.0)))
        bottom = int(math.floor(min(high_y, height - 1.0)))
        if left > right or top > bottom:
            continue
        e0 = vec3.cross(pc, pb)
        e1 = vec3.cross(pa, pc)
        e2 = vec3.cross(pb, pa)
        determinant = vec3.dot(pa, e0)
        side = 1.0
        if determinant < 0.0 and instance.two_sided == 1:
            e0, e1, e2 = vec3.neg(e0), vec3.neg(e1), vec3.neg(e2)
            determinant = -determinant
            side = -1.0
        if not determinant > 0.0:
            continue
        triangle = triangles[count]
        edges = triangle.edges
        for axis in range(3):
            edges[axis] = e0[axis]
            edges[3 + axis] = e1[axis]
            edges[6 + axis] = e2[axis]
        triangle.determinant = determinant
        triangle.corners[0] = ia
        triangle.corners[1] = ib
        triangle.corners[2] = ic
        triangle.instance = number
        triangle.side = side
        fill(edges, top, bottom, left, right, 1.0 / determinant, nearest, count, depth, ids)
        box[0] = min(box[0], left)
        box[1] = min(box[1], top)
        box[2] = max(box[2], right)
        box[3] = max(box[3], bottom)
        count += 1
    return count
