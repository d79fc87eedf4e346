"""Every pair of bodies against each other: the cheapest search for small scenes, and the reference for the others."""

from __future__ import annotations

from ..jit import kernel
from ..model import DYNAMIC


@kernel
def overlap(boxes, a, b):
    """Whether the bounds of bodies a and b meet; a bound that is not a number never does."""
    i = 6 * a
    j = 6 * b
    return (
        boxes[i] <= boxes[j + 3]
        and boxes[j] <= boxes[i + 3]
        and boxes[i + 1] <= boxes[j + 4]
        and boxes[j + 1] <= boxes[i + 4]
        and boxes[i + 2] <= boxes[j + 5]
        and boxes[j + 2] <= boxes[i + 5]
    )


@kernel
def all_pairs(bodies, boxes, pairs):
    """Write the pairs (a < b) of bodies that may touch into ``pairs`` (two entries each); return their number.

    The number goes on counting when ``pairs`` is full, so that the caller learns how many there were.
    """
    count = 0
    num_bodies = bodies.shape[0]
    for a in range(num_bodies):
        if bodies[a].num_colliders == 0:
            continue
        dynamic = bodies[a].motion == DYNAMIC
        for b in range(a + 1, num_bodies):
            if (dynamic or bodies[b].motion == DYNAMIC) and overlap(boxes, a, b) and bodies[b].num_colliders > 0:
                if 2 * count + 1 < pairs.shape[0]:
                    pairs[2 * count] = a
                    pairs[2 * count + 1] = b
                count += 1
    return count
