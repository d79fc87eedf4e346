"""PlanetLanding: ground, start, fuel, ends, and that a simple controller solves level easy."""

import gymnasium
import numpy as np
import pytest

from avalanche_gym.envs.planet_landing import PlanetLandingTask, dynamics, reward, scene
from avalanche_gym.envs.planet_landing.ground import Ground, altitude_of, facet_below
from avalanche_gym.physics.mass_properties import rotation_matrix
from tests.envs.environments import LANES, LEVELS, landing_policy, started, success_rate

ID = "avalanche/PlanetLanding-v0"
COAST = np.array([-1.0, 0.0, 0.0, 0.0], np.float32)


def test_a_simple_controller_solves_level_easy():
    assert success_rate(ID, landing_policy) >= 0.9


def test_chance_does_not():
    generator = np.random.default_rng(0)
    assert success_rate(ID, lambda rows: generator.uniform(-1, 1, (LANES, 4)), seed=1) == 0.0
    assert success_rate(ID, lambda rows: np.zeros((LANES, 4)), seed=1) == 0.0


def place(task, height, *, velocity=(0.0, 0.0, 0.0), tilt=0.0):
    """Put the lander of lane 0 above the north pole, its feet ``height`` [m] above the highest ground below them."""
    table = task._ground
    feet = [(*foot[:2], scene.PLANET_RADIUS) for foot in scene.FEET]
    ground = max(scene.PLANET_RADIUS - altitude_of(foot, table[3][facet_below(foot, *table)]) for foot in feet)
    z = ground - scene.FOOT[2] + scene.LEG_RADIUS + height
    orientation = (np.cos(0.5 * tilt), np.sin(0.5 * tilt), 0.0, 0.0)
    task.world.set_state(
        task.lander,
        position=(0.0, 0.0, z),
        orientation=orientation,
        linear_velocity=velocity,
        angular_velocity=(0, 0, 0),
    )
    task.observe(task.every_lane)


@pytest.mark.parametrize("level", LEVELS)
def test_ground_is_the_facet_that_the_vertical_meets(level):
    planet = scene.planet_of(level)
    ground = Ground(planet, scene.SUBDIVISIONS)
    triangles = planet.vertices[planet.faces]
    generator = np.random.default_rng(0)
    for point in generator.normal(size=(200, 3)):
        direction = point / np.linalg.norm(point)
        # Barycentric weights of the direction in every facet: all positive in the one it meets.
        weights = np.linalg.solve(
            np.swapaxes(triangles, 1, 2), np.broadcast_to(direction[:, None], (len(triangles), 3, 1))
        )
        radius = 1.0 / weights[np.argmax(weights.min(axis=1)), :, 0].sum()
        table = (ground.directions, ground.faces, ground.centers, ground.planes)
        found = facet_below(tuple(25.0 * direction), *table)
        assert altitude_of(tuple(25.0 * direction), ground.planes[found]) == pytest.approx(25.0 - radius, abs=1e-9)


@pytest.mark.parametrize("level", LEVELS)
def test_start_is_an_orbit(level):
    task = started(PlanetLandingTask(200, level))
    position, velocity = task.world.position[:, task.lander], task.world.linear_velocity[:, task.lander]
    radius = np.linalg.norm(position, axis=1)
    low, high = scene.LEVELS[level].altitude
    assert ((radius >= scene.PLANET_RADIUS + low) & (radius <= scene.PLANET_RADIUS + high)).all()
    share = np.linalg.norm(velocity, axis=1) / np.sqrt(scene.MU / radius)
    assert (share >= 0.9 - 1e-12).all()
    np.testing.assert_allclose(np.einsum("ij,ij->i", position, velocity), 0.0, atol=1e-9)
    headings = np.einsum("ij,ij->i", np.cross(position, velocity), np.roll(position, 1, axis=1))
    assert 60 < (headings > 0.0).sum() < 140


def test_thrust_and_turns_are_impulses_in_the_frame_of_the_lander():
    env = gymnasium.make(ID).unwrapped
    env.reset(seed=3)
    task = env.task
    fuel = task.lanes[0]["fuel"]
    before = task.world.linear_velocity[0, task.lander].copy()
    axis = rotation_matrix(task.world.orientation[0, task.lander])[:, 2]
    gravity = -scene.MU * task.world.position[0, task.lander] / np.linalg.norm(task.world.position[0, task.lander]) ** 3
    env.step(np.array([1.0, 0.0, 0.0, 0.0], np.float32))
    change = task.world.linear_velocity[0, task.lander] - before
    # Gravity changes by 4 % on the way of 0.4 m.
    np.testing.assert_allclose(change, 0.1 * (dynamics.MAX_THRUST * axis + gravity), atol=0.004)
    assert fuel - task.lanes[0]["fuel"] == pytest.approx(0.25)

    env.reset(seed=3)
    rotation = rotation_matrix(task.world.orientation[0, task.lander])
    env.step(np.array([-1.0, 0.0, 0.5, 0.0], np.float32))
    np.testing.assert_allclose(rotation.T @ task.world.angular_velocity[0, task.lander], (0.0, 0.1, 0.0), atol=1e-4)
    assert task.lanes[0]["fuel"] == fuel


