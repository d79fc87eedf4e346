"""The scripts end to end, on small Gymnasium environments and tiny budgets."""

import gymnasium
import numpy as np
import pytest
import torch
from stable_baselines3.common.vec_env import VecNormalize

from avalanche_gym import policies
from avalanche_gym.envs.sb3 import SB3VecEnv
from training import demo, evaluate, experiment, plot, record, train

PNG = b"\x89PNG"
PPO = {
    "n_timesteps": 512,
    "n_envs": 2,
    "normalize": True,
    "policy": "MlpPolicy",
    "n_steps": 64,
    "batch_size": 64,
    "n_epochs": 2,
    "policy_kwargs": "dict(net_arch=[8])",
}
SAC = {
    "n_timesteps": 128,
    "n_envs": 2,
    "normalize": "dict(norm_obs=True, norm_reward=False)",
    "policy": "MlpPolicy",
    "buffer_size": 1000,
    "learning_starts": 64,
    "batch_size": 32,
    "policy_kwargs": "dict(net_arch=[8])",
}


class Guess(gymnasium.Env):
    """One step; success is an action of the observation's sign, and the return is 1 then, else 0."""

    metadata = {"render_modes": ["rgb_array"]}
    observation_space = gymnasium.spaces.Box(-1.0, 1.0, (1,), np.float32)
    action_space = gymnasium.spaces.Box(-1.0, 1.0, (1,), np.float32)

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self._sign = self.np_random.choice([-1.0, 1.0])
        return np.full(1, self._sign, np.float32), {}

    def step(self, action):
        success = bool(self._sign * action[0] > 0.0)
        return np.zeros(1, np.float32), float(success), True, False, {"is_success": success}


class Copy:
    """The policy that solves Guess."""

    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        return observation, None


@pytest.fixture(scope="module")
def guess():
    gymnasium.register("training_tests/Guess-v0", Guess)
    yield "training_tests/Guess-v0"
    del gymnasium.registry["training_tests/Guess-v0"]


def pendulum(**hyperparameters):
    return experiment.Experiment("ppo", "Pendulum-v1", {}, 3, PPO | hyperparameters)


def quick_train(experiment_, folder, **arguments):
    arguments = {"evaluations": 0, "checkpoints": 0, "progress_bar": False, "threads": 1} | arguments
    return train.train(experiment_, folder, **arguments)


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """Folder and model of a finished run."""
    folder = tmp_path_factory.mktemp("runs") / "pendulum"
    model = quick_train(pendulum(), folder, evaluations=2, evaluation_episodes=2, checkpoints=2, progress_bar=True)
    return folder, model


def test_a_run_leaves_its_folder(run):
    folder, model = run
    assert model.num_timesteps == 512
    assert experiment.Experiment.load(folder) == pendulum()
    expected = ["model.zip", "vecnormalize.pkl", "evaluations.npz", "progress-0000000000.csv"]
    expected += ["best/model.zip", "best/vecnormalize.pkl"]
    expected += ["checkpoints/model_512_steps.zip", "checkpoints/model_vecnormalize_512_steps.pkl"]
    assert [name for name in expected if not (folder / name).is_file()] == []
    assert list(folder.glob("events.out.tfevents.*"))


def test_a_saved_policy_acts_as_the_model_did(run):
    folder, model = run
    observations = np.random.default_rng(0).uniform(-1.0, 1.0, (5, 3)).astype(np.float32)
    normalization = model.get_vec_normalize_env()
    assert isinstance(normalization, VecNormalize)
    expected, _ = model.predict(normalization.normalize_obs(observations), deterministic=True)
    actions, _ = policies.TrainedPolicy.load(folder).predict(observations)
    np.testing.assert_array_equal(actions, expected)


def test_a_checkpoint_carries_its_own_statistics(run):
    folder, _ = run
    path = folder / "checkpoints" / "model_256_steps.zip"
    statistics = experiment.make_normalized_env(pendulum(), training=False, statistics=policies.model_files(path)[1])
    observations = np.ones((1, 3), np.float32)
    early, _ = policies.TrainedPolicy.load(path).predict(observations)
    model = experiment.ALGORITHMS["ppo"].load(path, device="cpu")
    expected, _ = model.predict(statistics.normalize_obs(observations), deterministic=True)
    np.testing.assert_array_equal(early, expected)
    assert early != policies.TrainedPolicy.load(folder).predict(observations)[0]


def test_the_same_seed_gives_the_same_policy(tmp_path):
    first = quick_train(pendulum(), tmp_path / "a").policy.state_dict()
    again = quick_train(pendulum(), tmp_path / "b").policy.state_dict()
    assert all(torch.equal(first[name], again[name]) for name in first)


def test_a_run_is_resumed(run, tmp_path):
    folder, _ = run
    model = quick_train(pendulum(n_timesteps=256), tmp_path, resume=folder)
    assert model.num_timesteps == 512 + 256
    before = experiment.make_normalized_env(pendulum(), training=True, statistics=folder / "vecnormalize.pkl")
    assert model.get_vec_normalize_env().obs_rms.count > before.obs_rms.count
    assert (tmp_path / "progress-0000000512.csv").is_file()


