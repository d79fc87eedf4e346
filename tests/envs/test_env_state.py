"""States: taken, put back, carried to another environment, bit by bit."""

import pickle

import gymnasium
import numpy as np
import pytest

from tests.envs.environments import IDS


def run(env, actions):
    return [env.step(action) for action in actions]


def assert_same(a, b):
    for first, second in zip(a, b, strict=True):
        np.testing.assert_array_equal(first[0], second[0])
        assert first[1:] == second[1:]


@pytest.mark.parametrize("id", IDS)
def test_the_future_repeats_bit_by_bit(id):
    env = gymnasium.make(id, level="hard").unwrapped
    env.action_space.seed(3)
    actions = [env.action_space.sample() for _ in range(40)]
    env.reset(seed=2)
    run(env, actions[:20])
    state = env.get_state()
    future = run(env, actions[20:])
    after, _ = env.reset()  # draws from the generator, whose state is part of the state
    env.set_state(state)
    assert_same(run(env, actions[20:]), future)
    np.testing.assert_array_equal(env.reset()[0], after)

    other = gymnasium.make(id, level="hard").unwrapped
    observation, _ = other.reset(options={"state": pickle.loads(pickle.dumps(state))})
    np.testing.assert_array_equal(observation, state.observation)
    assert_same(run(other, actions[20:]), future)


@pytest.mark.parametrize("id", IDS)
def test_a_lane_becomes_a_single_environment_and_back(id):
    vector = gymnasium.make_vec(id, num_envs=3, level="hard")
    vector.reset(seed=0)
    vector.action_space.seed(0)
    actions = [vector.action_space.sample() for _ in range(30)]
    for action in actions[:15]:
        vector.step(action)
    states = vector.get_state()
    single = gymnasium.make(id, level="hard").unwrapped
    single.set_state(states[1])
    rows = [vector.step(action) for action in actions[15:]]
    for action, row in zip(actions[15:], rows, strict=True):
        observation, reward, *_ = single.step(action[1])
        np.testing.assert_array_equal(observation, row[0][1])
        assert reward == row[1][1]
    vector.set_state(states)
    for action, row in zip(actions[15:], rows, strict=True):
        again = vector.step(action)
        for a, b in zip(again[:4], row[:4], strict=True):
            np.testing.assert_array_equal(a, b)
    observations, _ = vector.reset(options={"state": states[2]})
    for row in observations:
        np.testing.assert_array_equal(row, states[2].observation)


def test_a_state_of_another_kind_is_refused():
    push, land = (gymnasium.make(id).unwrapped for id in IDS)
    push.reset(seed=0)
    land.reset(seed=0)
    with pytest.raises(TypeError, match="PushTerrain.*a state of PlanetLanding.*get_state"):
        push.set_state(land.get_state())
    hard = gymnasium.make(IDS[0], level="hard").unwrapped
    hard.reset(seed=0)
    with pytest.raises(ValueError, match="'hard'.*'easy'"):
        push.set_state(hard.get_state())
    push.step(push.action_space.sample())
