"""Cells of the infinite hierarchical grid, and the table that finds them.

A level is a grid of cubes without bounds; its edge s is a power of two, so dividing by it is exact. A body belongs to
one cell: the one that holds the low corner of its bounds, in the level with

    s / 2 <= e < s        (e the largest extent of its bounds)

Two boxes overlap along an axis if low_b <= high_a and high_b >= low_a, so with c(x) = floor(x / s) and
high_b - low_b < s

    c(low_a) - 1 <= c(low_b) <= c(high_a):

bodies of a level that meet a given box lie in a few of its cells, three or less along each axis for a small box. A cell
is found by a 64-bit hash of its level and indices in a table with open addressing and linear probing (Teschner et al.
2003, sec. 4; levels as in Ericson 2005, sec. 7.2). Two cells with the same hash share a slot; what is found is always
compared by its bounds, so that costs time and changes nothing. Edges of four times the extent need a third of the
look-ups and were slower: more bodies are compared.
"""

from __future__ import annotations

import math

import numpy as np

from ..jit import kernel
from .tables import MOST_LEVELS

# Cells farther out are taken as one; floats are coarser than cells there.
FARTHEST = float(2**61)
# Odd numbers with well mixed bits (the golden ratio, and primes of xxHash).
HASH_X = np.uint64(0x9E3779B97F4A7C15)
HASH_Y = np.uint64(0xC2B2AE3D27D4EB4F)
HASH_Z = np.uint64(0x165667B19E3779F9)
HASH_LEVEL = np.uint64(0x85EBCA77C2B2AE63)
HASH_SHIFT = np.uint64(32)


@kernel
def exponent_of(extent):
    """Exponent of the cells for bounds of a largest extent [m]."""
    _, exponent = math.frexp(extent)
    return np.int64(exponent)


@kernel
def cell_index(x, scale):
    """Index of the cell that holds x [m]; ``scale`` is 1 / s."""
    return np.int64(min(max(np.floor(x * scale), -FARTHEST), FARTHEST))


@kernel
def key_of(exponent, x, y, z):
    """Hash of a cell, never 0."""
    mixed = np.uint64(x) * HASH_X + np.uint64(y) * HASH_Y + np.uint64(z) * HASH_Z + np.uint64(exponent) * HASH_LEVEL
    mixed = (mixed ^ (mixed >> HASH_SHIFT)) * HASH_X
    mixed = mixed ^ (mixed >> HASH_SHIFT)
    key = np.int64(mixed)
    return key if key != 0 else np.int64(1)


@kernel
def find_slot(cells, key):
    """The slot of a cell, or the free one where it belongs; there are a power of two of them, half of them free."""
    mask = np.int64(cells.shape[0] - 1)
    slot = key & mask
    while cells[slot].key != key and cells[slot].key != 0:
        slot = (slot + 1) & mask
    return slot


@kernel
def level_of(grid, exponent):
    """The number of a level, a new one if need be; -1 if there are MOST_LEVELS already."""
    for level in range(grid.levels):
        if grid.exponent[level] == exponent:
            return np.int64(level)
    if grid.levels == MOST_LEVELS:
        return np.int64(-1)
    level = grid.levels
    grid.exponent[level] = exponent
    grid.members[level] = 0
    grid.dynamic[level] = 0
    grid.levels += 1
    return level