def test_sac_resumes_with_its_replay_buffer(tmp_path):
    sac = experiment.Experiment("sac", "Pendulum-v1", {}, 0, SAC)
    assert quick_train(sac, tmp_path).replay_buffer.size() == 64
    assert quick_train(sac, tmp_path, resume=tmp_path).replay_buffer.size() == 128


def test_the_time_limit_stops_training(tmp_path):
    model = quick_train(pendulum(n_timesteps=10**9), tmp_path, time_limit=0.0)
    assert model.num_timesteps == PPO["n_envs"]
    assert (tmp_path / "model.zip").is_file()


def test_success_rates(guess):
    result = evaluate.evaluate(Copy(), guess, {}, episodes=100)
    assert (result.success_rate, result.mean_return, len(result.returns)) == (1.0, 1.0, 100)
    assert evaluate.evaluate("zero", guess, {}, episodes=100).success_rate == 0.0
    # The mean of 100 tosses of a coin lies outside of this band once in 10^9.
    assert 0.2 < evaluate.evaluate("random", guess, {}, episodes=100).success_rate < 0.8


def test_evaluate_script(run, capsys):
    folder, _ = run
    evaluate.main([str(folder), "--episodes", "2"])
    evaluate.main(["random", "--env", "Pendulum-v1", "--episodes", "2"])
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 2
    assert all("mean return -" in line and "success" not in line for line in lines)


def test_train_script(tmp_path, capsys):
    settings = [f"{key}={value}" for key, value in PPO.items()]
    arguments = ["--env", "Pendulum-v1", "--folder", str(tmp_path), "--evaluations", "0", "--no-progress-bar"]
    train.main([*arguments, "--threads", "1", "--set", *settings, "n_timesteps=128"])
    assert str(tmp_path / "curve.png") in capsys.readouterr().out
    train.main(["--resume", str(tmp_path), "--evaluations", "0", "--no-progress-bar", "--threads", "1"])
    assert "256 steps in all" in capsys.readouterr().out
    with pytest.raises(SystemExit, match="n_timesteps"):
        train.main(["--resume", str(tmp_path), "--set", "gamma=0.5"])


@pytest.mark.parametrize("env_id", ["avalanche/PlanetLanding-v0", "avalanche/PushTerrain-v0"])
def test_our_environments_are_trained_natively_batched(env_id, tmp_path):
    settings = experiment.Experiment("ppo", env_id, {"level": "easy"}, 0, PPO)
    model = quick_train(settings, tmp_path, evaluations=1, evaluation_episodes=2)
    assert isinstance(model.get_env().unwrapped, SB3VecEnv)
    assert plot.series(plot.read_progress(tmp_path), "eval/success_rate")[0].tolist() == [512.0]
    policy = policies.TrainedPolicy.load(tmp_path)
    assert evaluate.evaluate(policy, env_id, {"level": "easy"}, episodes=3).successes.shape == (3,)


def test_plot_draws_success_where_there_is_one(run, guess, tmp_path):
    folder, _ = run
    success = experiment.Experiment("ppo", guess, {}, 0, PPO)
    quick_train(success, tmp_path / "guess", evaluations=1)
    both = plot.plot([folder, tmp_path / "guess"], tmp_path / "curves" / "both.png")
    one = plot.plot([folder], tmp_path / "one.png")
    assert both.read_bytes()[:4] == one.read_bytes()[:4] == PNG
    rows = plot.read_progress(tmp_path / "guess")
    assert plot.series(rows, "eval/success_rate")[0].tolist() == [512.0]


def test_record_writes_a_video(run, tmp_path):
    folder, _ = run
    record.main([str(folder), "--output", str(tmp_path / "new" / "swing.mp4")])
    assert (tmp_path / "new" / "swing.mp4").stat().st_size > 10_000


def test_demo_says_where_everything_is(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(demo, "PICTURE_ATTEMPTS", 1)
    folder = tmp_path / "demo"
    folder.mkdir()
    (folder / "stale.txt").touch()
    demo.demo(pendulum(), folder, minutes=1.0, episodes=2, progress_bar=False)
    text = capsys.readouterr().out
    for name in ("model.zip", "curve.png", "landing.png"):
        assert str(folder / name) in text
        assert (folder / name).is_file()
    assert text.count("mean return") == 4
    assert not (folder / "stale.txt").exists()


def test_a_folder_without_a_run_is_named(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"experiment\.yml"):
        experiment.Experiment.load(tmp_path)
    with pytest.raises(FileNotFoundError, match="checkpoints"):
        policies.model_files(tmp_path)
    with pytest.raises(FileNotFoundError, match="progress"):
        plot.read_progress(tmp_path)
    with pytest.raises(ValueError, match="'zero' and 'random'"):
        evaluate.as_policy("clever", Guess.action_space, 0)
