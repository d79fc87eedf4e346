"""Bad input: the error names what was given, what is allowed and what to do, and the environment stays usable."""

import gymnasium
import numpy as np
import pytest

from avalanche_gym import physics
from tests.envs.environments import IDS


@pytest.mark.parametrize("id", IDS)
@pytest.mark.parametrize("make", [gymnasium.make, gymnasium.make_vec])
@pytest.mark.parametrize(
    ("kwargs", "error", "texts"),
    [
        ({"level": "insane"}, ValueError, ["level='insane'", "'easy', 'medium', 'hard'"]),
        ({"options": 0.01}, TypeError, ["options=0.01", "physics.Options"]),
        ({"options": physics.Options(time_step=0.007)}, ValueError, ["time_step=0.007", "/ n", "for example"]),
        ({"ranges": {"colour": (0, 1)}}, ValueError, ["'colour'", "allowed names"]),
    ],
)
def test_arguments(id, make, kwargs, error, texts):
    with pytest.raises(error) as raised:
        make(id, **kwargs)
    for text in texts:
        assert text in str(raised.value)


@pytest.mark.parametrize("id", IDS)
def test_ranges_must_be_pairs(id):
    name = {"PushTerrain": "goal_distance", "PlanetLanding": "altitude"}[id[10:-3]]
    for value in [(2.0, 1.0), (1.0,), (0.0, float("nan"))]:
        with pytest.raises(ValueError, match=rf"{name}.*\(low, high\)"):
            gymnasium.make(id, ranges={name: value})


@pytest.mark.filterwarnings("ignore:.*render_mode='ascii'")
@pytest.mark.parametrize("id", IDS)
def test_render_mode(id):
    for make in (gymnasium.make, gymnasium.make_vec):
        with pytest.raises(ValueError, match="render_mode='ascii'.*'rgb_array'"):
            make(id, render_mode="ascii")


@pytest.mark.parametrize("id", IDS)
def test_bad_actions_change_nothing(id):
    env, twin = (gymnasium.make(id).unwrapped for _ in range(2))
    env.reset(seed=4)
    twin.reset(seed=4)
    size = env.action_space.shape[0]
    nan = np.zeros(size, np.float32)
    nan[-1] = np.nan
    for action, error, texts in [
        (np.zeros(size + 1), ValueError, [f"shape ({size + 1},)", f"({size},)", "action_space.sample()"]),
        (0.5, ValueError, [f"({size},)"]),
        (nan, ValueError, ["not finite", "[-1, 1]", "step again"]),
        (["left"] * size, TypeError, ["not numeric", "floats in [-1, 1]"]),
    ]:
        with pytest.raises(error) as raised:
            env.step(action)
        for text in texts:
            assert text in str(raised.value)
    action = np.full(size, 0.3, np.float32)
    np.testing.assert_array_equal(env.step(action)[0], twin.step(action)[0])


@pytest.mark.parametrize("id", IDS)
def test_bad_actions_of_a_batch_name_the_lane(id):
    env = gymnasium.make_vec(id, num_envs=3)
    env.reset(seed=4)
    actions = np.zeros(env.action_space.shape, np.float32)
    with pytest.raises(ValueError, match=r"allowed is \(3, "):
        env.step(actions[:2])
    actions[2, 0] = np.inf
    with pytest.raises(ValueError, match="of lane 2 is not finite"):
        env.step(actions)
    assert env.elapsed.tolist() == [0, 0, 0]
    actions[2, 0] = 1.0
    env.step(actions)


@pytest.mark.parametrize("id", IDS)
def test_actions_are_clipped(id):
    env, twin = (gymnasium.make(id).unwrapped for _ in range(2))
    env.reset(seed=4)
    twin.reset(seed=4)
    size = env.action_space.shape[0]
    wide, unit = np.full(size, 7.0), np.ones(size)
    for _ in range(3):
        np.testing.assert_array_equal(env.step(wide)[0], twin.step(unit)[0])


@pytest.mark.parametrize("id", IDS)
def test_step_before_reset(id):
    for env in (gymnasium.make(id).unwrapped, gymnasium.make_vec(id, num_envs=2)):
        with pytest.raises(gymnasium.error.ResetNeeded, match="call reset"):
            env.step(np.zeros(env.action_space.shape, np.float32))


@pytest.mark.parametrize("id", IDS)
def test_vector_arguments(id):
    for kwargs, text in [
        ({"num_envs": 0}, "num_envs=0"),
        ({"autoreset_mode": "sometimes"}, "AutoresetMode.NEXT_STEP"),
        ({"max_episode_steps": 0}, "max_episode_steps=0"),
    ]:
        with pytest.raises(ValueError, match=text):
            gymnasium.make_vec(id, **kwargs)
    env = gymnasium.make_vec(id, num_envs=2)
    env.reset(seed=0)
    for options, text in [
        ({"reset_mask": [True, False]}, "numpy array of bool"),
        ({"reset_mask": np.zeros(2, bool)}, "chooses no lane"),
        ({"speed": 3}, "'speed'.*\"state\""),
    ]:
        with pytest.raises(ValueError, match=text):
            env.reset(options=options)
    with pytest.raises(ValueError, match="3 entries for 2 lanes"):
        env.reset(seed=[1, 2, 3])
    env.step(np.zeros(env.action_space.shape, np.float32))
