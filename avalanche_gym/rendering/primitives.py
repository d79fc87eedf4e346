"""Meshes of the simple forms: solids of the engine, and what marks a goal.

Round forms have as many triangles as it takes for their outline to look round at a quarter of the picture's height, and
no more: triangles cost time even where they cover a pixel or less.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..physics.shapes.planet import icosphere
from .geometry import Geometry

SEGMENTS = 28  # around a cylinder or capsule: an outline within 0.6 % of the radius
TURN_CONTRAST = 0.13  # of the eight sectors that show how a round body turns
TILE_CONTRAST = 0.1
GROUND_CONTRAST = 0.06
CAP_RINGS = 5  # from the equator of a capsule's cap to its pole


@lru_cache(maxsize=64)
def sphere(radius: float, subdivisions: int = 2) -> Geometry:
    """A sphere of 20 x 4^subdivisions triangles."""
    points, faces = icosphere(subdivisions)
    # The corners lie outside by as much as the middles of the faces lie inside, so the sphere looks neither small nor large.
    centers = points[faces].mean(axis=1)
    outside = 2.0 / (1.0 + np.linalg.norm(centers, axis=1).mean())
    return _with_sectors(Geometry(points * radius * outside, faces, points))


@lru_cache(maxsize=64)
def box(half_extents: tuple[float, float, float]) -> Geometry:
    """A box of twelve triangles; no face is smoothed into another."""
    corners = np.array([(x, y, z) for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
    vertices, normals, faces = [], [], []
    for axis in range(3):
        for side in (-1.0, 1.0):
            # The four corners of this face, counter-clockwise seen from outside.
            u, v = (axis + 1) % 3, (axis + 2) % 3
            on_face = corners[corners[:, axis] == side]
            order = np.argsort(side * np.arctan2(on_face[:, v], on_face[:, u]))
            first = len(vertices)
            vertices += list(on_face[order])
            normals += [side * np.eye(3)[axis]] * 4
            faces += [(first, first + 1, first + 2), (first, first + 2, first + 3)]
    return Geometry(np.array(vertices) * half_extents, np.array(faces), np.array(normals))


@lru_cache(maxsize=64)
def capsule(radius: float, half_length: float) -> Geometry:
    """A capsule along z."""
    angles = np.linspace(0.0, 0.5 * np.pi, CAP_RINGS + 1)
    latitude = np.concatenate([-angles[::-1], angles])  # the equator twice: once for each cap
    center = np.repeat([-half_length, half_length], CAP_RINGS + 1)
    profile = np.stack([radius * np.cos(latitude), center + radius * np.sin(latitude)], axis=1)
    normals = np.stack([np.cos(latitude), np.sin(latitude)], axis=1)
    return _with_sectors(_revolved(profile, normals))


@lru_cache(maxsize=64)
def cylinder(radius: float, half_length: float) -> Geometry:
    """A cylinder along z, with two flat ends."""
    parts = [
        ([(0.0, -half_length), (radius, -half_length)], [(0.0, -1.0)] * 2),
        ([(radius, -half_length), (radius, half_length)], [(1.0, 0.0)] * 2),
        ([(radius, half_length), (0.0, half_length)], [(0.0, 1.0)] * 2),
    ]
    still = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))
    pieces = [(_revolved(np.array(profile), np.array(normals)), *still) for profile, normals in parts]
    return _with_sectors(Geometry.merged(pieces))


def tile(half_extent: float, square: float) -> Geometry:
    """A square of the plane z = 0 with a checker pattern: stands for an infinite plane.

    Args:
        half_extent: [m] from the middle to a side.
        square: [m] side of a square of the pattern.
    """
    e = half_extent
    vertices = np.array([(-e, -e, 0.0), (e, -e, 0.0), (e, e, 0.0), (-e, e, 0.0)])
    up = np.tile((0.0, 0.0, 1.0), (4, 1))
    faces = np.array([(0, 1, 2), (0, 2, 3)])
    return Geometry(vertices, faces, up, cells=(square, square, math.inf), contrast=TILE_CONTRAST, unbounded=True)


def height_field(heights: ArrayLike, extent: tuple[float, float], cell: float | None = None) -> Geometry:
    """A terrain with smooth normals and faint squares.

    Args:
        heights: (rows, columns) [m], rows along y, columns along x.
        extent: [m] along x, along y; centred.
        cell: [m] side of the squares painted on it; None for a round length near a twentieth of its longer side.
    """
    z = np.asarray(heights, dtype=np.float64)
    rows, columns = z.shape
    x = np.linspace(-0.5 * extent[0], 0.5 * extent[0], columns)
    y = np.linspace(-0.5 * extent[1], 0.5 * extent[1], rows)
    vertices = np.stack([*np.meshgrid(x, y), z], axis=2).reshape(-1, 3)
    index = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]
    # The diagonal of a cell joins (row, column) and (row + 1, column + 1), as that of the collider does.
    faces = np.stack([a, b, c, a, c, d], axis=2).reshape(-1, 3)
    size = round_length(max(extent) / 20.0) if cell is None else cell
    normals = grid_normals(z, extent)
    cells = (size, size, math.inf)
    return Geometry(vertices, faces, normals, cells=cells, contrast=GROUND_CONTRAST, grid=(rows, columns))


def grid_normals(heights: NDArray[np.float64], extent: tuple[float, float]) -> NDArray[np.float64]:
    """(rows * columns, 3) unit normals of a height field, from central differences."""
    rows, columns = heights.shape
    slope_y, slope_x = np.gradient(heights, extent[1] / (rows - 1), extent[0] / (columns - 1))
    normals = np.stack([-slope_x, -slope_y, np.ones_like(heights)], axis=2).reshape(-1, 3)
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


def round_length(length: float) -> float:
    """The largest of 1, 2, 5 times a power of ten that is not above ``length``."""
    power = 10.0 ** np.floor(np.log10(length))
    return float(power * max(step for step in (1.0, 2.0, 5.0) if step * power <= length * (1.0 + 1e-9)))


@lru_cache(maxsize=64)
def disc(radius: float) -> Geometry:
    """A flat disc in the plane z = 0, seen from both sides: a goal region on level ground."""
    profile = np.array([(radius, 0.0), (0.0, 0.0)])
    return _revolved(profile, np.array([(0.0, 1.0)] * 2)).with_options(two_sided=True)


@lru_cache(maxsize=64)
def ring(radius: float, width: float) -> Geometry:
    """A flat ring in the plane z = 0, seen from both sides; ``radius`` [m] is that of its middle."""
    profile = np.array([(radius + 0.5 * width, 0.0), (radius - 0.5 * width, 0.0)])
    return _revolved(profile, np.array([(0.0, 1.0)] * 2)).with_options(two_sided=True)


@lru_cache(maxsize=64)
def beam(radius: float, bottom: float, top: float) -> Geometry:
    """An upright tube of light that fades towards its top: a goal that is seen from afar and on any ground.

    Args:
        radius: [m].
        bottom: [m] height where it begins; below the ground to meet uneven terrain.
        top: [m] height where it has faded away.
    """
    heights = np.array([bottom, 0.0, *np.linspace(0.0, top, 9)[1:]])
    profile = np.stack([np.full_like(heights, radius), heights], axis=1)
    fade = np.clip(1.0 - heights / top, 0.0, 1.0) ** 1.5
    tube = _revolved(profile, np.tile((1.0, 0.0), (len(heights), 1)))
    colors = np.ones((len(tube.vertices), 4))
    colors[:, 3] = np.repeat(fade, SEGMENTS)
    return tube.with_options(colors=colors, two_sided=True)


def _with_sectors(geometry: Geometry) -> Geometry:
    """Two shades that change at the planes through the origin across the body axes, and nowhere else."""
    reach = 1.01 * float(np.abs(geometry.vertices).max())
    return geometry.with_options(cells=(reach, reach, reach), contrast=TURN_CONTRAST)


def _revolved(profile: NDArray[np.float64], normals: NDArray[np.float64]) -> Geometry:
    """The surface that a line in the half plane (distance from z, z) sweeps about z; it runs with the outside on its right."""
    angles = np.linspace(0.0, 2.0 * np.pi, SEGMENTS, endpoint=False)
    cosine, sine = np.cos(angles), np.sin(angles)

    def sweep(line: NDArray[np.float64]) -> NDArray[np.float64]:
        flat = [line[:, :1] * cosine, line[:, :1] * sine, np.repeat(line[:, 1:], SEGMENTS, axis=1)]
        return np.stack(flat, axis=2).reshape(-1, 3)

    start = np.arange(SEGMENTS)
    end = np.roll(start, -1)
    rows = (np.arange(len(profile) - 1) * SEGMENTS)[:, None]
    lower = np.stack([rows + start, rows + end, rows + SEGMENTS + end], axis=2)
    upper = np.stack([rows + start, rows + SEGMENTS + end, rows + SEGMENTS + start], axis=2)
    faces = np.concatenate([lower.reshape(-1, 3), upper.reshape(-1, 3)])
    vertices = sweep(profile)
    corners = vertices[faces]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    # At a pole one of the two triangles of a quadrilateral has shrunk to a line.
    return Geometry(vertices, faces[area > 1e-9 * area.max()], sweep(normals))
