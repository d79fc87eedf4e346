"""render_mode="human": a window that shows the frame, for single and vector environments."""

import sys

import gymnasium
import numpy as np
import pygame
import pytest

from avalanche_gym.rendering import tile
from tests.envs.environments import IDS
from tests.envs.test_env_checkers import assert_checkers_pass


def shown():
    return pygame.surfarray.array3d(pygame.display.get_surface()).swapaxes(0, 1)


@pytest.mark.parametrize("id", IDS)
@pytest.mark.filterwarnings("error")
def test_the_checkers_pass(id):
    assert_checkers_pass(gymnasium.make(id, render_mode="human"))


@pytest.mark.parametrize("id", IDS)
def test_reset_and_step_bring_the_window_up_to_date(id):
    window, array = (gymnasium.make(id, render_mode=mode) for mode in ("human", "rgb_array"))
    assert window.metadata["render_modes"] == ["human", "rgb_array"]
    for env in (window, array):
        env.reset(seed=3)
    np.testing.assert_array_equal(shown(), array.render())
    action = np.ones(window.action_space.shape, np.float32)
    for env in (window, array):
        env.step(action)
    np.testing.assert_array_equal(shown(), array.render())
    assert window.render() is None
    assert id.partition("-")[0] in pygame.display.get_caption()[0]
    window.close()
    assert not pygame.display.get_init()
    window.close()


@pytest.mark.parametrize("id", IDS)
def test_lanes_stand_side_by_side(id):
    env = gymnasium.make_vec(id, num_envs=3, vectorization_mode="vector_entry_point", render_mode="human")
    array = gymnasium.make_vec(id, num_envs=3, vectorization_mode="vector_entry_point", render_mode="rgb_array")
    env.reset(seed=1)
    array.reset(seed=1)
    np.testing.assert_array_equal(shown(), tile(array.render()))
    env.step(env.action_space.sample())
    assert env.render() is None
    env.close()
    assert not pygame.display.get_init()


def test_a_missing_extra_is_named_when_the_environment_is_made(monkeypatch):
    monkeypatch.setitem(sys.modules, "pygame", None)
    with pytest.raises(ImportError, match=r"avalanche-gym\[render\]"):
        gymnasium.make(IDS[0], render_mode="human")


def test_a_missing_display_is_named(monkeypatch):
    for name in ("SDL_VIDEODRIVER", "DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    pygame.display.quit()
    env = gymnasium.make(IDS[0], render_mode="human")
    with pytest.raises(RuntimeError, match="SDL_VIDEODRIVER=dummy"):
        env.reset(seed=0)
    env.close()
