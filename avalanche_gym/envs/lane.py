"""One lane of a vector environment, for callers that ask for single environments."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .lane_state import LaneState

if TYPE_CHECKING:
    from .vector import NativeVectorEnv


class Lane:
    """Looks like the single environment where that makes sense; all else is read from the vector environment.

    It can't be stepped: lanes step together.
    """

    def __init__(self, env: NativeVectorEnv, index: int) -> None:
        self._env = env
        self.index = index

    def __getattr__(self, name: str) -> Any:
        if name == "_env":  # not there yet, while a copy is made
            raise AttributeError(name)
        return getattr(self._env, name)

    @property
    def unwrapped(self) -> Lane:
        return self

    @property
    def observation_space(self) -> Any:
        return self._env.single_observation_space

    @property
    def action_space(self) -> Any:
        return self._env.single_action_space

    @property
    def np_random(self) -> np.random.Generator:
        return self._env.task.generators[self.index]

    @property
    def np_random_seed(self) -> int | None:
        return self._env.np_random_seed[self.index]

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Start a new episode in this lane only."""
        mask = np.zeros(self._env.num_envs, np.bool_)
        mask[self.index] = True
        given = None if seed is None else [seed] * self._env.num_envs
        rows, info = self._env.reset(seed=given, options={**(options or {}), "reset_mask": mask})
        return rows[self.index], info

    def step(self, action: Any) -> Any:
        raise AttributeError("a lane can't be stepped alone; step the vector environment.")

    def get_state(self) -> LaneState:
        return self._env.get_state()[self.index]

    def set_state(self, state: LaneState) -> None:
        self._env.set_lane_states({self.index: state})

    def render(self) -> Any:
        return None if self._env.render_mode is None else self._env.frame(self.index)
