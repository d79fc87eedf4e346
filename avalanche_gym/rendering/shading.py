"""The colour of each pixel, once, after it is known what is seen there.

The visibility buffer names a triangle; its edge functions give barycentric coordinates at the pixel, and with these the
normal, the colour and the place in the pattern (``gather``). Light is that of ``lighting``, with a highlight (Phong 1975,
with a fixed exponent) and haze; it is computed for a block of pixels at once (``illuminate``, ``finish``), between which
each pixel is looked up in the shadow map.
"""

from __future__ import annotations

import math

import numpy as np

from ..physics.jit import kernel
from ..physics.maths import vec3
from .geometry import PLAIN
from .lanes import BLOCK
from .pattern import paint_patterns
from .shadow import BIAS, NORMAL_OFFSET, SLOPE_BIAS, STEEPEST, sunlight

DUSK = 12.0  # sunlight fades in until the cosine between surface and sun is 1 / DUSK: hides the steps of a coarse mesh
LEAST = 1e-30  # keeps the length of a vanishing normal from dividing by zero
# Above this a surface covers what was there entirely: nothing of the frame before may show, not even in the last bit.
OPAQUE = 0.999


@kernel
def blend(a, x, b, y, c, z):
    """a x + b y + c z."""
    return (a * x[0] + b * y[0] + c * z[0], a * x[1] + b * y[1] + c * z[1], a * x[2] + b * y[2] + c * z[2])


@kernel
def gather(instances, vertices, projected, triangles, ids, i, j, last, lanes):
    """Enter pixels of row j of the visibility buffer from column i on, until the lanes are full.

    The outer loop runs over triangles, the inner one over the neighbouring pixels that show the same.

    Returns:
        The column after the last pixel visited, and the number of pixels entered.
    """
    count = np.int64(0)
    while i <= last and count < BLOCK:
        number = ids[j, i]
        if number < 0:
            i += 1
            continue
        triangle = triangles[number]
        instance = instances[np.int64(triangle.instance)]
        edges = triangle.edges
        a = np.int64(triangle.corners[0])
        b = np.int64(triangle.corners[1])
        c = np.int64(triangle.corners[2])
        base = instance.first_projected
        na = vec3.scale(triangle.side, vec3.load(projected[base + a].normal))
        nb = vec3.scale(triangle.side, vec3.load(projected[base + b].normal))
        nc = vec3.scale(triangle.side, vec3.load(projected[base + c].normal))
        va = vertices[instance.first_vertex + a]
        vb = vertices[instance.first_vertex + b]
        vc = vertices[instance.first_vertex + c]
        ca, cb, cc = vec3.load(va.color), vec3.load(vb.color), vec3.load(vc.color)
        oa, ob, oc = va.color[3], vb.color[3], vc.color[3]
        tint = vec3.load(instance.color)
        opacity, gloss = instance.opacity, instance.gloss
        lit = np.float32(1 - instance.unlit)
        pattern, contrast = np.float32(instance.pattern), instance.contrast
        # Place on the surface and its change from pixel to pixel, for the pattern.
        size = instance.inverse_pattern_size
        pa = vec3.scale(size, vec3.load(va.position))
        pb = vec3.scale(size, vec3.load(vb.position))
        pc = vec3.scale(size, vec3.load(vc.position))
        along_i = blend(edges[0], pa, edges[3], pb, edges[6], pc)
        along_j = blend(edges[1], pa, edges[4], pb, edges[7], pc)
        sum_i = edges[0] + edges[3] + edges[6]
        sum_j = edges[1] + edges[4] + edges[7]
        facing = vec3.load(va.normal)
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
            color = vec3.multiply(tint, blend(f0, ca, f1, cb, f2, cc))
            normal = blend(f0, na, f1, nb, f2, nc)
            lanes.column[count] = i
            lanes.depth[count] = triangle.determinant * total
            lanes.normal_x[count] = normal[0]
            lanes.normal_y[count] = normal[1]
            lanes.normal_z[count] = normal[2]
            lanes.red[count] = color[0]
            lanes.green[count] = color[1]
            lanes.blue[count] = color[2]
            lanes.opacity[count] = opacity * (f0 * oa + f1 * ob + f2 * oc)
            lanes.gloss[count] = gloss
            lanes.lit[count] = lit
            lanes.pattern[count] = pattern
            if pattern != PLAIN:
                place = blend(e0, pa, e1, pb, e2, pc)
                lanes.contrast[count] = contrast
                lanes.place_x[count] = place[0]
                lanes.place_y[count] = place[1]
                lanes.place_z[count] = place[2]
                lanes.blur_x[count] = total * (abs(along_i[0] - sum_i * place[0]) + abs(along_j[0] - sum_j * place[0]))
                lanes.blur_y[count] = total * (abs(along_i[1] - sum_i * place[1]) + abs(along_j[1] - sum_j * place[1]))
                lanes.blur_z[count] = total * (abs(along_i[2] - sum_i * place[2]) + abs(along_j[2] - sum_j * place[2]))
                lanes.axis_x[count] = abs(facing[0])
                lanes.axis_y[count] = abs(facing[1])
                lanes.axis_z[count] = abs(facing[2])
            i += 1
            count += 1
    return i, count


