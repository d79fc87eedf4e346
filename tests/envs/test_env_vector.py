"""The vector environment against single environments, bit by bit, in every autoreset mode."""

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode, SyncVectorEnv

from tests.envs.environments import IDS

LANES = 3
LIMIT = 7  # steps of an episode, so that lanes end within a short test


def make_vector(id, mode=AutoresetMode.NEXT_STEP, **kwargs):
    return gymnasium.make_vec(
        id, num_envs=LANES, vectorization_mode="vector_entry_point", autoreset_mode=mode, **kwargs
    )


def make_reference(id, mode, **kwargs):
    return SyncVectorEnv([lambda: gymnasium.make(id, **kwargs)] * LANES, autoreset_mode=mode)


def assert_equal(a, b):
    """Same keys and bits, at any depth; entries that a mask rules out do not count.

    ``a`` may hold keys that ``b`` lacks where they tell about no lane: ours are in every info.
    """
    assert set(b) <= set(a)
    for key, value in a.items():
        if not key.startswith("_") and key not in b:
            assert not a[f"_{key}"].any()
        elif key.startswith("_") and key not in b:
            continue
        elif isinstance(value, dict):
            assert_equal(value, b[key])
        elif not key.startswith("_"):
            mask = a[f"_{key}"]
            np.testing.assert_array_equal(mask, b[f"_{key}"])
            for lane in np.flatnonzero(mask):
                np.testing.assert_array_equal(value[lane], b[key][lane], err_msg=key)


@pytest.mark.parametrize("id", IDS)
@pytest.mark.parametrize("mode", AutoresetMode)
def test_lanes_equal_single_environments(id, mode):
    generator = np.random.default_rng(1)
    vector = make_vector(id, mode, level="medium", max_episode_steps=LIMIT)
    reference = make_reference(id, mode, level="medium", max_episode_steps=LIMIT)
    assert vector.metadata["autoreset_mode"] is mode
    first, info = vector.reset(seed=11)
    expected, expected_info = reference.reset(seed=11)
    np.testing.assert_array_equal(first, expected)
    assert info == expected_info
    for _ in range(3 * LIMIT):
        actions = generator.uniform(-1.0, 1.0, vector.action_space.shape).astype(np.float32)
        *found, infos = vector.step(actions)
        *wanted, wanted_infos = reference.step(actions)
        for a, b in zip(found, wanted, strict=True):
            assert a.dtype == b.dtype
            np.testing.assert_array_equal(a, b)
        assert_equal(infos, wanted_infos)
        ended = found[2] | found[3]
        if mode is AutoresetMode.DISABLED and ended.any():
            options = {"reset_mask": ended}
            found_rows, _ = vector.reset(options=dict(options))
            wanted_rows, _ = reference.reset(options=dict(options))
            np.testing.assert_array_equal(found_rows, wanted_rows)


@pytest.mark.parametrize("id", IDS)
def test_a_list_seeds_each_lane(id):
    vector = make_vector(id)
    rows, _ = vector.reset(seed=[5, 5, 6])
    np.testing.assert_array_equal(rows[0], rows[1])
    assert not np.array_equal(rows[0], rows[2])
    single, _ = gymnasium.make(id).reset(seed=6)
    np.testing.assert_array_equal(rows[2], single)
    assert vector.np_random_seed == (5, 5, 6)


@pytest.mark.parametrize("id", IDS)
def test_reset_mask_leaves_other_lanes_alone(id):
    vector = make_vector(id, AutoresetMode.DISABLED)
    before, _ = vector.reset(seed=0)
    mask = np.array([False, True, False])
    after, _ = vector.reset(options={"reset_mask": mask})
    np.testing.assert_array_equal(before[~mask], after[~mask])
    assert not np.array_equal(before[1], after[1])


@pytest.mark.parametrize("id", IDS)
def test_disabled_mode_refuses_to_step_ended_lanes(id):
    vector = make_vector(id, AutoresetMode.DISABLED, max_episode_steps=1)
    vector.reset(seed=0)
    actions = np.zeros(vector.action_space.shape, np.float32)
    vector.step(actions)
    with pytest.raises(ValueError, match=r"lanes \[0, 1, 2\] have ended.*reset_mask"):
        vector.step(actions)
    vector.reset(options={"reset_mask": np.ones(LANES, bool)})
    vector.step(actions)


