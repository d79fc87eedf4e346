"""What is the same for every pixel of a frame, as the shading kernels read it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .camera import Camera
from .lighting import Lighting
from .shadow import BIAS, NORMAL_OFFSET, SLOPE_BIAS
from .shadow_map import SunView

FRAME = np.dtype(
    [
        # The ray through pixel (i, j), of length one along the optical axis: corner + i across + j down; world frame.
        ("corner", np.float64, 3),
        ("across", np.float64, 3),
        ("down", np.float64, 3),
        # The sun and the backdrop, see Lighting. Colours are linear.
        ("sun", np.float32, 3),  # unit, towards the sun, world frame
        ("sun_color", np.float32, 3),
        ("above", np.float32, 3),  # light from the sky
        ("below", np.float32, 3),  # light from the ground
        ("zenith", np.float32, 3),
        ("horizon", np.float32, 3),
        ("nadir", np.float32, 3),
        ("glow", np.float32),
        ("haze", np.float32),  # [1/m] inverse distance at which half of a surface's colour is the horizon's
        # A point at d [m] from the eye lies at column, row [map pixels] and nearness [m] of the shadow map:
        # map_eye + (map_across . d, map_down . d, sun . d). From the eye, since single precision serves for what is
        # seen from there, not for the world's own origin.
        ("map_eye", np.float32, 3),
        ("map_across", np.float32, 3),
        ("map_down", np.float32, 3),
        ("lift", np.float32),  # [m] see shadow.py
        ("bias", np.float32),  # [m]
        ("slope_bias", np.float32),  # [m]
    ],
    align=True,
)


def frame_record(
    camera: Camera, lighting: Lighting, sun_view: SunView, scene_size: float, width: int, height: int
) -> NDArray[np.void]:
    """The FRAME record (1,) of an image of this size [pixels] and a scene of this radius [m]."""
    record = np.zeros(1, dtype=FRAME)
    view = camera.record(width, height)[0]
    record["across"] = view["pixel"] * view["right"]
    record["down"] = view["pixel"] * view["down"]
    record["corner"] = view["forward"] - view["center"][0] * record["across"] - view["center"][1] * record["down"]
    record["sun"] = lighting.direction
    for name, color in lighting.linear_colors().items():
        record[name] = color
    record["glow"] = lighting.glow
    record["haze"] = 1.0 / (lighting.haze * scene_size)
    record["map_eye"] = sun_view.rows @ view["eye"] + sun_view.offsets
    record["map_across"], record["map_down"] = sun_view.rows[:2]
    record["lift"] = NORMAL_OFFSET * sun_view.pixel
    record["bias"] = BIAS * sun_view.pixel
    record["slope_bias"] = SLOPE_BIAS * sun_view.pixel
    return record
