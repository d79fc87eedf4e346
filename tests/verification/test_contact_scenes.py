"""Scenes with closed forms: flight, sliding, rolling, moving ground, stacking and impact.

Tolerances follow from the order of the step: what the trapezoid gets exactly (constant forces) is held to round-off,
and where a change falls inside a step the error is at most what that step can do.
"""

import math

import numpy as np
import pytest

from avalanche_gym import physics
from avalanche_gym.physics import Box, Capsule, Material, Plane, Sphere

GRAVITY = 9.81


def gravity_scene(direction=(0, 0, -1)):
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity(GRAVITY * np.asarray(direction, dtype=float)))
    return scene


def world_of(scene, time_step=1 / 240, **arguments):
    return physics.World(scene, options=physics.Options(time_step=time_step), **arguments)


# --- Flight ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("time_step", [1 / 30, 1 / 240, 1 / 960])
def test_free_fall_is_the_parabola(time_step):
    scene = gravity_scene()
    scene.add_body(Box((0.1, 0.2, 0.3)), mass=1.0, position=(1, 2, 3), linear_velocity=(3, -2, 10))
    world = world_of(scene, time_step)
    steps = round(2.0 / time_step)
    world.step(steps)
    time = steps * time_step
    expected = np.array([1, 2, 3]) + np.array([3, -2, 10]) * time - [0, 0, 0.5 * GRAVITY * time**2]
    np.testing.assert_allclose(world.position[0, 0], expected, atol=1e-12)
    assert abs(world.report().energy_change[0]) < 1e-12 * 100


@pytest.mark.parametrize("eccentricity", [0.5, 0.9])
def test_kepler_orbit_returns_and_keeps_its_energy(eccentricity):
    axis, mu = 10.0, 100.0
    scene = physics.Scene()
    scene.add_field(physics.PointGravity(center=(1, 2, 3), mu=mu))
    nearest = axis * (1 - eccentricity)
    speed = math.sqrt(mu * (1 + eccentricity) / nearest)
    start = np.array([1 + nearest, 2, 3])
    scene.add_body(Sphere(0.1), mass=2.0, position=start, linear_velocity=(0, speed, 0))
    period = 2 * math.pi * math.sqrt(axis**3 / mu)
    world = world_of(scene, period / 500)
    world.step(10 * 500)
    energy = world.kinetic_energy() + world.potential_energy()
    assert energy[0] == pytest.approx(-2.0 * mu / (2 * axis), rel=1e-12)
    assert np.linalg.norm(world.position[0, 0] - start) < 1e-9 * axis


# --- Sliding and rolling --------------------------------------------------------------------------


@pytest.mark.parametrize("time_step", [1 / 60, 1 / 120, 1 / 240])
def test_sliding_box_stops_where_it_should_and_stays(time_step):
    speed, friction = 5.0, 0.5
    scene = gravity_scene()
    scene.add_body(Box((0.2, 0.2, 0.1)), mass=3.0, position=(0, 0, 0.1), linear_velocity=(speed, 0, 0))
    scene.add_body(Plane(), motion="static")
    world = world_of(scene, time_step)
    world.step(round(1.5 / time_step))
    # Only the first step (its contacts are new) and the last (it stops within) are not exact; each errs by less than
    # the distance that friction makes within one step.
    error = world.position[0, 0, 0] - speed**2 / (2 * friction * GRAVITY)
    assert abs(error) < 0.5 * friction * GRAVITY * time_step**2
    before = world.position.copy()
    world.step(round(1.0 / time_step))
    # At rest up to the tolerance of the solver: 1e-12 of what gravity gives in a step.
    assert np.abs(world.linear_velocity[0, 0]).max() < 1e-12 * GRAVITY * time_step
    assert np.abs(world.angular_velocity[0, 0]).max() < 1e-12 * GRAVITY * time_step / 0.1
    assert np.abs(world.position - before).max() < 1e-13


