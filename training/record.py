"""Record a policy as a video (the ending of the file's name tells the format: .mp4 or .gif).

python -m training.record runs/demo --episodes 3 --output landing.mp4
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import imageio.v2 as imageio

from .enjoy import make_rendered_env, play_episode
from .evaluate import Policy, add_policy_arguments, as_policy, read_policy


def record(
    policy: Policy | str, env_id: str, env_kwargs: dict[str, Any], output: Path, *, episodes: int = 1, seed: int = 0
) -> Path:
    """Write the frames of ``episodes`` episodes at the environment's own rate; returns ``output``."""
    env = make_rendered_env(env_id, env_kwargs, "rgb_array")
    player = as_policy(policy, env.action_space, seed)
    output.parent.mkdir(parents=True, exist_ok=True)
    rate = env.metadata.get("render_fps", 30)
    timing = {"duration": 1000 / rate} if output.suffix == ".gif" else {"fps": rate}  # [ms], [1/s]
    video: Any
    with imageio.get_writer(output, **timing) as video:
        for episode in range(episodes):
            for _ in play_episode(player, env, seed + episode):
                video.append_data(env.render())
    env.close()
    return output


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    add_policy_arguments(parser)
    parser.add_argument("--episodes", type=int, default=1)
    parser.add_argument("--output", type=Path, default=Path("video.mp4"))
    args = parser.parse_args(arguments)
    policy, env_id, env_kwargs = read_policy(args)
    print(record(policy, env_id, env_kwargs, args.output, episodes=args.episodes, seed=args.seed))


if __name__ == "__main__":
    main()
