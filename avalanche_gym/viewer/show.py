"""A show: something the viewer can run and draw, whether a demo or an environment."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any, ClassVar

from ..physics.world import World
from ..rendering import BodyLooks, Camera, Lighting, Marker


class Show(ABC):
    """What the viewer runs: one world, how it goes on, and how it looks.

    Attributes:
        name: that the page and the command line choose it by.
        title: for people.
        description: one sentence.
        looks: of the bodies.
        energy_change: [J] that stepping alone added since the last reset; bodies that come and go, and clicks, do not
            count.
        level, levels: of difficulty; empty if there is none.
        driver, drivers: what acts in an environment; empty if nothing does.
        camera_moves: whether ``camera`` follows something.
    """

    name: str
    title: str
    description: str
    looks: BodyLooks
    energy_change: float = 0.0
    level: str = ""
    levels: tuple[str, ...] = ()
    driver: str = ""
    drivers: tuple[str, ...] = ()
    camera_moves: ClassVar[bool] = False

    @property
    @abstractmethod
    def world(self) -> World:
        """The running world; another object after some changes."""

    @abstractmethod
    def advance(self, speed: float) -> float:
        """Go on to the next frame, and return how much time [s] that was in the world.

        Args:
            speed: at which the world is watched, 1 for real time; slow motion wants shorter frames.
        """

    @abstractmethod
    def single_step(self) -> None:
        """Go on by as little as there is."""

    @abstractmethod
    def reset(self) -> None:
        """Begin anew."""

    @abstractmethod
    def camera(self) -> Camera:
        """From where to look now."""

    @abstractmethod
    def lighting(self) -> Lighting:
        """Sun and sky now."""

    def markers(self) -> Sequence[Marker]:
        """Translucent things to be drawn in this frame."""
        return ()

    def drive_with(self, driver: str) -> None:
        """Let one of ``drivers`` act."""
        raise ValueError(f"{self.title} has no driver to choose; it was given {driver!r}.")

    @property
    def point_gravity(self) -> bool | None:
        """Whether gravity pulls towards a point; None if that cannot be switched."""
        return None

    def set_point_gravity(self, on: bool) -> None:
        """Pull towards a point instead of down, or down again."""
        raise ValueError(f"{self.title} has one gravity only.")

    def counters(self) -> dict[str, Any]:
        """What else there is to tell; short texts by name."""
        return {}
