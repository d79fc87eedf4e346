"""The slow twin of the broad phase: every pair of boxes, compared by NumPy."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def meeting_pairs(boxes: NDArray[np.float64], dynamic: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Pairs (a, b), a < b, of boxes (n, 6), low and high, that meet and of which at least one is dynamic, in order."""
    low, high = boxes[:, :3], boxes[:, 3:]
    meet = ((low[:, None] <= high[None]) & (low[None] <= high[:, None])).all(axis=2)
    meet &= dynamic[:, None] | dynamic[None]
    return [(int(a), int(b)) for a, b in np.argwhere(np.triu(meet, 1))]
