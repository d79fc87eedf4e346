"""Putting bodies into the grid and taking them out, and finding what is near one of them."""

from __future__ import annotations

import math

import numpy as np

from ..jit import kernel
from ..model import DYNAMIC
from .cells import cell_index, exponent_of, find_slot, key_of, level_of
from .tables import IN_CELL, ON_LIST, OUT

SECOND_SHIFT = 32  # a pair (a, b), a < b, is one integer a << 32 | b: sorted by a, then by b
SECOND_MASK = (1 << SECOND_SHIFT) - 1


@kernel
def clear(grid, proxies, cells):
    """Take everything out."""
    for slot in range(cells.shape[0]):
        cells[slot].key = 0
    for body in range(proxies.shape[0]):
        proxies[body].place = OUT
    grid.used = 0
    grid.candidates = 0
    grid.listed = -1
    grid.levels = 0
    grid.valid = 1


@kernel
def _link(proxies, body, first):
    """Put a body in front of a chain; return the new start of it."""
    proxies[body].next = first
    proxies[body].previous = -1
    if first >= 0:
        proxies[first].previous = body
    return body


@kernel
def put_in(grid, proxies, cells, body):
    """Link a body by the bounds of its proxy."""
    proxy = proxies[body]
    box = proxy.box
    extent = max(box[3] - box[0], box[4] - box[1], box[5] - box[2])
    level = level_of(grid, exponent_of(extent)) if extent < math.inf else np.int64(-1)
    if level < 0:
        proxy.place = ON_LIST
        grid.listed = _link(proxies, body, grid.listed)
        return
    exponent = grid.exponent[level]
    scale = math.ldexp(1.0, -exponent)
    key = key_of(exponent, cell_index(box[0], scale), cell_index(box[1], scale), cell_index(box[2], scale))
    slot = find_slot(cells, key)
    if cells[slot].key == 0:
        cells[slot].key = key
        cells[slot].first = -1
        grid.used += 1
    proxy.place = IN_CELL
    proxy.level = level
    proxy.slot = slot
    cells[slot].first = _link(proxies, body, cells[slot].first)
    grid.members[level] += 1
    if proxy.motion == DYNAMIC:
        grid.dynamic[level] += 1


@kernel
def take_out(grid, proxies, cells, body):
    """Undo ``put_in``; a slot that empties keeps its key, so that searches still pass over it."""
    proxy = proxies[body]
    if proxy.place == OUT:
        return
    if proxy.next >= 0:
        proxies[proxy.next].previous = proxy.previous
    if proxy.previous >= 0:
        proxies[proxy.previous].next = proxy.next
    elif proxy.place == ON_LIST:
        grid.listed = proxy.next
    else:
        cells[proxy.slot].first = proxy.next
    if proxy.place == IN_CELL:
        grid.members[proxy.level] -= 1
        if proxy.motion == DYNAMIC:
            grid.dynamic[proxy.level] -= 1
    proxy.place = OUT


@kernel
def _meet(one, other):
    """Whether the fat bounds of two bodies meet, and one of them is dynamic."""
    a = one.box
    b = other.box
    # Without branches: which comparison fails first is anyone's guess.
    return (
        ((one.motion == DYNAMIC) | (other.motion == DYNAMIC))
        & (a[0] <= b[3])
        & (b[0] <= a[3])
        & (a[1] <= b[4])
        & (b[1] <= a[4])
        & (a[2] <= b[5])
        & (b[2] <= a[5])
    )


@kernel
def _note(proxies, body, other, found, count):
    """Append a pair if the bounds meet; return the new count, which goes on when ``found`` is full."""
    if _meet(proxies[body], proxies[other]):
        if count < found.shape[0]:
            found[count] = (min(body, other) << SECOND_SHIFT) | max(body, other)
        return count + 1
    return count


@kernel
def _cells_near(box, scale):
    """First and last cell along each axis that may hold a body that meets a box, and how many cells that are."""
    low = (cell_index(box[0], scale) - 1, cell_index(box[1], scale) - 1, cell_index(box[2], scale) - 1)
    high = (cell_index(box[3], scale), cell_index(box[4], scale), cell_index(box[5], scale))
    number = float(high[0] - low[0] + 1) * float(high[1] - low[1] + 1) * float(high[2] - low[2] + 1)
    return low, high, number


