"""Train a policy with Stable-Baselines3.

    python -m training.train --env avalanche/PlanetLanding-v0 --level easy --time-limit 10
    python -m training.train --algorithm sac --env Pendulum-v1 --set n_timesteps=20000 learning_starts=1000
    python -m training.train --resume runs/ppo/PlanetLanding-v0-easy_1

Hyperparameters come from ``training/hyperparams/<algorithm>.yml``. Everything a run leaves lies in one folder,
described in ``training/experiment.py``; ``tensorboard --logdir runs`` shows its progress.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from typing import Any

import torch
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import BaseCallback, CallbackList, CheckpointCallback, EvalCallback
from stable_baselines3.common.logger import Logger, make_output_format
from stable_baselines3.common.off_policy_algorithm import OffPolicyAlgorithm

from avalanche_gym.policies import model_files

from . import hyperparameters, plot
from .experiment import ALGORITHMS, Experiment, make_normalized_env, save_model

REPLAY_BUFFER = "replay_buffer.pkl"


class WallClockLimit(BaseCallback):
    """Stops training after a number of minutes."""

    def __init__(self, minutes: float) -> None:
        super().__init__()
        self._seconds = 60.0 * minutes
        self._deadline = float("inf")

    def _on_training_start(self) -> None:
        self._deadline = time.monotonic() + self._seconds

    def _on_step(self) -> bool:
        return time.monotonic() < self._deadline


class SaveBest(BaseCallback):
    """Saves the model when EvalCallback finds a new best one."""

    def __init__(self, folder: Path) -> None:
        super().__init__()
        self._folder = folder

    def _on_step(self) -> bool:
        save_model(self.model, self._folder)
        return True


def make_model(experiment: Experiment, resume: Path | None = None) -> BaseAlgorithm:
    """A new model for the experiment, or the one at ``resume`` to train on."""
    algorithm = ALGORITHMS[experiment.algorithm]
    if resume is None:
        env = make_normalized_env(experiment, training=True)
        arguments = {"device": "cpu", **hyperparameters.algorithm_arguments(experiment.hyperparameters)}
        return algorithm(env=env, seed=experiment.seed, **arguments)
    model_file, statistics = model_files(resume)
    env = make_normalized_env(experiment, training=True, statistics=statistics)
    model = algorithm.load(model_file, env=env, device="cpu")
    # Other episodes than those it began with.
    model.set_random_seed(experiment.seed + model.num_timesteps)
    buffer = model_file.with_name(REPLAY_BUFFER)
    if isinstance(model, OffPolicyAlgorithm) and buffer.is_file():
        model.load_replay_buffer(buffer)
    return model


def train(
    experiment: Experiment,
    folder: Path,
    *,
    resume: Path | None = None,
    time_limit: float | None = None,
    evaluations: int = 10,
    evaluation_episodes: int = 50,
    checkpoints: int = 10,
    progress_bar: bool = True,
    threads: int = 1,
) -> BaseAlgorithm:
    """Train for ``n_timesteps`` steps, or until the time is up or the user presses Ctrl-C; save either way.

    Args:
        folder: Where everything goes.
        resume: A run's folder or checkpoint to go on from, for ``n_timesteps`` more steps.
        time_limit: Wall clock [minutes].
        evaluations: How often in ``n_timesteps`` the policy is judged on ``evaluation_episodes`` episodes; 0 for never.
        checkpoints: How often it is saved; 0 for never.
        threads: Of torch. These networks are so small that a second thread waits more than it works.
    """
    torch.set_num_threads(threads)
    experiment.save(folder)
    model = make_model(experiment, resume)
    formats = [make_output_format("csv", str(folder), f"-{model.num_timesteps:010d}")]
    formats.append(make_output_format("tensorboard", str(folder)))
    model.set_logger(Logger(str(folder), formats))

    steps = int(experiment.hyperparameters["n_timesteps"])
    # Callbacks count calls, and one call is a step of every lane.
    calls = steps // experiment.num_envs
    callbacks: list[BaseCallback] = []
    if evaluations:
        evaluation = EvalCallback(
            make_normalized_env(experiment, training=False),
            n_eval_episodes=evaluation_episodes,
            eval_freq=max(calls // evaluations, 1),
            log_path=str(folder),
            callback_on_new_best=SaveBest(folder / "best"),
            warn=False,
        )
        callbacks.append(evaluation)
    if checkpoints:
        frequency = max(calls // checkpoints, 1)
        callbacks.append(CheckpointCallback(frequency, str(folder / "checkpoints"), "model", save_vecnormalize=True))
    if time_limit is not None:
        callbacks.append(WallClockLimit(time_limit))

    try:
        model.learn(
            steps, callback=CallbackList(callbacks), reset_num_timesteps=resume is None, progress_bar=progress_bar
        )
    except KeyboardInterrupt:
        print("Interrupted; saving what was learnt.")
    finally:
        save_model(model, folder)
        if isinstance(model, OffPolicyAlgorithm):
            model.save_replay_buffer(folder / REPLAY_BUFFER)
        model.logger.close()
    return model


def free_folder(root: Path, experiment: Experiment) -> Path:
    """``root/<algorithm>/<experiment>_<n>`` with the first n that is free."""
    parent = root / experiment.algorithm
    number = 1
    while (parent / f"{experiment.name}_{number}").exists():
        number += 1
    return parent / f"{experiment.name}_{number}"


def read_experiment(args: argparse.Namespace) -> Experiment:
    """The experiment that the user asked for."""
    overrides = hyperparameters.assignments(args.set)
    if args.resume:
        experiment = Experiment.load(args.resume)
        if set(overrides) - {"n_timesteps"}:
            raise SystemExit("A resumed run keeps its hyperparameters; only n_timesteps can be set")
        experiment.hyperparameters |= overrides
        return experiment
    entry = hyperparameters.read(args.algorithm, args.env, args.hyperparameters) | overrides
    env_kwargs: dict[str, Any] = {"level": args.level} if args.level else {}
    env_kwargs |= hyperparameters.assignments(args.env_kwargs)
    return Experiment(args.algorithm, args.env, env_kwargs, args.seed, entry)


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--algorithm", choices=list(ALGORITHMS), default="ppo")
    parser.add_argument("--env", default="avalanche/PlanetLanding-v0", help="any Gymnasium id")
    parser.add_argument("--level", help="easy, medium or hard, for environments that have levels")
    parser.add_argument("--env-kwargs", nargs="*", default=[], metavar="KEY=VALUE", help="further arguments of the env")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--hyperparameters", type=Path, help="another YAML file in rl-zoo3's schema")
    parser.add_argument(
        "--set", nargs="*", default=[], metavar="KEY=VALUE", help="hyperparameters over those of the file"
    )
    parser.add_argument("--time-limit", type=float, metavar="MINUTES")
    parser.add_argument("--evaluations", type=int, default=10, help="in the whole run; 0 for none")
    parser.add_argument("--evaluation-episodes", type=int, default=50)
    parser.add_argument("--checkpoints", type=int, default=10, help="in the whole run; 0 for none")
    parser.add_argument("--resume", type=Path, metavar="RUN", help="a run's folder or checkpoint to train on from")
    parser.add_argument("--folder", type=Path, help="where the run goes; a new one under runs/ (or that of --resume)")
    parser.add_argument("--threads", type=int, default=1, help="of torch; small networks are fastest with one")
    parser.add_argument("--no-progress-bar", action="store_true")
    args = parser.parse_args(arguments)

    experiment = read_experiment(args)
    folder = args.folder
    if folder is None:
        folder = model_files(args.resume)[0].parent if args.resume else free_folder(Path("runs"), experiment)
    started = time.monotonic()
    model = train(
        experiment,
        folder,
        resume=args.resume,
        time_limit=args.time_limit,
        evaluations=args.evaluations,
        evaluation_episodes=args.evaluation_episodes,
        checkpoints=args.checkpoints,
        progress_bar=not args.no_progress_bar,
        threads=args.threads,
    )
    curve = plot.plot([folder], folder / "curve.png")
    print(f"{model.num_timesteps} steps in all, {time.monotonic() - started:.0f} s this time.")
    print(f"Run: {folder}\nLearning curve: {curve}")
    print(f"Next: python -m training.evaluate {folder}")


if __name__ == "__main__":
    main()
