"""Trained policies as files: the folder that a training run leaves, and what it takes to act by it."""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from stable_baselines3.common.base_class import BaseAlgorithm
    from stable_baselines3.common.vec_env import VecNormalize

EXPERIMENT_FILE = "experiment.yml"


def read_experiment(path: Path) -> dict[str, Any]:
    """What the training run, whose folder ``path`` is or lies in, depended on: ``env``, ``algorithm`` and the rest.

    Raises:
        FileNotFoundError: neither ``path`` nor a folder above it holds ``experiment.yml``.
        ImportError: the extra ``train`` is not installed.
    """
    try:
        import yaml
    except ImportError as error:
        raise ImportError('A policy needs the extra for training: pip install "avalanche-gym[train]".') from error
    for folder in (path, *path.parents):
        file = folder / EXPERIMENT_FILE
        if file.is_file():
            fields: dict[str, Any] = yaml.safe_load(file.read_text(encoding="utf-8"))
            return fields
    raise FileNotFoundError(f"{path} does not belong to a training run (no {EXPERIMENT_FILE} there or above it)")


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
        """The policy of a run's folder, its ``best``, or one checkpoint's ``.zip``.

        The statistics are a pickle, which can run any program: load only what you trust.
        """
        model_file, statistics = model_files(path)
        name = str(read_experiment(path)["algorithm"]).upper()
        import stable_baselines3  # here, since what loads no policy needs no torch

        normalization = None
        if statistics is not None:
            with statistics.open("rb") as file:
                normalization = pickle.load(file)
        return cls(getattr(stable_baselines3, name).load(model_file, device="cpu"), normalization)

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