ANGLE = math.radians(20.0)
DOWNHILL = (math.sin(ANGLE), 0.0, -math.cos(ANGLE))


@pytest.mark.parametrize("shape", [Box((0.2, 0.3, 0.1)), Box((0.1, 0.1, 0.1))])
def test_incline_sticks_just_above_and_slips_just_below_the_angle(shape):
    height = shape.half_extents[2]
    for factor, slips in ((1 + 1e-6, False), (1 - 1e-6, True)):
        friction = factor * math.tan(ANGLE)
        scene = gravity_scene(DOWNHILL)
        material = Material(friction=friction)
        scene.add_body(shape, mass=2.0, position=(0, 0, height), material=material)
        scene.add_body(Plane(), motion="static", material=Material(friction=0.0))
        world = world_of(scene)
        world.step(1)
        start = world.position[0, 0, 0]
        world.step(479)
        speed = world.linear_velocity[0, 0, 0]
        if slips:
            acceleration = GRAVITY * (math.sin(ANGLE) - friction * math.cos(ANGLE))
            assert speed == pytest.approx(2.0 * acceleration, rel=1e-6)
        else:
            assert abs(speed) < 1e-12 and abs(world.position[0, 0, 0] - start) < 1e-12


def test_steep_slide_has_the_exact_acceleration():
    scene = gravity_scene(DOWNHILL)
    scene.add_body(Box((0.2, 0.2, 0.05)), mass=2.0, position=(0, 0, 0.05), material=Material(friction=0.1))
    scene.add_body(Plane(), motion="static", material=Material(friction=0.1))
    world = world_of(scene)
    world.step(240)
    expected = GRAVITY * (math.sin(ANGLE) - 0.1 * math.cos(ANGLE))
    assert world.linear_velocity[0, 0, 0] == pytest.approx(expected, rel=1e-9)
    assert world.position[0, 0, 0] == pytest.approx(0.5 * expected, rel=1e-4)


@pytest.mark.parametrize("time_step", [1 / 60, 1 / 240])
def test_sliding_sphere_ends_rolling_at_five_sevenths(time_step):
    speed, friction, radius = 5.0, 0.3, 0.1
    scene = gravity_scene()
    material = Material(friction=friction)
    scene.add_body(Sphere(radius), mass=1.0, position=(0, 0, radius), linear_velocity=(speed, 0, 0), material=material)
    scene.add_body(Plane(), motion="static", material=material)
    world = world_of(scene, time_step)
    world.step(round(1.0 / time_step))
    final = 5 / 7 * speed
    assert world.linear_velocity[0, 0, 0] == pytest.approx(final, rel=1e-9)
    assert world.angular_velocity[0, 0, 1] == pytest.approx(final / radius, rel=1e-9)
    sliding = 2 * speed / (7 * friction * GRAVITY)
    distance = 12 / 49 * speed**2 / (friction * GRAVITY) + final * (1.0 - sliding)
    assert abs(world.position[0, 0, 0] - distance) < 0.5 * friction * GRAVITY * time_step**2
    assert world.position[0, 0, 2] == pytest.approx(radius, abs=1e-10)


def test_sphere_rolls_down_an_incline():
    scene = gravity_scene(DOWNHILL)
    scene.add_body(Sphere(0.1), mass=1.0, position=(0, 0, 0.1))
    scene.add_body(Plane(), motion="static")
    world = world_of(scene)
    world.step(480)
    assert world.linear_velocity[0, 0, 0] == pytest.approx(5 / 7 * GRAVITY * math.sin(ANGLE) * 2.0, rel=1e-9)
    assert world.position[0, 0, 0] == pytest.approx(5 / 14 * GRAVITY * math.sin(ANGLE) * 4.0, rel=1e-4)


