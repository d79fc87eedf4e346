"""Gymnasium's and Stable-Baselines3's checkers, with warnings as errors, for every id, level and option."""

import warnings

import gymnasium
import pytest
from gymnasium.utils.env_checker import check_env

from avalanche_gym import physics
from tests.envs.environments import IDS, LEVELS

pytestmark = pytest.mark.filterwarnings("error")


def assert_checkers_pass(env, **options):
    from stable_baselines3.common.env_checker import check_env as check_sb3

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env.unwrapped, **options)
        check_sb3(env.unwrapped, warn=True)
    env.close()


@pytest.mark.parametrize("level", LEVELS)
@pytest.mark.parametrize("id", IDS)
def test_levels(id, level):
    assert_checkers_pass(gymnasium.make(id, level=level), skip_render_check=level != "easy")


@pytest.mark.parametrize("id", IDS)
def test_render_mode(id):
    assert_checkers_pass(gymnasium.make(id, render_mode="rgb_array"))


@pytest.mark.parametrize("id", IDS)
def test_options_and_ranges(id):
    interval = gymnasium.make(id).unwrapped.task.control_interval
    name = {"PushTerrain": "goal_distance", "PlanetLanding": "altitude"}[id[10:-3]]
    env = gymnasium.make(
        id,
        options=physics.Options(time_step=interval / 8, events=False, sleeping=False),
        ranges={name: (1.0, 1.2)},
        max_episode_steps=50,
    )
    assert_checkers_pass(env, skip_render_check=True)


@pytest.mark.parametrize("id", IDS)
def test_module_prefix_imports_the_package(id):
    env = gymnasium.make(f"avalanche_gym:{id}")
    assert env.spec.id == id
    env.close()


@pytest.mark.parametrize("id", IDS)
def test_all_kinds_agree_on_the_length_of_an_episode(id):
    vector = gymnasium.make_vec(id, num_envs=1)
    assert gymnasium.spec(id).max_episode_steps == vector.max_episode_steps == type(vector).default_episode_steps


@pytest.mark.parametrize("id", IDS)
def test_docstring_has_the_sections_of_a_page(id):
    page = type(gymnasium.make(id).unwrapped).__doc__
    sections = (
        "Description",
        "Action Space",
        "Observation Space",
        "Rewards",
        "Starting State",
        "Episode End",
        "Arguments",
        "Version History",
    )
    positions = [page.index(f"## {section}") for section in sections]
    assert positions == sorted(positions)
