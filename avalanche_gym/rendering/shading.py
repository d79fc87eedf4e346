"""The colour of each pixel, once, after it is known what is seen there.

Pixels are gathered in blocks (gathering.py). Light is that of lighting.py, with a highlight (Phong 1975, with a fixed
exponent) and haze; it is computed for a block of pixels at once (``illuminate``), each of which is then looked up in
the shadow map (``finish``).
"""

from __future__ import annotations

import math

import numpy as np

from ..physics.jit import entry_point, kernel
from .gathering import gather
from .shadow import STEEPEST, sunlight

DUSK = 12.0  # sunlight fades in until the cosine between surface and sun is 1 / DUSK: hides the steps of a coarse mesh
LEAST = 1e-30  # keeps the length of a vanishing normal from dividing by zero
# Above this a surface covers what was there entirely: nothing of the frame before may show, not even in the last bit.
OPAQUE = 0.999
# [cells] A pixel is never taken to be smaller: keeps averages over it, differences divided by it, from rounding.
SHARPEST = 1e-4


@kernel
def square_wave(x, width):
    """Mean over a window of this width about x of a wave of period 2: 1 on [0, 1), -1 on [1, 2); float32.

    Averaged over the pixel, squares far away fade to their mean instead of flickering.
    """
    half = np.float32(0.5)
    width = max(width, np.float32(SHARPEST))
    a = half * (x - half * width)
    b = half * (x + half * width)
    # The wave's integral is a triangle wave.
    return np.float32(2.0) * (abs(a - np.floor(a) - half) - abs(b - np.floor(b) - half)) / width


@kernel
def illuminate(lanes, count, frame, j):
    """Light of sky and ground, what the sun adds where it is not hidden, and the place in the shadow map.

    Everything is a float32, so that the loop runs on eight pixels at once; a literal would turn it into float64.
    """
    zero, half, one, two = np.float32(0.0), np.float32(0.5), np.float32(1.0), np.float32(2.0)
    dusk, least, steepest = np.float32(DUSK), np.float32(LEAST), np.float32(STEEPEST)
    ray_x = np.float32(frame.corner[0] + j * frame.down[0])
    ray_y = np.float32(frame.corner[1] + j * frame.down[1])
    ray_z = np.float32(frame.corner[2] + j * frame.down[2])
    step_x, step_y, step_z = np.float32(frame.across[0]), np.float32(frame.across[1]), np.float32(frame.across[2])
    sun, sun_color, above, below = frame.sun, frame.sun_color, frame.above, frame.below
    map_eye, across, down = frame.map_eye, frame.map_across, frame.map_down
    lift, bias, slope_bias = frame.lift, frame.bias, frame.slope_bias
    for k in range(count):
        wave = square_wave(lanes.place_x[k], lanes.blur_x[k])
        wave *= square_wave(lanes.place_y[k], lanes.blur_y[k])
        wave *= square_wave(lanes.place_z[k], lanes.blur_z[k])
        contrast = lanes.contrast[k]
        shade = one + contrast * wave if contrast != zero else one
        red, green, blue = shade * lanes.red[k], shade * lanes.green[k], shade * lanes.blue[k]

        nx, ny, nz = lanes.normal_x[k], lanes.normal_y[k], lanes.normal_z[k]
        scale = one / math.sqrt(max(nx * nx + ny * ny + nz * nz, least))
        nx *= scale
        ny *= scale
        nz *= scale
        depth = lanes.depth[k]
        dx = depth * (ray_x + lanes.column[k] * step_x)
        dy = depth * (ray_y + lanes.column[k] * step_y)
        dz = depth * (ray_z + lanes.column[k] * step_z)
        inverse = one / math.sqrt(max(dx * dx + dy * dy + dz * dz, least))
        facing = nx * sun[0] + ny * sun[1] + nz * sun[2]
        lanes.sun[k] = lanes.surface[k] if facing > zero else zero
        facing = max(facing, zero)

        # Moved off the surface, see shadow.py.
        sine = math.sqrt(max(one - facing * facing, zero))
        px = dx + lift * sine * nx
        py = dy + lift * sine * ny
        pz = dz + lift * sine * nz
        tangent = min(sine / max(facing, least), steepest)
        lanes.map_x[k] = map_eye[0] + px * across[0] + py * across[1] + pz * across[2]
        lanes.map_y[k] = map_eye[1] + px * down[0] + py * down[1] + pz * down[2]
        lanes.nearness[k] = map_eye[2] + px * sun[0] + py * sun[1] + pz * sun[2] + bias + slope_bias * tangent

        # The highlight: the cosine between the mirrored ray of the sun and the eye, to the power of 16.
        toward = -(nx * dx + ny * dy + nz * dz) * inverse
        shine = max(two * facing * toward + (dx * sun[0] + dy * sun[1] + dz * sun[2]) * inverse, zero)
        shine *= shine
        shine *= shine
        shine *= shine
        shine *= shine
        lit = lanes.lit[k]
        fade = lit * min(one, facing * dusk)
        shine *= fade * lanes.gloss[k]
        facing *= fade
        lanes.sun_red[k] = sun_color[0] * (facing * red + shine)
        lanes.sun_green[k] = sun_color[1] * (facing * green + shine)
        lanes.sun_blue[k] = sun_color[2] * (facing * blue + shine)
        tilt = half + half * nz
        lanes.red[k] = red * (one - lit + lit * (below[0] + tilt * (above[0] - below[0])))
        lanes.green[k] = green * (one - lit + lit * (below[1] + tilt * (above[1] - below[1])))
        lanes.blue[k] = blue * (one - lit + lit * (below[2] + tilt * (above[2] - below[2])))


