"""Heaps and walls of many layers, whose load the pile tier has to carry down through all of them, come to rest."""

from __future__ import annotations

import numpy as np
import pytest

from avalanche_gym import physics

WIDTH, STEEP = 1.0, 8.0  # [m] of the pit, and the slope of its walls
RADIUS, LAYER = 0.06, 16  # [m], and bodies of a layer as they are dropped


def pit(count: int) -> physics.Scene:
    """Spheres, boxes and capsules in turn that fall into a pit; they fill it in layers of some 45 bodies."""
    generator = np.random.default_rng(0)
    line = np.linspace(-1.0, 1.0, 65)
    x, y = np.meshgrid(line, line)
    heights = np.clip(STEEP * (np.maximum(np.abs(x), np.abs(y)) - WIDTH / 2), 0.0, 2.5)
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity((0.0, 0.0, -9.81)))
    scene.add_body(physics.HeightField(heights, (2.0, 2.0)), motion="static")
    for number in range(count):
        layer, cell = divmod(number, LAYER)
        place = 0.2 * (np.array([cell % 4, cell // 4]) - 1.5) + generator.uniform(-0.02, 0.02, 2)
        box = physics.Box(RADIUS * generator.uniform(0.6, 1.0, 3))
        shape = (physics.Sphere(RADIUS), box, physics.Capsule(0.75 * RADIUS, 0.05))[number % 3]
        scene.add_body(shape, density=1000.0, position=(*place, 0.15 + 0.16 * layer))
    return scene


@pytest.mark.parametrize(("count", "rate"), [(1000, 60), (900, 30)])
def test_a_deep_heap_comes_to_rest(count: int, rate: int) -> None:
    # 20 layers trembled at 4 cm/s and dipped 15 mm into each other for ever, since loads of contacts that had opened by
    # 0.1 % were forgotten; at 30 steps a second they sank at 1 m/s, as fast as they were pushed apart.
    world = physics.World(pit(count), options=physics.Options(time_step=1.0 / rate, sleeping=False))
    world.step(6 * rate)
    speed = np.linalg.norm(world.linear_velocity[0, 1:], axis=1)
    depth = np.maximum(-world.contacts()["gap"], 0.0)
    assert np.quantile(speed, 0.9) < 2e-3
    assert np.percentile(depth, 99) < 1e-3


def test_bodies_of_a_heap_that_falls_do_not_end_a_step_in_each_other() -> None:
    """Balls against balls in closed form, all others as reported: 3 mm in any step, 1 mm for 99 of 100 contacts.

    Where many are stopped at once while others fall on, six rounds of parting left a box 16 mm deep in its neighbour.
    """
    world = physics.World(pit(700), options=physics.Options(time_step=1.0 / 60.0, sleeping=False))
    balls = [handle for handle, body in enumerate(world.scene.bodies) if isinstance(body.shape, physics.Sphere)]
    depths = []
    for _ in range(90):
        world.step(1)
        depths.append(np.maximum(-world.contacts()["gap"], 0.0))
        places = world.position[0, balls]
        apart = np.linalg.norm(places[:, None] - places[None], axis=2) + 1e3 * np.eye(len(places))
        assert max(world.report().penetration[0], 2 * RADIUS - apart.min()) <= 3e-3
    assert np.percentile(np.concatenate(depths), 99) <= 1e-3


def test_what_is_pushed_far_is_reported_where_it_ends() -> None:
    # Spheres that a falling heap pushed through others within a step were reported as open: 6 cm.
    world = physics.World(pit(900), options=physics.Options(time_step=1.0 / 30.0, substeps=1, sleeping=False))
    spheres = [handle for handle, body in enumerate(world.scene.bodies) if isinstance(body.shape, physics.Sphere)]
    for _ in range(30):
        world.step(1)
        places = world.position[0, spheres]
        apart = np.linalg.norm(places[:, None] - places[None], axis=2) + 1e3 * np.eye(len(places))
        assert world.report().penetration[0] >= 2 * RADIUS - apart.min() - 1e-9


def test_a_thin_wall_with_gaps_rests_with_more_substeps() -> None:
    # One brick thick, twelve high: with the eight substeps of the default it sways at 1/60 s (docs/solver.md).
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity((0.0, 0.0, -9.81)))
    scene.add_body(physics.Plane(), motion="static")
    for row in range(12):
        for column in range(12):
            place = (0.2 * column + 0.1 * (row % 2), 0.0, 0.05 + 0.101 * row)
            scene.add_body(physics.Box((0.1, 0.05, 0.05)), density=1000.0, position=place)
    world = physics.World(scene, options=physics.Options(time_step=1.0 / 60.0, substeps=32, sleeping=False))
    world.step(600)
    assert np.linalg.norm(world.linear_velocity[0], axis=1).max() < 1e-3
    assert np.abs(world.position[0, 1:, 1]).max() < 0.1
