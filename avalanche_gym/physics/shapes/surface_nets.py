"""A closed mesh of the surface where a function of space is zero: naive surface nets (Gibson 1998).

A grid cell through which the surface passes has one vertex, the mean of the places where its edges cross the surface.
Every grid edge that crosses the surface joins the vertices of its four cells by a quad, which is cut along its shorter
diagonal. A last step moves the vertices onto the surface along the gradient, each within its cell, so that no face
folds.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Field = Callable[[Floats], Floats]

# Newton steps that take the vertices onto the surface.
PROJECTIONS = 4
# Share of a cell that a vertex stays away from the cell's sides: edges are at least twice as long.
INSET = 0.1


def surface_nets(field: Field, lower: Floats, upper: Floats, cell: float) -> tuple[Floats, NDArray[np.int64]]:
    """Triangles of the surface field = 0.

    Args:
        field: takes points (n, 3) [m] and returns (n,) values, negative inside; positive all over the box's faces.
        lower, upper: (3,) [m] of the box that holds the surface.
        cell: [m] edge of a grid cell.

    Returns:
        vertices (n, 3) [m], faces (m, 3) counter-clockwise from outside.
    """
    counts = np.ceil((upper - lower) / cell).astype(int) + 1
    axes = [lower[k] + cell * np.arange(counts[k]) for k in range(3)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    values = field(points.reshape(-1, 3)).reshape(counts)
    inside = values < 0.0
    cells = tuple(counts - 1)
    total = np.zeros((*cells, 3))
    number = np.zeros(cells)
    quads = []
    for axis in range(3):
        here: list[slice] = [slice(None)] * 3
        ahead: list[slice] = [slice(None)] * 3
        here[axis], ahead[axis] = slice(None, -1), slice(1, None)
        first, second = values[tuple(here)], values[tuple(ahead)]
        crosses = inside[tuple(here)] != inside[tuple(ahead)]
        where = np.argwhere(crosses)
        share = first[crosses] / (first[crosses] - second[crosses])
        at = points[tuple(where.T)].copy()
        at[:, axis] += cell * share
        u, v = (axis + 1) % 3, (axis + 2) % 3
        ring = []
        for back_u, back_v in ((1, 1), (0, 1), (0, 0), (1, 0)):
            around = where.copy()
            around[:, u] -= back_u
            around[:, v] -= back_v
            np.add.at(total, tuple(around.T), at)
            np.add.at(number, tuple(around.T), 1.0)
            ring.append(np.ravel_multi_index(tuple(around.T), cells))
        quad = np.stack(ring, axis=1)
        # Counter-clockwise about the axis if the inside is behind.
        outward = inside[tuple(here)][crosses]
        quads.append(np.where(outward[:, None], quad, quad[:, ::-1]))
    used = number > 0
    vertices = total[used] / number[used][:, None]
    index = np.cumsum(used.ravel()) - 1
    corners = index[np.concatenate(quads)]
    low = lower + cell * (np.argwhere(used) + INSET)
    vertices = _onto_surface(field, vertices, cell, low, low + cell * (1.0 - 2.0 * INSET))
    a, b, c, d = (vertices[corners[:, k]] for k in range(4))
    shorter = np.linalg.norm(a - c, axis=1) <= np.linalg.norm(b - d, axis=1)
    one = np.where(shorter[:, None], corners[:, [0, 1, 2]], corners[:, [0, 1, 3]])
    other = np.where(shorter[:, None], corners[:, [0, 2, 3]], corners[:, [1, 2, 3]])
    return vertices, np.concatenate([one, other]).astype(np.int64)


def _onto_surface(field: Field, points: Floats, cell: float, low: Floats, high: Floats) -> Floats:
    """Points moved to where the field is zero, along its gradient, as far as ``low`` and ``high`` (n, 3) allow."""
    step = 1e-4 * cell
    for _ in range(PROJECTIONS):
        value = field(points)
        gradient = np.stack(
            [(field(points + step * e) - field(points - step * e)) / (2.0 * step) for e in np.eye(3)], axis=1
        )
        move = value / np.einsum("ij,ij->i", gradient, gradient)
        points = np.clip(points - move[:, None] * gradient, low, high)
    return points
