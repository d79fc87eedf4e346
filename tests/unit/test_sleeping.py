"""Islands in balance fall asleep, cost nothing, and wake for every reason there is."""

from __future__ import annotations

import numpy as np
import pytest

from avalanche_gym import physics
from avalanche_gym.physics.scenes.piles import pile

GRAVITY = 9.81


def stack(count: int = 2, motion: str = "static", num_worlds: int = 1, **options: object) -> physics.World:
    """Boxes on a floor of the given motion; handle 0 is the floor."""
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity((0.0, 0.0, -GRAVITY)))
    scene.add_body(physics.Box((2.0, 2.0, 0.1)), motion=motion, position=(0, 0, -0.1), name="floor")
    for level in range(count):
        scene.add_body(physics.Box((0.1, 0.1, 0.1)), mass=1.0, position=(0, 0, 0.1 + 0.2 * level))
    scene.add_body(physics.Sphere(0.1), mass=1.0, position=(1.0, 0.0, 0.1), name="apart")
    return physics.World(scene, num_worlds=num_worlds, options=physics.Options(**options))  # type: ignore[arg-type]


def test_a_resting_stack_sleeps_with_its_contacts_and_no_velocity() -> None:
    world = stack()
    before = len(world.contacts())
    world.step(100)
    assert world.sleeping.tolist() == [[False, True, True, True]]
    assert not world.linear_velocity.any() and not world.angular_velocity.any()
    contacts = world.contacts()
    assert before == 0 and len(contacts) == 9 and world.report().contacts[0] == 9
    assert np.isclose(contacts["impulse"][:, 2].sum() * 240, (3 + 1) * GRAVITY, rtol=1e-9)


def test_asleep_and_awake_end_in_the_same_place() -> None:
    asleep, awake = stack(3), stack(3, sleeping=False)
    asleep.step(400)
    awake.step(400)
    assert asleep.sleeping[0, 1:].all() and not awake.sleeping.any()
    assert np.abs(asleep.position - awake.position).max() < 1e-12


@pytest.mark.parametrize("how", ["impulse", "buffer", "force", "state", "parameters", "floor", "user", "all"])
def test_what_wakes_an_island(how: str) -> None:
    world = stack()
    world.step(100)
    if how == "impulse":
        world.apply_impulse(2, (0, 0, 1e-3))
    elif how == "buffer":
        world.impulse_buffer[0, 2, 2] = 1e-3
        world.step(1)
    elif how == "force":
        world.apply_force(2, (0.1, 0, 0))
    elif how == "state":
        world.set_state(2, position=(0, 0, 0.5))
    elif how == "parameters":
        world.set_parameters(1, friction=0.1)
    elif how == "floor":
        world.set_state(0, position=(0, 0, -0.2))
    elif how == "user":
        world.wake(1)
    else:
        world.wake()
    assert not world.sleeping[0, 1:3].any()
    # Only what carries all wakes all.
    assert world.sleeping[0, 3] == (how not in ("floor", "all"))


def test_a_removed_support_wakes_what_it_bore() -> None:
    world = stack()
    world.step(100)
    world.remove_body(1)
    world.step(24)
    assert world.linear_velocity[0, 2, 2] < -0.5


def test_a_touch_wakes_and_the_way_is_that_of_a_world_without_sleep() -> None:
    worlds = [stack(sleeping=flag) for flag in (True, False)]
    for world in worlds:
        world.step(100)
        world.set_state(3, position=(0.6, 0.0, 0.2), linear_velocity=(-2.0, 0.0, 0.0))
    assert worlds[0].sleeping[0, 1:3].all()
    for world in worlds:
        world.step(60)
    assert not worlds[0].sleeping[0, 1:3].any()
    assert np.abs(worlds[0].position - worlds[1].position).max() < 1e-9


def test_nothing_sleeps_at_the_top_of_its_flight_nor_under_a_held_force() -> None:
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity((0.0, 0.0, -1e-9)))  # slow as can be
    scene.add_body(physics.Sphere(0.1), mass=1.0, position=(0, 0, 1), linear_velocity=(0, 0, 5e-10))
    world = physics.World(scene)
    world.step(400)
    assert not world.sleeping.any()
    world = stack()
    for _ in range(30):
        world.apply_force(2, (0.1, 0.0, 0.0))
        world.step(4)
    assert world.sleeping.tolist() == [[False, False, False, True]]


