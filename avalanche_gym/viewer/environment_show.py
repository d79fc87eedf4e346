"""The environments as shows: a policy, chance or nothing acts in them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Protocol

import gymnasium
import numpy as np
from numpy.typing import NDArray

from ..envs.base import BatchedTask
from ..physics.world import World
from ..rendering import Camera, Lighting, Marker
from .show import Show

NAMESPACE = "avalanche"
ENDED_FOR = 1.2  # [s] that the end of an episode is shown before the next begins


class Policy(Protocol):
    """What can act: the form of a Stable-Baselines3 model, which takes batches."""

    def predict(self, observation: Any, *, deterministic: bool = True) -> tuple[NDArray[Any], Any]: ...


def environment_ids() -> list[str]:
    """The ids of all registered environments of the package."""
    return [id for id, spec in gymnasium.registry.items() if spec.namespace == NAMESPACE]


class EnvironmentShow(Show):
    """An environment of the package.

    Args:
        id: of the environment.
        level: of difficulty; its own default if empty.
        policy: that acts at first; without one, chance does.
        seed: of the first episode.
    """

    camera_moves = True

    def __init__(self, id: str, level: str = "", policy: Policy | None = None, seed: int = 0) -> None:
        settings: Mapping[str, Any] = {"level": level} if level else {}
        self._env = gymnasium.make(id, disable_env_checker=True, **settings)
        task = self._env.unwrapped.task  # type: ignore[attr-defined]
        assert isinstance(task, BatchedTask)
        self._task = task
        self.name = id
        self.title = task.name
        self.description = _summary(type(self._env.unwrapped).__doc__ or "")
        self.level, self.levels = task.level, tuple(task.level_ranges)
        self._policy = policy
        self.drivers = ("random", "zero") if policy is None else ("policy", "random", "zero")
        self.driver = self.drivers[0]
        self._env.action_space.seed(seed)
        self._begin(seed)
        self._picture = task.make_picture()
        self.looks = self._picture.view.looks

    def _begin(self, seed: int | None = None) -> None:
        self._observation, _ = self._env.reset(seed=seed)
        self._return, self._length, self._ended_for, self._outcome = 0.0, 0, -1.0, ""
        self.energy_change = 0.0

    @property
    def world(self) -> World:
        return self._task.world

    def advance(self, speed: float) -> float:
        interval = self._task.control_interval
        if self._ended_for >= 0.0:
            # Counted as it is watched, so that the result can be read in fast motion too.
            self._ended_for += interval / speed
            if self._ended_for > ENDED_FOR:
                self._begin()
            return interval
        self._step()
        return interval

    def single_step(self) -> None:
        if self._ended_for >= 0.0:
            self._begin()
        else:
            self._step()

    def _step(self) -> None:
        before = self._energy()
        self._observation, reward, terminated, truncated, info = self._env.step(self._action())
        self.energy_change += self._energy() - before
        self._return += float(reward)
        self._length += 1
        if terminated or truncated:
            self._ended_for = 0.0
            failed = "time is up" if truncated else "failed"
            self._outcome = "success" if info["is_success"] else info.get("physics_error", failed)

    def _energy(self) -> float:
        return float(self.world.kinetic_energy()[0] + self.world.potential_energy()[0])

    def _action(self) -> Any:
        if self.driver == "policy" and self._policy is not None:
            observation = self._observation
            if isinstance(observation, dict):
                batch: Any = {key: value[np.newaxis] for key, value in observation.items()}
            else:
                batch = np.asarray(observation)[np.newaxis]
            return self._policy.predict(batch, deterministic=True)[0][0]
        action = self._env.action_space.sample()
        return action if self.driver == "random" else np.zeros_like(action)

    def reset(self) -> None:
        self._begin()

    def drive_with(self, driver: str) -> None:
        if driver not in self.drivers:
            raise ValueError(f"{self.title}: driver {driver!r}; allowed are {', '.join(self.drivers)}.")
        self.driver = driver

    def camera(self) -> Camera:
        return self._picture.camera(0)

    def lighting(self) -> Lighting:
        return self._picture.lighting(0)

    def markers(self) -> Sequence[Marker]:
        return self._picture.markers(0)

    def counters(self) -> dict[str, Any]:
        return {"episode step": self._length, "return": f"{self._return:.2f}", "outcome": self._outcome or "running"}


def _summary(page: str) -> str:
    """The first two sentences below "Description"."""
    text = " ".join(page.partition("## Description")[2].partition("##")[0].split())
    return ". ".join(text.split(". ")[:2]).removesuffix(".") + "." if text else ""
