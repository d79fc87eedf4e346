"""A frame in three calls: opaque surfaces, translucent ones, and the picture in bytes."""

from __future__ import annotations

import numpy as np

from ..physics.jit import entry_point
from .shading import paint_box
from .sky import paint_sky
from .visibility import draw_instance, is_outside, project

# The curve from linear light to bytes has this many steps a unit of light: fine enough that none is seen in the dark.
STEPS = 8192
BRIGHTEST = 2.0  # linear light above this is white


@entry_point
def draw_opaque(
    instances,
    order,
    camera,
    light,
    shadow,
    shadow_depth,
    vertices,
    faces,
    projected,
    triangles,
    depth,
    ids,
    lanes,
    image,
):
    """Draw the instances numbered in ``order`` and the sky behind them into an empty frame."""
    height, width = depth.shape
    depth[:, :] = np.float32(0.0)
    ids[:, :] = np.int32(-1)
    box = np.array([width, height, -1, -1])
    count = np.int64(0)
    for k in range(len(order)):
        number = order[k]
        instance = instances[number]
        if is_outside(instance, camera[0], width, height):
            continue
        project(instance, camera[0], vertices, projected)
        count = draw_instance(instance, number, camera[0], faces, projected, triangles, count, depth, ids, box)
    paint_sky(camera[0], light[0], ids, lanes[0], image)
    paint_box(
        instances, camera[0], light[0], shadow[0], shadow_depth, vertices, projected, triangles, box, ids, lanes[0], image
    )


@entry_point
def draw_translucent(
    instances,
    order,
    camera,
    light,
    shadow,
    shadow_depth,
    vertices,
    faces,
    projected,
    triangles,
    depth,
    ids,
    lanes,
    image,
):
    """Blend the instances numbered in ``order``, the farthest first, over a frame; of each, its nearest surface is seen.

    ``depth`` is changed: pass a copy of the frame's where it is still needed. ``ids`` must be empty, as draw_opaque
    leaves it.
    """
    height, width = depth.shape
    first = np.int64(0)
    for k in range(len(order)):
        number = order[k]
        instance = instances[number]
        if is_outside(instance, camera[0], width, height):
            continue
        box = np.array([width, height, -1, -1])
        project(instance, camera[0], vertices, projected)
        draw_instance(instance, number, camera[0], faces, projected, triangles, first, depth, ids, box)
        paint_box(
        instances, camera[0], light[0], shadow[0], shadow_depth, vertices, projected, triangles, box, ids, lanes[0], image
    )


@entry_point
def develop(image, curve, samples, frame):
    """Average blocks of ``samples`` x ``samples`` pixels and turn linear light into bytes.

    Args:
        image: (height * samples, width * samples, 3) float32, linear.
        curve: (n,) uint8, the byte of the light k / STEPS.
        frame: (height, width, 3) uint8, written.
    """
    height, width, _ = frame.shape
    last = len(curve) - 1.0
    factor = STEPS / (samples * samples)
    for j in range(height):
        for i in range(width):
            for channel in range(3):
                if samples == 1:
                    total = float(image[j, i, channel])
                else:
                    total = 0.0
                    for down in range(j * samples, (j + 1) * samples):
                        for across in range(i * samples, (i + 1) * samples):
                            total += image[down, across, channel]
                # In this order a NaN becomes 0.
                frame[j, i, channel] = curve[int(max(0.0, min(total * factor, last)))]