@pytest.mark.parametrize("radius", [0.4, 0.6])
def test_a_turntable_carries_what_friction_can_hold(radius):
    """A box on a kinematic disc that turns at w: it goes round iff w^2 r <= mu g."""
    spin, friction = 3.0, 0.5
    scene = gravity_scene()
    material = Material(friction=friction)
    scene.add_body(Box((1.0, 1.0, 0.1)), motion="kinematic", angular_velocity=(0, 0, spin), material=material)
    start = {"linear_velocity": (0, spin * radius, 0), "angular_velocity": (0, 0, spin)}
    box = scene.add_body(Box((0.05, 0.05, 0.05)), mass=1.0, position=(radius, 0, 0.15), material=material, **start)
    world = world_of(scene)
    world.step(240)
    distance = np.linalg.norm(world.position[0, box, :2])
    if spin**2 * radius <= friction * GRAVITY:
        # The table's velocity is taken where the box was when the step began: it spirals out by (w h)^2 r a step.
        assert abs(distance - radius) < 1.1 * spin**2 * radius / 240
        assert world.position[0, box, 2] == pytest.approx(0.15, abs=1e-9)
    else:
        assert distance > radius + 0.1


def test_a_lift_carries_its_load():
    scene = gravity_scene()
    lift = scene.add_body(Box((1.0, 1.0, 0.1)), motion="kinematic", linear_velocity=(0.5, 0.0, 0.25))
    box = scene.add_body(Box((0.1, 0.1, 0.1)), mass=1.0, position=(0, 0, 0.2), linear_velocity=(0.5, 0, 0.25))
    world = world_of(scene)
    world.step(240)
    np.testing.assert_allclose(world.position[0, box] - world.position[0, lift], [0, 0, 0.2], atol=1e-9)
    world.set_state(lift, linear_velocity=(0.5, 0.0, -0.25))
    world.step(240)
    np.testing.assert_allclose(world.position[0, box, 2] - world.position[0, lift, 2], 0.2, atol=1e-9)


# --- Stacks ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("top", [1.0, 1000.0])
def test_a_stack_of_ten_stands_and_bears_the_weights_above(top):
    step, half = 1 / 60, 0.1
    scene = gravity_scene()
    scene.add_body(Plane(), motion="static")
    masses = [1.0] * 9 + [top]
    for level, mass in enumerate(masses):
        scene.add_body(Box((half, half, half)), mass=mass, position=(0, 0, half * (2 * level + 1)))
    world = world_of(scene, step)
    world.step(300)
    expected = half * (2 * np.arange(10) + 1)
    np.testing.assert_allclose(world.position[0, 1:, 2], expected, atol=1e-6)
    np.testing.assert_allclose(world.position[0, 1:, :2], 0.0, atol=1e-6)
    assert world.report().penetration[0] < 1e-6
    contacts = world.contacts()
    for level in range(10):
        force = contacts["impulse"][contacts["body_b"] == level + 1].sum(axis=0) / step
        weight = GRAVITY * sum(masses[level:])
        np.testing.assert_allclose(force, [0, 0, weight], atol=1e-6 * weight)


# --- Impacts --------------------------------------------------------------------------------------


def test_free_collisions_keep_momentum_and_lose_energy():
    """A cloud of mixed bodies flies into itself; nothing else acts."""
    generator = np.random.default_rng(3)
    scene = physics.Scene()
    shapes = (Sphere(0.3), Box((0.2, 0.3, 0.25)), Capsule(0.15, 0.3))
    for index in range(9):
        position = generator.uniform(-1, 1, 3)
        position[0] += 2.0 * (index % 3 - 1)
        scene.add_body(
            shapes[index % 3],
            density=100.0 * 10 ** generator.uniform(0, 2),
            position=position * 1.5,
            linear_velocity=-2.0 * position + generator.normal(size=3),
            angular_velocity=3.0 * generator.normal(size=3),
            material=Material(friction=0.4, restitution=0.5),
        )
    world = world_of(scene)
    linear, angular, energy = world.linear_momentum(), world.angular_momentum(), world.kinetic_energy()
    start = energy[0]
    scale = np.abs(linear).max()
    touched = 0
    for _ in range(12):
        world.step(40)
        touched = max(touched, world.report().contacts[0])
        assert world.kinetic_energy()[0] <= energy[0] * (1 + 1e-12)
        energy = world.kinetic_energy()
        np.testing.assert_allclose(world.linear_momentum(), linear, atol=1e-11 * scale)
    assert touched > 2
    # The lever arms of an impulse are those of the start of its step: first order in the step.
    np.testing.assert_allclose(world.angular_momentum(), angular, atol=2 * start / 240)


