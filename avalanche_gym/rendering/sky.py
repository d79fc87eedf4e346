"""What is seen where there is no surface: a gradient from horizon to zenith, a halo about the sun, stars."""

from __future__ import annotations

import math

import numpy as np

from ..physics.jit import kernel
from ..physics.maths import vec3
from .lanes import BLOCK

STAR_CELLS = 40  # along each side of the cube on which stars are strewn, at most one a cell
STAR_SHARE = 0.3  # of the cells that hold one
STAR_SIZE = 0.9  # [pixels] radius within which a star is seen


@kernel
def cell_noise(i, j, k):
    """Three numbers in [0, 1) that belong to a cell (the mixer of SplitMix64, Steele et al. 2014)."""
    bits = np.uint64(i) * np.uint64(0x9E3779B97F4A7C15) + np.uint64(j) * np.uint64(0xD1B54A32D192ED03)
    bits += np.uint64(k) * np.uint64(0x8CB92BA72F3D8DD7)
    bits = (bits ^ (bits >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    bits = (bits ^ (bits >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    bits = bits ^ (bits >> np.uint64(31))
    mask = np.uint64(0x1FFFFF)
    scale = 1.0 / 2097152.0
    return (
        float(bits & mask) * scale,
        float((bits >> np.uint64(21)) & mask) * scale,
        float((bits >> np.uint64(42)) & mask) * scale,
    )


@kernel
def star(direction, pixel):
    """Brightness in [0, 1] of the star seen in a direction; ``pixel`` [rad] is the angle between neighbouring pixels."""
    x, y, z = direction
    ax, ay, az = abs(x), abs(y), abs(z)
    # The cube's face that the ray leaves through, and the place on it in [-1, 1]^2.
    if az >= ax and az >= ay:
        face, u, v = (0 if z > 0.0 else 1), x / az, y / az
    elif ay >= ax:
        face, u, v = (2 if y > 0.0 else 3), x / ay, z / ay
    else:
        face, u, v = (4 if x > 0.0 else 5), y / ax, z / ax
    u = 0.5 * (u + 1.0) * STAR_CELLS
    v = 0.5 * (v + 1.0) * STAR_CELLS
    i = int(math.floor(u))
    j = int(math.floor(v))
    place_u, place_v, kind = cell_noise(i, j, face)
    if kind > STAR_SHARE:
        return 0.0
    # Cells shrink towards the cube's corners; that the stars there are a little denser is not seen.
    reach = STAR_SIZE * pixel * 0.5 * STAR_CELLS
    du = u - i - (0.15 + 0.7 * place_u)
    dv = v - j - (0.15 + 0.7 * place_v)
    near = 1.0 - (du * du + dv * dv) / (reach * reach)
    if near <= 0.0:
        return 0.0
    share = kind / STAR_SHARE
    return near * (0.12 + 0.88 * share * share * share)


@kernel
def sky_block(lanes, first, count, camera, light, j):
    """The backdrop at ``count`` pixels of row j from column ``first`` on, without stars; float32 throughout."""
    zero, one, four = np.float32(0.0), np.float32(1.0), np.float32(4.0)
    step = vec3.scale(camera.pixel, vec3.load(camera.right))
    ray = vec3.add_scaled(vec3.load(camera.forward), (j - camera.center[1]) * camera.pixel, vec3.load(camera.down))
    ray = vec3.add_scaled(ray, first - camera.center[0], step)
    ray_x, ray_y, ray_z = np.float32(ray[0]), np.float32(ray[1]), np.float32(ray[2])
    step_x, step_y, step_z = np.float32(step[0]), np.float32(step[1]), np.float32(step[2])
    sun_x, sun_y, sun_z = np.float32(light.sun[0]), np.float32(light.sun[1]), np.float32(light.sun[2])
    glow = np.float32(light.glow)
    h0, h1, h2 = np.float32(light.horizon[0]), np.float32(light.horizon[1]), np.float32(light.horizon[2])
    z0, z1, z2 = np.float32(light.zenith[0]), np.float32(light.zenith[1]), np.float32(light.zenith[2])
    n0, n1, n2 = np.float32(light.nadir[0]), np.float32(light.nadir[1]), np.float32(light.nadir[2])
    s0, s1, s2 = np.float32(light.sun_color[0]), np.float32(light.sun_color[1]), np.float32(light.sun_color[2])
    for k in range(count):
        column = np.float32(k)
        dx = ray_x + column * step_x
        dy = ray_y + column * step_y
        dz = ray_z + column * step_z
        scale = one / math.sqrt(dx * dx + dy * dy + dz * dz)
        height = dz * scale
        low = one - max(height, zero)
        up = one - low * low * low
        down = min(one, max(zero, -four * height))
        level = one - up - down
        halo = max(zero, (dx * sun_x + dy * sun_y + dz * sun_z) * scale)
        halo *= halo
        halo *= halo
        halo *= halo
        halo *= halo * glow
        lanes.red[k] = level * h0 + up * z0 + down * n0 + halo * s0
        lanes.green[k] = level * h1 + up * z1 + down * n1 + halo * s1
        lanes.blue[k] = level * h2 + up * z2 + down * n2 + halo * s2


@kernel
def paint_sky(camera, light, ids, lanes, image):
    """Colour the pixels where nothing is seen."""
    height, width = ids.shape
    for j in range(height):
        for first in range(0, width, BLOCK):
            count = min(BLOCK, width - first)
            free = 0
            for i in range(first, first + count):
                free += 1 if ids[j, i] < 0 else 0
            if free == 0:
                continue
            sky_block(lanes, first, count, camera, light, j)
            for k in range(count):
                if ids[j, first + k] < 0:
                    image[j, first + k, 0] = lanes.red[k]
                    image[j, first + k, 1] = lanes.green[k]
                    image[j, first + k, 2] = lanes.blue[k]
    if light.stars > 0.0:
        paint_stars(camera, light, ids, image)


@kernel
def paint_stars(camera, light, ids, image):
    """Add the stars where nothing is seen."""
    height, width = ids.shape
    step = vec3.scale(camera.pixel, vec3.load(camera.right))
    for j in range(height):
        ray = vec3.add_scaled(vec3.load(camera.forward), (j - camera.center[1]) * camera.pixel, vec3.load(camera.down))
        for i in range(width):
            if ids[j, i] < 0:
                brightness = light.stars * star(vec3.add_scaled(ray, i - camera.center[0], step), camera.pixel)
                for channel in range(3):
                    image[j, i, channel] += brightness
