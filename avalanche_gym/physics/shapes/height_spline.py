"""Coefficients of the smooth surface of a height field: a bicubic spline through its samples.

With a spacing h the surface along one axis is

    z(x) = sum_i c_i B(x / h - i),    B the cubic B-spline: B(0) = 4/6, B(+-1) = 1/6, zero from +-2 on,

and the tensor product of both axes in the plane (de Boor 1978, "A practical guide to splines", chapters IV and XVII).
Its curvature is continuous. It goes through the samples z_i if

    (c_{i-1} + 4 c_i + c_{i+1}) / 6 = z_i,    i = 0 ... n - 1.

The two conditions that are missing say that the third derivative does not jump at the second sample and at the last but
one ("not a knot"), so a surface sampled from a cubic polynomial is met exactly, up to the rim. In the coefficients they
are explicit: c_1 = (8 z_1 - z_0 - z_2) / 6, and c_0, c_{-1} follow from the equations of z_1, z_0. What is left is
tridiagonal. Three samples give a parabola, two a straight line.

Error for a smooth hill: h^4 max|z''''| * 5/384 in height away from the rim (Hall and Meyer 1976), order 3 in the slope,
2 in the curvature. Where the samples jump the surface overshoots a step along an axis by 11 %, and 27 % of that remain
from each cell to the next.

The coefficients depend linearly on the samples: those of moving heights move at the coefficients of the rates, so they
are advanced like samples and never solved for again while stepping.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def _solve(samples: NDArray[np.float64]) -> NDArray[np.float64]:
    """Coefficients (n + 2, ...) along the first axis of samples (n, ...)."""
    n = len(samples)
    c = np.empty((n + 2, *samples.shape[1:]))
    inner = c[1:-1]
    if n == 2:
        inner[:] = samples
        c[0], c[-1] = 2.0 * samples[0] - samples[1], 2.0 * samples[1] - samples[0]
        return c
    inner[1] = (8.0 * samples[1] - samples[0] - samples[2]) / 6.0
    inner[-2] = (8.0 * samples[-2] - samples[-1] - samples[-3]) / 6.0
    # Elimination from coefficient 2 on, then back from n - 3: pivots 4, 4 - 1/4, ...
    pivots = np.empty(n)
    pivots[1] = np.inf  # c_1 is known
    for i in range(2, n - 2):
        pivots[i] = 4.0 - 1.0 / pivots[i - 1]
        below = inner[1] if i == 2 else inner[i - 1] / pivots[i - 1]
        inner[i] = 6.0 * samples[i] - below
    for i in range(n - 3, 1, -1):
        inner[i] = (inner[i] - inner[i + 1]) / pivots[i]
    if n == 3:
        bend = (samples[0] - 2.0 * samples[1] + samples[2]) / 6.0
        inner[0], inner[2] = samples[0] - bend, samples[2] - bend
    else:
        inner[0] = 6.0 * samples[1] - 4.0 * inner[1] - inner[2]
        inner[-1] = 6.0 * samples[-2] - 4.0 * inner[-2] - inner[-3]
    c[0] = 6.0 * samples[0] - 4.0 * inner[0] - inner[1]
    c[-1] = 6.0 * samples[-1] - 4.0 * inner[-1] - inner[-2]
    return c


def spline_coefficients(samples: NDArray[np.float64]) -> NDArray[np.float64]:
    """Coefficients (..., rows + 2, columns + 2) [m] of the spline through samples (..., rows, columns) [m].

    Number by number in the order of the axes, so every field of a batch gets the bits it would get alone.
    """
    along_y = _solve(np.moveaxis(samples, -2, 0))  # (rows + 2, ..., columns)
    both = _solve(np.moveaxis(along_y, -1, 0))  # (columns + 2, rows + 2, ...)
    return np.ascontiguousarray(np.moveaxis(both, (0, 1), (-1, -2)))


def pool_of_field(samples: NDArray[np.float64], smooth: bool) -> NDArray[np.float64]:
    """(..., size) part of a field in the pool of heights: samples (..., rows, columns); coefficients if smooth."""
    lead = samples.shape[:-2]
    flat = samples.reshape(*lead, -1)
    if not smooth:
        return flat
    return np.concatenate([flat, spline_coefficients(samples).reshape(*lead, -1)], axis=-1)
