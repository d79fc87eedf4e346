"""SB3VecEnv against Stable-Baselines3's own DummyVecEnv of monitored single environments."""

import copy
import pickle

import gymnasium
import numpy as np
import pytest
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import DummyVecEnv, VecNormalize

from avalanche_gym.envs.sb3 import SB3VecEnv
from tests.envs.environments import IDS

LANES, LIMIT = 3, 6


@pytest.mark.parametrize("id", IDS)
def test_equals_dummy_vec_env(id):
    found = SB3VecEnv(id, LANES, max_episode_steps=LIMIT)
    wanted = DummyVecEnv([lambda: Monitor(gymnasium.make(id, max_episode_steps=LIMIT))] * LANES)
    for env in (found, wanted):
        env.seed(9)
    np.testing.assert_array_equal(found.reset(), wanted.reset())
    generator = np.random.default_rng(0)
    for _ in range(2 * LIMIT + 1):
        actions = generator.uniform(-1.0, 1.0, (LANES, found.action_space.shape[0])).astype(np.float32)
        rows, rewards, ends, infos = found.step(actions)
        expected_rows, expected_rewards, expected_ends, expected_infos = wanted.step(actions)
        np.testing.assert_array_equal(rows, expected_rows)
        np.testing.assert_array_equal(rewards, expected_rewards)
        np.testing.assert_array_equal(ends, expected_ends)
        assert rewards.dtype == expected_rewards.dtype
        for info, expected in zip(infos, expected_infos, strict=True):
            assert info.keys() == expected.keys()
            for key in ("is_success", "reward_terms", "TimeLimit.truncated"):
                assert info[key] == expected[key]
            if "episode" in info:
                assert info["episode"]["r"] == pytest.approx(expected["episode"]["r"], abs=1e-6)
                assert info["episode"]["l"] == expected["episode"]["l"]
                assert info["episode"]["t"] > 0.0
                np.testing.assert_array_equal(info["terminal_observation"], expected["terminal_observation"])


def test_attributes_and_methods_of_lanes():
    env = SB3VecEnv(IDS[0], 2, level="medium", render_mode="rgb_array")
    env.reset()
    assert env.get_attr("level") == ["medium", "medium"]
    assert env.render_mode == "rgb_array"
    env.set_attr("mark", 7, indices=1)
    assert env.get_attr("mark", indices=1) == [7]
    assert not env.has_attr("nothing_of_that_name")
    states = env.env_method("get_state")
    env.step(np.ones((2, 2), np.float32))
    env.env_method("set_state", states[0], indices=0)
    assert env.env_is_wrapped(gymnasium.wrappers.TimeLimit) == [False, False]
    assert env.env_is_wrapped(Monitor) == [True, True]
    single = env.env_method("render", indices=0)[0]
    assert env.render().shape[1] == 2 * single.shape[1] or env.render().shape[0] == 2 * single.shape[0]
    assert env.seed(3) == [3, 4]
    env.close()


def test_options_start_from_a_state():
    env = SB3VecEnv(IDS[0], 2)
    env.reset()
    state = env.env_method("get_state", indices=1)[0]
    env.step(np.ones((2, 2), np.float32))
    env.set_options({"state": state})
    for row in env.reset():
        np.testing.assert_array_equal(row, state.observation)


@pytest.mark.filterwarnings("error")
def test_works_under_vec_normalize_and_evaluate_policy():
    class Still:
        def predict(self, observation, state=None, episode_start=None, deterministic=False):
            return np.zeros((len(observation), 2), np.float32), None

    env = VecNormalize(SB3VecEnv(IDS[0], 2, max_episode_steps=5), norm_reward=False)
    returns, lengths = evaluate_policy(Still(), env, n_eval_episodes=4, return_episode_rewards=True)
    assert lengths == [5] * 4
    assert np.isfinite(returns).all()


def test_other_ids_are_refused():
    with pytest.raises(ValueError, match="CartPole-v1.*avalanche/.*make_vec_env"):
        SB3VecEnv("CartPole-v1", 2)


def test_an_episode_begins_where_a_lane_is_reset():
    env = SB3VecEnv(IDS[0], 2, max_episode_steps=5)
    env.reset()
    still = np.zeros((2, 2), np.float32)
    for _ in range(3):
        env.step(still)
    env.env_method("reset", indices=1)
    ends = [info["episode"]["l"] for _ in range(5) for info in env.step(still)[3] if "episode" in info]
    assert ends == [5, 5]


def test_copies_go_their_own_way():
    env = SB3VecEnv(IDS[0], 2)
    env.seed(1)
    env.reset()
    twins = [copy.deepcopy(env), pickle.loads(pickle.dumps(env))]
    push = np.ones((2, 2), np.float32)
    for _ in range(3):
        rows = [one.step(push)[0] for one in (env, *twins)]
        assert (rows[0] == rows[1]).all() and (rows[0] == rows[2]).all()
