"""Success rate and mean return of a policy.

    python -m training.evaluate runs/ppo/PlanetLanding-v0-easy_1 --episodes 100
    python -m training.evaluate random --env avalanche/PlanetLanding-v0 --level easy

The policy is a run's folder, its ``best``, a checkpoint's ``.zip``, or one of two to compare with: ``zero`` (the action
of all zeros) and ``random`` (uniform actions).
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import gymnasium
import numpy as np
import torch
from stable_baselines3.common.evaluation import evaluate_policy

from avalanche_gym.policies import TrainedPolicy

from . import hyperparameters
from .experiment import EVALUATION_SEED, Experiment, make_env

# Lanes of an evaluation: enough for batched kernels to pay, few enough that every lane plays an episode or two.
MAX_LANES = 64


class Policy(Protocol):
    """What is judged here: Stable-Baselines3's form of a predictor."""

    def predict(
        self,
        observation: Any,
        state: tuple[np.ndarray, ...] | None = None,
        episode_start: np.ndarray | None = None,
        deterministic: bool = True,
    ) -> tuple[np.ndarray, tuple[np.ndarray, ...] | None]: ...


class ZeroPolicy:
    """Does nothing: the action of all zeros."""

    def __init__(self, action_space: gymnasium.Space[Any]) -> None:
        self._action = np.zeros_like(action_space.sample())

    def predict(
        self, observation: Any, state: Any = None, episode_start: Any = None, deterministic: bool = True
    ) -> tuple[np.ndarray, None]:
        return np.stack([self._action] * batch_size(observation)), None


class RandomPolicy:
    """Draws every action uniformly from the action space."""

    def __init__(self, action_space: gymnasium.Space[Any], seed: int) -> None:
        self._action_space = action_space
        self._action_space.seed(seed)

    def predict(
        self, observation: Any, state: Any = None, episode_start: Any = None, deterministic: bool = True
    ) -> tuple[np.ndarray, None]:
        return np.stack([self._action_space.sample() for _ in range(batch_size(observation))]), None


def as_policy(policy: Policy | str, action_space: gymnasium.Space[Any], seed: int) -> Policy:
    """The policy itself, or the one that the name ``"zero"`` or ``"random"`` stands for."""
    if policy == "zero":
        return ZeroPolicy(action_space)
    if policy == "random":
        return RandomPolicy(action_space, seed)
    if isinstance(policy, str):
        raise ValueError(f"No policy is named {policy!r}; the names are 'zero' and 'random'")
    return policy


def batch_size(observation: Any) -> int:
    """Lanes in a batch of observations, which may be a dictionary of arrays."""
    return len(next(iter(observation.values())) if isinstance(observation, dict) else observation)


@dataclass(frozen=True)
class Evaluation:
    """What a policy did in a number of episodes."""

    returns: np.ndarray  # (episodes,) undiscounted
    lengths: np.ndarray  # (episodes,) [steps]
    successes: np.ndarray  # (episodes,) bool; empty if the environment does not say

    @property
    def mean_return(self) -> float:
        return float(self.returns.mean())

    @property
    def success_rate(self) -> float:
        """Fraction of episodes that ended in success; NaN if the environment does not say."""
        return float(self.successes.mean()) if self.successes.size else float("nan")

    def __str__(self) -> str:
        success = f"success rate {self.success_rate:.2f}, " if self.successes.size else ""
        return (
            f"{success}mean return {self.mean_return:.2f} (standard deviation {self.returns.std():.2f}), "
            f"mean length {self.lengths.mean():.0f} steps, {self.returns.size} episodes"
        )


def evaluate(
    policy: Policy | str,
    env_id: str,
    env_kwargs: dict[str, Any],
    *,
    episodes: int = 100,
    seed: int = EVALUATION_SEED,
    deterministic: bool = True,
) -> Evaluation:
    """Play ``episodes`` episodes, spread evenly over the lanes so that short ones are not favoured.

    Args:
        policy: A policy, or the name ``"zero"`` or ``"random"``.
        seed: Lane i starts from seed + i.
        deterministic: Whether a stochastic policy acts by its mean.
    """
    env = make_env(env_id, min(episodes, MAX_LANES), seed, env_kwargs)
    successes: list[bool] = []

    def note_success(locals_: dict[str, Any], _: dict[str, Any]) -> None:
        if locals_["done"] and "is_success" in locals_["info"]:
            successes.append(bool(locals_["info"]["is_success"]))

    # One small network and many short calls: a second thread only waits.
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        returns, lengths = evaluate_policy(
            as_policy(policy, env.action_space, seed),
            env,
            episodes,
            deterministic=deterministic,
            callback=note_success,
            return_episode_rewards=True,
            warn=False,
        )
    finally:
        torch.set_num_threads(threads)
        env.close()
    return Evaluation(np.array(returns), np.array(lengths), np.array(successes, dtype=bool))


def add_policy_arguments(parser: argparse.ArgumentParser) -> None:
    """The arguments by which the scripts are told a policy and an environment."""
    parser.add_argument("policy", help="a run's folder, its best/, a checkpoint's .zip, 'zero' or 'random'")
    parser.add_argument("--env", help="environment id; that of the run unless given")
    parser.add_argument("--level", help="easy, medium or hard; that of the run unless given")
    parser.add_argument("--env-kwargs", nargs="*", default=[], metavar="KEY=VALUE", help="further arguments of the env")
    parser.add_argument("--seed", type=int, default=EVALUATION_SEED)


def read_policy(args: argparse.Namespace) -> tuple[Policy | str, str, dict[str, Any]]:
    """The policy (loaded, or a name), the environment id and its arguments that the user asked for.

    Raises:
        SystemExit: ``zero`` or ``random`` without ``--env``.
    """
    kwargs = hyperparameters.assignments(args.env_kwargs)
    if args.level:
        kwargs["level"] = args.level
    if args.policy in ("zero", "random"):
        if not args.env:
            raise SystemExit(f"The policy {args.policy!r} needs an environment: --env avalanche/PlanetLanding-v0")
        return args.policy, args.env, kwargs
    experiment = Experiment.load(Path(args.policy))
    return TrainedPolicy.load(Path(args.policy)), args.env or experiment.env, experiment.env_kwargs | kwargs


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    add_policy_arguments(parser)
    parser.add_argument("--episodes", type=int, default=100)
    parser.add_argument("--stochastic", action="store_true", help="sample actions instead of taking their mean")
    args = parser.parse_args(arguments)
    policy, env_id, env_kwargs = read_policy(args)
    result = evaluate(
        policy, env_id, env_kwargs, episodes=args.episodes, seed=args.seed, deterministic=not args.stochastic
    )
    print(f"{args.policy} on {env_id} {env_kwargs or ''}: {result}")


if __name__ == "__main__":
    main()
