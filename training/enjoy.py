"""Watch a policy in a window.

python -m training.enjoy runs/demo --episodes 5
python -m training.enjoy random --env avalanche/PushTerrain-v0 --level easy
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from typing import Any

import gymnasium
import numpy as np

from .evaluate import Policy, add_policy_arguments, as_policy, read_policy


def make_rendered_env(env_id: str, env_kwargs: dict[str, Any], render_mode: str) -> gymnasium.Env[Any, Any]:
    """One environment that draws itself."""
    if env_id.startswith("avalanche/"):
        import avalanche_gym  # noqa: F401  (registers the ids)
    return gymnasium.make(env_id, render_mode=render_mode, **env_kwargs)


def play_episode(policy: Policy, env: gymnasium.Env[Any, Any], seed: int) -> Iterator[tuple[float, dict[str, Any]]]:
    """Play one episode and yield reward and ``info`` after the reset (reward 0) and after every step."""
    observation, info = env.reset(seed=seed)
    yield 0.0, info
    finished = False
    while not finished:
        action, _ = policy.predict(_batch_of_one(observation), deterministic=True)
        observation, reward, terminated, truncated, info = env.step(action[0])
        finished = terminated or truncated
        yield float(reward), info


def _batch_of_one(observation: Any) -> Any:
    if isinstance(observation, dict):
        return {key: value[np.newaxis] for key, value in observation.items()}
    return np.asarray(observation)[np.newaxis]


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    add_policy_arguments(parser)
    parser.add_argument("--episodes", type=int, default=5)
    args = parser.parse_args(arguments)
    policy, env_id, env_kwargs = read_policy(args)
    env = make_rendered_env(env_id, env_kwargs, "human")
    player = as_policy(policy, env.action_space, args.seed)
    for episode in range(args.episodes):
        rewards, infos = zip(*play_episode(player, env, args.seed + episode), strict=True)
        success = f", success: {bool(infos[-1]['is_success'])}" if "is_success" in infos[-1] else ""
        print(f"Episode {episode + 1}: return {sum(rewards):.2f}, {len(rewards) - 1} steps{success}")
    env.close()


if __name__ == "__main__":
    main()
