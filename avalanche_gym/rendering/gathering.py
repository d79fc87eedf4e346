"""From the visibility buffer to what has to be lit: the surface at each pixel.

The buffer names a triangle; its edge functions give barycentric coordinates at the pixel (visibility.py), and with
these the normal, the colour and the place in the pattern.
"""

from __future__ import annotations

import numpy as np

from ..physics.jit import kernel
from ..physics.maths import vec3
from .lanes import BLOCK


@kernel
def blend(a, x, b, y, c, z):
    """a x + b y + c z."""
    return (a * x[0] + b * y[0] + c * z[0], a * x[1] + b * y[1] + c * z[1], a * x[2] + b * y[2] + c * z[2])


@kernel
def gather(instances, vertices, projected, triangles, ids, i, j, last, backdrop, lanes):
    """Enter pixels of row j of the visibility buffer from column i on, until the lanes are full, and empty it.

    The outer loop runs over triangles, the inner one over the neighbouring pixels that show the same.

    Returns:
        The column after the last pixel visited, and the number of pixels entered.
    """
    count = np.int64(0)
    while i <= last and count < BLOCK:
        number = ids[j, i]
        if number < 0:
            if backdrop == 1:
                lanes.column[count] = i
                lanes.opacity[count] = 1.0
                lanes.surface[count] = 0.0
                lanes.contrast[count] = 0.0
                lanes.lit[count] = 0.0
                count += 1
            i += 1
            continue
        triangle = triangles[number]
        instance = instances[np.int64(triangle.instance)]
        edges = triangle.edges
        a = np.int64(triangle.corners[0])
        b = np.int64(triangle.corners[1])
        c = np.int64(triangle.corners[2])
        base = instance.first_projected
        na, nb, nc = projected[base + a].normal, projected[base + b].normal, projected[base + c].normal
        va = vertices[instance.first_vertex + a]
        vb = vertices[instance.first_vertex + b]
        vc = vertices[instance.first_vertex + c]
        ca, cb, cc = va.color, vb.color, vc.color
        tint = instance.color
        opacity, gloss, contrast, side = instance.opacity, instance.gloss, instance.contrast, triangle.side
        lit = np.float32(1 - instance.unlit)
        # Place on the surface and its change from pixel to pixel, for the pattern.
        size = vec3.load(instance.pattern_scale)
        offset = vec3.load(instance.pattern_offset)
        pa = vec3.multiply(size, vec3.load(va.position))
        pb = vec3.multiply(size, vec3.load(vb.position))
        pc = vec3.multiply(size, vec3.load(vc.position))
        along_i = blend(edges[0], pa, edges[3], pb, edges[6], pc)
        along_j = blend(edges[1], pa, edges[4], pb, edges[7], pc)
        sum_i = edges[0] + edges[3] + edges[6]
        sum_j = edges[1] + edges[4] + edges[7]
        r0 = edges[1] * j + edges[2]
        r1 = edges[4] * j + edges[5]
        r2 = edges[7] * j + edges[8]
        while i <= last and ids[j, i] == number and count < BLOCK:
            ids[j, i] = -1
            e0 = edges[0] * i + r0
            e1 = edges[3] * i + r1
            e2 = edges[6] * i + r2
            total = 1.0 / (e0 + e1 + e2)
            e0 *= total
            e1 *= total
            e2 *= total
            f0, f1, f2 = np.float32(e0), np.float32(e1), np.float32(e2)
            color = blend(f0, ca, f1, cb, f2, cc)
            normal = blend(f0, na, f1, nb, f2, nc)
            lanes.column[count] = i
            lanes.opacity[count] = opacity * (f0 * ca[3] + f1 * cb[3] + f2 * cc[3])
            lanes.surface[count] = 1.0
            lanes.depth[count] = triangle.determinant * total
            lanes.normal_x[count] = side * normal[0]
            lanes.normal_y[count] = side * normal[1]
            lanes.normal_z[count] = side * normal[2]
            lanes.red[count] = tint[0] * color[0]
            lanes.green[count] = tint[1] * color[1]
            lanes.blue[count] = tint[2] * color[2]
            lanes.gloss[count] = gloss
            lanes.lit[count] = lit
            lanes.contrast[count] = contrast
            if contrast != 0.0:
                p = blend(e0, pa, e1, pb, e2, pc)
                lanes.place_x[count] = p[0] + offset[0]
                lanes.place_y[count] = p[1] + offset[1]
                lanes.place_z[count] = p[2] + offset[2]
                lanes.blur_x[count] = total * (abs(along_i[0] - sum_i * p[0]) + abs(along_j[0] - sum_j * p[0]))
                lanes.blur_y[count] = total * (abs(along_i[1] - sum_i * p[1]) + abs(along_j[1] - sum_j * p[1]))
                lanes.blur_z[count] = total * (abs(along_i[2] - sum_i * p[2]) + abs(along_j[2] - sum_j * p[2]))
            i += 1
            count += 1
    return i, count
