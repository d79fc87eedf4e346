"""Which broad phase a world has, and that it changes no bit."""

from __future__ import annotations

import numpy as np
import pytest

from avalanche_gym import physics
from avalanche_gym.physics import stages


def cluttered(offset: float) -> physics.Scene:
    """Bodies of sizes from 2 cm to 200 m that fall on a plane, on static blocks and on each other."""
    generator = np.random.default_rng(3)
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity((0.0, 0.0, -9.81)))
    scene.add_body(physics.Plane(), motion="static")
    scene.add_body(physics.Box((100.0, 100.0, 0.01)), motion="static", position=(offset, 0.0, 0.05))
    for number in range(40):
        place = (offset + generator.uniform(-1, 1), generator.uniform(-1, 1), generator.uniform(0.2, 1.0))
        size = 10.0 ** generator.uniform(-2.0, -0.7)
        if number % 2:
            scene.add_body(physics.Sphere(size), position=place, linear_velocity=generator.normal(size=3))
        else:
            scene.add_body(physics.Box((size, size, 0.5 * size)), position=place, motion="static")
    return scene


@pytest.mark.parametrize("offset", [0.0, 1e6])
def test_the_broad_phase_changes_no_bit(monkeypatch, offset):
    worlds = []
    for limit in (0, 1000):
        monkeypatch.setattr(stages, "GRID_FROM", limit)
        world = physics.World(cluttered(offset), num_worlds=2)
        world.apply_impulse(3, (0.5, 0.0, 0.0), world=1)
        for _ in range(6):
            world.step(20)
        assert ("hash grid" in world.features) == (limit == 0)
        worlds.append(world)
    grid, pairs = worlds
    assert grid.report().contacts.min() > 5
    for name in ("position", "orientation", "linear_velocity", "angular_velocity"):
        np.testing.assert_array_equal(getattr(grid, name), getattr(pairs, name))


def test_bodies_that_are_placed_elsewhere_are_found_there(monkeypatch):
    monkeypatch.setattr(stages, "GRID_FROM", 0)
    scene = physics.Scene()
    one = scene.add_body(physics.Sphere(1.0))
    two = scene.add_body(physics.Sphere(1.0), position=(5.0, 0.0, 0.0))
    world = physics.World(scene)
    world.step()
    assert len(world.contacts()) == 0
    for place in ((1.9, 0.0, 0.0), (1e9, 0.0, 0.0), (-1.9, 0.0, 0.0)):
        world.set_state(one, position=(0.0, 0.0, 0.0))
        world.set_state(two, position=place)
        world.step()
        assert len(world.contacts()) == (abs(place[0]) < 2.0)
