"""Sparse direct solution of (I + G^T B G) y = c in 6 x 6 blocks, one block row a body, without pivoting.

The matrix is A = L U with unit lower L, column by column in the elimination order (right-looking; Davis 2006, "Direct
methods for sparse linear systems", ch. 4 and 6, here with blocks). For column j, with A_jj = L_j U_j,

    L_ij = A_ij U_j^-1,    U_jk = L_j^-1 A_jk,    A_ik <- A_ik - L_ij U_jk     for all later neighbours i, k of j.

If A is symmetric, U_jk = D_j L_kj^T with D_j = diag(U_j): half of the panel and half of the updates are left out.
Pivots cannot vanish in the symmetric case (I plus something positive semidefinite); in the other, a factorisation that
goes wrong is caught by the residual, which rejects the step.

Slots of ``blocks``: [0, n) the diagonal by position, [n, n + slots) the lower triangle, and as many for the upper one
in the same order, U_jk for L_kj. The right side is gathered from, and the solution scattered to, ``nodes.scaled``.
"""

from __future__ import annotations

from ..jit import kernel
from .elimination import order_at, rows_at, start_at


@kernel
def subtract_product(blocks, target, left, right):
    """A <- A - L U for three blocks."""
    for i in range(0, 36, 6):
        c0 = blocks[target, i]
        c1 = blocks[target, i + 1]
        c2 = blocks[target, i + 2]
        c3 = blocks[target, i + 3]
        c4 = blocks[target, i + 4]
        c5 = blocks[target, i + 5]
        for k in range(6):
            factor = blocks[left, i + k]
            c0 -= factor * blocks[right, 6 * k]
            c1 -= factor * blocks[right, 6 * k + 1]
            c2 -= factor * blocks[right, 6 * k + 2]
            c3 -= factor * blocks[right, 6 * k + 3]
            c4 -= factor * blocks[right, 6 * k + 4]
            c5 -= factor * blocks[right, 6 * k + 5]
        blocks[target, i] = c0
        blocks[target, i + 1] = c1
        blocks[target, i + 2] = c2
        blocks[target, i + 3] = c3
        blocks[target, i + 4] = c4
        blocks[target, i + 5] = c5


@kernel
def factorise_diagonal(blocks, slot):
    """A_jj = L_j U_j in place; the diagonal of U_j is stored as its reciprocal."""
    for k in range(6):
        inverse = 1.0 / blocks[slot, 7 * k]
        blocks[slot, 7 * k] = inverse
        for i in range(k + 1, 6):
            factor = blocks[slot, 6 * i + k] * inverse
            blocks[slot, 6 * i + k] = factor
            for j in range(k + 1, 6):
                blocks[slot, 6 * i + j] -= factor * blocks[slot, 6 * k + j]


@kernel
def solve_upper_from_right(blocks, slot, diagonal):
    """A_ij <- A_ij U_j^-1."""
    for k in range(6):
        inverse = blocks[diagonal, 7 * k]
        for i in range(0, 36, 6):
            total = blocks[slot, i + k]
            for j in range(k):
                total -= blocks[slot, i + j] * blocks[diagonal, 6 * j + k]
            blocks[slot, i + k] = total * inverse


@kernel
def solve_lower_from_left(blocks, slot, diagonal):
    """A_jk <- L_j^-1 A_jk."""
    for i in range(1, 6):
        for k in range(i):
            factor = blocks[diagonal, 6 * i + k]
            for j in range(6):
                blocks[slot, 6 * i + j] -= factor * blocks[slot, 6 * k + j]


@kernel
def solve_lower(blocks, slot, x):
    """x <- L_j^-1 x for the first six entries of x."""
    for i in range(1, 6):
        total = x[i]
        for k in range(i):
            total -= blocks[slot, 6 * i + k] * x[k]
        x[i] = total


@kernel
def solve_upper(blocks, slot, x):
    """x <- U_j^-1 x for the first six entries of x."""
    for i in range(5, -1, -1):
        total = x[i]
        for k in range(i + 1, 6):
            total -= blocks[slot, 6 * i + k] * x[k]
        x[i] = total * blocks[slot, 7 * i]


@kernel
def factorise(blocks, index, num_bodies, num_handles, slots, symmetric):
    """L U (or L D L^T) of the assembled matrix, in place. ``symmetric``: int64, 0 or 1."""
    n = num_bodies
    start = start_at(num_handles, n)
    pattern = rows_at(num_handles, n)
    lower = n
    upper = n + slots
    for j in range(n):
        factorise_diagonal(blocks, j)
        first = index[start + j]
        last = index[start + j + 1]
        for s in range(first, last):
            if symmetric != 0:
                # U_jk = (L_j^-1 A_kj^T) = (A_kj L_j^-T)^T, and L_kj = A_kj L_j^-T D_j^-1: solve once, then transpose.
                solve_upper_from_right(blocks, lower + s, j)
                for c in range(6):
                    pivot = 1.0 / blocks[j, 7 * c]
                    for r in range(6):
                        blocks[upper + s, 6 * c + r] = blocks[lower + s, 6 * r + c] * pivot
            else:
                solve_upper_from_right(blocks, lower + s, j)
                solve_lower_from_left(blocks, upper + s, j)
        for q in range(first, last):
            k = index[pattern + q]
            subtract_product(blocks, k, lower + q, upper + q)
            # Later neighbours of j are a subset of the neighbours of k: walk along both lists.
            t = index[start + k]
            for p in range(q + 1, last):
                i = index[pattern + p]
                while index[pattern + t] != i:
                    t += 1
                subtract_product(blocks, lower + t, lower + p, upper + q)
                if symmetric == 0:
                    subtract_product(blocks, upper + t, lower + q, upper + p)


@kernel
def solve(blocks, index, nodes, num_bodies, num_handles, slots):
    """y = (L U)^-1 c; c and y in ``nodes.scaled``."""
    n = num_bodies
    order = order_at(num_handles)
    start = start_at(num_handles, n)
    pattern = rows_at(num_handles, n)
    lower = n
    upper = n + slots
    for j in range(n):
        x = nodes[index[order + j]].scaled
        solve_lower(blocks, j, x)
        for s in range(index[start + j], index[start + j + 1]):
            y = nodes[index[order + index[pattern + s]]].scaled
            for i in range(6):
                total = y[i]
                for k in range(6):
                    total -= blocks[lower + s, 6 * i + k] * x[k]
                y[i] = total
    for j in range(n - 1, -1, -1):
        x = nodes[index[order + j]].scaled
        for s in range(index[start + j], index[start + j + 1]):
            y = nodes[index[order + index[pattern + s]]].scaled
            for i in range(6):
                total = x[i]
                for k in range(6):
                    total -= blocks[upper + s, 6 * i + k] * y[k]
                x[i] = total
        solve_upper(blocks, j, x)