@pytest.mark.parametrize("restitution", [0.0, 0.5])
@pytest.mark.parametrize("shape", [Sphere(0.1), Box((0.1, 0.1, 0.1))])
def test_a_heavy_blow_does_not_push_a_resting_body_into_the_ground(shape, restitution):
    """A ball of 100 times the mass falls on a body that the ground already bears."""
    scene = gravity_scene()
    material = Material(restitution=restitution)
    scene.add_body(Plane(), motion="static", material=material)
    scene.add_body(shape, mass=1.0, position=(0, 0, 0.1), material=material)
    scene.add_body(Sphere(0.2), mass=100.0, position=(0, 0, 0.9), material=material)
    world = world_of(scene)
    energy = world.kinetic_energy() + world.potential_energy()
    for _ in range(20):
        world.step(4)
        assert world.report().penetration[0] < 1e-9
        after = world.kinetic_energy() + world.potential_energy()
        assert after <= energy * (1 + 1e-12)
        energy = after
    assert world.position[0, 1, 2] >= 0.1 - 1e-9


@pytest.mark.parametrize("restitution", [0.3, 0.8, 1.0])
def test_a_bounce_returns_the_square_of_the_restitution(restitution):
    scene = gravity_scene()
    scene.add_body(Sphere(0.1), mass=1.0, position=(0, 0, 1.1), material=Material(restitution=restitution))
    scene.add_body(Plane(), motion="static", material=Material(restitution=1.0))
    world = world_of(scene)
    top = math.sqrt(2 / GRAVITY)  # [s] of the fall, then of the top of each arc
    taken = 0
    for bounce in range(1, 4):
        top += (restitution ** (bounce - 1) if bounce > 1 else 0.0) * math.sqrt(2 / GRAVITY)
        top += restitution**bounce * math.sqrt(2 / GRAVITY)
        world.step(round(top * 240) - taken)
        taken = round(top * 240)
        energy = world.kinetic_energy()[0] + world.potential_energy()[0] - 0.1 * GRAVITY
        assert energy == pytest.approx(GRAVITY * restitution ** (2 * bounce), rel=1e-12)


def test_without_restitution_a_ball_stays_where_it_fell():
    scene = gravity_scene()
    scene.add_body(Sphere(0.1), mass=1.0, position=(0, 0, 1.1))
    scene.add_body(Plane(), motion="static", material=Material(restitution=1.0))
    world = world_of(scene)
    world.step(115)
    assert np.abs(world.linear_velocity[0, 0]).max() < 1e-14
    assert world.position[0, 0, 2] == pytest.approx(0.1, abs=1e-12)


@pytest.mark.parametrize("restitution", [0.0, 0.5])
def test_a_box_dropped_flat_rebounds_flat(restitution):
    scene = gravity_scene()
    scene.add_body(Box((0.2, 0.1, 0.1)), mass=1.0, position=(0, 0, 0.6), material=Material(restitution=restitution))
    scene.add_body(Plane(), motion="static", material=Material(restitution=1.0))
    world = world_of(scene)
    world.step(math.ceil(240 * math.sqrt(1 / GRAVITY)) + 2)
    energy = world.kinetic_energy()[0] + world.potential_energy()[0] - 0.1 * GRAVITY
    assert energy == pytest.approx(restitution**2 * 0.5 * GRAVITY, rel=1e-10, abs=1e-12)
    assert np.abs(world.angular_velocity[0, 0]).max() < 1e-10
