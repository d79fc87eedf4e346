"""The vector environment: many lanes of a task in a few kernel calls a step, with Gymnasium's three autoreset modes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar

import gymnasium
import numpy as np
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import ArrayLike, NDArray

from .. import physics
from .base import BatchedTask
from .lane import Lane
from .lane_state import LaneState
from .picture import RENDER_MODES, Picture, check_render_mode, open_window
from .single import checked_reset_options, checked_states, spaces_of

if TYPE_CHECKING:
    from ..rendering import Window

Mask = NDArray[np.bool_]


class NativeVectorEnv(VectorEnv):
    """``num_envs`` lanes of a task; lane i has the same bits as the single environment with the same seed.

    Args:
        num_envs: lanes.
        level: "easy", "medium" or "hard".
        render_mode: ``None``, "rgb_array", or "human": all lanes side by side in one window.
        options: of the physics; see the single environment.
        ranges: of the start of an episode; see the single environment.
        max_episode_steps: after so many steps an episode is truncated; ``None`` takes the task's own number.
        autoreset_mode: when an ended lane starts again: in the next step, in the same step, or by the user.
    """

    # Closing an environment that could not be made finds no window.
    _window: Window | None = None

    task_class: ClassVar[type[BatchedTask]]
    default_episode_steps: ClassVar[int]

    def __init__(
        self,
        num_envs: int = 1,
        level: str = "easy",
        render_mode: str | None = None,
        options: physics.Options | None = None,
        ranges: Mapping[str, Sequence[float]] | None = None,
        max_episode_steps: int | None = None,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        **settings: Any,
    ) -> None:
        name = self.task_class.name
        check_render_mode(name, render_mode)
        try:
            self.autoreset_mode = AutoresetMode(autoreset_mode)
        except ValueError:
            raise ValueError(
                f"{name}(autoreset_mode={autoreset_mode!r}): allowed are "
                f"{', '.join(map(str, AutoresetMode))}; import AutoresetMode from gymnasium.vector."
            ) from None
        limit = self.default_episode_steps if max_episode_steps is None else max_episode_steps
        if isinstance(limit, bool) or not isinstance(limit, (int, np.integer)) or limit < 1:
            raise ValueError(f"{name}(max_episode_steps={limit!r}): give a whole number of at least 1, or None.")
        self.task = self.task_class(num_envs, level, options, ranges, **settings)
        self.num_envs = self.task.num_envs
        self.level = level
        self.render_mode = render_mode
        self.max_episode_steps = int(limit)
        self.metadata = {
            "render_modes": list(RENDER_MODES),
            "render_fps": round(1.0 / self.task.control_interval),
            "autoreset_mode": self.autoreset_mode,
        }
        self.single_observation_space, self.single_action_space = spaces_of(self.task)
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self.elapsed = np.zeros(self.num_envs, np.int64)  # steps of the running episode
        self._ended = np.zeros(self.num_envs, np.bool_)  # lanes whose episode is over and not started again
        self._seeds: list[int | None] = [None] * self.num_envs
        self._picture: Picture | None = None
        self._window = open_window(self.task, render_mode)
        self._started = False

    # --- Starting -------------------------------------------------------------------------------------------------

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Start new episodes.

        Args:
            seed: s seeds lane i with s + i; a list gives each lane its own; ``None`` goes on with the generators.
            options: "reset_mask", (num_envs,) bool: only these lanes; "state": a state, or a list of one a lane, to
                start from instead of a drawn one.
        """
        checked = checked_reset_options(self.task, options)
        mask = self._checked_mask(checked["reset_mask"]) if "reset_mask" in checked else self.task.every_lane.copy()
        if "reset_mask" in checked and not self._started:
            raise gymnasium.error.ResetNeeded(f"{self.task.name}: call reset() for all lanes before a reset_mask.")
        states = checked_states(self.task, checked["state"], mask) if checked.get("state") is not None else None
        self._seed(seed, mask)
        if states is None:
            self.task.reset(mask)
        else:
            self.task.set_states(states)
        self._started = True
        self.elapsed[mask] = 0
        self._ended[mask] = False
        self._show()
        return self.task.observation.copy(), {}

    def _seed(self, seed: int | Sequence[int | None] | None, mask: Mask) -> None:
        if seed is None:
            seeds: list[int | None] = [None] * self.num_envs
        elif isinstance(seed, (int, np.integer)):
            seeds = [int(seed) + lane for lane in range(self.num_envs)]
        elif isinstance(seed, (list, tuple, np.ndarray)):
            seeds = [int(one) if isinstance(one, np.integer) else one for one in seed]
            self._check_length("seed", seeds)
        else:
            raise TypeError(f"{self.task.name}: reset(seed={seed!r}): give an int, a list of one a lane, or None.")
        fresh = {
            lane: seeding.np_random(seeds[lane])
            for lane in np.flatnonzero(mask).tolist()
            if seeds[lane] is not None or self._seeds[lane] is None
        }
        for lane, (generator, number) in fresh.items():
            self.task.generators[lane], self._seeds[lane] = generator, number

    def _check_length(self, what: str, values: Sequence[Any]) -> None:
        if len(values) != self.num_envs:
            raise ValueError(
                f"{self.task.name}: reset({what}) has {len(values)} entries for {self.num_envs} lanes; give one a lane."
            )

    def _checked_mask(self, mask: Any) -> Mask:
        if not isinstance(mask, np.ndarray) or mask.dtype != np.bool_ or mask.shape != (self.num_envs,):
            raise ValueError(
                f'{self.task.name}: reset(options={{"reset_mask": {mask!r}}}): give a numpy array of bool, shape '
                f"({self.num_envs},), True for the lanes to reset."
            )
        if not mask.any():
            raise ValueError(f"{self.task.name}: the reset_mask chooses no lane; set at least one to True.")
        return mask.copy()

    # --- Stepping -------------------------------------------------------------------------------------------------

    def step(self, actions: ArrayLike) -> tuple[NDArray[np.float32], NDArray[np.float64], Mask, Mask, dict[str, Any]]:
        """One control interval of every lane with actions (num_envs, n)."""
        if not self._started:
            raise gymnasium.error.ResetNeeded(f"{self.task.name}: step() before reset(); call reset() first.")
        waiting = self._ended
        if self.autoreset_mode is AutoresetMode.DISABLED and waiting.any():
            raise ValueError(
                f"{self.task.name}: the episodes of lanes {np.flatnonzero(waiting).tolist()} have ended and "
                'autoreset_mode is DISABLED; call reset(options={"reset_mask": mask}) with these lanes True first.'
            )
        task = self.task
        task.step(actions)
        self.elapsed += 1
        truncated = self.elapsed >= self.max_episode_steps
        for lane in task.failures:
            truncated[lane] = True
        terminated, reward = task.terminated.copy(), task.reward.copy()
        infos: dict[str, Any] = {}
        if self.autoreset_mode is AutoresetMode.SAME_STEP:
            ended = terminated | truncated
            infos = self._infos(~ended)
            if ended.any():
                final: NDArray[Any] = np.full(self.num_envs, None, dtype=object)
                for lane in np.flatnonzero(ended).tolist():
                    final[lane] = task.observation[lane].copy()
                infos["final_obs"] = final
                infos["_final_obs"] = ended.copy()
                infos["final_info"] = self._infos(ended)
                infos["_final_info"] = ended.copy()
                self._restart(ended)
        else:
            if waiting.any():
                # These lanes were stepped with the rest; what came of it is overwritten by their new episode.
                self._restart(waiting)
                terminated[waiting] = truncated[waiting] = False
                reward[waiting] = 0.0
            infos = self._infos(~waiting)
            self._ended = terminated | truncated
        self._show()
        return task.observation.copy(), reward, terminated, truncated, infos

    def _restart(self, mask: Mask) -> None:
        self.task.reset(mask)
        self.elapsed[mask] = 0

    def _infos(self, mask: Mask) -> dict[str, Any]:
        """What the step tells about the lanes of the mask, as Gymnasium batches it: arrays and masks."""
        task = self.task
        terms: dict[str, Any] = {}
        for column, name in enumerate(task.term_names):
            terms[name] = np.where(mask, task.terms[:, column], 0.0)
            terms[f"_{name}"] = mask.copy()
        infos: dict[str, Any] = {
            "is_success": task.success & mask,
            "_is_success": mask.copy(),
            "reward_terms": terms,
            "_reward_terms": mask.copy(),
        }
        failed = [lane for lane in task.failures if mask[lane]]
        if failed:
            texts: NDArray[Any] = np.full(self.num_envs, None, dtype=object)
            texts[failed] = [task.failures[lane] for lane in failed]
            infos["physics_error"] = texts
            infos["_physics_error"] = np.isin(np.arange(self.num_envs), failed)
        return infos

    # --- State, attributes, pictures ------------------------------------------------------------------------------

    def get_state(self) -> list[LaneState]:
        """The state of every lane; see the single environment."""
        return [
            state.with_elapsed(int(self.elapsed[lane]), bool(self._ended[lane]))
            for lane, state in enumerate(self.task.get_states())
        ]

    def set_state(self, states: Sequence[LaneState]) -> None:
        """Continue every lane from a state that ``get_state`` returned, its count of steps included."""
        self._check_length("state", states)
        self.set_lane_states(dict(enumerate(states)))
        self._started = True

    def set_lane_states(self, states: Mapping[int, LaneState]) -> None:
        """Continue some lanes from given states."""
        self.task.set_states(states)
        for lane, state in states.items():
            self.elapsed[lane] = state.elapsed
            self._ended[lane] = state.ended

    @property  # type: ignore[misc]
    def np_random(self) -> tuple[np.random.Generator, ...]:  # type: ignore[override]
        """The generator of each lane."""
        return tuple(self.task.generators)

    @property
    def np_random_seed(self) -> tuple[int | None, ...]:  # type: ignore[override]
        """The seed of each lane."""
        return tuple(self._seeds)

    def lane(self, index: int) -> Lane:
        """One lane, seen as an environment of its own."""
        return Lane(self, index)

    def call(self, name: str, *args: Any, **kwargs: Any) -> tuple[Any, ...]:
        """Call a method of every lane, or read an attribute of it."""
        found = [getattr(self.lane(index), name) for index in range(self.num_envs)]
        return tuple(value(*args, **kwargs) if callable(value) else value for value in found)

    def get_attr(self, name: str) -> tuple[Any, ...]:
        """An attribute of every lane."""
        return self.call(name)

    def frame(self, lane: int) -> NDArray[np.uint8]:
        """A picture of one lane, (height, width, 3)."""
        if self._picture is None:
            self._picture = self.task.make_picture()
        return self._picture.frame(lane)

    def _show(self) -> None:
        if self._window is not None:
            from ..rendering import tile  # here, since environments that draw nothing need no renderer

            self._window.show(tile([self.frame(lane) for lane in range(self.num_envs)]))

    def render(self) -> tuple[NDArray[np.uint8], ...] | None:
        """A frame of each lane in mode "rgb_array"; ``None`` without a mode, and in mode "human", whose window is
        brought up to date by ``reset`` and ``step``.
        """
        if self.render_mode is None:
            gymnasium.logger.warn(
                f'render() without a render_mode; give one: gymnasium.make_vec("avalanche/{self.task.name}-v0", '
                'render_mode="rgb_array").'
            )
        if self.render_mode != "rgb_array":
            return None
        return tuple(self.frame(lane) for lane in range(self.num_envs))

    def close_extras(self, **kwargs: Any) -> None:
        """Close the window, and let go of the renderer."""
        self._picture = None
        if self._window is not None:
            self._window.close()
