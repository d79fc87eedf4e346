"""Shadows of the sun: a depth map seen from the sun (Williams 1978), looked up with a smooth filter.

The map is drawn like any picture, by parallel rays (visibility.py); it keeps how near to the sun the first surface
lies, and a point that is less near is in the shade. Two things blur that comparison: a pixel of the map stands for a
patch of surface, on which the nearness changes by the slope, and neighbouring pixels are averaged for a soft edge. So
the point is moved off its surface by a share of a pixel that grows with the slope (normal offset, Holbert 2011), and
the margin of the comparison grows with the slope too; a constant margin is either too small on steep ground or lets
the shadows of low bodies come off.
"""

from __future__ import annotations

import numpy as np

from ..physics.jit import kernel

# Of a map pixel: the least margin of the comparison, its growth with the tangent of the slope, and the largest slope
# that counts. Smaller values show stripes on lit ground, larger ones a lit seam between a body and its shadow.
BIAS, SLOPE_BIAS, STEEPEST = 0.5, 1.0, 6.0
# [map pixels] how far the point is moved along its normal where light only grazes the surface.
NORMAL_OFFSET = 1.2


@kernel
def sunlight(x, y, nearness, depth):
    """Share in [0, 1] of the sun that reaches a point.

    Weights of the quadratic B-spline over 3 x 3 map pixels: the edge of a shadow is smooth, without steps.

    Args:
        x: [map pixels] column, whole numbers at the centres of pixels.
        y: [map pixels] row.
        nearness: [m] to the sun, with the margin.
        depth: (n, n) float32, the map.

    All of them float32.
    """
    zero, half, one = np.float32(0.0), np.float32(0.5), np.float32(1.0)
    x += half
    y += half
    size = depth.shape[0]
    if not (x >= 2.0 and y >= 2.0 and x <= size - 2.0 and y <= size - 2.0):
        return one
    i = int(x)
    j = int(y)
    u = x - np.float32(i)
    v = y - np.float32(j)
    u0, u1, u2 = half * (one - u) * (one - u), half + u * (one - u), half * u * u
    lit = zero
    weight = half * (one - v) * (one - v)
    for row in range(j - 1, j + 2):
        share = u0 if depth[row, i - 1] <= nearness else zero
        share += u1 if depth[row, i] <= nearness else zero
        share += u2 if depth[row, i + 1] <= nearness else zero
        lit += weight * share
        weight = half + v * (one - v) if row < j else half * v * v
    return lit
