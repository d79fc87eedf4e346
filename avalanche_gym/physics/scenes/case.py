"""What a hard case is: a scene, how long it runs, and how far a motion is from the truth."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ..scene import Scene

GRAVITY = 9.81  # [m/s^2] of every scene, unless it says otherwise
EVERY_STEP = 0.0
ONLY_THE_END = math.inf


@dataclass(frozen=True)
class Recording:
    """A motion as any engine may have made it: n samples of all bodies, static ones too; the first is the start."""

    time: NDArray[np.float64]  # (n,) [s]
    position: NDArray[np.float64]  # (n, bodies, 3) [m] of the frame each shape was given in
    orientation: NDArray[np.float64]  # (n, bodies, 4) unit quaternion wxyz
    linear_velocity: NDArray[np.float64]  # (n, bodies, 3) [m/s] of that frame's origin, world frame
    angular_velocity: NDArray[np.float64]  # (n, bodies, 3) [rad/s], world frame
    contact_force: NDArray[np.float64] | None = None
    """(bodies, 3) [N] sum over the contacts of each body in the last step; ``None`` if the engine does not tell."""

    @property
    def finite(self) -> bool:
        return all(bool(np.isfinite(values).all()) for values in (self.position, self.linear_velocity))


class Actuated(Protocol):
    """What a drive may do to a running simulation. ``World`` offers it, and so does the adapter of each peer."""

    def apply_force(self, body: int, force: Any) -> None:
        """Hold a force [N] at the centre of mass through the next call of step."""

    def apply_impulse(self, body: int, impulse: Any) -> None:
        """Change the velocity at once by an impulse [N s] at the centre of mass."""

    def set_state(self, body: int, *, position: Any = None, linear_velocity: Any = None) -> None:
        """Place a kinematic body and set the velocity it keeps."""

    def set_heights(self, body: int, heights: Any, height_rates: Any) -> None:
        """Replace the samples of a height field [m] and their rates [m/s]."""


Drive = Callable[[Actuated, float, float], None]
"""Called before each step with the simulation, the time [s] and the length of the step [s]."""


@dataclass(frozen=True)
class Companion:
    """A second scene that a case is compared with, run with the same settings."""

    scene: Callable[[], Scene]
    time_unit: float = 1.0
    """Its step is this times that of the case, and its motion lasts this times as long."""


@dataclass(frozen=True)
class Unbuilt:
    """A hard case that is not a scene yet, with the reason."""

    number: int
    title: str
    lacking: str


@dataclass(frozen=True)
class HardCase:
    """A scene with a known answer. Tests, benchmarks, viewer and the adapters of other engines all read this.

    ``measure(recording, *recordings_of_companions)`` returns errors by name; the one named ``error`` is the headline.
    Errors are infinite for a motion that is not finite.
    """

    name: str
    number: int  # of the list of hard cases, see docs/hard_cases.md
    title: str
    truth: str  # what the errors are measured against, and where that comes from
    scene: Callable[[], Scene]
    duration: float  # [s], a multiple of 1/30
    measure: Callable[..., dict[str, float]]
    error: str  # key of the headline
    unit: str  # of the headline
    passes_at: float  # the headline error up to which the case counts as survived at a step of 1/240 s
    goal: dict[float, float] = field(default_factory=dict)  # headline error aimed at, by steps a second
    sampling: float = ONLY_THE_END  # [s] between samples, a multiple of 1/30, or EVERY_STEP
    drive: Drive | None = None
    companions: tuple[Companion, ...] = ()
    chaotic: bool = False  # errors are invariants and statistics; no order can be fitted
    order: bool = True  # whether the error is one that falls with the step (a count or a drift from rest is not)
    refusal: str = ""  # "allowed" or "required": an error that names the body, before anything is stepped

    @property
    def theme(self) -> str:
        """The file it is from."""
        builder = self.scene.func if isinstance(self.scene, partial) else self.scene
        return builder.__module__.rpartition(".")[2]

    def errors(self, *recordings: Recording) -> dict[str, float]:
        """What ``measure`` says, or infinite errors if a motion is not finite."""
        if not all(recording.finite for recording in recordings):
            return {self.error: math.inf}
        with np.errstate(all="ignore"):
            return {name: float(value) for name, value in self.measure(*recordings).items()}


def rotation_matrices(quaternions: NDArray[np.float64]) -> NDArray[np.float64]:
    """(..., 3, 3) from unit quaternions wxyz (..., 4)."""
    w, x, y, z = np.moveaxis(np.asarray(quaternions), -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))


def angle_between(first: NDArray[np.float64], second: NDArray[np.float64]) -> NDArray[np.float64]:
    """Angle [rad] of the rotation from one attitude to another, unit quaternions (..., 4).

    Through the sine, since the cosine of a small angle has no digits left below 1e-8.
    """
    w1, v1 = first[..., :1], first[..., 1:]
    w2, v2 = second[..., :1], second[..., 1:]
    vector = w1 * v2 - w2 * v1 - np.cross(v1, v2)
    scalar = np.sum(first * second, axis=-1)
    return 2.0 * np.arctan2(np.linalg.norm(vector, axis=-1), np.abs(scalar))


def about(axis: Any, angle: float) -> tuple[float, float, float, float]:
    """Unit quaternion of a turn by ``angle`` [rad] about a unit axis."""
    s = math.sin(0.5 * angle)
    return (math.cos(0.5 * angle), s * axis[0], s * axis[1], s * axis[2])
