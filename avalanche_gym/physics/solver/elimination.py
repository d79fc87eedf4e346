"""Elimination order and pattern of the factorisation: minimum degree on the graph of bodies that touch.

The matrix I + G^T B G has a 6 x 6 block for every body and for every pair of bodies that touch. Eliminating a body
joins all its neighbours; taking the body with the fewest neighbours first keeps that fill small (Tinney & Walker 1967;
George & Liu 1989). The graph is kept as one set of bits a body, so joining neighbours is a bitwise or.

Layout in ``index``, for n bodies in the island and a table of ``num_handles`` bodies of the world:

    [0:2]          memory wanted (blocks, integers)
    table          num_handles   body -> node                                (solver/problem.py)
    order          n             position -> node
    position       n             node -> position; -1 - (number of neighbours) while not eliminated
    start          n + 1         first off-diagonal slot of each position
    graph          n * words     bits of the neighbours
    rows           slots         position of the later body, ascending within a column
"""

from __future__ import annotations

from ..jit import kernel
from .bits import count_bits, lowest_bit
from .problem import RESERVED

WORD = 64


@kernel
def order_at(num_handles):
    """Where the elimination order begins in ``index``."""
    return RESERVED + num_handles


@kernel
def position_at(num_handles, n):
    return RESERVED + num_handles + n


@kernel
def start_at(num_handles, n):
    return RESERVED + num_handles + 2 * n


@kernel
def graph_at(num_handles, n):
    return RESERVED + num_handles + 3 * n + 1


@kernel
def rows_at(num_handles, n):
    return graph_at(num_handles, n) + n * ((n + WORD - 1) // WORD)


@kernel
def neighbours(index, first, words):
    """How many bits are set."""
    total = 0
    for w in range(words):
        total += count_bits(index[first + w])
    return total


@kernel
def eliminate(rows, num_contacts, num_bodies, num_handles, index):
    """Choose the order and write the pattern.

    Returns:
        slots: off-diagonal blocks of one triangle; -1 if ``index`` is too short (``index[1]``: the length wanted).
        products: 6 x 6 block products of the symmetric factorisation, its cost.
    """
    n = num_bodies
    words = (n + WORD - 1) // WORD
    order = order_at(num_handles)
    position = position_at(num_handles, n)
    start = start_at(num_handles, n)
    graph = graph_at(num_handles, n)
    pattern = rows_at(num_handles, n)
    if pattern > len(index):
        index[1] = pattern + 8 * n
        return -1, 0
    for i in range(n * words):
        index[graph + i] = 0
    for i in range(num_contacts):
        row = rows[i]
        a = row.a
        b = row.b
        if a < n and b < n and a != b:
            index[graph + a * words + b // WORD] |= 1 << (b % WORD)
            index[graph + b * words + a // WORD] |= 1 << (a % WORD)
    for i in range(n):
        index[position + i] = -1 - neighbours(index, graph + i * words, words)
    slots = 0
    products = 0
    for step in range(n):
        # The uneliminated body with the fewest neighbours; the first of equals, so that the order is reproducible.
        chosen = 0
        fewest = n
        for i in range(n):
            degree = -1 - index[position + i]
            if 0 <= degree < fewest:
                fewest = degree
                chosen = i
        index[order + step] = chosen
        index[position + chosen] = step
        index[start + step] = slots
        if pattern + slots + fewest > len(index):
            # At least this many; the caller grows and repeats, and each repetition gets at least half as far again.
            index[1] = pattern + 2 * (slots + fewest) + n
            return -1, 0
        own = graph + chosen * words
        for w in range(words):
            word = index[own + w]
            while word != 0:
                other = w * WORD + lowest_bit(word)
                word &= word - 1
                index[pattern + slots] = other
                slots += 1
                joined = graph + other * words
                for v in range(words):
                    index[joined + v] |= index[own + v]
                index[joined + other // WORD] &= ~(1 << (other % WORD))
                index[joined + chosen // WORD] &= ~(1 << (chosen % WORD))
                index[position + other] = -1 - neighbours(index, joined, words)
        products += fewest * (fewest + 1) // 2
    index[start + n] = slots
    for step in range(n):
        first = index[start + step]
        for s in range(first, index[start + step + 1]):
            # Insertion sort of the column by position.
            row_position = index[position + index[pattern + s]]
            t = s
            while t > first and index[pattern + t - 1] > row_position:
                index[pattern + t] = index[pattern + t - 1]
                t -= 1
            index[pattern + t] = row_position
    return slots, products
