"""The single environment: a batched task of one lane as a gymnasium.Env."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from .. import physics
from .base import BatchedTask
from .lane_state import LaneState
from .picture import RENDER_MODES, Picture, check_render_mode, open_window

Observation = NDArray[np.float32]


def spaces_of(task: BatchedTask) -> tuple[spaces.Box, spaces.Box]:
    """Observation and action space of one lane."""
    bound = task.observation_bound
    return spaces.Box(-bound, bound, dtype=np.float32), spaces.Box(-1.0, 1.0, (task.action_size,), np.float32)


class SingleEnv(gymnasium.Env[Observation, NDArray[np.float32]]):
    """One lane of a task; subclasses name the task and describe it."""

    task_class: ClassVar[type[BatchedTask]]
    metadata: dict[str, Any] = {"render_modes": list(RENDER_MODES)}

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        fps = round(1.0 / cls.task_class.control_interval)
        cls.metadata = {"render_modes": list(RENDER_MODES), "render_fps": fps}

    def __init__(
        self,
        level: str = "easy",
        render_mode: str | None = None,
        options: physics.Options | None = None,
        ranges: Mapping[str, Sequence[float]] | None = None,
        **settings: Any,
    ) -> None:
        check_render_mode(self.task_class.name, render_mode)
        self.task = self.task_class(1, level, options, ranges, **settings)
        self.level = level
        self.render_mode = render_mode
        self.observation_space, self.action_space = spaces_of(self.task)  # type: ignore[assignment]
        self._picture: Picture | None = None
        self._window = open_window(self.task, render_mode)
        self._started = False

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Start an episode; ``options={"state": get_state()}`` starts it from that state."""
        state = checked_reset_options(self.task, options).get("state")
        states = None if state is None else checked_states(self.task, state, self.task.every_lane)
        super().reset(seed=seed)
        self.task.generators[0] = self.np_random
        if states is None:
            self.task.reset(self.task.every_lane)
        else:
            self.task.set_states(states)
        self._started = True
        self._show()
        return self.task.observation[0].copy(), {}

    def step(self, action: NDArray[np.float32]) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """One control interval; see the class for what comes back."""
        if not self._started:
            raise gymnasium.error.ResetNeeded(f"{self.task.name}: step() before reset(); call reset() first.")
        task = self.task
        task.step(action[None] if isinstance(action, np.ndarray) else [action])
        info: dict[str, Any] = {
            "is_success": bool(task.success[0]),
            "reward_terms": dict(zip(task.term_names, task.terms[0].tolist(), strict=True)),
        }
        if task.failures:
            info["physics_error"] = task.failures[0]
        self._show()
        return (
            task.observation[0].copy(),
            float(task.reward[0]),
            bool(task.terminated[0]),
            bool(task.failures),
            info,
        )

    def get_state(self) -> LaneState:
        """Every bit that decides the future, the random numbers included; what wrappers count is theirs."""
        return self.task.get_states()[0]

    def set_state(self, state: LaneState) -> None:
        """Continue from a state that ``get_state`` returned."""
        self.task.set_states({0: state})
        self._started = True

    def render(self) -> NDArray[np.uint8] | None:
        """The frame (height, width, 3) in mode "rgb_array"; ``None`` without a mode, and in mode "human", whose window
        is brought up to date by ``reset`` and ``step``.
        """
        if self.render_mode is None:
            gymnasium.logger.warn(
                f'render() without a render_mode; give one: gymnasium.make("avalanche/{self.task.name}-v0", '
                'render_mode="rgb_array").'
            )
        return self._frame() if self.render_mode == "rgb_array" else None

    def _frame(self) -> NDArray[np.uint8]:
        if self._picture is None:
            self._picture = self.task.make_picture()
        return self._picture.frame(0)

    def _show(self) -> None:
        if self._window is not None:
            self._window.show(self._frame())

    def close(self) -> None:
        """Close the window, and let go of the renderer."""
        self._picture = None
        if self._window is not None:
            self._window.close()


def checked_reset_options(task: BatchedTask, options: dict[str, Any] | None) -> dict[str, Any]:
    """The options of reset, or a ValueError that names the unknown one."""
    for name in options or {}:
        if name not in ("state", "reset_mask"):
            raise ValueError(
                f'{task.name}: reset(options={{{name!r}: ...}}): allowed are "state", which get_state() returned, and, '
                'in vector environments, "reset_mask".'
            )
    return dict(options or {})


def checked_states(task: BatchedTask, state: Any, mask: NDArray[np.bool_]) -> dict[int, LaneState]:
    """The option "state" of reset by lane of the mask: one state for all of them, or one for each of the task."""
    if not isinstance(state, (LaneState, list, tuple)):
        raise TypeError(
            f'{task.name}: reset(options={{"state": ...}}) is a {type(state).__name__}; give what get_state() '
            "returned, or one state of it for all lanes."
        )
    states = [state] * task.num_envs if isinstance(state, LaneState) else list(state)
    if len(states) != task.num_envs:
        raise ValueError(
            f"{task.name}: reset(state) has {len(states)} entries for {task.num_envs} lanes; give one a lane."
        )
    chosen = {int(lane): states[lane] for lane in np.flatnonzero(mask)}
    task.check_states(chosen)
    return chosen
