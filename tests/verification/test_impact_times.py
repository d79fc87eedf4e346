"""Impacts located in time: bounces, Zeno, the cradle, oblique blows. Ground truth in closed form."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import brentq

from avalanche_gym import physics

GRAVITY = 9.81
WEIGHT = 1000.0 * 4.0 / 3.0 * math.pi * 0.1**3 * GRAVITY  # [N] of a ball of radius 0.1 m
STEPS = (1 / 30, 1 / 60, 1 / 240, 1 / 960)


def world_of(scene: physics.Scene, time_step: float, **options: bool) -> physics.World:
    return physics.World(scene, options=physics.Options(time_step=time_step, **options))


def falling(shape: physics.Shape, height: float, restitution: float) -> tuple[physics.Scene, int]:
    """A body at ``height`` [m] over a plane that leaves the restitution to it."""
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity((0.0, 0.0, -GRAVITY)))
    scene.add_body(physics.Plane(), motion="static", material=physics.Material(restitution=1.0))
    material = physics.Material(friction=0.5, restitution=restitution)
    body = scene.add_body(shape, density=1000.0, position=(0.0, 0.0, height), material=material)
    return scene, body


@pytest.mark.parametrize("time_step", STEPS)
@pytest.mark.parametrize(("restitution", "count"), [(0.8, 4), (0.3, 1), (0.5, 2), (0.95, 4)])
def test_apexes_are_those_of_the_parabolas(time_step: float, restitution: float, count: int) -> None:
    scene, ball = falling(physics.Sphere(0.1), 1.1, restitution)
    world = world_of(scene, time_step)
    fall = math.sqrt(2.0 / GRAVITY)
    taken = 0
    for bounce in range(1, count + 1):
        top = fall * (1.0 + 2.0 * sum(restitution**k for k in range(1, bounce)) + restitution**bounce)
        world.step(round(top / time_step) - taken)
        taken = round(top / time_step)
        energy = GRAVITY * (world.position[0, ball, 2] - 0.1) + 0.5 * world.linear_velocity[0, ball, 2] ** 2
        assert energy == pytest.approx(GRAVITY * restitution ** (2 * bounce), rel=1e-12)


@pytest.mark.parametrize("time_step", [1 / 60, 1 / 240])
def test_a_bounce_without_loss_keeps_its_energy(time_step: float) -> None:
    scene, ball = falling(physics.Sphere(0.1), 1.1, 1.0)
    world = world_of(scene, time_step)
    events = 0
    for _ in range(20):
        world.step(round(1.0 / time_step))
        events += int(world.report().events[0])
        energy = GRAVITY * (world.position[0, ball, 2] - 0.1) + 0.5 * world.linear_velocity[0, ball, 2] ** 2
        assert energy == pytest.approx(GRAVITY, rel=1e-12)
    assert events == 22
    assert int(world.report().event_limit[0]) == 0


@pytest.mark.parametrize("time_step", STEPS)
@pytest.mark.parametrize("restitution", [0.2, 0.5, 0.8, 0.95])
def test_an_endless_sequence_ends_at_its_closed_form_time(time_step: float, restitution: float) -> None:
    scene, ball = falling(physics.Sphere(0.1), 0.35, restitution)
    world = world_of(scene, time_step)
    end = math.sqrt(2 * 0.25 / GRAVITY) * (1 + restitution) / (1 - restitution)
    steps = math.floor(end / time_step)
    world.step(steps - 1)
    assert abs(world.linear_velocity[0, ball, 2]) + world.position[0, ball, 2] - 0.1 > 1e-9  # still bouncing
    world.step(2)  # past the end
    assert abs(world.linear_velocity[0, ball, 2]) < 1e-12
    assert world.position[0, ball, 2] == pytest.approx(0.1, abs=1e-12)
    world.step(100)
    assert int(world.report().events[0]) == 0
    assert world.contacts()["impulse"][0, 2] == pytest.approx(WEIGHT * time_step, rel=1e-9)


def test_a_bounce_shows_in_the_contacts_and_the_report() -> None:
    scene, _ = falling(physics.Sphere(0.1), 0.1 + 1e-3, 0.5)
    world = world_of(scene, 1 / 60)
    world.step(1)
    assert int(world.report().events[0]) >= 1
    blow = world.contacts()["impulse"][0, 2]
    mass = WEIGHT / GRAVITY
    # Momentum balance over the step: what the contact gave is what the ball gained beside gravity's part.
    assert blow == pytest.approx(mass * (world.linear_velocity[0, 1, 2] + GRAVITY / 60), rel=1e-9)


@pytest.mark.parametrize("time_step", [1 / 60, 1 / 240])
@pytest.mark.parametrize("shape", [physics.Box((0.1, 0.2, 0.3)), physics.Cylinder(0.2, 0.3)], ids=["box", "cylinder"])
def test_what_falls_flat_rebounds_flat(shape: physics.Shape, time_step: float) -> None:
    scene, body = falling(shape, 0.8, 0.5)
    world = world_of(scene, time_step)
    fall = math.sqrt(2 * 0.5 / GRAVITY)
    world.step(round(fall / time_step) + 4)
    energy = GRAVITY * (world.position[0, body, 2] - 0.3) + 0.5 * world.linear_velocity[0, body, 2] ** 2
    assert energy == pytest.approx(0.25 * GRAVITY * 0.5, rel=1e-10)
    assert np.abs(world.angular_velocity[0, body]).max() < 1e-10


@pytest.mark.parametrize("time_step", STEPS)
@pytest.mark.parametrize("count", [1, 2, 3, 4])
@pytest.mark.parametrize("gap", [0.0, 1e-3])
def test_a_cradle_sends_out_as_many_as_came_in(count: int, gap: float, time_step: float) -> None:
    scene = physics.Scene()
    material = physics.Material(friction=0.0, restitution=1.0)
    for number in range(5):
        struck = number >= count
        place = number * (0.2 + gap) - (0.0 if struck else 0.5)
        velocity = (0.0 if struck else 2.0, 0.0, 0.0)
        scene.add_body(
            physics.Sphere(0.1), mass=1.0, position=(place, 0.0, 0.0), linear_velocity=velocity, material=material
        )
    world = world_of(scene, time_step)
    world.step(round(1.0 / time_step))
    expected = np.where(np.arange(5) >= 5 - count, 2.0, 0.0)
    np.testing.assert_allclose(world.linear_velocity[0, :, 0], expected, atol=1e-12)


@pytest.mark.parametrize("time_step", [1 / 60, 1 / 240])
@pytest.mark.parametrize("friction", [0.0, 0.05, 0.2, 0.5, 3.0])
@pytest.mark.parametrize("restitution", [0.0, 0.9])
@pytest.mark.parametrize("others", [0, 12])
def test_an_oblique_blow_between_spheres(restitution: float, friction: float, others: int, time_step: float) -> None:
    """Slip limited by mu times the normal impulse, or what stops the slip: (2/7) m_eff |u_t|.

    However many bodies are elsewhere in the world.
    """
    radii, masses = np.array([0.1, 0.15]), np.array([1.3, 0.7])
    places = np.array([[-0.6, 0.0, 0.0], [0.0, 0.08, 0.05]])
    velocities = np.array([[3.0, 0.4, -0.2], [-1.0, 0.1, 0.3]])
    spins = np.array([[3.0, -5.0, 7.0], [-2.0, 4.0, 1.0]])
    scene = physics.Scene()
    material = physics.Material(friction=friction, restitution=math.sqrt(restitution))
    for body in range(2):
        scene.add_body(
            physics.Sphere(radii[body]), mass=masses[body], position=places[body], linear_velocity=velocities[body],
            angular_velocity=spins[body], material=material,
        )  # fmt: skip
    for number in range(others):
        scene.add_body(physics.Sphere(0.1), mass=1.0, position=(9.0, 0.0, float(number)))
    world = world_of(scene, time_step)
    world.step(round(0.5 / time_step))

    apart, drift = places[1] - places[0], velocities[1] - velocities[0]
    a, b, c = drift @ drift, 2 * apart @ drift, apart @ apart - radii.sum() ** 2
    normal = apart + drift * (-b - math.sqrt(b * b - 4 * a * c)) / (2 * a)
    normal /= np.linalg.norm(normal)
    slip = drift + np.cross(spins[1], -radii[1] * normal) - np.cross(spins[0], radii[0] * normal)
    reduced = 1.0 / (1.0 / masses).sum()
    load = -(1.0 + restitution) * (slip @ normal) * reduced
    push = -2.0 / 7.0 * reduced * (slip - (slip @ normal) * normal)
    push *= min(1.0, friction * load / np.linalg.norm(push))
    impulse = push + load * normal
    for body, sign in ((0, -1.0), (1, 1.0)):
        velocity = velocities[body] + sign * impulse / masses[body]
        inertia = 0.4 * masses[body] * radii[body] ** 2
        spin = spins[body] + np.cross(-sign * radii[body] * normal, sign * impulse) / inertia
        np.testing.assert_allclose(world.linear_velocity[0, body], velocity, atol=1e-12)
        np.testing.assert_allclose(world.angular_velocity[0, body], spin, atol=1e-11)


@pytest.mark.parametrize("time_step", STEPS)
@pytest.mark.parametrize("friction", [0.0, 0.2, 3.0])
def test_a_ball_falls_on_a_box_that_rests(friction: float, time_step: float) -> None:
    """Without rebound, coming from the side, on a box that may slide: (1 + 5/2) / m + 1 / m_box resists the slip."""
    mass, carrier, radius, drift, height = 1.0, 5.0, 0.1, 1.0, 0.4
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity((0.0, 0.0, -GRAVITY)))
    smooth = physics.Material(friction=0.0)
    scene.add_body(physics.Plane(), motion="static", material=smooth)
    box = scene.add_body(physics.Box((1.0, 1.0, 0.2)), mass=carrier, position=(0, 0, 0.2), material=smooth)
    ball = scene.add_body(
        physics.Sphere(radius), mass=mass, position=(-0.5, 0, 0.4 + radius + height), linear_velocity=(drift, 0, 0),
        material=physics.Material(friction=friction),
    )  # fmt: skip
    world = world_of(scene, time_step)
    duration = 0.5
    world.step(round(duration / time_step))

    fall = math.sqrt(2 * height / GRAVITY)
    give = 3.5 / mass + 1.0 / carrier
    push = min(friction * mass * GRAVITY * fall, drift / give)
    slip = drift - push * give
    slides = min(duration - fall, slip / (friction * mass * GRAVITY * give)) if friction > 0.0 else 0.0
    push += friction * mass * GRAVITY * slides
    assert world.linear_velocity[0, ball, 0] == pytest.approx(drift - push / mass, abs=1e-6)
    assert world.linear_velocity[0, box, 0] == pytest.approx(push / carrier, abs=1e-6)
    assert world.angular_velocity[0, ball, 1] == pytest.approx(2.5 * push / (mass * radius), abs=1e-5)
    assert world.position[0, ball, 2] == pytest.approx(0.4 + radius, abs=1e-6)


def kepler_state(
    place: NDArray[np.float64], velocity: NDArray[np.float64], mu: float, time: float
) -> NDArray[np.float64]:
    """Place and velocity in the plane after ``time`` on a Kepler ellipse, by its eccentric anomaly."""
    r, v2 = np.linalg.norm(place), velocity @ velocity
    axis = 1.0 / (2.0 / r - v2 / mu)
    momentum = place[0] * velocity[1] - place[1] * velocity[0]
    eccentric = ((v2 - mu / r) * place - (place @ velocity) * velocity) / mu
    e = np.linalg.norm(eccentric)
    x = eccentric / e
    y = np.array([-x[1], x[0]]) * np.sign(momentum)
    begin = math.atan2((place @ velocity) / (e * math.sqrt(mu * axis)), (1 - r / axis) / e)
    mean = begin - e * math.sin(begin) + math.sqrt(mu / axis**3) * time
    anomaly = brentq(lambda E: E - e * math.sin(E) - mean, mean - 1.1, mean + 1.1, xtol=1e-15, rtol=1e-15)
    flat = math.sqrt(1 - e * e)
    rate = math.sqrt(mu / axis**3) / (1 - e * math.cos(anomaly))
    where = axis * ((math.cos(anomaly) - e) * x + flat * math.sin(anomaly) * y)
    how = axis * rate * (-math.sin(anomaly) * x + flat * math.cos(anomaly) * y)
    return np.concatenate([where, how])


@pytest.mark.parametrize("time_step", [1 / 60, 1 / 240])
def test_bounces_on_a_planet(time_step: float) -> None:
    """Four arcs of Kepler ellipses between rebounds from a sphere, without friction."""
    mu, planet, radius, restitution = 100.0, 3.0, 0.1, 0.8
    place, velocity = np.array([4.0, 0.0]), np.array([0.5, 2.0])
    scene = physics.Scene()
    scene.add_field(physics.PointGravity(center=(0, 0, 0), mu=mu))
    material = physics.Material(friction=0.0, restitution=math.sqrt(restitution))
    scene.add_body(physics.Sphere(planet), motion="static", material=material)
    ball = scene.add_body(
        physics.Sphere(radius), mass=2.0, position=(*place, 0.0), linear_velocity=(*velocity, 0.0), material=material
    )
    world = world_of(scene, time_step)
    duration = 3.0
    world.step(round(duration / time_step))

    left, state, bounces = duration, np.concatenate([place, velocity]), 0
    while True:

        def height(time: float, state: NDArray[np.float64] = state) -> float:
            return float(np.linalg.norm(kepler_state(state[:2], state[2:], mu, time)[:2]) - planet - radius)

        times = np.linspace(1e-3, left, 4000)
        below = [t for t in times if height(t) < 0.0]
        if not below:
            break
        hit = brentq(height, below[0] - (times[1] - times[0]), below[0], xtol=1e-15, rtol=1e-15)
        state = kepler_state(state[:2], state[2:], mu, hit)
        up = state[:2] / np.linalg.norm(state[:2])
        state[2:] -= (1 + restitution) * (state[2:] @ up) * up
        left -= hit
        bounces += 1
    assert bounces >= 4
    state = kepler_state(state[:2], state[2:], mu, left)
    np.testing.assert_allclose(world.position[0, ball, :2], state[:2], atol=1e-7)
    np.testing.assert_allclose(world.linear_velocity[0, ball, :2], state[2:], atol=1e-7)


def test_what_happens_does_not_depend_on_the_step() -> None:
    """A cloud of bodies that turn flies into itself: seven blows between exact flights."""

    def velocities(time_step: float) -> NDArray[np.float64]:
        generator = np.random.default_rng(3)
        scene = physics.Scene()
        shapes = (physics.Sphere(0.3), physics.Box((0.2, 0.3, 0.25)), physics.Capsule(0.15, 0.3))
        for index in range(9):
            place = generator.uniform(-1, 1, 3)
            place[0] += 2.0 * (index % 3 - 1)
            scene.add_body(
                shapes[index % 3], density=100.0 * 10 ** generator.uniform(0, 2), position=place * 1.5,
                linear_velocity=-2.0 * place + generator.normal(size=3),
                angular_velocity=3.0 * generator.normal(size=3),
                material=physics.Material(friction=0.4, restitution=0.5),
            )  # fmt: skip
        world = world_of(scene, time_step)
        world.step(round(0.55 / time_step))
        return world.linear_velocity[0]

    expected = velocities(1 / 960)
    for time_step in (1 / 20, 1 / 60, 1 / 240):
        np.testing.assert_allclose(velocities(time_step), expected, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("spin", [0.0, 3.0])
def test_energy_never_grows(spin: float) -> None:
    """Tumbling boxes with friction and restitution on a plane and on each other."""
    generator = np.random.default_rng(3)
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity((0.0, 0.0, -GRAVITY)))
    material = physics.Material(friction=0.6, restitution=0.8)
    scene.add_body(physics.Plane(), motion="static", material=material)
    for number in range(6):
        axis = generator.normal(size=4)
        scene.add_body(
            physics.Box(generator.uniform(0.05, 0.2, 3)), density=500.0,
            position=(0.3 * (number % 2), 0.3 * (number // 2 % 2), 0.5 + 0.4 * number),
            orientation=axis / np.linalg.norm(axis), angular_velocity=spin * generator.normal(size=3),
            material=material,
        )  # fmt: skip
    world = world_of(scene, 1 / 240)
    energy = float(world.kinetic_energy()[0] + world.potential_energy()[0])
    for _ in range(480):
        world.step(1)
        now = float(world.kinetic_energy()[0] + world.potential_energy()[0])
        assert now <= energy + 1e-7 * abs(energy)
        energy = now


def test_elastic_balls_keep_their_energy() -> None:
    from avalanche_gym.physics.scenes.piles import ball_cube

    world = world_of(ball_cube(1.0, 0.0), 1 / 240)
    energy = float(world.kinetic_energy()[0] + world.potential_energy()[0])
    world.step(5 * 240)
    assert float(world.kinetic_energy()[0] + world.potential_energy()[0]) == pytest.approx(energy, rel=1e-9)
    assert int(world.report().event_limit[0]) == 0


def test_a_snapshot_and_a_lane_see_the_same_bits() -> None:
    scene, _ = falling(physics.Sphere(0.1), 0.6, 0.9)
    single = world_of(scene, 1 / 60)
    batch = physics.World(scene, num_worlds=3, options=physics.Options(time_step=1 / 60))
    single.step(40)
    batch.step(40)
    snapshot = single.snapshot()
    single.step(30)
    batch.step(30)
    for lane in range(3):
        np.testing.assert_array_equal(batch.position[lane], single.position[0])
    after = single.position.copy()
    single.restore(snapshot)
    single.step(30)
    np.testing.assert_array_equal(single.position, after)