@kernel
def finish(lanes, count, frame, shadow_depth, j, image):
    """Look pixels up in the shadow map, add the sun, the haze and the sky, and blend them into row j of the image."""
    for k in range(count):
        if lanes.sun[k] > 0.0:
            lanes.sun[k] = sunlight(lanes.map_x[k], lanes.map_y[k], lanes.nearness[k], shadow_depth)
    zero, one, four = np.float32(0.0), np.float32(1.0), np.float32(4.0)
    ray_x = np.float32(frame.corner[0] + j * frame.down[0])
    ray_y = np.float32(frame.corner[1] + j * frame.down[1])
    ray_z = np.float32(frame.corner[2] + j * frame.down[2])
    step_x, step_y, step_z = np.float32(frame.across[0]), np.float32(frame.across[1]), np.float32(frame.across[2])
    sun, sun_color, glow, haze = frame.sun, frame.sun_color, frame.glow, frame.haze
    zenith, horizon, nadir = frame.zenith, frame.horizon, frame.nadir
    for k in range(count):
        dx = ray_x + lanes.column[k] * step_x
        dy = ray_y + lanes.column[k] * step_y
        dz = ray_z + lanes.column[k] * step_z
        length = math.sqrt(dx * dx + dy * dy + dz * dz)
        height = dz / length
        halo = max(zero, (dx * sun[0] + dy * sun[1] + dz * sun[2]) / length)
        halo *= halo
        halo *= halo
        halo *= halo
        halo *= halo * glow
        low = one - max(height, zero)
        up = one - low * low * low
        down = min(one, max(zero, -four * height))
        # What is far away fades into the horizon; the sky itself is what lies behind no surface at all. Written without
        # branches, which would keep the loop from running on eight pixels at once.
        surface = lanes.surface[k]
        far = haze * lanes.depth[k] * length
        clear = surface / (one + far * far)
        halo *= one - surface
        level = surface + (one - surface) * (one - up - down)
        up *= one - surface
        down *= one - surface
        share = lanes.sun[k]
        red = level * horizon[0] + up * zenith[0] + down * nadir[0] + halo * sun_color[0]
        green = level * horizon[1] + up * zenith[1] + down * nadir[1] + halo * sun_color[1]
        blue = level * horizon[2] + up * zenith[2] + down * nadir[2] + halo * sun_color[2]
        lanes.red[k] = red + clear * (lanes.red[k] + share * lanes.sun_red[k] - red)
        lanes.green[k] = green + clear * (lanes.green[k] + share * lanes.sun_green[k] - green)
        lanes.blue[k] = blue + clear * (lanes.blue[k] + share * lanes.sun_blue[k] - blue)
    red, green, blue = lanes.red, lanes.green, lanes.blue
    for k in range(count):
        i = int(lanes.column[k])
        share = lanes.opacity[k]
        if share > OPAQUE:
            share = one
        keep = one - share
        image[j, i, 0] = keep * image[j, i, 0] + share * red[k]
        image[j, i, 1] = keep * image[j, i, 1] + share * green[k]
        image[j, i, 2] = keep * image[j, i, 2] + share * blue[k]


@entry_point
def paint(
    instances,
    vertices,
    projected,
    triangles,
    frames,
    shadow_depth,
    box,
    backdrop,
    ids,
    lanes,
    image,
):
    """Blend what is seen into the image and empty the visibility buffer.

    Args:
        instances: INSTANCE of every visual.
        vertices: VERTEX of every mesh.
        projected, triangles, ids: as draw_instances left them.
        frames: (1,) FRAME.
        shadow_depth: (n, n) float32, the shadow map.
        box: (4,) the pixels to visit: first column, first row, last column, last row.
        backdrop: 1 to paint the sky where nothing is seen, 0 to leave the image there.
        lanes: (1,) LANES, scratch.
        image: (height, width, 3) float32, linear.
    """
    last = box[2]
    for j in range(box[1], box[3] + 1):
        i = box[0]
        while i <= last:
            i, count = gather(instances, vertices, projected, triangles, ids, i, j, last, backdrop, lanes[0])
            illuminate(lanes[0], count, frames[0], j)
            finish(lanes[0], count, frames[0], shadow_depth, j, image)
