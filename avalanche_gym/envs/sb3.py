"""The environments as a Stable-Baselines3 VecEnv, natively batched."""

from __future__ import annotations

import time
from collections.abc import Iterable, Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

from .vector import NativeVectorEnv

try:
    from stable_baselines3.common.monitor import Monitor
    from stable_baselines3.common.vec_env import VecEnv
except ImportError as error:  # pragma: no cover
    raise ImportError(
        'avalanche_gym.envs.sb3 needs stable-baselines3, which is not installed: pip install "avalanche-gym[train]".'
    ) from error

Indices = None | int | Iterable[int]


class SB3VecEnv(VecEnv):
    """``num_envs`` lanes of an environment for Stable-Baselines3.

    Ended lanes start again in the same step. Their info holds ``terminal_observation``, ``TimeLimit.truncated`` and
    ``episode`` {"r": return, "l": steps, "t": seconds since this object was made}, as after SB3's Monitor; every info
    holds ``is_success`` and ``reward_terms``.

    Args:
        id: of the environment, "avalanche/PlanetLanding-v0".
        num_envs: lanes.
        kwargs: of the environment: level, options, max_episode_steps ...
    """

    def __init__(self, id: str, num_envs: int, **kwargs: Any) -> None:
        if not isinstance(id, str) or not id.split(":")[-1].startswith("avalanche/"):
            raise ValueError(
                f"SB3VecEnv(id={id!r}): allowed are ids of this package, such as 'avalanche/PlanetLanding-v0'; "
                "for others use stable_baselines3.common.env_util.make_vec_env."
            )
        env = gymnasium.make_vec(
            id,
            num_envs=num_envs,
            vectorization_mode="vector_entry_point",
            autoreset_mode=AutoresetMode.SAME_STEP,
            **kwargs,
        )
        assert isinstance(env, NativeVectorEnv)
        self.env = env
        self.lanes = [env.lane(index) for index in range(num_envs)]
        self._own: list[dict[str, Any]] = [{} for _ in range(num_envs)]  # what set_attr gave to lanes
        self._actions: NDArray[Any] = np.zeros(0)
        self._returns = np.zeros(num_envs)
        self._lengths = np.zeros(num_envs, np.int64)
        self._made = time.perf_counter()
        super().__init__(num_envs, env.single_observation_space, env.single_action_space)

    def reset(self) -> NDArray[np.float32]:
        """Start new episodes with the seeds and options given before, if any."""
        seeds = None if all(seed is None for seed in self._seeds) else list(self._seeds)
        observations, _ = self.env.reset(seed=seeds)
        for lane, options in zip(self.lanes, self._options, strict=True):
            if options:
                observations[lane.index], _ = lane.reset(options=options)
        self._reset_seeds()
        self._reset_options()
        self.reset_infos = [{} for _ in range(self.num_envs)]
        return observations

    def step_async(self, actions: NDArray[Any]) -> None:
        self._actions = actions

    def step_wait(self) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.bool_], list[dict[str, Any]]]:
        fresh = self.env.elapsed == 0  # also after env_method("reset")
        self._returns[fresh] = 0.0
        self._lengths[fresh] = 0
        observations, rewards, terminated, truncated, batch = self.env.step(self._actions)
        task = self.env.task
        self._returns += rewards
        self._lengths += 1
        ended = terminated | truncated
        # The task keeps terms and success of the step until the next one, also of lanes that started again.
        names = task.term_names
        infos: list[dict[str, Any]] = [
            {"is_success": success, "reward_terms": dict(zip(names, row, strict=True)), "TimeLimit.truncated": False}
            for success, row in zip(task.success.tolist(), task.terms.tolist(), strict=True)
        ]
        if ended.any():
            seconds = round(time.perf_counter() - self._made, 6)
            for lane in np.flatnonzero(ended).tolist():
                info = infos[lane]
                info["terminal_observation"] = batch["final_obs"][lane]
                info["TimeLimit.truncated"] = bool(truncated[lane] and not terminated[lane])
                info["episode"] = {"r": float(self._returns[lane]), "l": int(self._lengths[lane]), "t": seconds}
                if lane in task.failures:
                    info["physics_error"] = task.failures[lane]
                self.reset_infos[lane] = {}
        return observations, rewards.astype(np.float32), ended, infos

    def close(self) -> None:
        self.env.close()

    # --- Attributes and methods of lanes --------------------------------------------------------------------------

    def _chosen(self, indices: Indices) -> list[int]:
        return list(self._get_indices(indices))

    def get_attr(self, attr_name: str, indices: Indices = None) -> list[Any]:
        """An attribute of each lane: what set_attr gave it, or else that of the environment."""
        return [
            self._own[index][attr_name] if attr_name in self._own[index] else getattr(self.lanes[index], attr_name)
            for index in self._chosen(indices)
        ]

    def set_attr(self, attr_name: str, value: Any, indices: Indices = None) -> None:
        """Give lanes an attribute that get_attr returns; it does not change the task."""
        for index in self._chosen(indices):
            self._own[index][attr_name] = value

    def env_method(self, method_name: str, *args: Any, indices: Indices = None, **kwargs: Any) -> list[Any]:
        """Call a method of each lane: reset, get_state, set_state, render ..."""
        return [getattr(self.lanes[index], method_name)(*args, **kwargs) for index in self._chosen(indices)]

    def env_is_wrapped(
        self, wrapper_class: type[gymnasium.Wrapper[Any, Any, Any, Any]], indices: Indices = None
    ) -> list[bool]:
        """No lane is wrapped; ``Monitor`` is answered with True, since its statistics are here."""
        return [wrapper_class is Monitor for _ in self._chosen(indices)]

    def get_images(self) -> Sequence[NDArray[np.uint8] | None]:
        """A frame of each lane."""
        return [lane.render() for lane in self.lanes]
