"""The batched task: one implementation of dynamics, observation and reward for every way to use an environment.

A BatchedTask holds ``num_envs`` lanes: lane i is world i of one physics World, row i of every array here, and generator
i. The single environment is a task of one lane, the vector environment and the Stable-Baselines3 environment are tasks
of many, so a lane gives the same bits whoever drives it. A step is a handful of compiled calls over all lanes.
"""

from __future__ import annotations

import dataclasses
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import physics
from ..physics.jit import entry_point
from .lane_state import LaneState, restore_worlds, world_of_lane
from .picture import Picture

# A control interval holds a whole number of physics steps up to this relative round-off.
INTERVAL_TOLERANCE = 1e-9


@entry_point
def first_bad_row(actions):
    """Index of the first row with a value that is not finite, or -1."""
    for row in range(actions.shape[0]):
        for column in range(actions.shape[1]):
            if not np.isfinite(actions[row, column]):
                return row
    return -1


class BatchedTask(ABC):
    """A task in ``num_envs`` independent lanes.

    Args:
        num_envs: lanes.
        level: "easy", "medium" or "hard".
        options: of the physics; ``None`` takes the task's own. ``time_step`` must divide ``control_interval``.
        ranges: ``{name: (low, high)}`` replaces ranges of the level that the start of an episode is drawn from.

    Attributes:
        observation: (num_envs, n) float32, within the bounds of the task.
        reward: (num_envs,) float64, the sum of ``terms``.
        terms: (num_envs, terms) float64, in the order of ``term_names``.
        terminated: (num_envs,) bool.
        success: (num_envs,) bool.
        failures: {lane: text} of lanes whose physics failed in the last step.
        generators: one numpy Generator a lane, the only source of randomness.
    """

    name: ClassVar[str]
    action_size: ClassVar[int]
    term_names: ClassVar[tuple[str, ...]]
    control_interval: ClassVar[float]  # [s] of one environment step
    default_options: ClassVar[physics.Options]  # of the physics; their time_step divides control_interval
    level_ranges: ClassVar[Mapping[str, Any]]  # dataclass of ranges by level
    draws: ClassVar[int]  # uniform random numbers that start an episode
    lane_dtype: ClassVar[np.dtype[Any]]  # what the task remembers of a lane
    observation_bound: ClassVar[NDArray[np.float32]]  # (n,) observations lie in [-bound, bound]

    def __init__(
        self,
        num_envs: int,
        level: str = "easy",
        options: physics.Options | None = None,
        ranges: Mapping[str, Sequence[float]] | None = None,
    ) -> None:
        if isinstance(num_envs, bool) or not isinstance(num_envs, (int, np.integer)) or num_envs < 1:
            raise ValueError(f"{self.name}(num_envs={num_envs!r}): give a whole number of at least 1.")
        if level not in self.level_ranges:
            raise ValueError(
                f"{self.name}(level={level!r}): allowed are {', '.join(map(repr, self.level_ranges))}. "
                "Choose one of them; 'easy' is the default."
            )
        if options is not None and not isinstance(options, physics.Options):
            raise TypeError(
                f"{self.name}(options={options!r}): give avalanche_gym.physics.Options(...), or None for the default."
            )
        self.num_envs = int(num_envs)
        self.level = level
        self.options = options or self.default_options
        self.num_steps = self._steps_per_interval()
        self.ranges = self._with_ranges(self.level_ranges[level], ranges)
        self.range_record = _as_record(self.ranges)
        self.generators = [np.random.default_rng() for _ in range(self.num_envs)]
        self.observation = np.zeros((self.num_envs, len(self.observation_bound)), np.float32)
        self.reward = np.zeros(self.num_envs)
        self.terms = np.zeros((self.num_envs, len(self.term_names)))
        self.terminated = np.zeros(self.num_envs, np.bool_)
        self.success = np.zeros(self.num_envs, np.bool_)
        self.lanes = np.zeros(self.num_envs, self.lane_dtype)
        self.failures: dict[int, str] = {}
        self.every_lane = np.ones(self.num_envs, np.bool_)
        self.no_actions = np.zeros((self.num_envs, self.action_size))
        self._draws = np.zeros((self.num_envs, self.draws))
        self.world = physics.World(self.build_scene(), num_worlds=self.num_envs, options=self.options)

    # --- What a task defines --------------------------------------------------------------------------------------

    @abstractmethod
    def build_scene(self) -> physics.Scene:
        """The bodies and fields that all lanes start from."""

    @abstractmethod
    def start(self, mask: NDArray[np.bool_], draws: NDArray[np.float64]) -> None:
        """Place the bodies of the chosen lanes for a new episode, from uniform numbers ``draws`` (lanes, draws)."""

    @abstractmethod
    def observe(self, mask: NDArray[np.bool_]) -> None:
        """Write the observation of the chosen lanes at the start of an episode, and what the reward compares with."""

    @abstractmethod
    def advance(self, actions: NDArray[np.float64]) -> None:
        """Act, step the world, then write observation, reward, terms, terminated and success of every lane.

        Raises:
            physics.PhysicsError: after everything was written; failed worlds stand at their last good step.
        """

    @abstractmethod
    def make_picture(self) -> Picture:
        """What draws the lanes of this task."""

    def lane_arrays(self) -> dict[str, NDArray[Any]]:
        """Arrays (num_envs, ...) that decide the future of a lane beside its world."""
        return {"lanes": self.lanes}

    # --- Episodes -------------------------------------------------------------------------------------------------

    def reset(self, mask: NDArray[np.bool_]) -> None:
        """Start a new episode in the lanes of the mask (num_envs,); others keep every bit."""
        for lane in np.flatnonzero(mask):
            self.generators[lane].random(out=self._draws[lane])
        self.world.reset(world=mask)
        self.lanes[mask] = np.zeros((), self.lane_dtype)
        self.start(mask, self._draws)
        self.observe(mask)

    def step(self, actions: ArrayLike) -> None:
        """One control interval of all lanes with actions (num_envs, action_size), clipped to [-1, 1].

        Raises:
            ValueError, TypeError: actions of a wrong shape, or not finite; nothing has changed then.
        """
        checked = self.checked_actions(actions)
        if self.failures:
            self.failures = {}
        try:
            self.advance(checked)
        except physics.PhysicsError as error:
            self.failures = {
                world: f"body {body} in physics step {step} of the control interval: {reason}"
                for world, body, step, reason in error.failures
            }

    def checked_actions(self, actions: ArrayLike) -> NDArray[np.float64]:
        """Actions as float64 (num_envs, action_size)."""
        expected = (self.num_envs, self.action_size)
        try:
            array = np.ascontiguousarray(actions, dtype=np.float64)
        except (TypeError, ValueError):
            raise TypeError(
                f"{self.name}: action {actions!r} is not numeric; give floats in [-1, 1] of shape {self._shape_text()}."
            ) from None
        if array.shape != expected:
            shape = array.shape[1:] if self.num_envs == 1 and array.shape[:1] == (1,) else array.shape
            raise ValueError(
                f"{self.name}: action has shape {shape}; allowed is {self._shape_text()}, floats in [-1, 1]. "
                "Reshape it, or take one from action_space.sample()."
            )
        lane = first_bad_row(array)
        if lane >= 0:
            raise ValueError(
                f"{self.name}: action {array[lane].tolist()} of lane {lane} is not finite; allowed are numbers in "
                "[-1, 1]. Nothing was changed: replace the NaN or infinity and step again."
            )
        return array

    def _shape_text(self) -> str:
        return f"({self.action_size},)" if self.num_envs == 1 else f"({self.num_envs}, {self.action_size})"

    # --- State ----------------------------------------------------------------------------------------------------

    def get_states(self) -> list[LaneState]:
        """The state of each lane: every bit that decides its future, its generator included."""
        arrays = self.world.snapshot().arrays
        return [
            LaneState(
                task=self.name,
                level=self.level,
                world=world_of_lane(arrays, lane, self.num_envs),
                arrays={name: array[lane].copy() for name, array in self.lane_arrays().items()},
                observation=self.observation[lane].copy(),
                generator=dict(self.generators[lane].bit_generator.state),
            )
            for lane in range(self.num_envs)
        ]

    def check_states(self, states: Mapping[int, Any]) -> None:
        """Raise a TypeError or ValueError for what is no state of this task and level."""
        for lane, state in states.items():
            if not 0 <= lane < self.num_envs:
                raise IndexError(f"{self.name}: state of lane {lane}; there are lanes 0 to {self.num_envs - 1}.")
            if not isinstance(state, LaneState) or state.task != self.name:
                given = f"a state of {state.task}" if isinstance(state, LaneState) else f"a {type(state).__name__}"
                raise TypeError(f"{self.name}: state of lane {lane} is {given}; give what get_state() returned here.")
            if state.level != self.level:
                raise ValueError(
                    f"{self.name}: state of lane {lane} belongs to level {state.level!r}, this environment is "
                    f"{self.level!r}; make one with level={state.level!r} to use it."
                )

    def set_states(self, states: Mapping[int, LaneState]) -> None:
        """Put lanes into states that ``get_states`` returned, of this task or of another one of the same kind."""
        self.check_states(states)
        if not states:
            return
        restore_worlds(self.world, {lane: state.world for lane, state in states.items()})
        for lane, state in states.items():
            for name, array in self.lane_arrays().items():
                array[lane] = state.arrays[name]
            self.observation[lane] = state.observation
            self.generators[lane].bit_generator.state = state.generator

    # --- Settings -------------------------------------------------------------------------------------------------

    def _steps_per_interval(self) -> int:
        exact = self.control_interval / self.options.time_step
        steps = round(exact)
        if steps < 1 or abs(exact - steps) > INTERVAL_TOLERANCE * exact:
            raise ValueError(
                f"{self.name}(options=Options(time_step={self.options.time_step!r})): one environment step lasts "
                f"{self.control_interval} s and must hold a whole number of physics steps. "
                f"Give a time_step of {self.control_interval} / n, for example {self.default_options.time_step}."
            )
        return steps

    def _with_ranges(self, level: Any, ranges: Mapping[str, Sequence[float]] | None) -> Any:
        """The level's ranges with the user's in their place."""
        if ranges is None:
            return level
        if not isinstance(ranges, Mapping):
            raise TypeError(f"{self.name}(ranges={ranges!r}): give a dict of name: (low, high), or None.")
        names = [field.name for field in dataclasses.fields(level)]
        for name, value in dict(ranges).items():
            if name not in names:
                raise ValueError(f"{self.name}(ranges={{{name!r}: ...}}): allowed names are {', '.join(names)}.")
            pair = np.asarray(value, dtype=np.float64)
            if pair.shape != (2,) or not np.isfinite(pair).all() or pair[0] > pair[1]:
                raise ValueError(f"{self.name}(ranges={{{name!r}: {value!r}}}): give (low, high), finite, low <= high.")
        return dataclasses.replace(level, **{name: tuple(map(float, value)) for name, value in ranges.items()})


def range_dtype(level_class: Any) -> np.dtype[Any]:
    """Record dtype of a dataclass of ranges: what kernels read."""
    return np.dtype([(field.name, np.float64, 2) for field in dataclasses.fields(level_class)], align=True)


def _as_record(ranges: Any) -> NDArray[Any]:
    """(1,) record of a dataclass of ranges."""
    record = np.zeros(1, range_dtype(type(ranges)))
    for field in dataclasses.fields(ranges):
        record[0][field.name] = getattr(ranges, field.name)
    return record
