"""Pairs of bodies that are close, kept from step to step: only what has left its fat bounds is looked up again.

The bounds of a dynamic body in the grid are fat: wider than those of this step. While it stays inside of them, its
pairs stay candidates, and a step costs a comparison for each body and each candidate. The pairs that come out are those
whose bounds of this step meet, in the order of their handles, so they do not depend on what was kept.
"""

from __future__ import annotations

import math

import numpy as np

from ..jit import kernel
from ..model import DYNAMIC
from .all_pairs import overlap
from .grid import SECOND_MASK, SECOND_SHIFT, clear, put_in, search, take_out
from .tables import OUT

# Fat bounds are wider by this fraction of the body's radius, and hold so many steps of its present motion, but no more
# than its radius. Wider ones are left less often and meet more often.
FAT = 0.1
AHEAD = 8.0
# Bounds that have become wider than they need be by this factor are made anew: of a body that was fast.
LOOSE = 2.0


@kernel
def _within(box, fat, size):
    """Whether bounds box[0:6] are inside the fat ones, and those not much too wide."""
    loose = False
    for axis in range(3):
        loose = loose or fat[3 + axis] - fat[axis] > LOOSE * (box[3 + axis] - box[axis] + size)
    return not loose and (
        fat[0] <= box[0]
        and fat[1] <= box[1]
        and fat[2] <= box[2]
        and box[3] <= fat[3]
        and box[4] <= fat[4]
        and box[5] <= fat[5]
    )


@kernel
def _bounded(box):
    """Whether bounds exist; what is not a number compares false."""
    return box[0] <= box[3] and box[1] <= box[4] and box[2] <= box[5]


@kernel
def _find_moved(bodies, proxies, boxes, moved):
    """Write the bodies whose place in the grid is no longer right to ``moved``; return how many."""
    count = 0
    for index in range(bodies.shape[0]):
        body = bodies[index]
        proxy = proxies[index]
        box = boxes[6 * index : 6 * index + 6]
        if body.num_colliders == 0 or not _bounded(box):
            right = proxy.place == OUT
        else:
            right = proxy.place != OUT and proxy.motion == body.motion and _within(box, proxy.box, FAT * body.radius)
        if not right:
            moved[count] = index
            count += 1
    return count


@kernel
def _fatten(body, motion, box, fat):
    """Bounds to put a body in by; ``motion`` (3) [m] is how far it flies in a step."""
    room = FAT * body.radius if body.motion == DYNAMIC else 0.0
    for axis in range(3):
        ahead = min(max(AHEAD * motion[axis], -body.radius), body.radius)
        fat[axis] = box[axis] - room + min(ahead, 0.0)
        fat[3 + axis] = box[3 + axis] + room + max(ahead, 0.0)
        # Infinity less infinity.
        if math.isnan(fat[axis]) or math.isnan(fat[3 + axis]):
            fat[axis] = box[axis]
            fat[3 + axis] = box[3 + axis]


@kernel
def _counting_sort(keys, count, shift, num_bodies, starts, out):
    """Sort ``keys`` stably by the handle at ``shift`` into ``out``; ``starts`` is (bodies + 1,) scratch."""
    for index in range(num_bodies + 1):
        starts[index] = 0
    for index in range(count):
        starts[((keys[index] >> shift) & SECOND_MASK) + 1] += 1
    for index in range(num_bodies):
        starts[index + 1] += starts[index]
    for index in range(count):
        handle = (keys[index] >> shift) & SECOND_MASK
        out[starts[handle]] = keys[index]
        starts[handle] += 1


@kernel
def _merge(candidates, kept, found, count):
    """Merge sorted ``found`` into sorted candidates[:kept], from the back."""
    last = kept + count - 1
    old = kept - 1
    new = count - 1
    while new >= 0:
        if old >= 0 and candidates[old] > found[new]:
            candidates[last] = candidates[old]
            old -= 1
        else:
            candidates[last] = found[new]
            new -= 1
        last -= 1


@kernel
def update_candidates(grid, bodies, starts, flown, boxes, proxies, cells, candidates, moved, found, sorted_keys):
    """Bring the candidates up to date with the bounds of this step; return how many there are.

    If they do not fit, the grid is to be built anew with more room. ``moved`` (bodies + 1,), ``found`` and
    ``sorted_keys`` (pair capacity,) are scratch.
    """
    num_bodies = bodies.shape[0]
    if grid.valid == 0:
        clear(grid, proxies, cells)
    count = _find_moved(bodies, proxies, boxes, moved)
    if count == 0:
        return grid.candidates
    for number in range(count):
        index = moved[number]
        take_out(grid, proxies, cells, index)
    if grid.used + count > cells.shape[0] // 2:
        # Too many slots of cells that bodies have left: put all in anew.
        known = grid.candidates
        for index in range(num_bodies):
            proxies[index].moved = 0 if proxies[index].place == OUT else 1
        clear(grid, proxies, cells)
        grid.candidates = known
        for index in range(num_bodies):
            if proxies[index].moved == 1:
                proxies[index].moved = 0
                put_in(grid, proxies, cells, index)
    for level in range(grid.levels):
        grid.still[level] = grid.members[level]
    num_levels = grid.levels
    for number in range(count):
        index = moved[number]
        proxy = proxies[index]
        proxy.moved = 1
        proxy.motion = bodies[index].motion
        box = boxes[6 * index : 6 * index + 6]
        if bodies[index].num_colliders > 0 and _bounded(box):
            flight = (
                flown[index].center[0] - starts[index].center[0],
                flown[index].center[1] - starts[index].center[1],
                flown[index].center[2] - starts[index].center[2],
            )
            _fatten(bodies[index], flight, box, proxy.box)
            put_in(grid, proxies, cells, index)
    for level in range(num_levels, grid.levels):
        grid.still[level] = 0
    kept = np.int64(0)
    for number in range(grid.candidates):
        key = candidates[number]
        if proxies[key >> SECOND_SHIFT].moved == 0 and proxies[key & SECOND_MASK].moved == 0:
            candidates[kept] = key
            kept += 1
    new = np.int64(0)
    for number in range(count):
        if proxies[moved[number]].place != OUT:
            new = search(grid, proxies, cells, moved[number], found, new)
    for number in range(count):
        proxies[moved[number]].moved = 0
    total = kept + new
    grid.candidates = total
    if total > candidates.shape[0] or new > found.shape[0]:
        grid.valid = 0
        return total
    _counting_sort(found, new, 0, num_bodies, moved, sorted_keys)
    _counting_sort(sorted_keys, new, SECOND_SHIFT, num_bodies, moved, found)
    _merge(candidates, kept, found, new)
    return total


@kernel
def meeting_pairs(candidates, count, boxes, pairs):
    """Write the candidates whose bounds of this step meet into ``pairs`` (two entries each); return their number."""
    number = 0
    for index in range(count):
        a = candidates[index] >> SECOND_SHIFT
        b = candidates[index] & SECOND_MASK
        if overlap(boxes, a, b):
            if 2 * number + 1 < pairs.shape[0]:
                pairs[2 * number] = a
                pairs[2 * number + 1] = b
            number += 1
    return number
