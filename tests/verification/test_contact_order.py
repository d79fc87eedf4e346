"""Order 2 of the smooth step, and what it keeps: stopping, turning ground, curved ground, rolling rims."""

import numpy as np
import pytest

from avalanche_gym import physics

GRAVITY = 9.81


def world_of(time_step, *, bodies, gravity=(0.0, 0.0, -GRAVITY), **options):
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity(gravity))
    for shape, arguments in bodies:
        scene.add_body(shape, **arguments)
    return physics.World(scene, options=physics.Options(time_step=time_step, **options))


def stopping_error(rate, heading=0.0):
    material = physics.Material(friction=0.5)
    velocity = (5.0 * np.cos(heading), 5.0 * np.sin(heading), 0.0)
    ground = (physics.Plane(), {"motion": "static", "material": material})
    box = {"mass": 1.0, "position": (0.0, 0.0, 0.1), "linear_velocity": velocity, "material": material}
    world = world_of(1.0 / rate, bodies=[ground, (physics.Box((0.2, 0.2, 0.1)), box)])
    world.step(int(1.2 * rate))
    return abs(np.linalg.norm(world.position[0, 1, :2]) - 25.0 / GRAVITY)


def test_the_stopping_distance_has_order_two():
    rates = np.array([30, 60, 120, 240, 480, 960, 1920])
    errors = np.array([stopping_error(rate) for rate in rates])
    assert errors[1] < 1e-4 and errors[3] < 1e-5
    assert -np.polyfit(np.log(rates), np.log(errors), 1)[0] > 1.9


def test_the_cone_is_round():
    material = physics.Material(friction=0.5)
    speeds = []
    for heading in np.linspace(0.0, 0.5 * np.pi, 7):
        velocity = (5.0 * np.cos(heading), 5.0 * np.sin(heading), 0.0)
        ground = (physics.Plane(), {"motion": "static", "material": material})
        box = {"mass": 1.0, "position": (0.0, 0.0, 0.1), "linear_velocity": velocity, "material": material}
        world = world_of(1 / 60, bodies=[ground, (physics.Box((0.2, 0.2, 0.1)), box)])
        world.step(30)
        speeds.append(np.linalg.norm(world.linear_velocity[0, 1]))
    np.testing.assert_allclose(speeds, 5.0 - 0.5 * GRAVITY * 0.5, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("share", [0.99, 1.01])
def test_a_turning_disk_carries_a_box_that_friction_can_hold(share):
    """r w^2 = share mu g: it keeps its place on the disk for 10 s, or slides off."""
    radius, friction = 1.0, 0.3
    spin = np.sqrt(share * friction * GRAVITY / radius)
    material = physics.Material(friction=friction)
    disk = {"motion": "kinematic", "angular_velocity": (0.0, 0.0, spin), "material": material}
    box = {
        "mass": 1.0, "position": (radius, 0.0, 0.15), "material": material,
        "linear_velocity": (0.0, spin * radius, 0.0), "angular_velocity": (0.0, 0.0, spin),
    }  # fmt: skip
    world = world_of(1 / 240, bodies=[(physics.Cylinder(1.5, 0.1), disk), (physics.Box((0.05, 0.05, 0.05)), box)])
    world.step(2400)
    angle = spin * 10.0
    turned = np.array([np.cos(angle), np.sin(angle)]) * radius
    moved = np.linalg.norm(world.position[0, 1, :2] - turned)
    assert moved < 1e-6 if share < 1.0 else moved > 0.1


def test_a_ball_in_a_smooth_bowl_swings_with_order_two():
    """A pendulum of length 1.95 from 30 degrees; the period by the elliptic integral, which four swings return to."""
    from scipy.special import ellipk

    length = 1.95
    period = 4.0 * np.sqrt(length / GRAVITY) * ellipk(np.sin(np.radians(15.0)) ** 2)
    x = np.linspace(-1.25, 1.25, 129)
    heights = 2.0 - np.sqrt(4.0 - x[:, None] ** 2 - x[None, :] ** 2)
    start = length * np.array([np.sin(np.radians(30.0)), 0.0, -np.cos(np.radians(30.0))]) + (0.0, 0.0, 2.0)
    smooth = physics.Material(friction=0.0)
    errors = []
    for steps in (320, 640):
        ground = (physics.HeightField(heights, (2.5, 2.5), surface="smooth"), {"motion": "static", "material": smooth})
        ball = {"mass": 1.0, "position": start, "material": smooth}
        world = world_of(period / steps, bodies=[ground, (physics.Sphere(0.05), ball)])
        before = world.potential_energy()[0]
        world.step(2 * steps)
        errors.append(abs(world.kinetic_energy()[0] + world.potential_energy()[0] - before))
        assert np.linalg.norm(world.position[0, 1] - start) < 1e-3
    assert errors[1] < 0.3 * errors[0]


def test_a_very_heavy_body_rests_on_light_ones():
    boxes = [(physics.Plane(), {"motion": "static"})]
    for i in range(10):
        mass = 1e6 if i == 9 else 1.0
        boxes.append((physics.Box((0.1, 0.1, 0.1)), {"mass": mass, "position": (0.0, 0.0, 0.1 + 0.2 * i)}))
    world = world_of(1 / 240, bodies=boxes)
    start = world.position.copy()
    world.step(480)
    assert np.abs(world.position - start).max() < 1e-7


@pytest.mark.verify
@pytest.mark.parametrize("share", [1.0 + 1e-6, 1.0 / 0.95])
def test_a_box_sticks_on_an_incline_for_an_hour(share):
    angle = np.radians(20.0)
    material = physics.Material(friction=share * np.tan(angle))
    gravity = (GRAVITY * np.sin(angle), 0.0, -GRAVITY * np.cos(angle))
    box = {"mass": 2.0, "position": (0.0, 0.0, 0.1), "material": material}
    ground = (physics.Plane(), {"motion": "static", "material": physics.Material(friction=0.0)})
    world = world_of(1 / 60, bodies=[ground, (physics.Box((0.2, 0.3, 0.1)), box)], gravity=gravity, sleeping=False)
    world.step(60)
    start = world.position[0, 1].copy()
    for _ in range(60):
        world.step(3600)
        assert np.abs(world.linear_velocity[0, 1]).max() < 1e-12
    assert np.abs(world.position[0, 1] - start).max() < 1e-12 * 3600.0
