"""Impacts in other sizes, steps, gravities and numbers than those of the hard cases: what holds of one holds of all."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.spatial import cKDTree

from avalanche_gym import physics

GRAVITY = 9.81
ELASTIC = physics.Material(friction=0.0, restitution=1.0)


def world_of(scene: physics.Scene, time_step: float) -> physics.World:
    return physics.World(scene, options=physics.Options(time_step=time_step))


def over_plane(gravity: float = GRAVITY) -> physics.Scene:
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity((0.0, 0.0, -gravity)))
    scene.add_body(physics.Plane(), motion="static", material=physics.Material(friction=0.5, restitution=1.0))
    return scene


def bounce(time: float, height: float, restitution: float, gravity: float) -> float:
    """[m] above the ground: parabola after parabola, at rest after an endless number of them."""
    first = math.sqrt(2.0 * height / gravity)
    if time >= first * (1.0 + restitution) / (1.0 - restitution):
        return 0.0
    begin, length, speed = -first, 2.0 * first, gravity * first
    while time > begin + length:
        begin, length, speed = begin + length, length * restitution, speed * restitution
    return (speed - 0.5 * gravity * (time - begin)) * (time - begin)


@pytest.mark.parametrize("restitution", [0.3, 0.5, 0.8])
@pytest.mark.parametrize("early", [1e-6, -1e-6])
def test_the_time_at_which_an_endless_sequence_ends(restitution: float, early: float) -> None:
    """Thrown up so that it ends a microsecond before a step does, or after: at rest, or not yet."""
    time_step, height = 1 / 60, 0.3

    def end(throw: float) -> float:
        landing = math.sqrt(throw * throw + 2.0 * GRAVITY * height)
        return (throw + landing) / GRAVITY + 2.0 * restitution / (1.0 - restitution) * landing / GRAVITY

    steps = math.ceil(end(0.0) / time_step)
    throw = brentq(lambda throw: end(throw) - (steps * time_step - early), 0.0, 3.0, xtol=1e-15)
    scene = over_plane()
    ball = scene.add_body(
        physics.Sphere(0.1), mass=1.0, position=(0.0, 0.0, 0.1 + height), linear_velocity=(0.0, 0.0, throw),
        material=physics.Material(friction=0.5, restitution=restitution),
    )  # fmt: skip
    world = world_of(scene, time_step)
    world.step(steps)
    rests = abs(world.linear_velocity[0, ball, 2]) < 1e-12
    assert rests == (early > 0.0)


@pytest.mark.parametrize("time_step", [1 / 30, 1 / 60, 1 / 240])
@pytest.mark.parametrize("gravity", [1.62, 25.0])
@pytest.mark.parametrize("count", [3, 40])
def test_each_of_many_balls_bounces_for_itself(count: int, gravity: float, time_step: float) -> None:
    generator = np.random.default_rng(count)
    scene = over_plane(gravity)
    radii, heights = generator.uniform(0.02, 0.4, count), generator.uniform(0.05, 2.0, count)
    restitutions, masses = generator.uniform(0.2, 0.99, count), 10.0 ** generator.uniform(-2, 2, count)
    for number in range(count):
        scene.add_body(
            physics.Sphere(radii[number]), mass=masses[number],
            position=(number % 8, number // 8, radii[number] + heights[number]),
            material=physics.Material(friction=0.5, restitution=restitutions[number]),
        )  # fmt: skip
    world = world_of(scene, time_step)
    for step in range(1, round(2.0 / time_step) + 1):
        world.step(1)
        for number in range(count):
            expected = bounce(step * time_step, heights[number], restitutions[number], gravity)
            found = world.position[0, number + 1, 2] - radii[number]
            assert found == pytest.approx(expected, abs=1e-9 * heights[number])


@pytest.mark.parametrize("time_step", [1 / 30, 1 / 60, 1 / 960])
@pytest.mark.parametrize(("count", "incoming"), [(3, 2), (4, 1), (6, 3), (7, 4)])
@pytest.mark.parametrize("gap", [0.0, 1e-6, 0.02])
def test_cradles(count: int, incoming: int, gap: float, time_step: float) -> None:
    """In a row that lies askew in space, heavy and small."""
    direction = np.array([0.6, -0.48, 0.64])
    scene = physics.Scene()
    for number in range(count):
        struck = number >= incoming
        place = number * (0.06 + gap) - (0.0 if struck else 0.3)
        scene.add_body(
            physics.Sphere(0.03), mass=50.0, position=place * direction,
            linear_velocity=(0.0 if struck else 7.0) * direction, material=ELASTIC,
        )  # fmt: skip
    world = world_of(scene, time_step)
    world.step(round(0.2 / time_step))
    expected = np.where(np.arange(count) >= count - incoming, 7.0, 0.0)
    np.testing.assert_allclose(world.linear_velocity[0], np.outer(expected, direction), atol=7e-12)


SLABS = {
    "plate": (physics.Box((0.5, 0.3, 0.02)), 0.02),
    "rod": (physics.Box((0.02, 0.02, 0.5)), 0.5),
    "cylinder": (physics.Cylinder(0.03, 0.4), 0.4),
    "hull": (physics.ConvexHull(list(itertools.product((-0.1, 0.13), (-0.2, 0.2), (-0.1, 0.1)))), 0.1),
}


@pytest.mark.parametrize("time_step", [1 / 30, 1 / 60, 1 / 240])
@pytest.mark.parametrize("shape", SLABS)
@pytest.mark.parametrize("tilt", [0.0, 0.03, 0.5])
def test_flat_on_a_tilted_plane(tilt: float, shape: str, time_step: float) -> None:
    """Along the normal of the plane, with everything tilted alike: it rebounds flat, by e of its speed."""
    solid, half = SLABS[shape]
    up = np.array([math.sin(tilt), 0.0, math.cos(tilt)])
    turned = (math.cos(0.5 * tilt), 0.0, math.sin(0.5 * tilt), 0.0)
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity(tuple(-GRAVITY * up)))
    scene.add_body(physics.Plane(), motion="static", orientation=turned, material=ELASTIC)
    body = scene.add_body(
        solid, density=300.0, position=(half + 0.4) * up, orientation=turned,
        material=physics.Material(friction=0.5, restitution=0.7),
    )  # fmt: skip
    world = world_of(scene, time_step)
    fall = math.sqrt(2.0 * 0.4 / GRAVITY)
    steps = math.ceil((fall + 0.05) / time_step)
    world.step(steps)
    left = steps * time_step - fall
    speed = 0.7 * GRAVITY * fall
    height = half + speed * left - 0.5 * GRAVITY * left**2
    np.testing.assert_allclose(world.position[0, body], height * up, atol=1e-10)
    np.testing.assert_allclose(world.linear_velocity[0, body], (speed - GRAVITY * left) * up, atol=1e-10)
    np.testing.assert_allclose(world.angular_velocity[0, body], 0.0, atol=1e-10)


def kepler(place: NDArray[np.float64], velocity: NDArray[np.float64], mu: float, time: float) -> NDArray[np.float64]:
    """(2, 3) place and velocity after ``time`` on a Kepler ellipse, by its eccentric anomaly."""
    distance = float(np.linalg.norm(place))
    axis = 1.0 / (2.0 / distance - velocity @ velocity / mu)
    eccentric = ((velocity @ velocity - mu / distance) * place - (place @ velocity) * velocity) / mu
    e = float(np.linalg.norm(eccentric))
    x = eccentric / e
    momentum = np.cross(place, velocity)
    y = np.cross(momentum / np.linalg.norm(momentum), x)
    start = math.atan2((place @ velocity) / math.sqrt(mu * axis), 1.0 - distance / axis)
    mean = start - e * math.sin(start) + math.sqrt(mu / axis**3) * time
    anomaly = brentq(lambda E: E - e * math.sin(E) - mean, mean - 1.1, mean + 1.1, xtol=1e-15, rtol=1e-15)
    flat, rate = math.sqrt(1.0 - e * e), math.sqrt(mu / axis**3) / (1.0 - e * math.cos(anomaly))
    where = axis * ((math.cos(anomaly) - e) * x + flat * math.sin(anomaly) * y)
    return np.array([where, axis * rate * (-math.sin(anomaly) * x + flat * math.cos(anomaly) * y)])


@pytest.mark.parametrize("time_step", [1 / 30, 1 / 60, 1 / 960])
@pytest.mark.parametrize(("planet", "radius", "gravity"), [(0.5, 0.02, 1.6), (20.0, 0.4, 9.81), (100.0, 0.1, 30.0)])
def test_arcs_on_planets(planet: float, radius: float, gravity: float, time_step: float) -> None:
    """Four arcs in space around a planet of any size, away from the origin: within 1e-7 of its radius."""
    center, restitution = np.array([3.0, -2.0, 1.0]), 0.9
    mu = gravity * planet**2
    up = np.array([0.48, 0.64, 0.6])
    rise = min(0.3 * planet, 2.0)
    state = np.array([(planet + radius + rise) * up, 0.2 * math.sqrt(gravity * rise) * np.array([0.8, -0.6, 0.0])])
    scene = physics.Scene()
    scene.add_field(physics.PointGravity(center=tuple(center), mu=mu))
    scene.add_body(physics.Sphere(planet), motion="static", position=center, material=ELASTIC)
    ball = scene.add_body(
        physics.Sphere(radius), mass=2.0, position=state[0] + center, linear_velocity=state[1],
        material=physics.Material(friction=0.0, restitution=restitution),
    )  # fmt: skip
    world = world_of(scene, time_step)
    start = steps = 0
    begin = 0.0
    for _ in range(4):

        def height(time: float, state: NDArray[np.float64] = state) -> float:
            return float(np.linalg.norm(kepler(state[0], state[1], mu, time)[0])) - planet - radius

        # The speed of the rebound and the fall bracket the arc: it is over before twice the time of uniform gravity.
        times = np.linspace(1e-4, 5.0, 4000) * math.sqrt(rise / gravity)
        below = np.flatnonzero([height(time) < 0.0 for time in times])[0]
        met = brentq(height, times[max(below - 1, 0)], times[below], xtol=1e-15, rtol=1e-15)
        steps = math.floor((begin + met) / time_step)
        if steps > start:
            world.step(steps - start)
            start = steps
            expected = kepler(state[0], state[1], mu, steps * time_step - begin)
            np.testing.assert_allclose(world.position[0, ball] - center, expected[0], atol=1e-7 * planet)
            np.testing.assert_allclose(world.linear_velocity[0, ball], expected[1], atol=1e-7 * planet)
        state, begin = kepler(state[0], state[1], mu, met), begin + met
        normal = state[0] / np.linalg.norm(state[0])
        state[1] -= (1.0 + restitution) * (state[1] @ normal) * normal


def balls(spacing: float, seed: int) -> physics.Scene:
    """216 elastic balls without friction, as close as ``spacing`` radii, a little out of line, over a plane."""
    generator = np.random.default_rng(seed)
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity((0.0, 0.0, -GRAVITY)))
    scene.add_body(physics.Plane(), motion="static", material=ELASTIC)
    for number in range(216):
        cell = np.array([number % 6, number // 6 % 6, number // 36])
        loose = min(0.01, 0.025 * (spacing - 2.0))  # [m] none overlap
        place = spacing * 0.1 * cell + (0.0, 0.0, 0.4) + generator.uniform(-loose, loose, 3)
        scene.add_body(physics.Sphere(0.1), mass=1.0, position=place, material=ELASTIC)
    return scene


def energy_of(world: physics.World) -> float:
    return float(world.kinetic_energy()[0] + world.potential_energy()[0])


@pytest.mark.verify
@pytest.mark.parametrize(("spacing", "time_step"), [(2.3, 1 / 60), (2.1, 1 / 60), (2.5, 1 / 30), (2.1, 1 / 240)])
def test_elastic_balls_however_close(spacing: float, time_step: float) -> None:
    world = world_of(balls(spacing, 3), time_step)
    energy = energy_of(world)
    world.step(round(5.0 / time_step))
    assert energy_of(world) == pytest.approx(energy, rel=1e-9)
    assert int(world.report().event_limit[0]) == 0


def test_no_overlap_is_reported_where_there_is_none() -> None:
    """Balls that struck and went on are told of at the end of the step, where they are then."""
    world = world_of(balls(2.5, 1), 1 / 60)
    for _ in range(70):
        world.step(1)
        places = world.position[0, 1:]
        pairs = cKDTree(places).query_pairs(0.2, output_type="ndarray")
        gaps = np.linalg.norm(places[pairs[:, 0]] - places[pairs[:, 1]], axis=1) - 0.2
        true = max(0.0, 0.1 - places[:, 2].min(), -gaps.min() if len(gaps) else 0.0)
        assert float(world.report().penetration[0]) == pytest.approx(true, abs=1e-9)
