"""A floor that is flat to nine digits is flat: samples of a height field that lie in one plane, but for noise, put
into it.

Three points bear on a floor whose heights are off by 1e-9 m, which ones is noise, and so is where a body that slides
and turns on them goes. As for meshes (mesh_preparation.py) a sample moves if all of its faces lie in one plane: its
six edges are flat, by the second differences of height_field_grid.py. Samples that are joined by edges share the plane

    z = s_x x + s_y y + z_0

of least squares through all corners of their faces. What is off it by more than such noise, as the foot of a hill, is
left out, and a plane found for the rest. Noise bends this way and that from one edge to the next, shape does not:
ground that is bent, however gently, keeps its samples.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from .mesh_repair import Floats, Ints, components

# Points are off a plane by noise below this fraction of the size of the ground. Smaller: noise in the ninth digit makes
# edges and corners that bear. Larger: bodies of a hundredth of the ground sink in by more than what they leave alone
# (response/creep.py, SETTLED).
FLAT_HEIGHT = 1e-9
# A second difference of four heights holds so many units of round-off of the heights themselves.
HEIGHT_ROUND_OFF = 16.0 * 2.220446049250313e-16
# Noise is off a plane by this many times the median of the second differences at most: six times its own deviation.
FAR = 2.5
# A plane is found anew for what is left of a floor so often at most; each time it is less.
MOST_PASSES = 20

# From a sample along its edges, (rows, columns); itself first.
_NEIGHBOURS = ((0, 0), (0, 1), (1, 0), (1, 1), (0, -1), (-1, 0), (-1, -1))


def flattened(samples: Floats, extent: Sequence[float]) -> Floats:
    """Samples (..., rows, columns) [m] of fields over ``extent`` [m]; the same array where nothing moves."""
    fields = samples.reshape(-1, *samples.shape[-2:])
    noise = HEIGHT_ROUND_OFF * np.abs(fields).max(axis=(1, 2), keepdims=True)
    off = FLAT_HEIGHT * float(max(extent)) + noise
    # Around a flat sample diagonals are flat. All fields are asked for that at once: moving ground brings new samples
    # for every world in every step, and hardly any is flat.
    flattest = np.abs(_bends_across(fields)).min(axis=(1, 2), keepdims=True)
    moved = fields
    for index in np.flatnonzero(flattest <= 4.0 * off):
        heights = _flattened(fields[index], float(noise[index, 0, 0]), float(off[index, 0, 0]))
        if heights is not None:
            if moved is fields:
                moved = fields.copy()
            moved[index] = heights
    return samples if moved is fields else moved.reshape(samples.shape)


def _flattened(heights: Floats, noise: float, off: float) -> Floats | None:
    """The samples (rows, columns) of one field, or None if nothing moves."""
    bends = _bends(heights)
    sizes = [np.abs(bend) for bend in bends]
    if not any(((size > noise) & (size <= 4.0 * off)).any() for size in sizes):
        return None
    inside = _inside(heights.shape, [size <= 4.0 * off for size in sizes])
    small = [np.where(size <= 4.0 * off, bend, 0.0) for bend, size in zip(bends, sizes, strict=True)]
    ways = _ways(heights.shape, small)
    change = np.abs(ways).max(axis=0)
    for _ in range(MOST_PASSES):
        rows, columns = np.nonzero(inside)
        if len(rows) == 0:
            return None
        count, group = _joined(inside)
        level = _planes(heights, rows, columns, group, count)
        above = heights[rows, columns] - level
        far = np.abs(above) > np.minimum(off, FAR * _medians(change[rows, columns], group, count) + noise)[group]
        if not far.any():
            break
        inside[rows[far], columns[far]] = False
    sign = np.sign(ways)
    alike = (sign[:, :-1, :-1] * (sign[:, 1:, :-1] + sign[:, :-1, 1:])).sum(axis=0)
    inner = np.minimum(rows, heights.shape[0] - 2), np.minimum(columns, heights.shape[1] - 2)
    noisy = np.bincount(group, weights=alike[inner], minlength=count) < 0.0
    moves = noisy[group] & (np.abs(above) > noise) & ~far
    if not moves.any():
        return None
    result = heights.copy()
    result[rows[moves], columns[moves]] = level[moves]
    return result


def _ways(shape: tuple[int, ...], bends: list[Floats]) -> Floats:
    """(3, rows, columns) [m] the second differences over the edges that start at each sample; beside the rim those of
    its neighbours.
    """
    ways = np.zeros((3, *shape))
    ways[0, 1:-1, :-1], ways[1, :-1, 1:-1], ways[2, :-1, :-1] = bends
    ways[0, 0], ways[0, -1], ways[1, :, 0], ways[1, :, -1] = ways[0, 1], ways[0, -2], ways[1, :, 1], ways[1, :, -2]
    for way in ways:
        way[-1], way[:, -1] = way[-2], way[:, -2]
    return ways


def _medians(values: Floats, group: Ints, count: int) -> Floats:
    """(count,) the median of each group; the upper one of two."""
    order = np.lexsort((values, group))
    size = np.bincount(group, minlength=count)
    medians: Floats = values[order][np.cumsum(size) - size + size // 2]
    return medians


def _bends(z: Floats) -> list[Floats]:
    """Second differences [m], as in height_field_grid.bend_of, over edges of two faces: along x, y, the diagonals."""
    return [
        z[1:-1, :-1] + z[1:-1, 1:] - z[2:, 1:] - z[:-2, :-1],
        z[:-1, 1:-1] + z[1:, 1:-1] - z[1:, 2:] - z[:-1, :-2],
        _bends_across(z),
    ]


def _bends_across(z: Floats) -> Floats:
    """The last of them."""
    bends: Floats = z[..., :-1, :-1] + z[..., 1:, 1:]
    bends -= z[..., :-1, 1:]
    bends -= z[..., 1:, :-1]
    return bends


def _inside(shape: tuple[int, ...], flat: list[NDArray[np.bool_]]) -> NDArray[np.bool_]:
    """(rows, columns) whether all faces of a sample lie in one plane; ``flat``: the edges, as in _bends."""
    inside = np.ones(shape, bool)
    ahead, aside, across = flat
    inside[1:-1, :-1] &= ahead
    inside[1:-1, 1:] &= ahead
    inside[:-1, 1:-1] &= aside
    inside[1:, 1:-1] &= aside
    inside[:-1, :-1] &= across
    inside[1:, 1:] &= across
    return inside


def _joined(inside: NDArray[np.bool_]) -> tuple[int, Ints]:
    """Number of groups of samples that edges join, and the group of each, in the order of ``np.nonzero``."""
    number = np.cumsum(inside).reshape(inside.shape) - 1
    pairs = []
    for first, second in (
        (np.s_[:, :-1], np.s_[:, 1:]),
        (np.s_[:-1, :], np.s_[1:, :]),
        (np.s_[:-1, :-1], np.s_[1:, 1:]),
    ):
        both = inside[first] & inside[second]
        pairs.append((number[first][both], number[second][both]))
    one, other = (np.concatenate(ends) for ends in zip(*pairs, strict=True))
    return components(one, other, int(inside.sum()))


def _planes(heights: Floats, rows: Ints, columns: Ints, group: Ints, count: int) -> Floats:
    """[m] height of the plane of least squares of its group at each sample."""
    size = np.bincount(group, minlength=count)
    # Seen from the middle of the group, which keeps the sums small.
    middle = [np.bincount(group, weights=index, minlength=count) / size for index in (rows, columns)]
    base = np.bincount(group, weights=heights[rows, columns], minlength=count) / size
    moments = np.zeros((count, 3, 3))
    sums = np.zeros((count, 3))
    for rise, shift in _NEIGHBOURS:
        i, j = rows + rise, columns + shift
        exists = (0 <= i) & (i < heights.shape[0]) & (0 <= j) & (j < heights.shape[1])
        i, j, own = i[exists], j[exists], group[exists]
        place = (np.ones(len(own)), i - middle[0][own], j - middle[1][own])
        z = heights[i, j] - base[own]
        for k in range(3):
            sums[:, k] += np.bincount(own, weights=place[k] * z, minlength=count)
            for m in range(3):
                moments[:, k, m] += np.bincount(own, weights=place[k] * place[m], minlength=count)
    plane = np.linalg.solve(moments, sums[:, :, None])[group, :, 0]
    local = (rows - middle[0][group], columns - middle[1][group])
    level: Floats = base[group] + plane[:, 0] + plane[:, 1] * local[0] + plane[:, 2] * local[1]
    return level
