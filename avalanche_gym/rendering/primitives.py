"""Meshes of the simple forms: solids of the engine, and what marks a goal.

Round forms have as many triangles as it takes for their outline to look round at a quarter of the picture's height, and
no more: triangles cost time even where they cover a pixel or less.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..physics.shapes.icosphere import icosphere
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
    # Corners lie outside by as much as the middles of faces lie inside, so the sphere looks neither small nor large.
    centers = points[faces].mean(axis=1)
    outside = 2.0 / (1.0 + np.linalg.norm(centers, axis=1).mean())
    return _with_sectors(Geometry(points * radius * outside, faces, points))


@lru_cache(maxsize=64)
def box(half_extents: tuple[float, float, float]) -> Geometry:
    """A box of twelve triangles; no face is smoothed into another."""
    corners = np.array([(x, y, z) for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
    vertices: list[NDArray[np.float64]] = []
    normals: list[NDArray[np.float64]] = []
    faces: list[tuple[int, int, int]] = []
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


def height_field(
    heights: ArrayLike, extent: tuple[float, float], cell: float | None = None, skirt: float | None = None
) -> Geometry:
    """A terrain with smooth normals, faint squares and vertical sides.

    Args:
        heights: (rows, columns) [m], rows along y, columns along x.
        extent: [m] along x, along y; centred.
        cell: [m] side of the squares painted on it; None for a round length near a twentieth of its longer side.
        skirt: [m] by which the sides reach below the lowest point; None for a share of its size; 0 for a sheet that is
            seen from below too.
    """
    z = np.asarray(heights, dtype=np.float64)
    rows, columns = z.shape
    index = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]
    # The diagonal of a cell joins (row, column) and (row + 1, column + 1), as that of the collider does.
    faces = np.stack([a, b, c, a, c, d], axis=2).reshape(-1, 3)
    vertices, normals = grid_surface(z, extent)
    deep = 0.04 * max(extent) if skirt is None else skirt
    if deep > 0.0:
        side_vertices, side_normals = grid_sides(z, extent, float(z.min()) - deep)
        half = len(side_vertices) // 2
        # The border is walked counter-clockwise; each corner occurs twice, for the two sides that meet there.
        lengths = np.array([columns, rows, columns, rows])
        joined = np.delete(np.arange(half), np.cumsum(lengths) - 1) + len(vertices)
        low, high = joined + half, joined
        sides = np.stack([low, low + 1, high + 1, low, high + 1, high], axis=1).reshape(-1, 3)
        faces = np.concatenate([faces, sides])
        vertices, normals = np.concatenate([vertices, side_vertices]), np.concatenate([normals, side_normals])
    size = round_length(max(extent) / 20.0) if cell is None else cell
    return Geometry(
        vertices,
        faces,
        normals,
        two_sided=deep <= 0.0,
        cells=(size, size, math.inf),
        contrast=GROUND_CONTRAST,
        grid=(rows, columns),
    )


def grid_surface(
    heights: NDArray[np.float64], extent: tuple[float, float]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Vertices (rows * columns, 3) [m] and unit normals of a height field, these from central differences."""
    rows, columns = heights.shape
    x = np.linspace(-0.5 * extent[0], 0.5 * extent[0], columns)
    y = np.linspace(-0.5 * extent[1], 0.5 * extent[1], rows)
    vertices = np.stack([*np.meshgrid(x, y), heights], axis=2).reshape(-1, 3)
    slope_y, slope_x = np.gradient(heights, extent[1] / (rows - 1), extent[0] / (columns - 1))
    normals = np.stack([-slope_x, -slope_y, np.ones_like(heights)], axis=2).reshape(-1, 3)
    return vertices, normals / np.linalg.norm(normals, axis=1, keepdims=True)


def grid_sides(
    heights: NDArray[np.float64], extent: tuple[float, float], bottom: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Vertices (n, 3) [m] of the four sides of a height field, the upper ones first, and their unit normals."""
    rows, columns = heights.shape
    points = grid_surface(heights, extent)[0].reshape(rows, columns, 3)
    border = [points[0], points[:, -1], points[-1, ::-1], points[::-1, 0]]
    outwards = np.array([(0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (-1.0, 0.0, 0.0)])
    upper = np.concatenate(border)
    lower = upper * (1.0, 1.0, 0.0) + (0.0, 0.0, bottom)
    normals = np.repeat(outwards, [columns, rows, columns, rows], axis=0)
    return np.concatenate([upper, lower]), np.concatenate([normals, normals])


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
    """An upright tube of light that fades towards its top, from heights ``bottom`` < 0 to ``top`` > 0 [m]."""
    heights = np.array([bottom, 0.0, *np.linspace(0.0, top, 9)[1:]])
    tube = band(radius, bottom, top, tuple(heights.tolist()))
    colors = np.ones((len(tube.vertices), 4))
    colors[:, 3] = np.clip(1.0 - tube.vertices[:, 2] / top, 0.0, 1.0)
    return tube.with_options(colors=colors)


@lru_cache(maxsize=64)
def band(radius: float, bottom: float, top: float, heights: tuple[float, ...] = ()) -> Geometry:
    """An open upright tube between two heights [m], seen from both sides; ``heights`` [m] of its rings of vertices."""
    levels = np.array(heights or (bottom, top))
    profile = np.stack([np.full_like(levels, radius), levels], axis=1)
    return _revolved(profile, np.tile((1.0, 0.0), (len(levels), 1))).with_options(two_sided=True)


def _with_sectors(geometry: Geometry) -> Geometry:
    """Two shades that change at the planes through the origin across the body axes, and nowhere else."""
    reach = 1.01 * float(np.abs(geometry.vertices).max())
    return geometry.with_options(cells=(reach, reach, reach), contrast=TURN_CONTRAST)


def _revolved(profile: NDArray[np.float64], normals: NDArray[np.float64]) -> Geometry:
    """What a line in the half plane (distance from z, z) sweeps about z; it runs with the outside on its right."""
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
