"""Tables that grow, limits that hold, and steps that fail: what one world meets stops no other."""

import numpy as np
import pytest

from avalanche_gym import physics
from tests.world_bits import bits

STEP = 0.01

# --- Capacity -------------------------------------------------------------------------------------


def tiles_scene(count):
    """Boxes side by side on a plane: four contacts each."""
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity((0, 0, -9.81)))
    scene.add_body(physics.Plane(), motion="static")
    for index in range(count):
        scene.add_body(physics.Box((0.1, 0.1, 0.1)), mass=1.0, position=(index, 0, 0.1))
    return scene


def test_contacts_grow_beyond_the_first_capacity():
    world = physics.World(tiles_scene(20), num_worlds=2, options=physics.Options(time_step=STEP))
    world.set_state(1, position=(0, 0, 5), world=0)
    snapshot = world.snapshot()
    world.step(10)
    assert [len(world.contacts(world=number)) for number in range(2)] == [76, 80]
    assert world.report().contacts.tolist() == [76, 80] and world.report().steps.tolist() == [10, 10]
    np.testing.assert_allclose(world.position[1, 1:, 2], 0.1, atol=1e-10)
    # Back to a state saved when there was less room.
    after = bits(world)
    world.restore(snapshot)
    world.step(10)
    assert bits(world) == after


def test_max_contacts_is_a_hard_limit():
    """Lifted boxes do not count; the world that has too many stands still, the other one goes on."""
    options = physics.Options(time_step=STEP, max_contacts=12)
    world = physics.World(tiles_scene(4), num_worlds=2, options=options)
    world.set_state(4, position=(3, 0, 5), world=1)
    with pytest.raises(RuntimeError) as raised:
        world.step(3)
    assert str(raised.value).startswith("World 0: 16 contacts exceed Options(max_contacts=12); raise it, or leave None")
    assert not isinstance(raised.value, physics.PhysicsError)
    assert world.report().steps.tolist() == [0, 3]
    assert world.position[0, 1].tolist() == [0, 0, 0.1] and world.position[1, 4, 2] < 5
    world.set_state(4, position=(3, 0, 5), world=0)
    world.step(3)
    assert world.report().steps.tolist() == [3, 3] and world.report().contacts.tolist() == [12, 12]


def test_a_large_limit_of_contacts_costs_no_memory_until_it_is_met():
    """Room grows up to the limit, as it does without one; the limit itself is allowed, one less is not."""
    free = physics.World(tiles_scene(20), options=physics.Options(time_step=STEP))
    free.step(3)
    for limit in (80, 2**31 - 1):
        world = physics.World(tiles_scene(20), options=physics.Options(time_step=STEP, max_contacts=limit))
        world.step(3)
        assert bits(world) == bits(free) and len(world.contacts()) == 80
    world = physics.World(tiles_scene(20), options=physics.Options(time_step=STEP, max_contacts=79))
    with pytest.raises(RuntimeError, match="80 contacts exceed"):
        world.step(3)


def test_more_pairs_than_bodies():
    """Every ball near every other: the list of pairs grows, and nothing is lost."""
    scene = physics.Scene()
    for index in range(24):
        scene.add_body(physics.Sphere(1.0), mass=1.0, position=(1e-3 * index, 0, 0))
    world = physics.World(scene, options=physics.Options(time_step=STEP))
    world.step()
    assert world.report().contacts.tolist() == [24 * 23 // 2]


# --- Steps that fail ------------------------------------------------------------------------------


def flying_scene():
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity((0, 0, -9.81)))
    scene.add_body(physics.Plane(), motion="static", name="ground")
    scene.add_body(physics.Sphere(0.1), mass=0.5, position=(0, 0, 2), name="ball")
    scene.add_body(physics.Box((0.1, 0.2, 0.3)), mass=2.0, position=(5, 0, 2), name="box")
    return scene


@pytest.fixture(scope="module")
def flying():
    return physics.World(flying_scene(), num_worlds=3, options=physics.Options(time_step=STEP))


def by_impulse(world, body):
    world.apply_impulse(body, (0, 1e308, 0), world=1)


def by_impulse_off_centre(world, body):
    world.apply_impulse(body, (0, 1e200, 0), point=(1e150, 0, 0), world=1)


def by_force(world, body):
    world.apply_force(body, (1e308, 0, 0), world=1)


def by_buffer(world, body):
    world.impulse_buffer[1, body, 4] = np.nan


@pytest.mark.parametrize("break_it", [by_impulse, by_impulse_off_centre, by_force, by_buffer])
@pytest.mark.parametrize(("body", "name"), [(1, "'ball'"), (2, "'box'")])
def test_a_state_that_is_not_finite_stops_one_world_only(flying, break_it, body, name):
    flying.reset()
    flying.step(3)
    before = bits(flying, 1)
    break_it(flying, body)
    assert np.isfinite(flying.linear_velocity).all()
    with pytest.raises(physics.PhysicsError) as raised:
        flying.step(5)
    assert raised.value.worlds == (1,)
    assert raised.value.failures[0][:3] == (1, name, 0)
    for text in ("world 1", name, "step 0", "others finished", "Reset"):
        assert text in str(raised.value)
    assert bits(flying, 1) == before
    assert flying.report().steps.tolist() == [5, 0, 5]
    assert bits(flying, 0) == bits(flying, 2) != before
    # Usable afterwards, and as if nothing had been.
    flying.step(5)
    assert flying.position[1, 1] == pytest.approx([0, 0, 2 - 0.5 * 9.81 * 0.08**2])
    assert flying.report().energy_change == pytest.approx([0, 0, 0], abs=1e-11)


def test_several_worlds_fail_at_once_and_later_steps_count(flying):
    flying.reset()
    flying.set_state(1, linear_velocity=(0, 1e154, 0), world=slice(0, 2))
    flying.apply_force(1, (0, 0, 1e155), world=slice(0, 2))
    with pytest.raises(physics.PhysicsError) as raised:
        flying.step(5)
    # 2e153 m/s more a step: the square overflows at 1.34e154 m/s.
    assert raised.value.worlds == (0, 1) and raised.value.failures[0][2] == raised.value.failures[1][2] == 4
    assert np.isfinite(flying.position).all() and flying.report().steps.tolist() == [4, 4, 5]
    flying.reset()
    flying.step()


def test_an_impulse_of_1e12_is_no_error(flying):
    """No absolute limits: finite, and right."""
    flying.reset()
    flying.apply_impulse(1, (0, 0, 1e12))
    flying.step(1)
    assert flying.position[0, 1, 2] == pytest.approx(2 + 2e12 * STEP - 0.5 * 9.81 * STEP**2, rel=1e-15)


def test_bad_and_crowded_worlds_are_reported_once():
    world = physics.World(tiles_scene(4), num_worlds=3, options=physics.Options(time_step=STEP, max_contacts=12))
    world.set_state(4, position=(3, 0, 5), world=slice(1, 3))
    world.apply_impulse(1, (0, 0, 1e308), world=2)
    with pytest.raises(physics.PhysicsError, match="world 2") as raised:
        world.step(2)
    assert "World 0: 16 contacts" in str(raised.value.__cause__)
    assert world.report().steps.tolist() == [0, 2, 0]