@kernel
def illuminate(lanes, count, camera, light, shadow, j):
    """Light of sky and ground, what the sun adds where it is not hidden, and the place in the shadow map.

    Everything is a float32, so that the loop runs on eight pixels at once; a literal would turn it into float64.
    """
    zero, half, one, two = np.float32(0.0), np.float32(0.5), np.float32(1.0), np.float32(2.0)
    dusk, least, offset = np.float32(DUSK), np.float32(LEAST), np.float32(NORMAL_OFFSET)
    steepest, slope_bias, bias = np.float32(STEEPEST), np.float32(SLOPE_BIAS), np.float32(BIAS)
    pixel, haze = np.float32(shadow.pixel), np.float32(light.haze)
    # The ray through column i of this row, of length one along the optical axis, is ray + i step.
    step = vec3.scale(camera.pixel, vec3.load(camera.right))
    ray = vec3.add_scaled(vec3.load(camera.forward), (j - camera.center[1]) * camera.pixel, vec3.load(camera.down))
    ray = vec3.add_scaled(ray, -camera.center[0], step)
    ray_x, ray_y, ray_z = np.float32(ray[0]), np.float32(ray[1]), np.float32(ray[2])
    step_x, step_y, step_z = np.float32(step[0]), np.float32(step[1]), np.float32(step[2])
    sun_x, sun_y, sun_z = np.float32(light.sun[0]), np.float32(light.sun[1]), np.float32(light.sun[2])
    # Rows of the matrix from the world to the shadow map, and the eye there.
    eye = vec3.sub(vec3.load(camera.eye), vec3.load(shadow.center))
    across = vec3.scale(shadow.scale, vec3.load(shadow.across))
    along = vec3.scale(shadow.scale, vec3.load(shadow.along))
    eye_u = np.float32(vec3.dot(across, eye) + shadow.half)
    eye_v = np.float32(vec3.dot(along, eye) + shadow.half)
    eye_w = np.float32(-vec3.dot(vec3.load(shadow.sun), eye))
    across_x, across_y, across_z = np.float32(across[0]), np.float32(across[1]), np.float32(across[2])
    along_x, along_y, along_z = np.float32(along[0]), np.float32(along[1]), np.float32(along[2])
    offset *= pixel
    slope_bias *= pixel
    bias *= pixel
    sun_red, sun_green, sun_blue = (
        np.float32(light.sun_color[0]),
        np.float32(light.sun_color[1]),
        np.float32(light.sun_color[2]),
    )
    above_red, above_green, above_blue = (
        np.float32(light.above[0]),
        np.float32(light.above[1]),
        np.float32(light.above[2]),
    )
    below_red, below_green, below_blue = (
        np.float32(light.below[0]),
        np.float32(light.below[1]),
        np.float32(light.below[2]),
    )
    for k in range(count):
        nx, ny, nz = lanes.normal_x[k], lanes.normal_y[k], lanes.normal_z[k]
        scale = one / math.sqrt(max(nx * nx + ny * ny + nz * nz, least))
        nx *= scale
        ny *= scale
        nz *= scale
        depth = lanes.depth[k]
        dx = depth * (ray_x + lanes.column[k] * step_x)
        dy = depth * (ray_y + lanes.column[k] * step_y)
        dz = depth * (ray_z + lanes.column[k] * step_z)
        distance = math.sqrt(dx * dx + dy * dy + dz * dz)
        inverse = one / max(distance, least)
        facing = nx * sun_x + ny * sun_y + nz * sun_z
        lanes.sun[k] = one if facing > zero else zero
        facing = max(facing, zero)

        # Moved off the surface, see shadow.py.
        sine = math.sqrt(max(one - facing * facing, zero))
        lift = offset * sine
        px = dx + lift * nx
        py = dy + lift * ny
        pz = dz + lift * nz
        tangent = min(sine / max(facing, least), steepest)
        lanes.map_x[k] = eye_u + px * across_x + py * across_y + pz * across_z
        lanes.map_y[k] = eye_v + px * along_x + py * along_y + pz * along_z
        lanes.map_z[k] = eye_w - (px * sun_x + py * sun_y + pz * sun_z) - (bias + slope_bias * tangent)

        # The highlight: the cosine between the mirrored ray of the sun and the eye, to the power of 16.
        toward = -(nx * dx + ny * dy + nz * dz) * inverse
        shine = two * facing * toward + (dx * sun_x + dy * sun_y + dz * sun_z) * inverse
        shine = max(shine, zero)
        shine *= shine
        shine *= shine
        shine *= shine
        shine *= shine
        lit = lanes.lit[k]
        fade = lit * min(one, facing * dusk)
        shine *= fade * lanes.gloss[k]
        facing *= fade
        tilt = half + half * nz
        red, green, blue = lanes.red[k], lanes.green[k], lanes.blue[k]
        lanes.sun_red[k] = sun_red * (facing * red + shine)
        lanes.sun_green[k] = sun_green * (facing * green + shine)
        lanes.sun_blue[k] = sun_blue * (facing * blue + shine)
        shines = one - lit
        lanes.red[k] = red * (shines + lit * (tilt * above_red + (one - tilt) * below_red))
        lanes.green[k] = green * (shines + lit * (tilt * above_green + (one - tilt) * below_green))
        lanes.blue[k] = blue * (shines + lit * (tilt * above_blue + (one - tilt) * below_blue))
        far = distance * haze
        lanes.clear[k] = one / (one + far * far)


