"""Algebra of the second-order cone L = {x : |x_t| <= x_n} around a unit normal n; vectors in the world frame.

A vector stands for the pair (x_n, x_t). The product and what follows from it (Alizadeh & Goldfarb 2003, sec. 4):

    a o b = (a . b, a_n b_t + b_n a_t),      det a = a_n^2 - |a_t|^2,      unit element e = n.
"""

from __future__ import annotations

import math

from ..jit import kernel
from ..maths import vec3


@kernel
def product(a, b, n):
    """a o b."""
    a_n = vec3.dot(a, n)
    b_n = vec3.dot(b, n)
    mixed = vec3.add(vec3.scale(a_n, b), vec3.scale(b_n, a))
    return vec3.add_scaled(mixed, vec3.dot(a, b) - 2.0 * a_n * b_n, n)


@kernel
def reflect(a, n):
    """(a_n, -a_t)."""
    return vec3.sub(vec3.scale(2.0 * vec3.dot(a, n), n), a)


@kernel
def determinant(a, n):
    """a_n^2 - |a_t|^2, with little cancellation near the surface of the cone."""
    a_n = vec3.dot(a, n)
    length = math.sqrt(vec3.norm_squared(vec3.add_scaled(a, -a_n, n)))
    return (a_n - length) * (a_n + length)


@kernel
def divide(c, a, n):
    """The b with a o b = c, for a inside the cone."""
    a_n = vec3.dot(a, n)
    c_n = vec3.dot(c, n)
    b_n = (2.0 * a_n * c_n - vec3.dot(a, c)) / determinant(a, n)
    a_t = vec3.add_scaled(a, -a_n, n)
    c_t = vec3.add_scaled(c, -c_n, n)
    return vec3.add_scaled(vec3.scale(1.0 / a_n, vec3.add_scaled(c_t, -b_n, a_t)), b_n, n)


@kernel
def scaling_point(x, z, n):
    """(w, h): the unit w and length h with x = h (2 w w^T - 2 n n^T + 1) z (Nesterov & Todd 1997)."""
    det_x = determinant(x, n)
    det_z = determinant(z, n)
    x = vec3.scale(1.0 / math.sqrt(det_x), x)
    z = vec3.scale(1.0 / math.sqrt(det_z), z)
    both = vec3.add(x, reflect(z, n))
    return vec3.scale(1.0 / math.sqrt(2.0 + 2.0 * vec3.dot(x, z)), both), math.sqrt(det_x / det_z)


@kernel
def scale_by(w, n, v):
    """W v, where W is the root of 2 w w^T - 2 n n^T + 1."""
    w_n = vec3.dot(w, n)
    v_n = vec3.dot(v, n)
    w_t = vec3.add_scaled(w, -w_n, n)
    inner = vec3.dot(w_t, v)
    scaled = vec3.add_scaled(v, v_n + inner / (1.0 + w_n), w_t)
    return vec3.add_scaled(scaled, w_n * v_n + inner - v_n, n)


@kernel
def step_to_surface(x, d, n):
    """Largest t <= 1 for which x + t d stays in the cone; x inside."""
    d_n = vec3.dot(d, n)
    a = determinant(d, n)
    b = 2.0 * vec3.dot(x, n) * d_n - vec3.dot(x, d)
    c = determinant(x, n)
    discriminant = b * b - a * c
    if discriminant <= 0.0:
        return 1.0
    root = math.sqrt(discriminant)
    if b <= 0.0:
        return min(1.0, c / (root - b))
    if a < 0.0:
        return min(1.0, (b + root) / -a)
    return 1.0
