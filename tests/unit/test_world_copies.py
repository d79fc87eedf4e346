"""Copies of a World, by ``copy`` and by ``pickle``: worlds of their own, bit for bit in the same state."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable

import numpy as np
import pytest

from avalanche_gym import physics

PUBLIC = ("position", "orientation", "linear_velocity", "angular_velocity")


def bits(world: physics.World) -> list[bytes]:
    return [getattr(world, name).tobytes() for name in PUBLIC]


def pickled(world: physics.World) -> physics.World:
    twin: physics.World = pickle.loads(pickle.dumps(world))
    return twin


def build(num_worlds: int) -> physics.World:
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity((0.0, 0.0, -9.81)))
    scene.add_body(physics.HeightField(np.zeros((4, 4)), size=(4.0, 4.0)), motion="kinematic")
    others = [physics.Sphere(0.1)] if num_worlds > 1 else []
    for number in range(4):
        scene.add_body(physics.Box((0.1, 0.1, 0.1)), position=(0.3 * number, 0.0, 0.2), mass=1.0, alternatives=others)
    return physics.World(scene, num_worlds)


@pytest.mark.parametrize("twin_of", [copy.copy, copy.deepcopy, pickled])
@pytest.mark.parametrize("num_worlds", [1, 3])
def test_a_copy_goes_its_own_way_and_the_same_way(twin_of: Callable[[physics.World], physics.World], num_worlds: int):
    world = build(num_worlds)
    if num_worlds == 1:
        world.remove_body(2)
        world.add_body(physics.Cylinder(0.1, 0.1), position=(0.6, 0.0, 0.2))
        world.add_body(physics.Sphere(0.1), position=(0.6, 0.5, 0.2))
    else:
        world.set_parameters(1, shape=1, world=2)
        world.set_parameters(3, mass=3.0, friction=0.1, world=0)
    world.step(10)
    rates = np.random.default_rng(1).uniform(0.0, 0.1, (4, 4))
    world.set_heights(0, height_rates=rates, world=num_worlds - 1)
    world.step(10)
    world.apply_force(1, (1.0, 0.0, 0.0))
    twin = twin_of(world)
    before = bits(world)
    assert bits(twin) == before and str(twin.report()) == str(world.report())
    assert (twin.contacts(num_worlds - 1) == world.contacts(num_worlds - 1)).all()
    twin.step(40)
    assert bits(world) == before and bits(twin) != before
    world.step(40)
    assert bits(twin) == bits(world)
    world.reset()
    twin.reset()
    assert bits(twin) == bits(world)


def test_materials_and_shapes_mean_the_same_in_a_copy():
    scene = physics.Scene()
    ice, steel = physics.Material(friction=0.1), physics.Material(friction=0.4)
    scene.set_pair(ice, steel, friction=0.0)
    scene.add_field(physics.UniformGravity((0.0, 0.0, -9.81)))
    scene.add_body(physics.Plane(), motion="static", material=ice)
    world = physics.World(scene)
    twin = copy.deepcopy(world)
    handle = twin.add_body(
        physics.Sphere(0.1), position=(0.0, 0.0, 0.1), linear_velocity=(1.0, 0.0, 0.0), material=steel
    )
    twin.step(100)
    assert twin.linear_velocity[0, handle, 0] == 1.0 and world.num_bodies == 1
