"""Many frames as one picture."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray


def tile(frames: Sequence[NDArray[np.uint8]], columns: int | None = None, gap: int = 2) -> NDArray[np.uint8]:
    """Lay the frames of a vector environment side by side.

    Args:
        frames: each (height, width, 3) uint8, of the same shape.
        columns: how many in a row; None for a picture that is about square.
        gap: [pixels] of dark border between them.

    Returns:
        (rows * height + gaps, columns * width + gaps, 3) uint8; places without a frame are dark.
    """
    if len(frames) == 0:
        raise ValueError("tile(frames) got no frame; give at least one.")
    shapes = {frame.shape for frame in frames}
    if len(shapes) != 1:
        raise ValueError(f"tile(frames) got frames of the shapes {sorted(shapes)}; draw all of them at the same size.")
    height, width, channels = frames[0].shape
    across = math.ceil(math.sqrt(len(frames))) if columns is None else columns
    down = math.ceil(len(frames) / across)
    picture = np.full((down * (height + gap) - gap, across * (width + gap) - gap, channels), 24, dtype=np.uint8)
    for index, frame in enumerate(frames):
        row, column = divmod(index, across)
        top, left = row * (height + gap), column * (width + gap)
        picture[top : top + height, left : left + width] = frame
    return picture