@pytest.mark.parametrize("id", IDS)
def test_returned_arrays_are_not_reused(id):
    vector = make_vector(id)
    first, _ = vector.reset(seed=0)
    kept = first.copy()
    actions = np.ones(vector.action_space.shape, np.float32)
    second = vector.step(actions)
    third = vector.step(actions)
    np.testing.assert_array_equal(first, kept)
    for a, b in zip(second[:4], third[:4], strict=True):
        assert not np.shares_memory(a, b)


@pytest.mark.parametrize("id", IDS)
@pytest.mark.parametrize("mode", AutoresetMode)
def test_a_lane_whose_physics_fails_is_truncated(id, mode):
    vector = make_vector(id, mode)
    vector.reset(seed=0)
    vector.task.world.impulse_buffer[1, -1, 5] = np.inf if id.endswith("Landing-v0") else np.nan
    if id.endswith("Landing-v0"):
        # Its own impulses overwrite the buffer: spin the lander so fast that its turn overflows.
        vector.task.world.set_state(vector.task.lander, angular_velocity=(1e200, 1e200, 0.0), world=1)
    _, _, terminated, truncated, infos = vector.step(np.zeros(vector.action_space.shape, np.float32))
    assert truncated.tolist() == [False, True, False]
    told = infos["final_info"] if mode is AutoresetMode.SAME_STEP else infos
    assert told["_physics_error"].tolist() == [False, True, False]
    assert "not finite" in told["physics_error"][1]
    if mode is AutoresetMode.DISABLED:
        vector.reset(options={"reset_mask": terminated | truncated})
    rows, *_ = vector.step(np.zeros(vector.action_space.shape, np.float32))
    assert np.isfinite(rows).all()


@pytest.mark.parametrize("id", IDS)
def test_lanes_that_fail_in_different_steps_of_the_physics_are_all_told(id, monkeypatch):
    vector = make_vector(id)
    vector.reset(seed=0)
    world = vector.task.world
    step, calls = world.step, []

    def broken(num_steps=1):
        if num_steps == 1:
            world.impulse_buffer[len(calls) % LANES, -1, 0] = np.inf
        elif not calls:
            world.impulse_buffer[:, -1, 0] = np.inf
        calls.append(num_steps)
        step(num_steps)

    monkeypatch.setattr(world, "step", broken)
    _, _, _, truncated, infos = vector.step(np.zeros(vector.action_space.shape, np.float32))
    assert truncated.all() and infos["_physics_error"].all()
    if id.endswith("Landing-v0"):
        assert [f"physics step {lane} " in infos["physics_error"][lane] for lane in range(LANES)] == [True] * LANES


@pytest.mark.parametrize("id", IDS)
@pytest.mark.parametrize(
    "arguments",
    [
        {"seed": [3, -1, 4]},
        {"seed": 1.5},
        {"seed": "abc"},
        {"seed": 3, "options": {"state": 5}},
        {"seed": 3, "options": {"state": [None, None, None]}},
        {"seed": 3, "options": {"nonsense": 5}},
    ],
)
def test_a_reset_that_is_refused_changes_nothing(id, arguments):
    vector, single = make_vector(id), gymnasium.make(id)
    twin = make_vector(id)
    for env in (vector, twin, single):
        env.reset(seed=5)
    with pytest.raises((TypeError, ValueError, gymnasium.error.Error)):
        vector.reset(**arguments)
    if isinstance(arguments["seed"], int):
        before = single.unwrapped.get_state()
        with pytest.raises((TypeError, ValueError)):
            single.reset(**arguments)
        assert single.unwrapped.get_state().generator == before.generator
    assert vector.np_random_seed == twin.np_random_seed
    np.testing.assert_array_equal(vector.reset()[0], twin.reset()[0])


def test_no_lane_may_be_set():
    vector = make_vector(IDS[0])
    vector.reset(seed=0)
    state = vector.get_state()[0]
    vector.set_lane_states({})
    with pytest.raises(IndexError, match="lane 9.*lanes 0 to 2"):
        vector.set_lane_states({9: state})
