"""Our engine, with its default options."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

import avalanche_gym
from avalanche_gym import physics
from avalanche_gym.physics.scenes import HardCase
from avalanche_gym.physics.scenes.recording import contact_forces, joined

from .engine import Engine, Simulation, State


class Ours(Simulation):
    """A World of one."""

    def __init__(self, case: HardCase, scene: physics.Scene, step: float, tolerance: float | None = None) -> None:
        default = physics.Options().tolerance
        options = physics.Options(time_step=step, tolerance=default if tolerance is None else tolerance)
        self.world = physics.World(scene, options=options)
        self.reports: list[physics.StepReport] = []

    def step(self, count: int) -> None:
        self.world.step(count)
        self.reports.append(self.world.report())

    def state(self) -> State:
        w = self.world
        arrays = (w.position, w.orientation, w.linear_velocity, w.angular_velocity)
        return tuple(array[0].copy() for array in arrays)  # type: ignore[return-value]

    def report(self) -> dict[str, float]:
        whole = joined(self.reports)
        return {"residual": float(whole.residual[0]), "overlap": float(whole.penetration[0])}

    def contact_force(self) -> np.ndarray:
        return contact_forces(self.world)

    def apply_force(self, body: int, force: Any) -> None:
        self.world.apply_force(body, force)

    def apply_impulse(self, body: int, impulse: Any) -> None:
        self.world.apply_impulse(body, impulse)

    def set_state(self, body: int, *, position: Any = None, linear_velocity: Any = None) -> None:
        self.world.set_state(body, position=position, linear_velocity=linear_velocity)

    def set_heights(self, body: int, heights: Any, height_rates: Any) -> None:
        self.world.set_heights(body, heights, height_rates)


def engine(tolerance: float | None = None) -> Engine:
    """The default, or another tolerance of the contact solver."""
    name = "avalanche" if tolerance is None else f"avalanche {tolerance:.0e}"
    settings = "Options(time_step)" if tolerance is None else f"Options(time_step, tolerance={tolerance:g})"
    return Engine(name, avalanche_gym.__version__, settings, 240, partial(Ours, tolerance=tolerance))
