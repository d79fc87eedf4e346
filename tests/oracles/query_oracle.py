"""Slow, obvious twins of ray cast and nearest point: every triangle in turn, and points along the ray one by one."""

from __future__ import annotations

import numpy as np


def cross_triangles(origin, direction, triangles):
    """Distances along a ray to triangles (m, 3, 3), infinite where it misses, and whether each is met in front.

    Moeller and Trumbore 1997, for all triangles at once.
    """
    a, b, c = (triangles[:, k] for k in range(3))
    ab, ac = b - a, c - a
    p = np.cross(direction, ac)
    determinant = (ab * p).sum(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        s = origin - a
        u = (s * p).sum(axis=1) / determinant
        q = np.cross(s, ab)
        v = (q @ direction) / determinant
        t = (ac * q).sum(axis=1) / determinant
        hit = (u >= -1e-12) & (v >= -1e-12) & (u + v <= 1.0 + 1e-12) & (t >= 0.0)
    return np.where(hit, t, np.inf), determinant > 0.0


def march(inside, origin, direction, distance, points=4000):
    """Where a ray first is inside a solid: the first of many points along it, then bisection; infinite for a miss.

    ``inside`` takes points (n, 3) [m].
    """
    t = np.linspace(0.0, distance, points)
    found = np.flatnonzero(inside(origin + t[:, None] * direction))
    if len(found) == 0:
        return np.inf
    if found[0] == 0:
        return 0.0
    low, high = t[found[0] - 1], t[found[0]]
    for _ in range(60):
        middle = 0.5 * (low + high)
        if inside((origin + middle * direction)[None])[0]:
            high = middle
        else:
            low = middle
    return high


def in_capsule(size):
    def inside(p):
        z = np.clip(p[:, 2], -size[1], size[1])
        return np.hypot(np.hypot(p[:, 0], p[:, 1]), p[:, 2] - z) <= size[0]

    return inside


def in_cylinder(size):
    return lambda p: (np.hypot(p[:, 0], p[:, 1]) <= size[0]) & (np.abs(p[:, 2]) <= size[1])


def in_box(size):
    return lambda p: (np.abs(p) <= size).all(axis=1)


def in_hull(normals, offsets):
    return lambda p: (p @ np.transpose(normals) <= offsets).all(axis=1)
