"""What every engine looks like to the report: a scene becomes a simulation that steps, is read and is acted on."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from avalanche_gym.physics import PointGravity, Scene, UniformGravity
from avalanche_gym.physics.scenes import HardCase
from avalanche_gym.physics.scenes.case import rotation_matrices

State = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]


class Unsupported(Exception):
    """The engine cannot be given this scene; the text says why."""


class Simulation(ABC):
    """One scene running in one engine. Also an ``Actuated`` of physics.scenes."""

    @abstractmethod
    def step(self, count: int) -> None:
        """Advance, by the engine's own loop where it has one."""

    @abstractmethod
    def state(self) -> State:
        """Position [m], orientation wxyz, velocity [m/s], angular velocity [rad/s] of all bodies, world frame.

        Of the frames their shapes were given in; copies, each (bodies, 3 | 4).
        """

    def report(self) -> dict[str, float]:
        """What the engine tells about its own error, since the start."""
        return {}

    def contact_force(self) -> NDArray[np.float64] | None:
        """(bodies, 3) [N] of the last step, if it tells."""
        return None

    def apply_force(self, body: int, force: Any) -> None:
        raise Unsupported("forces while running")

    def apply_impulse(self, body: int, impulse: Any) -> None:
        raise Unsupported("impulses while running")

    def set_state(self, body: int, *, position: Any = None, linear_velocity: Any = None) -> None:
        raise Unsupported("bodies moved by the user")

    def set_heights(self, body: int, heights: Any, height_rates: Any) -> None:
        raise Unsupported("ground that moves")

    def close(self) -> None:  # noqa: B027, most hold nothing
        """Give back what the engine holds."""


@dataclass(frozen=True)
class Engine:
    """An engine with one choice of settings."""

    name: str  # in the data and the plots
    version: str
    settings: str  # one line a reader can set it up by
    default_rate: int  # [steps/s] that a user gets who asks for nothing, to the nearest rung of the ladder
    build: Callable[[HardCase, Scene, float], Simulation]  # case, scene, step [s]; Unsupported if it cannot
    suits: Callable[[HardCase], bool] = lambda case: True  # whether this choice is meant for the case


def gravity(scene: Scene) -> NDArray[np.float64]:
    """[m/s^2] sum of the uniform fields."""
    return np.sum([f.acceleration for f in scene.fields if isinstance(f, UniformGravity)] or [np.zeros(3)], axis=0)


def attractors(scene: Scene) -> list[PointGravity]:
    return [f for f in scene.fields if isinstance(f, PointGravity)]


def principal(body: Any) -> NDArray[np.float64]:
    """(3,) [kg m^2]; peers get inertias that are diagonal in the frame of the shape."""
    inertia = np.asarray(body.inertia)
    off = np.abs(inertia - np.diag(np.diag(inertia))).max()
    if off > 1e-9 * np.abs(inertia).max():
        raise Unsupported("an inertia that is not diagonal in the frame of the shape")
    return np.diag(inertia).copy()


def from_center(orientation: NDArray[np.float64], center: NDArray[np.float64]) -> NDArray[np.float64]:
    """(bodies, 3) [m] from the mass centre of each body to the origin of its frame, world frame."""
    return -np.einsum("bij,bj->bi", rotation_matrices(orientation), center)
