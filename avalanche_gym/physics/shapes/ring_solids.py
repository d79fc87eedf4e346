"""Solids with a hole: torus and gear."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from . import checks
from .triangle_mesh import TriangleMesh

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def quads_between(first: Ints, second: Ints) -> Ints:
    """(2 n, 3) triangles between two chains of n + 1 vertices; seen with ``first`` below ``second`` and both running
    to the right they are counter-clockwise.
    """
    a, b, c, d = first[:-1], first[1:], second[1:], second[:-1]
    return np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])


def torus(radius: float, tube: float, *, segments: int = 64, sides: int = 32) -> TriangleMesh:
    """A torus about the z axis, its vertices on the exact surface.

    Args:
        radius: [m] from its centre to the middle of the tube; the hole has the radius ``radius - tube``.
        tube: [m] radius of the tube, less than ``radius``.
        segments: around the hole; sides: around the tube. One line of vertices runs round the hole.
    """
    radius = checks.positive_number("torus(radius)", radius)
    tube = checks.positive_number("torus(tube)", tube)
    if tube >= radius:
        raise ValueError(f"torus(tube)={tube!r} is not less than radius={radius!r}; the tube would fill the hole.")
    _check_count("torus(segments)", segments)
    _check_count("torus(sides)", sides)
    around = 2.0 * np.pi * np.arange(segments) / segments
    along = 2.0 * np.pi * np.arange(sides) / sides + np.pi
    reach = radius + tube * np.cos(along)
    height = np.broadcast_to(tube * np.sin(along), (segments, sides))
    vertices = np.stack([np.cos(around)[:, None] * reach, np.sin(around)[:, None] * reach, height], axis=2)
    grid = np.arange(segments * sides).reshape(segments, sides)
    closed = np.concatenate([grid, grid[:, :1]], axis=1)
    faces = [quads_between(closed[i], closed[(i + 1) % segments]) for i in range(segments)]
    return TriangleMesh(vertices.reshape(-1, 3), np.concatenate(faces)[:, ::-1])


def gear(radius: float, thickness: float, *, teeth: int = 12, depth: float = 0.2, bore: float = 0.3) -> TriangleMesh:
    """A spur gear about the z axis, with straight flanks and a bore.

    Args:
        radius: [m] of the tips.
        thickness: [m] along z, about z = 0.
        teeth: their number.
        depth: of the gaps, in radii.
        bore: radius of the hole, in radii, less than 1 - depth.
    """
    radius = checks.positive_number("gear(radius)", radius)
    thickness = checks.positive_number("gear(thickness)", thickness)
    _check_count("gear(teeth)", teeth)
    if not (0.0 < depth < 1.0 and 0.0 < bore < 1.0 - depth):
        raise ValueError(
            f"gear(depth)={depth!r}, gear(bore)={bore!r}; both are positive, and bore must be less than 1 - depth."
        )
    # A tooth: foot, tip, tip, foot, as shares of a pitch.
    shares = np.array([0.05, 0.2, 0.5, 0.65])
    angles = 2.0 * np.pi * (np.arange(teeth)[:, None] + shares).ravel() / teeth
    tips = np.tile(np.array([1.0 - depth, 1.0, 1.0, 1.0 - depth]), teeth)
    count = len(angles)
    circle = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    rings = []
    for reach in (radius * tips, np.full(count, radius * bore)):
        for z in (-0.5 * thickness, 0.5 * thickness):
            rings.append(np.concatenate([circle * reach[:, None], np.full((count, 1), z)], axis=1))
    rows = np.arange(4 * count).reshape(4, count)
    outer_low, outer_high, bore_low, bore_high = np.concatenate([rows, rows[:, :1]], axis=1)
    faces = [
        quads_between(outer_low, outer_high),
        quads_between(bore_high, bore_low),
        quads_between(outer_high, bore_high),
        quads_between(bore_low, outer_low),
    ]
    return TriangleMesh(np.concatenate(rings), np.concatenate(faces))


def _check_count(label: str, count: int) -> None:
    if isinstance(count, bool) or not isinstance(count, (int, np.integer)) or count < 3:
        raise ValueError(f"{label}={count!r}; give a whole number of at least 3.")
