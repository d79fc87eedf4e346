"""Pictures of a lane: the bodies of its world as the renderer sees them, and what the task draws over them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from ..rendering import Camera, Lighting, Marker, Window, WorldView
    from .base import BatchedTask

RENDER_MODES = ("human", "rgb_array")
WIDTH, HEIGHT = 480, 480  # [pixels]


def check_render_mode(name: str, mode: str | None) -> None:
    """Raises: ValueError: not ``None`` and not in RENDER_MODES."""
    if mode is not None and mode not in RENDER_MODES:
        allowed = ", ".join(map(repr, RENDER_MODES))
        raise ValueError(f"{name}(render_mode={mode!r}): allowed are {allowed} and None, which draws nothing.")


def open_window(task: BatchedTask, mode: str | None) -> Window | None:
    """The window of mode "human", which keeps to the pace of the world; ``None`` in other modes.

    Raises:
        ImportError: the extra ``render`` is not installed.
    """
    if mode != "human":
        return None
    from ..rendering import Window  # here, since environments that draw nothing need no renderer

    return Window(f"avalanche/{task.name}, {task.level}", fps=1.0 / task.control_interval)


class Picture(ABC):
    """Draws lanes of one task; the renderer is made once and holds its buffers."""

    def __init__(self, task: BatchedTask) -> None:
        from ..rendering import Renderer  # here, since environments that draw nothing need no renderer

        self.task = task
        self.view = self.make_view()
        self.renderer = Renderer(WIDTH, HEIGHT)

    @abstractmethod
    def make_view(self) -> WorldView:
        """The bodies and their colours."""

    @abstractmethod
    def camera(self, lane: int) -> Camera:
        """From where a lane is seen."""

    def lighting(self, lane: int) -> Lighting:
        """Sun and sky."""
        from ..rendering import DAY

        return DAY

    def markers(self, lane: int) -> Sequence[Marker]:
        """Translucent things drawn in this frame only."""
        return ()

    def prepare(self, lane: int) -> None:  # noqa: B027
        """Bring what differs between lanes, beside the poses, into the view; most tasks have nothing of that kind."""

    def frame(self, lane: int) -> NDArray[np.uint8]:
        """(height, width, 3) uint8."""
        self.prepare(lane)
        self.view.update(self.task.world, lane)
        self.renderer.lighting = self.lighting(lane)
        return self.renderer.render(self.view, self.camera(lane), list(self.markers(lane)))