@kernel
def finish(lanes, count, light, shadow_depth):
    """Look the pixels up in the shadow map, add the sun, and then the haze."""
    for k in range(count):
        if lanes.sun[k] > 0.0:
            lanes.sun[k] = sunlight(lanes.map_x[k], lanes.map_y[k], lanes.map_z[k], shadow_depth)
    one = np.float32(1.0)
    red, green, blue = np.float32(light.horizon[0]), np.float32(light.horizon[1]), np.float32(light.horizon[2])
    for k in range(count):
        sun = lanes.sun[k]
        clear = lanes.clear[k]
        lanes.red[k] = clear * (lanes.red[k] + sun * lanes.sun_red[k]) + (one - clear) * red
        lanes.green[k] = clear * (lanes.green[k] + sun * lanes.sun_green[k]) + (one - clear) * green
        lanes.blue[k] = clear * (lanes.blue[k] + sun * lanes.sun_blue[k]) + (one - clear) * blue


@kernel
def scatter(lanes, count, j, image):
    """Blend the pixels into row j of the image."""
    for k in range(count):
        i = int(lanes.column[k])
        opacity = lanes.opacity[k]
        if opacity > OPAQUE:
            image[j, i, 0] = lanes.red[k]
            image[j, i, 1] = lanes.green[k]
            image[j, i, 2] = lanes.blue[k]
        else:
            image[j, i, 0] += opacity * (lanes.red[k] - image[j, i, 0])
            image[j, i, 1] += opacity * (lanes.green[k] - image[j, i, 1])
            image[j, i, 2] += opacity * (lanes.blue[k] - image[j, i, 2])


@kernel
def paint_box(
    instances, camera, light, shadow, shadow_depth, vertices, projected, triangles, box, ids, lanes, image
):
    """Blend the visible triangles into the image (height, width, 3) float32, and take them off the visibility buffer.

    Args:
        box: (4,) the pixels to visit: first column, first row, last column, last row.
    """
    last = box[2]
    for j in range(box[1], box[3] + 1):
        i = box[0]
        while i <= last:
            i, count = gather(instances, vertices, projected, triangles, ids, i, j, last, lanes)
            paint_patterns(lanes, count)
            illuminate(lanes, count, camera, light, shadow, j)
            finish(lanes, count, light, shadow_depth)
            scatter(lanes, count, j, image)