@kernel
def _search_level(grid, proxies, cells, body, level, found, count):
    """Append the pairs of a body that has moved with those of one level."""
    proxy = proxies[body]
    box = proxy.box
    own = proxy.place == IN_CELL and proxy.level == level
    # Of two bodies that moved, the smaller one finds the other; in one level that with the smaller handle.
    finds_moved = proxy.place == IN_CELL and grid.exponent[level] > grid.exponent[proxy.level]
    exponent = grid.exponent[level]
    scale = math.ldexp(1.0, -exponent)
    low, high, number = _cells_near(box, scale)
    if number > proxies.shape[0]:
        # More cells than bodies: ask these one by one.
        for other in range(proxies.shape[0]):
            one = proxies[other]
            if one.place == IN_CELL and one.level == level and other != body:
                if one.moved == 0 or finds_moved or (own and other > body):
                    count = _note(proxies, body, other, found, count)
        return count
    for x in range(low[0], high[0] + 1):
        for y in range(low[1], high[1] + 1):
            for z in range(low[2], high[2] + 1):
                key = key_of(exponent, x, y, z)
                slot = find_slot(cells, key)
                other = cells[slot].first if cells[slot].key == key else np.int64(-1)
                while other >= 0:
                    if proxies[other].moved == 0 or finds_moved or (own and other > body):
                        count = _note(proxies, body, other, found, count)
                    other = proxies[other].next
    return count


@kernel
def _meets_box(proxy, box):
    fat = proxy.box
    return (
        (box[0] <= fat[3])
        & (fat[0] <= box[3])
        & (box[1] <= fat[4])
        & (fat[1] <= box[4])
        & (box[2] <= fat[5])
        & (fat[2] <= box[5])
    )


@kernel
def list_within(grid, proxies, cells, box, found):
    """Write the bodies whose fat bounds meet box[0:6] to ``found`` (bodies,), in no order; return their number."""
    count = np.int64(0)
    if not box[0] <= box[3]:
        return count
    for level in range(grid.levels):
        if grid.members[level] == 0:
            continue
        exponent = grid.exponent[level]
        scale = math.ldexp(1.0, -exponent)
        low, high, number = _cells_near(box, scale)
        if number > proxies.shape[0]:
            # More cells than bodies: ask these one by one.
            for other in range(proxies.shape[0]):
                if proxies[other].place == IN_CELL and proxies[other].level == level:
                    if _meets_box(proxies[other], box):
                        found[count] = other
                        count += 1
            continue
        for x in range(low[0], high[0] + 1):
            for y in range(low[1], high[1] + 1):
                for z in range(low[2], high[2] + 1):
                    key = key_of(exponent, x, y, z)
                    slot = find_slot(cells, key)
                    other = cells[slot].first if cells[slot].key == key else np.int64(-1)
                    while other >= 0:
                        # Cells that share a slot are met more than once: a body counts in its own alone.
                        if proxies[other].level == level and _meets_box(proxies[other], box):
                            own_x = cell_index(proxies[other].box[0], scale)
                            own_y = cell_index(proxies[other].box[1], scale)
                            own_z = cell_index(proxies[other].box[2], scale)
                            if own_x == x and own_y == y and own_z == z:
                                found[count] = other
                                count += 1
                        other = proxies[other].next
    other = grid.listed
    while other >= 0:
        if _meets_box(proxies[other], box):
            found[count] = other
            count += 1
        other = proxies[other].next
    return count


@kernel
def search(grid, proxies, cells, body, found, count):
    """Append the pairs of a body that has moved to ``found``; return how many there are now.

    A pair of bodies that both moved is found once.
    """
    proxy = proxies[body]
    if proxy.place == ON_LIST:
        for other in range(proxies.shape[0]):
            place = proxies[other].place
            if place != OUT and other != body:
                # What is in a cell and moved finds this body on the list.
                if proxies[other].moved == 0 or (place == ON_LIST and other > body):
                    count = _note(proxies, body, other, found, count)
        return count
    for level in range(grid.levels):
        if grid.members[level] == 0 or (proxy.motion != DYNAMIC and grid.dynamic[level] == 0):
            continue
        if grid.exponent[level] < grid.exponent[proxy.level] and grid.still[level] == 0:
            continue
        count = _search_level(grid, proxies, cells, body, level, found, count)
    other = grid.listed
    while other >= 0:
        count = _note(proxies, body, other, found, count)
        other = proxies[other].next
    return count