def test_a_heap_with_rolling_friction_is_swept_while_it_falls_and_then_sleeps() -> None:
    world = physics.World(pile(60, rolling_friction=0.005), options=physics.Options(time_step=1 / 60))
    tiers = set()
    for _ in range(12):
        world.step(60)
        tiers.add(world.report().tier[0])
    assert "pile" in tiers
    assert world.sleeping[0, 1:].all() and not world.linear_velocity.any()


def test_a_body_that_may_not_sleep_keeps_its_island_awake() -> None:
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity((0.0, 0.0, -GRAVITY)))
    scene.add_body(physics.Plane(), motion="static")
    for place, allowed in ((0.0, True), (1.0, False)):
        scene.add_body(physics.Box((0.1, 0.1, 0.1)), mass=1.0, position=(place, 0, 0.1), allow_sleep=allowed)
    world = physics.World(scene)
    world.step(200)
    assert world.sleeping.tolist() == [[False, True, False]]


def test_on_a_turntable_nothing_sleeps_until_it_stands() -> None:
    world = stack(1, motion="kinematic")
    world.set_state(0, angular_velocity=(0, 0, 0.5))
    world.step(200)
    assert not world.sleeping.any()
    world.set_state(0, angular_velocity=(0, 0, 0))
    world.step(300)
    assert world.sleeping[0, 1]
    world.set_state(0, linear_velocity=(0.1, 0, 0))
    world.step(24)
    assert world.linear_velocity[0, 1, 0] == pytest.approx(0.1, rel=1e-6)


def test_lanes_equal_single_worlds_and_snapshots_hold_sleep() -> None:
    batch, single = stack(num_worlds=3), stack()
    for world in (batch, single):
        world.step(100)
    batch.apply_impulse(2, (0.3, 0, 0), world=1)
    single.apply_impulse(2, (0.3, 0, 0))
    assert batch.sleeping[:, 1].tolist() == [True, False, True]
    kept = batch.snapshot()
    for world in (batch, single):
        world.step(80)
    assert (batch.position[1] == single.position[0]).all()
    first = batch.position.copy()
    batch.restore(kept)
    assert batch.sleeping[:, 1].tolist() == [True, False, True]
    batch.step(80)
    assert (batch.position == first).all()
    batch.reset(0)
    assert not batch.sleeping[0].any() and len(batch.contacts(0)) == 0


def test_a_call_that_is_refused_wakes_nobody() -> None:
    world = stack()
    world.step(100)
    wrong = (
        lambda: world.apply_impulse(2, (0, 0, 1), point=(0, 0)),
        lambda: world.apply_force(2, (0, 0, 1), point=(0, np.nan, 0)),
        lambda: world.set_parameters(2, mass=-1.0),
        lambda: world.set_parameters(2, shape=1),
        lambda: world.set_state(2, orientation=(2, 0, 0, 0)),
        lambda: world.set_heights(0, np.zeros((2, 2))),
        lambda: world.add_body(physics.Sphere(-1.0)),
    )
    for call in wrong:
        with pytest.raises(ValueError):
            call()
    assert world.sleeping[0, 1:].all()


def test_who_falls_asleep_does_not_depend_on_who_sleeps_in_another_world() -> None:
    """A call that wakes all that sleeps leaves those alone that are about to."""
    batch, single = stack(num_worlds=2), stack()
    batch.step(100)
    batch.reset(1)
    batch.set_state(3, position=(9.0, 9.0, 90.0), world=1)
    single.set_state(3, position=(9.0, 9.0, 90.0))
    for world in (batch, single):
        world.step(40)
    assert batch.sleeping[0].any() and not batch.sleeping[1].any()
    for world in (batch, single):
        world.set_state(0, position=(0.0, 0.0, -0.1))
        world.step(25)
    assert single.sleeping[0, 1:3].all()
    assert (batch.sleeping[1] == single.sleeping[0]).all()
