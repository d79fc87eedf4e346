"""Patterns painted on surfaces, each averaged over the pixel: without that, distant squares would flicker."""

from __future__ import annotations

import numpy as np

from ..physics.jit import kernel
from .geometry import CHECKER, GRID, OCTANTS

GRID_LINE = 0.05  # width of a grid line, in cells
# [cells] A pixel is never taken to be smaller: keeps the averages, which are differences divided by it, from rounding.
SHARPEST = 1e-4


@kernel
def square_wave(x, width):
    """Integral over a window of this width about x of a wave of period 2: 1 on [0, 1), -1 on [1, 2); float32."""
    half = np.float32(0.5)
    a = half * (x - half * width)
    b = half * (x + half * width)
    # The wave's own integral is a triangle wave.
    return np.float32(2.0) * (abs(a - np.floor(a) - half) - abs(b - np.floor(b) - half))


@kernel
def between_lines(x, width):
    """Length of the part of a window of this width about x that lies off the lines about the whole numbers; float32."""
    half, line, rest = np.float32(0.5), np.float32(GRID_LINE), np.float32(1.0 - GRID_LINE)
    a = x + half * (line - width)
    b = x + half * (line + width)
    # Integral of 1 - (indicator of [0, GRID_LINE), repeated with period 1).
    fa = np.floor(a)
    fb = np.floor(b)
    return max(b - fb, line) - max(a - fa, line) + rest * (fb - fa)


@kernel
def paint_checker(lanes, count):
    """Squares on the plane of the two body axes that the surface faces least."""
    one, kind, sharpest = np.float32(1.0), np.float32(CHECKER), np.float32(SHARPEST)
    for k in range(count):
        x, y, z = lanes.axis_x[k], lanes.axis_y[k], lanes.axis_z[k]
        # All are read before one is chosen: a conditional read would keep the loop from running on eight pixels at once.
        px, py, pz = lanes.place_x[k], lanes.place_y[k], lanes.place_z[k]
        bx, by, bz = lanes.blur_x[k], lanes.blur_y[k], lanes.blur_z[k]
        contrast = lanes.contrast[k]
        flat = z >= max(x, y)
        first = flat or y > x
        u = px if first else py
        du = bx if first else by
        v = py if flat else pz
        dv = by if flat else bz
        du = max(du, sharpest)
        dv = max(dv, sharpest)
        wave = square_wave(u, du) * square_wave(v, dv) / (du * dv)
        shade = one + contrast * wave if lanes.pattern[k] == kind else one
        lanes.red[k] *= shade
        lanes.green[k] *= shade
        lanes.blue[k] *= shade


@kernel
def paint_grid(lanes, count):
    """Thin lines at even distances along the body axes x and y."""
    one, kind, sharpest = np.float32(1.0), np.float32(GRID), np.float32(SHARPEST)
    for k in range(count):
        du = max(lanes.blur_x[k], sharpest)
        dv = max(lanes.blur_y[k], sharpest)
        free = between_lines(lanes.place_x[k], du) * between_lines(lanes.place_y[k], dv) / (du * dv)
        shade = one - lanes.contrast[k] * (one - free) if lanes.pattern[k] == kind else one
        lanes.red[k] *= shade
        lanes.green[k] *= shade
        lanes.blue[k] *= shade


@kernel
def paint_octants(lanes, count):
    """Two shades that change at the planes through the origin across the body axes."""
    one, two, kind, sharpest = np.float32(1.0), np.float32(2.0), np.float32(OCTANTS), np.float32(SHARPEST)
    for k in range(count):
        du = max(lanes.blur_x[k], sharpest)
        dv = max(lanes.blur_y[k], sharpest)
        dw = max(lanes.blur_z[k], sharpest)
        wave = max(-du, min(du, two * lanes.place_x[k]))
        wave *= max(-dv, min(dv, two * lanes.place_y[k]))
        wave *= max(-dw, min(dw, two * lanes.place_z[k]))
        shade = one + lanes.contrast[k] * wave / (du * dv * dw) if lanes.pattern[k] == kind else one
        lanes.red[k] *= shade
        lanes.green[k] *= shade
        lanes.blue[k] *= shade


@kernel
def paint_patterns(lanes, count):
    """Shade the colours of a block of pixels by their patterns; most blocks have one or none."""
    checkers, grids, octants = 0, 0, 0
    for k in range(count):
        kind = int(lanes.pattern[k])
        checkers += 1 if kind == CHECKER else 0
        grids += 1 if kind == GRID else 0
        octants += 1 if kind == OCTANTS else 0
    if checkers > 0:
        paint_checker(lanes, count)
    if grids > 0:
        paint_grid(lanes, count)
    if octants > 0:
        paint_octants(lanes, count)
