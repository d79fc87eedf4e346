"""The frame in a window: ``render_mode="human"``. Needs the extra ``render`` (pygame-ce)."""

from __future__ import annotations

import os
from types import ModuleType

import numpy as np
from numpy.typing import NDArray


def _pygame() -> ModuleType:
    # pygame greets on stdout, which belongs to the program.
    os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
    try:
        import pygame
    except ImportError as error:
        raise ImportError(
            'A window needs pygame-ce: pip install "avalanche-gym[render]". Without it, use render_mode="rgb_array".'
        ) from error
    return pygame


class Window:
    """Shows frames; opens with the first one. Two of them in one program take turns in the same window.

    Args:
        title: of the window.
        fps: frames a second at most; ``show`` waits to keep to it. None never waits.

    Raises:
        ImportError: the extra ``render`` is not installed.

    Attributes:
        is_open: False before the first frame and after the window was closed, by the program or by the user.
    """

    def __init__(self, title: str = "avalanche_gym", fps: float | None = None) -> None:
        self._pygame = _pygame()
        self._title = title
        self._fps = fps
        self._clock = self._pygame.time.Clock()
        self._was_closed = False
        self.is_open = False

    def show(self, frame: NDArray[np.uint8]) -> bool:
        """Show a frame, and answer the window's events.

        Args:
            frame: (height, width, 3) uint8; the window takes its size.

        Returns:
            Whether the window is open still: False once the user has closed it or pressed Escape, and from then on
            frames are ignored.

        Raises:
            RuntimeError: there is no display.
        """
        if self._was_closed:
            return False
        size = (frame.shape[1], frame.shape[0])
        # pygame has one window for the whole program: another Window may have closed or resized it since.
        surface = self._pygame.display.get_surface() if self.is_open and self._pygame.display.get_init() else None
        if surface is None or surface.get_size() != size:
            self._open(size)
            surface = self._pygame.display.get_surface()
        self._pygame.surfarray.blit_array(surface, frame.swapaxes(0, 1))
        self._pygame.display.flip()
        for event in self._pygame.event.get():
            is_escape = event.type == self._pygame.KEYDOWN and event.key == self._pygame.K_ESCAPE
            if event.type == self._pygame.QUIT or is_escape:
                self.close()
                return False
        if self._fps is not None:
            self._clock.tick(self._fps)
        return True

    def _open(self, size: tuple[int, int]) -> None:
        try:
            self._pygame.display.init()
            # Where SDL finds no display, it takes this driver and shows nothing.
            if self._pygame.display.get_driver() == "offscreen" and "SDL_VIDEODRIVER" not in os.environ:
                raise self._pygame.error("there is no display")
            self._pygame.display.set_mode(size)
        except self._pygame.error as error:
            self._pygame.display.quit()
            raise RuntimeError(
                f"No window can be opened: {error}. Run where there is a display, set SDL_VIDEODRIVER=dummy to run "
                'without one, or use render_mode="rgb_array".'
            ) from error
        self._pygame.display.set_caption(self._title)
        self.is_open = True

    def close(self) -> None:
        """Close the window for good; harmless when repeated."""
        if self.is_open:
            self._pygame.display.quit()
        self.is_open = False
        self._was_closed = True

    def __enter__(self) -> Window:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
