"""From linear light to the bytes of a picture."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ..physics.jit import entry_point
from .color import to_srgb

STEPS = 8192  # of the curve from light to bytes, to a unit of light: fine enough that none is seen in the dark
BRIGHTEST = 1.3  # linear light above this is white
SHOULDER = 0.9  # brightness above which light is compressed towards white, so that highlights keep their form


@lru_cache(maxsize=1)
def response() -> NDArray[np.uint8]:
    """The byte of each linear brightness k / STEPS."""
    light = np.arange(int(BRIGHTEST * STEPS)) / STEPS
    room, bright = 1.0 - SHOULDER, np.maximum(light - SHOULDER, 0.0)
    # A hyperbola of slope one at the shoulder that reaches one at the brightest.
    scale = room * (BRIGHTEST - SHOULDER) / ((BRIGHTEST - SHOULDER) - room)
    light = np.minimum(light, SHOULDER) + bright / (1.0 + bright / scale)
    return np.round(255.0 * to_srgb(light)).astype(np.uint8)


@entry_point
def develop(image, curve, samples, frame):
    """Average blocks of ``samples`` x ``samples`` pixels and turn linear light into bytes.

    Args:
        image: (height * samples, width * samples, 3) float32, linear.
        curve: (n,) uint8, the response.
        frame: (height, width, 3) uint8, written.
    """
    height, width, _ = frame.shape
    last = len(curve) - 1.0
    factor = STEPS / (samples * samples)
    for j in range(height):
        for i in range(width):
            for channel in range(3):
                total = 0.0
                for down in range(j * samples, (j + 1) * samples):
                    for across in range(i * samples, (i + 1) * samples):
                        total += image[down, across, channel]
                # In this order a NaN becomes 0.
                frame[j, i, channel] = curve[int(max(0.0, min(total * factor, last)))]
