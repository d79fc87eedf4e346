"""Bodies that come and go in a running world: their rows alone change, and a restored world is the one it was."""

from __future__ import annotations

import numpy as np

from avalanche_gym import physics
from tests.world_bits import state_bits

ICE = physics.Material(friction=0.0)


def ground() -> physics.World:
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity((0.0, 0.0, -9.81)))
    scene.add_body(physics.Plane(), motion="static")
    for number in range(3):
        scene.add_body(physics.Box((0.1, 0.1, 0.1)), position=(number, 0.0, 0.1), mass=1.0)
    return physics.World(scene)


def test_a_world_that_grew_steps_like_one_that_was_built():
    """Also beyond the number of bodies from which the hash grid is used."""
    grown = ground()
    scene = grown.scene.copy()
    for number in range(70):
        shape = (physics.Sphere(0.1), physics.Box((0.1, 0.05, 0.1)))[number % 2]
        place = (number % 9, 1.0 + number // 9, 0.15)
        for target in (grown, scene):
            target.add_body(shape, position=place, mass=1.0, material=ICE, linear_velocity=(0.0, 0.3, 0.0))
    assert "hash grid" in grown.features
    built = physics.World(scene)
    for _ in range(3):
        grown.step(10)
        built.step(10)
        assert state_bits(grown) == state_bits(built)
    assert len(grown.contacts()) > 70
    grown.reset()
    built.reset()
    assert state_bits(grown) == state_bits(built)


def test_snapshots_outlive_bodies_that_come_and_go():
    world = ground()
    world.step(5)
    world.remove_body(1)
    late = world.add_body(
        physics.Compound([(physics.Sphere(0.1), (0, 0, z), (1, 0, 0, 0)) for z in (0, 0.1)]), position=(0, 5, 0.1)
    )
    assert late == 1
    world.add_body(physics.Sphere(0.1), position=(0.0, 7.0, 0.1), material=ICE)
    world.step(5)
    before = world.snapshot()
    contacts = world.contacts()
    world.step(20)
    future = state_bits(world)
    world.remove_body(2)
    world.add_body(physics.Sphere(0.3), position=(5, 5, 1))
    world.add_body(physics.Sphere(0.3), position=(9, 5, 1))
    world.step(3)
    world.restore(before)
    assert all(np.array_equal(world.contacts()[name], contacts[name]) for name in contacts.dtype.names)
    world.step(20)
    assert state_bits(world) == future


def test_queries_and_contacts_follow_the_bodies_that_are_there():
    world = ground()
    down = ((1.0, 0.0, 5.0), (0.0, 0.0, -1.0))
    assert world.ray_cast(*down)["body"] == 2
    world.remove_body(2)
    assert world.ray_cast(*down)["body"] == 0
    again = world.add_body(physics.Sphere(0.5), position=(1.0, 0.0, 0.5))
    assert again == 2 and world.ray_cast(*down)["distance"] == 4.0
    world.step()
    assert {2, 3} <= set(world.contacts()["body_b"].tolist())
    # The slot is the same, the motion is not: pairs that no longer count are not kept.
    world.remove_body(2)
    world.add_body(physics.Sphere(0.5), position=(1.0, 0.0, 0.5), motion="static")
    world.step()
    assert 2 not in world.contacts()["body_b"] and (world.contacts()["body_a"] == 0).all()


def test_a_snapshot_can_be_restored_again_after_tables_were_built_anew():
    """Colliders have other numbers then: bodies must not wear those of others, asleep or awake."""
    world = ground()
    world.remove_body(1)
    world.add_body(
        physics.Compound([(physics.Sphere(0.1), (0, 0, z), (1, 0, 0, 0)) for z in (0, 0.1)]), position=(0, 5, 2)
    )
    for wait in (5, 200):
        world.step(wait)
        assert bool(world.sleeping.any()) == (wait == 200)
        before = world.snapshot()
        world.apply_impulse(3, (0.5, 0.0, 0.0))
        world.step(20)
        future = state_bits(world)
        world.add_body(physics.Sphere(0.3), position=(9, 5, 1))
        for _ in range(2):
            world.restore(before)
            world.apply_impulse(3, (0.5, 0.0, 0.0))
            world.step(20)
            assert state_bits(world) == future


def test_what_a_removed_body_asked_for_is_asked_for_no_longer():
    """Snapshots outlive the tables: a world that forgets is stepped as one that never knew."""
    world = ground()
    bouncy = physics.Material(restitution=0.5)
    late = [
        world.add_body(physics.Box((1.0, 1.0, 0.1)), motion="static", position=(0.0, 9.0, 0.0)),
        world.add_body(physics.Sphere(0.1), position=(0.0, 20.0, 9.0), material=bouncy),
    ]
    assert world._storage.header[0]["cross_seams"] and "restitution" in world.features
    for handle in late:
        world.remove_body(handle)
    assert not world._storage.header[0]["cross_seams"] and "restitution" not in world.features


def test_what_drives_a_platform_goes_on_when_all_tables_are_built_anew():
    """A platform that speeds up evenly does not start with a jolt because a height field appears far away."""
    ways = []
    for comes in (False, True):
        scene = physics.Scene()
        scene.add_field(physics.UniformGravity((0.0, 0.0, -9.81)))
        platform = scene.add_body(physics.Box((1.0, 1.0, 0.1)), motion="kinematic")
        scene.add_body(physics.Box((0.1, 0.1, 0.1)), position=(0.0, 0.0, 0.2))
        world = physics.World(scene)
        for number in range(1, 40):
            world.set_state(platform, linear_velocity=(0.01 * number, 0.0, 0.0))
            if comes and number == 20:
                world.add_body(
                    physics.HeightField(np.zeros((3, 3)), size=(1.0, 1.0)), motion="static", position=(50, 0, 0)
                )
            world.step()
        ways.append(world.position[0, :2].copy())
    np.testing.assert_array_equal(*ways)
