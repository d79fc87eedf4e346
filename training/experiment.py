"""An experiment (algorithm, environment, seed, hyperparameters), its environments, and the folder it leaves.

::

    runs/ppo/PlanetLanding-v0-easy_1/
        experiment.yml                  what this was: read again by --resume, evaluate, enjoy and record
        model.zip, vecnormalize.pkl     the policy, and the running mean and variance it reads observations by
        best/                           the same two from the evaluation with the highest mean return
        checkpoints/                    the same two every few steps
        progress-<first step>.csv, evaluations.npz, events.out.tfevents...    plot and TensorBoard read these
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import yaml
from stable_baselines3 import PPO, SAC
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.vec_env import VecEnv, VecNormalize

from avalanche_gym.policies import EXPERIMENT_FILE, read_experiment

from . import hyperparameters

ALGORITHMS: dict[str, type[BaseAlgorithm]] = {"ppo": PPO, "sac": SAC}

# Lanes of the environments that training does not see: far from any seed a person chooses.
EVALUATION_SEED = 1_000_000


@dataclass
class Experiment:
    """What a training run depends on; the same experiment on the same machine gives the same policy."""

    algorithm: str  # "ppo" or "sac"
    env: str  # id of any Gymnasium environment
    env_kwargs: dict[str, Any] = field(default_factory=dict)
    seed: int = 0
    hyperparameters: dict[str, Any] = field(default_factory=dict)  # in the schema of rl-zoo3

    @property
    def name(self) -> str:
        """``PlanetLanding-v0-easy``."""
        parts = [self.env.split("/")[-1], *(str(value) for value in self.env_kwargs.values())]
        return "-".join(parts)

    @property
    def num_envs(self) -> int:
        return int(self.hyperparameters.get("n_envs", 1))

    def save(self, folder: Path) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        text = yaml.safe_dump(asdict(self), sort_keys=False)
        (folder / EXPERIMENT_FILE).write_text(text, encoding="utf-8")

    @classmethod
    def load(cls, path: Path) -> Experiment:
        """The experiment that ``path``, a run's folder or anything in it, belongs to.

        Raises:
            FileNotFoundError: Neither ``path`` nor a folder above it holds ``experiment.yml``.
        """
        return cls(**read_experiment(path))


def make_env(env_id: str, num_envs: int, seed: int, env_kwargs: dict[str, Any]) -> VecEnv:
    """``num_envs`` environments whose ``info`` gives each finished episode's return and length under ``"episode"``.

    Ours step all lanes in one kernel call; any other Gymnasium id gets one object a lane.
    """
    if env_id.startswith("avalanche/"):
        from avalanche_gym.envs.sb3 import SB3VecEnv

        env: VecEnv = SB3VecEnv(env_id, num_envs, **env_kwargs)
        env.seed(seed)
        return env
    return make_vec_env(env_id, num_envs, seed=seed, env_kwargs=env_kwargs)


def make_normalized_env(experiment: Experiment, *, training: bool, statistics: Path | None = None) -> VecEnv:
    """The environments of an experiment, wrapped in VecNormalize if its hyperparameters say so.

    Args:
        training: Whether statistics are updated and rewards scaled; without, the lanes are those of evaluation.
        statistics: A ``vecnormalize.pkl`` to go on from.
    """
    seed = experiment.seed if training else EVALUATION_SEED
    env = make_env(experiment.env, experiment.num_envs, seed, experiment.env_kwargs)
    arguments = hyperparameters.normalization_arguments(experiment.hyperparameters)
    if arguments is None:
        return env
    normalized = VecNormalize.load(str(statistics), env) if statistics else VecNormalize(env, **arguments)
    if not training:
        normalized.training = False
        normalized.norm_reward = False
    return normalized


def save_model(model: BaseAlgorithm, folder: Path) -> None:
    """Write the model, and the statistics without which it is worthless, into ``folder``."""
    folder.mkdir(parents=True, exist_ok=True)
    model.save(folder / "model.zip")
    normalization = model.get_vec_normalize_env()
    if normalization is not None:
        normalization.save(str(folder / "vecnormalize.pkl"))
