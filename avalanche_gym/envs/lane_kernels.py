"""What the kernels of every task share: drawing from a range, and writing observations within their bounds."""

from __future__ import annotations

from ..physics.jit import kernel


@kernel
def sample(interval, u):
    """The point at share u of a range (low, high)."""
    return interval[0] + u * (interval[1] - interval[0])


@kernel
def put(row, at, value, bound):
    """Write one value of an observation, clipped to its bound; return the place behind it."""
    row[at] = min(max(value, -bound[at]), bound[at])
    return at + 1


@kernel
def put_vector(row, at, scale, a, bound):
    """Write a vector divided by its scale; return the place behind it."""
    for axis in range(3):
        put(row, at + axis, a[axis] / scale, bound)
    return at + 3
