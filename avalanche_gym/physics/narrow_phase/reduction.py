"""Four contacts that support a body as well as all of its contacts would.

The deepest one, the one farthest from it, and the farthest on either side of the line through these two. Ties go to the
first, with a tolerance, so that round-off does not choose anew in every step and a regular polygon gives a regular
choice.
"""

from __future__ import annotations

from ..jit import kernel

# Columns of a scratch row: coordinates in the plane of the reference face, height over it, tag of the edge that leaves
# the vertex, gap along the normal, feature.
X, Y, HEIGHT, TAG, GAP, FEATURE = 0, 1, 2, 3, 4, 5

# Gaps this close, as a fraction of the pair's size, count as equally deep. The four contacts may miss the deepest point
# by no more.
DEPTH_TIE = 1e-9

# A point must be farther than an earlier one by this fraction to be taken instead.
FARTHER = 1e-6


@kernel
def drop_beyond(scratch, first, count, margin):
    """Keep the rows whose gap is at most ``margin``, in their order; return how many."""
    kept = 0
    for i in range(first, first + count):
        if scratch[i, GAP] <= margin:
            if first + kept != i:
                for column in range(FEATURE + 1):
                    scratch[first + kept, column] = scratch[i, column]
            kept += 1
    return kept


@kernel
def _deepest(scratch, first, count, tie):
    """Index of the first row that is as deep as the deepest."""
    smallest = scratch[first, GAP]
    for i in range(first + 1, first + count):
        smallest = min(smallest, scratch[i, GAP])
    for i in range(first, first + count):
        if scratch[i, GAP] <= smallest + tie:
            return i
    return first


@kernel
def select_four(scratch, first, count, size):
    """Row numbers of up to four of ``count`` rows; -1 where there is none. ``size`` is that of the pair [m]."""
    none = -1
    if count <= 4:
        return (
            first if count > 0 else none,
            first + 1 if count > 1 else none,
            first + 2 if count > 2 else none,
            first + 3 if count > 3 else none,
        )
    deepest = _deepest(scratch, first, count, DEPTH_TIE * size)
    x, y = scratch[deepest, X], scratch[deepest, Y]
    opposite = none
    best = 0.0
    for i in range(first, first + count):
        dx, dy = scratch[i, X] - x, scratch[i, Y] - y
        distance_squared = dx * dx + dy * dy
        if distance_squared > best * (1.0 + FARTHER):
            best, opposite = distance_squared, i
    if opposite == none:
        return deepest, none, none, none
    line_x, line_y = scratch[opposite, X] - x, scratch[opposite, Y] - y
    # Points within this distance of the line add no support.
    left, right = none, none
    most_left = most_right = FARTHER * best
    for i in range(first, first + count):
        area = line_x * (scratch[i, Y] - y) - line_y * (scratch[i, X] - x)
        if area > most_left * (1.0 + FARTHER):
            most_left, left = area, i
        elif -area > most_right * (1.0 + FARTHER):
            most_right, right = -area, i
    return deepest, opposite, left, right
