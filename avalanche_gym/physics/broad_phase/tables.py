"""Memory of the hash grid, one block a world: where each body is in it, its cells, and the pairs that are close."""

from __future__ import annotations

import numpy as np

MOST_LEVELS = 64  # size classes in use at once: sizes from 1 to 2**64

# PROXY.place
OUT, IN_CELL, ON_LIST = 0, 1, 2

PROXY = np.dtype(  # (worlds, bodies): 64 bytes, a line of the processor's cache
    [
        ("box", np.float64, 6),  # [m] fat bounds, low and high: the body is looked up again when it leaves them
        ("next", np.int32),  # body in the same cell or on the list, -1 at the end
        ("previous", np.int32),
        ("slot", np.int32),  # of its cell
        ("level", np.int8),  # of GRID.exponent
        ("place", np.int8),  # OUT: has no bounds; IN_CELL; ON_LIST: without end, or of a size class too many
        ("motion", np.int8),  # as in model.BODY when it was put there
        ("moved", np.int8),  # 1 while its pairs are looked up
    ],
    align=True,
)

CELL = np.dtype([("key", np.int64), ("first", np.int64)], align=True)  # (worlds, slots): key 0 is a free slot

GRID = np.dtype(  # (worlds,)
    [
        ("valid", np.int64),  # 0: everything is to be put in anew
        ("used", np.int64),  # slots with a key
        ("candidates", np.int64),  # pairs whose fat bounds meet
        ("listed", np.int64),  # first body on the list, -1 for none
        ("levels", np.int64),  # size classes met so far
        ("exponent", np.int64, MOST_LEVELS),  # cells of a level have edges of 2**exponent [m]
        ("members", np.int64, MOST_LEVELS),  # bodies in a level
        ("dynamic", np.int64, MOST_LEVELS),  # dynamic ones among them
        ("still", np.int64, MOST_LEVELS),  # those that have not moved in this step
    ],
    align=True,
)
