"""Hyperparameters from YAML, in the schema of rl-zoo3: one file an algorithm, one entry an environment id.

Three keys speak of the experiment: ``n_timesteps``, ``n_envs`` and ``normalize`` (true, or a string of keyword
arguments for VecNormalize). All others go to the algorithm, once these values are translated:

* ``lin_3e-4``: a schedule that falls linearly from that value to zero;
* ``policy_kwargs`` and the like, if a string: the expression ``dict(...)``, with ``nn`` for ``torch.nn``;
* ``train_freq`` as a list: a tuple, ``[1, episode]``.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml
from stable_baselines3.common.utils import LinearSchedule
from torch import nn

FOLDER = Path(__file__).parent / "hyperparams"

EXPERIMENT_KEYS = ("n_timesteps", "n_envs", "normalize")
# In the schema, but for wrappers that these scripts do not build.
UNSUPPORTED_KEYS = ("callback", "env_wrapper", "frame_stack", "vec_env_class", "vec_env_wrapper")


def read(algorithm: str, env_id: str, file: Path | None = None) -> dict[str, Any]:
    """The entry of ``env_id`` in ``file`` (the algorithm's file in ``hyperparams/`` unless given), untranslated.

    Raises:
        KeyError: There is no entry for ``env_id``, or one that asks for what these scripts cannot do.
    """
    file = file or FOLDER / f"{algorithm}.yml"
    entries = yaml.safe_load(file.read_text(encoding="utf-8"))
    if env_id not in entries:
        raise KeyError(f"{file} has no entry {env_id!r}, only {', '.join(entries)}; add one, or name another file")
    entry: dict[str, Any] = entries[env_id]
    for key in UNSUPPORTED_KEYS:
        if entry.get(key) is not None:
            raise KeyError(f"{file}: {env_id} sets {key!r}, which is not supported here; remove it")
    return entry


def assignments(texts: list[str]) -> dict[str, Any]:
    """``["gamma=0.9", "policy_kwargs=dict(net_arch=[64])"]`` as a dictionary; values are read as YAML.

    Raises:
        ValueError: A text without ``=``.
    """
    result = {}
    for text in texts:
        key, separator, value = text.partition("=")
        if not separator:
            raise ValueError(f"{text!r} sets nothing; write key=value, for example gamma=0.99")
        result[key.strip()] = yaml.safe_load(value)
    return result


def evaluate_keywords(value: Any) -> dict[str, Any]:
    """The dictionary that ``value`` is, or that its text describes: ``dict(net_arch=[64], activation_fn=nn.ELU)``."""
    if isinstance(value, str):
        value = eval(value, {"__builtins__": {}, "dict": dict, "nn": nn})
    if not isinstance(value, dict):
        raise TypeError(f"Expected a mapping or the text 'dict(...)', got {value!r}")
    return value


def algorithm_arguments(entry: dict[str, Any]) -> dict[str, Any]:
    """What the constructor of the algorithm takes: ``entry`` translated, without the experiment's own keys."""
    return {key: _translated(key, value) for key, value in entry.items() if key not in EXPERIMENT_KEYS}


def normalization_arguments(entry: dict[str, Any]) -> dict[str, Any] | None:
    """Keyword arguments of VecNormalize, or None when ``entry`` does not normalize.

    The discount is the algorithm's, because rewards are scaled by the spread of their discounted sum.
    """
    normalize = entry.get("normalize", False)
    if not normalize:
        return None
    arguments = {} if normalize is True else evaluate_keywords(normalize)
    if "gamma" in entry:
        arguments.setdefault("gamma", entry["gamma"])
    return arguments


def _translated(key: str, value: Any) -> Any:
    if key.endswith("_kwargs"):
        return evaluate_keywords(value)
    if key == "train_freq" and isinstance(value, list):
        return tuple(value)
    if isinstance(value, str):
        if value.startswith("lin_"):
            return LinearSchedule(float(value.removeprefix("lin_")), 0.0, 1.0)
        try:
            return float(value)  # YAML 1.1 takes 3e-4, without a point, for a string
        except ValueError:
            return value
    return value
