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

import pickle
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from stable_baselines3 import PPO, SAC
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.vec_env import VecEnv, VecNormalize

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
        (folder / "experiment.yml").write_text(text, encoding="utf-8")

    @classmethod
    def load(cls, path: Path) -> Experiment:
        """The experiment that ``path``, a run's folder or anything in it, belongs to.

        Raises:
            FileNotFoundError: Neither ``path`` nor a folder above it holds ``experiment.yml``.
        """
        for folder in (path, *path.parents):
            file = folder / "experiment.yml"
            if file.is_file():
                return cls(**yaml.safe_load(file.read_text(encoding="utf-8")))
        raise FileNotFoundError(f"{path} does not belong to a training run (no experiment.yml there or above it)")


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


def model_files(path: Path) -> tuple[Path, Path | None]:
    """Model and normalization statistics of a run's folder, its ``best``, or one checkpoint's ``.zip``.

    Raises:
        FileNotFoundError: There is no model.
    """
    model = path if path.suffix == ".zip" else path / "model.zip"
    if not model.is_file():
        raise FileNotFoundError(f"{model} does not exist; give a run's folder or the .zip of one of its checkpoints")
    if model.name == "model.zip":
        statistics = model.with_name("vecnormalize.pkl")
    else:  # CheckpointCallback: model_<n>_steps.zip and model_vecnormalize_<n>_steps.pkl
        statistics = model.with_name(model.stem.replace("model_", "model_vecnormalize_", 1) + ".pkl")
    return model, statistics if statistics.is_file() else None


class TrainedPolicy:
    """A model with the statistics it was trained with: takes observations as the environment gives them."""

    def __init__(self, model: BaseAlgorithm, normalization: VecNormalize | None) -> None:
        self._model = model
        self._normalization = normalization

    @classmethod
    def load(cls, path: Path) -> TrainedPolicy:
        """The policy of a run's folder, its ``best``, or one checkpoint's ``.zip``."""
        model_file, statistics = model_files(path)
        normalization = None
        if statistics is not None:
            with statistics.open("rb") as file:
                normalization = pickle.load(file)
        algorithm = ALGORITHMS[Experiment.load(path).algorithm]
        return cls(algorithm.load(model_file, device="cpu"), normalization)

    def predict(
        self,
        observation: Any,
        state: tuple[np.ndarray, ...] | None = None,
        episode_start: np.ndarray | None = None,
        deterministic: bool = True,
    ) -> tuple[np.ndarray, tuple[np.ndarray, ...] | None]:
        """Actions for a batch of observations, in the form that Stable-Baselines3 asks of a predictor."""
        if self._normalization is not None:
            observation = self._normalization.normalize_obs(observation)
        return self._model.predict(observation, state, episode_start, deterministic)
