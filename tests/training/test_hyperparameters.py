"""Reading hyperparameters in rl-zoo3's schema."""

import pytest
import yaml
from torch import nn

from training import hyperparameters
from training.experiment import ALGORITHMS


def test_values_are_translated():
    entry = {
        "n_timesteps": 100,
        "n_envs": 4,
        "normalize": True,
        "policy": "MlpPolicy",
        "learning_rate": "lin_3e-4",
        "clip_range": "2e-1",
        "train_freq": [1, "episode"],
        "policy_kwargs": "dict(net_arch=[32, 16], activation_fn=nn.ELU)",
    }
    arguments = hyperparameters.algorithm_arguments(entry)
    schedule = arguments.pop("learning_rate")
    assert schedule(1.0) == 3e-4
    assert schedule(0.5) == pytest.approx(1.5e-4)
    assert schedule(0.0) == 0.0
    assert arguments == {
        "policy": "MlpPolicy",
        "clip_range": 0.2,
        "train_freq": (1, "episode"),
        "policy_kwargs": {"net_arch": [32, 16], "activation_fn": nn.ELU},
    }


@pytest.mark.parametrize(
    ("entry", "expected"),
    [
        ({}, None),
        ({"normalize": False, "gamma": 0.9}, None),
        ({"normalize": True, "gamma": 0.9}, {"gamma": 0.9}),
        ({"normalize": "dict(norm_obs=True, norm_reward=False)"}, {"norm_obs": True, "norm_reward": False}),
        ({"normalize": {"gamma": 0.5}, "gamma": 0.9}, {"gamma": 0.5}),
    ],
)
def test_normalization_takes_the_discount_of_the_algorithm(entry, expected):
    assert hyperparameters.normalization_arguments(entry) == expected


def test_assignments_are_yaml():
    texts = ["gamma=0.9", "normalize=true", "policy_kwargs=dict(net_arch=[64])"]
    expected = {"gamma": 0.9, "normalize": True, "policy_kwargs": "dict(net_arch=[64])"}
    assert hyperparameters.assignments(texts) == expected
    with pytest.raises(ValueError, match="key=value"):
        hyperparameters.assignments(["gamma"])


def test_unknown_environment_names_those_there_are():
    with pytest.raises(KeyError, match=r"Nonsense-v0.*PlanetLanding-v0"):
        hyperparameters.read("ppo", "Nonsense-v0")


def test_what_is_not_supported_is_refused(tmp_path):
    file = tmp_path / "ppo.yml"
    file.write_text(yaml.safe_dump({"Pendulum-v1": {"policy": "MlpPolicy", "frame_stack": 4}}))
    with pytest.raises(KeyError, match="frame_stack"):
        hyperparameters.read("ppo", "Pendulum-v1", file)


@pytest.mark.parametrize("algorithm", list(ALGORITHMS))
def test_every_entry_of_the_repository_can_be_translated(algorithm):
    for env_id in yaml.safe_load((hyperparameters.FOLDER / f"{algorithm}.yml").read_text()):
        entry = hyperparameters.read(algorithm, env_id)
        assert entry["n_timesteps"] > 0
        assert "policy" in hyperparameters.algorithm_arguments(entry)
        hyperparameters.normalization_arguments(entry)
