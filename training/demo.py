"""The main job in one command: a lander learns to land on a small planet, in at most four minutes.

    python -m training.demo

Judges doing nothing, random actions and the untrained policy; trains PPO; judges the trained policy on the same
episodes; and leaves the model, the learning curve and a picture of a landing in ``runs/demo``.
"""

from __future__ import annotations

import argparse
import shutil
import time
from pathlib import Path
from typing import Any

import imageio.v2 as imageio
import numpy as np

from avalanche_gym.policies import TrainedPolicy

from . import hyperparameters
from .enjoy import make_rendered_env, play_episode
from .evaluate import Policy, evaluate
from .experiment import EVALUATION_SEED, Experiment, save_model
from .plot import plot
from .train import make_model, train

ENV = "avalanche/PlanetLanding-v0"
ENV_KWARGS = {"level": "easy"}
MINUTES = 4.0
EPISODES = 100
# A picture of a success is looked for in so many episodes.
PICTURE_ATTEMPTS = 20


def take_picture(policy: Policy, env_id: str, env_kwargs: dict[str, Any], output: Path) -> bool:
    """Write the last frame of the first successful episode (of the last one if none is); whether it was a success."""
    env = make_rendered_env(env_id, env_kwargs, "rgb_array")
    success = False
    for attempt in range(PICTURE_ATTEMPTS):
        for _, info in play_episode(policy, env, EVALUATION_SEED + attempt):
            success = bool(info.get("is_success", False))
        if success:
            break
    imageio.imwrite(output, np.asarray(env.render()))
    env.close()
    return success


def demo(experiment: Experiment, folder: Path, *, minutes: float, episodes: int, progress_bar: bool = True) -> None:
    """Judge, train, judge again; everything goes to ``folder``, whose former content is removed."""
    shutil.rmtree(folder, ignore_errors=True)
    save_model(make_model(experiment), folder / "untrained")
    experiment.save(folder)

    def judge(name: str, policy: Policy | str) -> None:
        result = evaluate(policy, experiment.env, experiment.env_kwargs, episodes=episodes)
        print(f"  {name:<18}{result}", flush=True)

    print(f"{experiment.env} {experiment.env_kwargs}: before training, {episodes} episodes each", flush=True)
    judge("doing nothing", "zero")
    judge("random actions", "random")
    judge("untrained policy", TrainedPolicy.load(folder / "untrained"))

    print(f"Training PPO for at most {minutes:g} minutes", flush=True)
    started = time.monotonic()
    model = train(
        experiment,
        folder,
        time_limit=minutes,
        evaluation_episodes=min(episodes, 50),
        checkpoints=0,
        progress_bar=progress_bar,
    )
    print(f"  {model.num_timesteps:,} steps in {time.monotonic() - started:.0f} s")

    print(f"After training, {episodes} episodes")
    trained = TrainedPolicy.load(folder)
    judge("trained policy", trained)
    curve = plot([folder], folder / "curve.png")
    picture = folder / "landing.png"
    success = take_picture(trained, experiment.env, experiment.env_kwargs, picture)

    print(f"Model:            {folder / 'model.zip'} (with vecnormalize.pkl beside it)")
    print(f"Learning curve:   {curve}")
    print(f"Picture:          {picture} ({'a landing' if success else 'no landing; the end of an episode'})")
    print(f"Watch it:         .venv/bin/python -m training.record {folder} --output landing.mp4")


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--folder", type=Path, default=Path("runs/demo"))
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args(arguments)
    entry = hyperparameters.read("ppo", ENV)
    demo(Experiment("ppo", ENV, ENV_KWARGS, args.seed, entry), args.folder, minutes=MINUTES, episodes=EPISODES)


if __name__ == "__main__":
    main()
