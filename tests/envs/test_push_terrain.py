"""PushTerrain: terrain, start, reward, ends, and that a simple controller solves level easy."""

import gymnasium
import numpy as np
import pytest

from avalanche_gym.envs.push_terrain import PushTerrainTask, scene
from tests.envs.environments import LANES, LEVELS, pushing_policy, started, success_rate

ID = "avalanche/PushTerrain-v0"


def test_a_simple_controller_solves_level_easy():
    assert success_rate(ID, pushing_policy) >= 0.9


def test_chance_does_not():
    generator = np.random.default_rng(0)
    assert success_rate(ID, lambda rows: generator.uniform(-1, 1, (LANES, 2)), seed=1) < 0.1
    assert success_rate(ID, lambda rows: np.zeros((LANES, 2)), seed=1) == 0.0


@pytest.mark.parametrize("level", LEVELS)
def test_heights_between_samples_follow_the_facets(level):
    task = started(PushTerrainTask(1, level))
    heights = task.heights[0]
    generator = np.random.default_rng(0)
    cell = scene.EXTENT / (scene.SAMPLES - 1)
    for x, y in generator.uniform(-0.499, 0.499, (200, 2)) * scene.EXTENT:
        column, row = int((x + 0.5 * scene.EXTENT) / cell), int((y + 0.5 * scene.EXTENT) / cell)
        corners = [(row, column), (row + 1, column + 1)]
        u, v = (x + 0.5 * scene.EXTENT) / cell - column, (y + 0.5 * scene.EXTENT) / cell - row
        corners.append((row, column + 1) if u > v else (row + 1, column))
        points = np.array([(c, r, 1.0) for r, c in corners])
        plane = np.linalg.solve(points, [heights[corner] for corner in corners])
        expected = plane @ [column + u, row + v, 1.0]
        assert scene.height_at(heights, x, y) == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("level", LEVELS)
def test_bodies_start_on_the_ground_without_overlap(level):
    task = started(PushTerrainTask(16, level))
    task.world.step(1)
    for lane in range(task.num_envs):
        gaps = task.world.contacts(lane)["gap"]
        assert gaps.min(initial=1.0) > -1e-6
    task.world.step(40)
    assert task.world.report().penetration.max() < 1e-3
    assert all(len(task.world.contacts(lane)) >= 2 for lane in range(task.num_envs))


def test_bodies_of_level_easy_stay_where_they_are():
    task = started(PushTerrainTask(16, "easy"))
    start = task.world.position.copy()
    task.world.step(60)
    assert np.abs(task.world.position - start)[:, task.body].max() < 0.02


def test_bowl_is_concave():
    task = started(PushTerrainTask(1, "medium"))
    heights = task.heights[0]
    middle = heights[scene.SAMPLES // 2, scene.SAMPLES // 2]
    assert min(heights[0, 0], heights[0, -1], heights[-1, 0], heights[-1, -1]) > middle


def test_terms_add_up_to_the_reward_and_shaping_telescopes():
    env = gymnasium.make(ID).unwrapped
    env.reset(seed=1)
    lane = env.task.lanes[0]
    start, progress = lane["potential"].copy(), 0.0
    env.action_space.seed(0)
    for _ in range(50):
        _, reward, _, _, info = env.step(env.action_space.sample())
        assert reward == pytest.approx(sum(info["reward_terms"].values()))
        progress += info["reward_terms"]["progress"]
    assert progress == pytest.approx(lane["potential"][0] - start[0])


def test_leaving_the_terrain_ends_the_episode():
    env = gymnasium.make(ID).unwrapped
    env.reset(seed=1)
    env.task.world.set_state(env.task.pusher, position=(3.7, 0.0, 1.0))
    _, _, terminated, _, info = env.step(np.zeros(2, np.float32))
    assert terminated
    assert not info["is_success"]
    assert info["reward_terms"]["lost"] < 0.0


def test_success_needs_a_slow_body():
    env = gymnasium.make(ID).unwrapped
    env.reset(seed=1)
    task = env.task
    goal = task.lanes[0]["goal"]
    place = (goal[0], goal[1], float(scene.height_at(task.heights[0], goal[0], goal[1])) + 0.16)
    task.world.set_state(task.body, position=place, linear_velocity=(1.0, 0.0, 0.0))
    assert not env.step(np.zeros(2, np.float32))[4]["is_success"]
    task.world.set_state(task.body, position=place, linear_velocity=(0.0, 0.0, 0.0))
    _, _, terminated, _, info = env.step(np.zeros(2, np.float32))
    assert terminated
    assert info["is_success"]
    assert info["reward_terms"]["success"] > 0.0


def test_ranges_are_kept():
    task = started(PushTerrainTask(20, "hard", ranges={"body_mass": (2.0, 2.0), "goal_distance": (0.5, 0.6)}))
    distance = np.linalg.norm(task.lanes["goal"] - task.world.position[:, task.body, :2], axis=1)
    assert ((distance >= 0.5) & (distance <= 0.6)).all()
    assert task.ranges.body_mass == (2.0, 2.0)
    assert task.ranges.roughness == scene.LEVELS["hard"].roughness
