"""Vectors of three floats, as tuples: the compiler keeps them in registers and nothing is allocated."""

from __future__ import annotations

import math

from ..jit import kernel

Vec3 = tuple[float, float, float]

ZERO: Vec3 = (0.0, 0.0, 0.0)


@kernel
def load_row(rows, number):
    """The first three entries of a row of a table of numbers."""
    return (rows[number, 0], rows[number, 1], rows[number, 2])


@kernel
def load(array):
    """The first three entries of an array."""
    return (array[0], array[1], array[2])


@kernel
def store(array, a):
    """Write a into the first three entries of an array."""
    array[0] = a[0]
    array[1] = a[1]
    array[2] = a[2]


@kernel
def add(a, b):
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


@kernel
def sub(a, b):
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


@kernel
def scale(s, a):
    return (s * a[0], s * a[1], s * a[2])


@kernel
def add_scaled(a, s, b):
    """a + s b."""
    return (a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2])


@kernel
def multiply(a, b):
    """Component by component."""
    return (a[0] * b[0], a[1] * b[1], a[2] * b[2])


@kernel
def neg(a):
    return (-a[0], -a[1], -a[2])


@kernel
def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@kernel
def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


@kernel
def norm(a):
    """Euclidean length, free of overflow and underflow."""
    largest = max(abs(a[0]), abs(a[1]), abs(a[2]))
    if largest == 0.0 or not math.isfinite(largest):
        return largest
    x = a[0] / largest
    y = a[1] / largest
    z = a[2] / largest
    return largest * math.sqrt(x * x + y * y + z * z)


@kernel
def norm_squared(a):
    return a[0] * a[0] + a[1] * a[1] + a[2] * a[2]


@kernel
def normalize(a):
    """a / |a|; the zero vector stays zero."""
    length = norm(a)
    if length == 0.0:
        return a
    return (a[0] / length, a[1] / length, a[2] / length)


@kernel
def min_(a, b):
    """Smaller of each component."""
    return (min(a[0], b[0]), min(a[1], b[1]), min(a[2], b[2]))


@kernel
def max_(a, b):
    """Larger of each component."""
    return (max(a[0], b[0]), max(a[1], b[1]), max(a[2], b[2]))


@kernel
def along(axis):
    """The unit vector along axis 0, 1 or 2."""
    return (1.0 if axis == 0 else 0.0, 1.0 if axis == 1 else 0.0, 1.0 if axis == 2 else 0.0)


@kernel
def tangents(n):
    """Two unit vectors t1, t2 that make (n, t1, t2) right-handed, for a unit n.

    Duff et al. 2017, "Building an orthonormal basis, revisited", listing 3: continuous but for the sign change at n_z
    = 0.
    """
    sign = math.copysign(1.0, n[2])
    a = -1.0 / (sign + n[2])
    b = n[0] * n[1] * a
    return (1.0 + sign * n[0] * n[0] * a, sign * b, -sign * n[0]), (b, sign + n[1] * n[1] * a, -n[1])
