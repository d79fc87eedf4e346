"""Rolling and torsional friction against closed forms.

A rolling sphere, m v' = -F, (2/5) m r^2 w' = F r - rho m g with v = w r, slows down by (5/7) rho g / r; a sphere that
spins about the vertical, (2/5) m r^2 w' = -tau m g, by (5/2) tau g / r^2.
"""

import numpy as np
import pytest

from avalanche_gym import physics

GRAVITY, RADIUS = 9.81, 0.1


def world_of(material, time_step, *, angle=0.0, shape=None, **state):
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity((GRAVITY * np.sin(angle), 0.0, -GRAVITY * np.cos(angle))))
    scene.add_body(physics.Plane(), motion="static", material=physics.Material(friction=0.0))
    shape = shape or physics.Sphere(RADIUS)
    scene.add_body(shape, mass=2.0, position=(0.0, 0.0, RADIUS), material=material, **state)
    return physics.World(scene, options=physics.Options(time_step=time_step))


@pytest.mark.parametrize("time_step", [1 / 60, 1 / 240])
@pytest.mark.parametrize("heading", [0.0, 0.7])
def test_a_rolling_sphere_slows_down_evenly_and_stops(time_step, heading):
    rolling, speed = 0.005, 1.0
    along = np.array([np.cos(heading), np.sin(heading), 0.0])
    spin = speed / RADIUS * np.array([-along[1], along[0], 0.0])
    material = physics.Material(friction=0.5, rolling_friction=rolling)
    world = world_of(material, time_step, linear_velocity=speed * along, angular_velocity=spin)
    deceleration = 5 / 7 * rolling * GRAVITY / RADIUS
    world.step(round(1.0 / time_step))
    assert world.linear_velocity[0, 1] @ along == pytest.approx(speed - deceleration, abs=1e-10)
    assert world.position[0, 1] @ along == pytest.approx(speed - 0.5 * deceleration, abs=1e-9)
    world.step(round(3.0 / time_step))
    assert np.abs(world.linear_velocity[0, 1]).max() < 1e-12
    # The instant of rest lies somewhere in its step.
    stop = speed**2 / (2 * deceleration)
    assert world.position[0, 1] @ along == pytest.approx(stop, abs=deceleration * time_step**2 / 7)


def test_a_sphere_that_spins_on_the_spot_slows_down_evenly_and_stops():
    torsional, speed = 0.001, 4.0
    material = physics.Material(friction=0.5, torsional_friction=torsional)
    world = world_of(material, 1 / 240, angular_velocity=(0.0, 0.0, speed))
    deceleration = 2.5 * torsional * GRAVITY / RADIUS**2
    world.step(240)
    assert world.angular_velocity[0, 1, 2] == pytest.approx(speed - deceleration, abs=1e-9)
    world.step(240)
    assert np.abs(world.angular_velocity[0, 1]).max() < 1e-11
    assert np.abs(world.position[0, 1, :2]).max() < 1e-12


@pytest.mark.parametrize("share", [0.98, 1.02])
def test_a_sphere_stays_on_a_slope_below_rolling_friction_over_radius(share):
    """It rolls if tan(angle) > rho / r."""
    rolling = 0.01
    angle = np.arctan(share * rolling / RADIUS)
    world = world_of(physics.Material(friction=0.5, rolling_friction=rolling), 1 / 240, angle=angle)
    world.step(480)
    if share < 1.0:
        assert abs(world.linear_velocity[0, 1, 0]) < 1e-12
    else:
        rate = 5 / 7 * GRAVITY * (np.sin(angle) - rolling / RADIUS * np.cos(angle))
        assert world.linear_velocity[0, 1, 0] == pytest.approx(2.0 * rate, rel=1e-6)


def test_features_name_what_the_materials_ask_for():
    rolls = world_of(physics.Material(rolling_friction=0.01), 1 / 240).features
    assert "rolling friction" in rolls.modelled and "torsional friction" in rolls.left_out
    plain = world_of(physics.Material(), 1 / 240).features
    assert {"rolling friction", "torsional friction"} <= set(plain.left_out)


def test_mixed_bodies_on_rough_ground_come_to_rest():
    rng = np.random.default_rng(3)
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity((0.0, 0.0, -GRAVITY)))
    material = physics.Material(friction=0.5, rolling_friction=0.005)
    scene.add_body(physics.HeightField(0.1 * rng.random((17, 17)), (4.0, 4.0)), motion="static", material=material)
    shapes = (physics.Sphere(0.1), physics.Capsule(0.08, 0.1), physics.Box((0.1, 0.12, 0.08)))
    for number in range(6):
        place = (0.8 * (number % 3) - 0.8, 0.8 * (number // 3) - 0.4, 0.5)
        scene.add_body(shapes[number % 3], density=500.0, position=place, material=material)
    world = physics.World(scene, options=physics.Options(time_step=1 / 120, sleeping=False))
    world.step(20 * 120)
    assert np.abs(world.linear_velocity[0, 1:]).max() < 1e-6
