"""Stars: at most one in each cell of a cube about the eye, always the same ones."""

from __future__ import annotations

import math

import numpy as np

from ..physics.jit import entry_point, kernel
from ..physics.maths import vec3

STAR_CELLS = 40  # along each side of the cube
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
    """Brightness in [0, 1] of the star in a direction; ``pixel`` [rad] is the angle between neighbouring pixels."""
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


@entry_point
def paint_stars(cameras, brightness, depth, image):
    """Add the stars where nothing is seen.

    Args:
        cameras: (1,) CAMERA.
        brightness: of the brightest star.
        depth: (height, width) float32, 0 where nothing is seen.
        image: (height, width, 3) float32, linear.
    """
    camera = cameras[0]
    height, width = depth.shape
    step = vec3.scale(camera.pixel, vec3.load(camera.right))
    for j in range(height):
        ray = vec3.add_scaled(vec3.load(camera.forward), (j - camera.center[1]) * camera.pixel, vec3.load(camera.down))
        for i in range(width):
            if depth[j, i] == 0.0:
                light = brightness * star(vec3.add_scaled(ray, i - camera.center[0], step), camera.pixel)
                for channel in range(3):
                    image[j, i, channel] += light
