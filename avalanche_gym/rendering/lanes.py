"""The table through which pixels pass while they are lit, a block of one row at a time.

Each quantity has a row of its own, so that the same arithmetic runs on eight pixels in one instruction. The rows are
fields of one record: the compiler then knows that they do not overlap, which it has to know to do so. In single
precision, since a byte is what comes out; places in the scene have been computed in double precision before.
"""

from __future__ import annotations

import numpy as np

BLOCK = 256  # pixels

LANES = np.dtype(
    [
        (name, np.float32, BLOCK)
        for name in (
            # Set when a pixel is gathered. Where nothing is seen, only these three:
            "column",  # [pixels]
            "opacity",
            "surface",  # 1, or 0 for the sky
            # and where a surface is seen, also these:
            "depth",  # [m] along the optical axis
            "normal_x",  # of any length, world frame
            "normal_y",
            "normal_z",
            "red",  # linear colour of the surface, then of the picture
            "green",
            "blue",
            "gloss",
            "lit",  # 1, or 0 for what shines by itself
            "contrast",  # of the pattern, 0 for none
            "place_x",  # [cells of the pattern] place on the surface, body frame
            "place_y",
            "place_z",
            "blur_x",  # [cells] extent of the pixel on the surface
            "blur_y",
            "blur_z",
            # Computed from these.
            "map_x",  # [map pixels] place in the shadow map
            "map_y",
            "nearness",  # to the sun, with the margin
            "sun",  # first 1 where the surface faces the sun, then the share of its light that arrives
            "sun_red",  # what the sun adds where it arrives
            "sun_green",
            "sun_blue",
        )
    ],
    align=True,
)
