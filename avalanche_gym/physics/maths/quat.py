"""Unit quaternions (w, x, y, z), as tuples; q rotates body coordinates into world coordinates."""

from __future__ import annotations

import math

from ..jit import kernel
from . import vec3

Quat = tuple[float, float, float, float]

IDENTITY: Quat = (1.0, 0.0, 0.0, 0.0)


@kernel
def load(array):
    """The first four entries of an array."""
    return (array[0], array[1], array[2], array[3])


@kernel
def store(array, q):
    """Write q into the first four entries of an array."""
    array[0] = q[0]
    array[1] = q[1]
    array[2] = q[2]
    array[3] = q[3]


@kernel
def multiply(a, b):
    """The rotation b, then a."""
    return (
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    )


@kernel
def conjugate(q):
    """The inverse of a unit quaternion."""
    return (q[0], -q[1], -q[2], -q[3])


@kernel
def normalize(q):
    """q / |q|."""
    s = 1.0 / math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    return (s * q[0], s * q[1], s * q[2], s * q[3])


@kernel
def rotate(q, a):
    """q a q*, for a unit q: body to world."""
    u = (q[1], q[2], q[3])
    t = vec3.scale(2.0, vec3.cross(u, a))
    return vec3.add(vec3.add_scaled(a, q[0], t), vec3.cross(u, t))


@kernel
def rotate_inverse(q, a):
    """q* a q, for a unit q: world to body."""
    return rotate(conjugate(q), a)


@kernel
def from_rotation_vector(a):
    """The rotation by the angle |a| [rad] about a."""
    angle = vec3.norm(a)
    half = 0.5 * angle
    # sin(half) / angle; the series leaves an error below angle^4 / 1920.
    s = math.sin(half) / angle if angle > 1e-4 else 0.5 - angle * angle / 48.0
    return (math.cos(half), s * a[0], s * a[1], s * a[2])


@kernel
def to_matrix(q):
    """The rotation matrix of a unit q, as nine floats row by row."""
    w, x, y, z = q
    return (
        1.0 - 2.0 * (y * y + z * z),
        2.0 * (x * y - w * z),
        2.0 * (x * z + w * y),
        2.0 * (x * y + w * z),
        1.0 - 2.0 * (x * x + z * z),
        2.0 * (y * z - w * x),
        2.0 * (x * z - w * y),
        2.0 * (y * z + w * x),
        1.0 - 2.0 * (x * x + y * y),
    )
