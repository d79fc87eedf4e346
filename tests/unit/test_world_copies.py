"""Copies by ``copy`` and ``pickle``: worlds of their own in the same state, to the bit, and what they are made from."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable

import numpy as np
import pytest

from avalanche_gym import physics
from tests.world_bits import state_bits


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
    before = state_bits(world)
    assert state_bits(twin) == before and str(twin.report()) == str(world.report())
    assert (twin.contacts(num_worlds - 1) == world.contacts(num_worlds - 1)).all()
    twin.step(40)
    assert state_bits(world) == before and state_bits(twin) != before
    world.step(40)
    assert state_bits(twin) == state_bits(world)
    world.reset()
    twin.reset()
    assert state_bits(twin) == state_bits(world)


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


@pytest.mark.parametrize("twin_of", [copy.copy, copy.deepcopy, physics.Scene.copy])
def test_a_copy_of_a_scene_is_a_scene_of_its_own_with_the_same_materials(
    twin_of: Callable[[physics.Scene], physics.Scene],
):
    scene = physics.Scene()
    ice, steel = physics.Material(friction=0.1), physics.Material(friction=0.4)
    scene.set_pair(ice, steel, friction=0.0)
    scene.add_body(physics.Plane(), motion="static", material=ice)
    twin = twin_of(scene)
    twin.add_field(physics.UniformGravity((0.0, 0.0, -9.81)))
    twin.set_pair(ice, ice, friction=1.0)
    ball = twin.add_body(physics.Sphere(0.1), position=(0.0, 0.0, 0.1), linear_velocity=(1.0, 0.0, 0.0), material=steel)
    assert len(scene.bodies) == 1 and not scene.fields and len(scene.pair_rules) == 1
    world = physics.World(twin)
    world.step(50)
    assert world.linear_velocity[0, ball, 0] == 1.0


@pytest.mark.parametrize("through", [copy.deepcopy, lambda pair: pickle.loads(pickle.dumps(pair))])
def test_a_world_and_its_snapshot_copied_together_belong_together(through: Callable[[tuple], tuple]):
    scene = physics.Scene()
    ice, steel = physics.Material(friction=0.1), physics.Material(friction=0.4)
    scene.set_pair(ice, steel, friction=0.2)
    scene.add_field(physics.UniformGravity((0.0, 0.0, -10.0)))
    scene.add_body(physics.Plane(), motion="static", material=ice)
    scene.add_body(
        physics.Box((0.1, 0.1, 0.1)), position=(0.0, 0.0, 0.1), linear_velocity=(1.0, 0.0, 0.0), material=steel
    )
    world = physics.World(scene)
    world.step(5)
    snapshot = world.snapshot()
    for pair in ((world, snapshot), (snapshot, world)):
        copies = through(pair)
        twin, twin_snapshot = copies if isinstance(copies[0], physics.World) else copies[::-1]
        twin.step(7)
        twin.restore(twin_snapshot)
        twin.step(5)
        world.restore(snapshot)
        world.step(5)
        assert state_bits(twin) == state_bits(world)


@pytest.mark.parametrize(
    "shape",
    [
        physics.HeightField(np.zeros((3, 3)), size=(1, 1)),
        physics.ConvexHull(np.random.default_rng(0).normal(size=(9, 3))),
        physics.TriangleMesh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)]),
        physics.RadialTerrain(np.ones(12)),
        physics.Compound([(physics.Sphere(1.0), (0, 0, 0), (1, 0, 0, 0))]),
    ],
)
def test_shapes_never_change_copied_or_not(shape: physics.Shape):
    for twin in (copy.copy(shape), copy.deepcopy(shape), pickle.loads(pickle.dumps(shape))):
        held = list(vars(twin).values())
        arrays = held + [entry for member in getattr(twin, "members", ()) for entry in member]
        found = [array for array in arrays if isinstance(array, np.ndarray)]
        assert found and not any(array.flags.writeable for array in found)


def test_a_physics_error_comes_out_of_a_worker_as_it_was():
    error = physics.PhysicsError([(3, "'ball'", 2, "its state is not finite")])
    twin = pickle.loads(pickle.dumps(error))
    assert (twin.worlds, twin.failures, str(twin)) == (error.worlds, error.failures, str(error))