def test_an_empty_tank_gives_no_thrust():
    env = gymnasium.make(ID, ranges={"fuel": (0.1, 0.1)}).unwrapped
    env.reset(seed=3)
    full = np.array([1.0, 0.0, 0.0, 0.0], np.float32)
    env.step(full)
    assert env.task.lanes[0]["fuel"] == 0.0
    twin = gymnasium.make(ID, ranges={"fuel": (0.1, 0.1)}).unwrapped
    twin.reset(options={"state": env.get_state()})
    np.testing.assert_array_equal(env.step(full)[0], twin.step(COAST)[0])


def test_a_soft_touch_rests_for_a_second_and_succeeds():
    env = gymnasium.make(ID).unwrapped
    env.reset(seed=0)
    place(env.task, 0.05)
    rested = 0
    for _ in range(60):
        _, value, terminated, _, info = env.step(COAST)
        assert value == pytest.approx(sum(info["reward_terms"].values()))
        rested += info["reward_terms"]["rest"] > 0.0
        if terminated:
            break
    assert info["is_success"]
    assert rested == reward.REST_STEPS
    assert env.task.lanes[0]["touchdown"] < dynamics.CRASH_SPEED


@pytest.mark.parametrize(("speed", "crashes"), [(0.7, False), (0.9, True)])
def test_touchdown_speed_decides(speed, crashes):
    env = gymnasium.make(ID).unwrapped
    env.reset(seed=0)
    place(env.task, 0.03, velocity=(0.0, 0.0, -speed))
    _, _, terminated, _, info = env.step(COAST)
    assert terminated == crashes
    assert (info["reward_terms"]["crash"] < 0.0) == crashes
    # Gravity adds 0.03 m/s on the way.
    assert env.task.lanes[0]["touchdown"] == pytest.approx(speed, abs=0.05)


@pytest.mark.parametrize("speed", [0.9, 1.6, 3.0])
def test_a_crash_earns_nothing(speed):
    """Slamming down upright stops the lander and brings all its feet to the ground, which is most of the potential."""
    env = gymnasium.make(ID).unwrapped
    env.reset(seed=0)
    place(env.task, 0.03, velocity=(0.0, 0.0, -speed))
    _, value, terminated, _, info = env.step(COAST)
    assert terminated
    assert info["reward_terms"]["shaping"] <= 0.0
    assert value <= reward.CRASH


def test_toppling_is_a_crash():
    env = gymnasium.make(ID).unwrapped
    env.reset(seed=0)
    place(env.task, 0.1, tilt=1.2)
    for _ in range(30):
        _, _, terminated, _, info = env.step(COAST)
        if terminated:
            break
    assert info["reward_terms"]["crash"] < 0.0


def test_escape_ends_the_episode():
    env = gymnasium.make(ID).unwrapped
    env.reset(seed=0)
    place(env.task, 19.0, velocity=(0.0, 0.0, 20.0))
    _, _, terminated, _, info = env.step(COAST)
    assert terminated
    assert not info["is_success"]
    assert info["reward_terms"]["escape"] < 0.0


def test_the_site_counts_where_there_is_one():
    env = gymnasium.make(ID, level="medium").unwrapped
    env.reset(seed=0)
    for site, wins in (((1.0, 0.0, 0.0), False), ((0.0, 0.0, 1.0), True)):
        place(env.task, 0.05)
        env.task.lanes[0]["site"] = site
        for _ in range(40):
            _, _, terminated, _, info = env.step(COAST)
        assert terminated == wins
        assert info["is_success"] == wins


def test_orbit_keeps_its_energy():
    env = gymnasium.make(ID).unwrapped
    env.reset(seed=5)
    world = env.task.world
    energy = world.kinetic_energy() + world.potential_energy()
    for _ in range(20):
        env.step(COAST)
    np.testing.assert_allclose(world.kinetic_energy() + world.potential_energy(), energy, rtol=1e-12)
