"""Batches of worlds that differ: each is the world it would be alone, and one that goes bad stops no other."""

from __future__ import annotations

import numpy as np
import pytest

from avalanche_gym import physics


def hills(seed: int) -> np.ndarray:
    return np.random.default_rng(seed).uniform(0.0, 0.1, (5, 5))


def build(num_worlds: int) -> tuple[physics.World, int, int]:
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity((0.0, 0.0, -9.81)))
    ground = scene.add_body(physics.HeightField(np.zeros((5, 5)), size=(4.0, 4.0)), motion="static")
    ball = scene.add_body(physics.Sphere(0.1), mass=1.0, position=(0.0, 0.0, 0.15))
    return physics.World(scene, num_worlds, physics.Options(events=False, sleeping=False)), ground, ball


def test_terrain_mass_and_friction_of_each_world_are_its_own():
    count = 6
    batch, ground, ball = build(count)
    mass, friction = np.linspace(0.5, 3.0, count), np.linspace(0.0, 1.0, count)
    batch.set_heights(ground, np.stack([hills(seed) for seed in range(count)]))
    batch.set_parameters(ball, mass=mass, friction=friction)
    batch.apply_impulse(ball, (0.3, 0.1, 0.0))
    batch.step(60)
    for number in range(count):
        alone, _, _ = build(1)
        alone.set_heights(ground, hills(number))
        alone.set_parameters(ball, mass=mass[number], friction=friction[number])
        alone.apply_impulse(ball, (0.3, 0.1, 0.0))
        alone.step(60)
        np.testing.assert_array_equal(alone.position[0], batch.position[number])
    assert len(np.unique(batch.position[:, ball, 0])) == count
    again = np.array([True, False] * 3)
    kept = batch.position[~again].copy()
    batch.reset(again)
    np.testing.assert_array_equal(batch.position[~again], kept)
    assert (batch.position[again, ball] == (0.0, 0.0, 0.15)).all()


def test_a_world_that_goes_bad_stops_no_other():
    batch, _, ball = build(3)
    twin, _, _ = build(3)
    twin.step(20)
    batch.impulse_buffer[1, ball, 0] = np.inf
    with pytest.raises(physics.PhysicsError) as caught:
        batch.step(20)
    assert [failure[0] for failure in caught.value.failures] == [1]
    np.testing.assert_array_equal(batch.position[[0, 2]], twin.position[[0, 2]])
    assert np.isfinite(batch.position).all()
    batch.reset(np.array([False, True, False]))
    batch.step(20)
    np.testing.assert_array_equal(batch.position[1], twin.position[1])


def test_sixteen_thousand_worlds_are_one_call():
    batch, _, ball = build(16384)
    batch.step(2)
    assert (batch.position[:, ball] == batch.position[0, ball]).all()
    assert (batch.report().steps == 2).all()


@pytest.mark.parametrize("what", ["heights that move", "restitution", "rolling friction", "sleep"])
def test_what_one_world_is_given_changes_no_bit_of_another(what: str):
    """Whether ground moves or anything bounces decides how a world is stepped: that world, and no other."""

    def heap(num_worlds: int) -> physics.World:
        scene = physics.Scene()
        scene.add_field(physics.UniformGravity((0.0, 0.0, -9.81)))
        scene.add_body(physics.HeightField(hills(1), size=(4.0, 4.0)), motion="kinematic")
        for number in range(14):
            x, y, z = 0.15 * (number % 3), 0.16 * (number // 3 % 2), 0.2 + 0.2 * (number // 6)
            scene.add_body(physics.Box((0.1, 0.08, 0.06)), mass=1.0, position=(x, y, z))
        return physics.World(scene, num_worlds, physics.Options(time_step=1 / 60))

    batch, alone = heap(2), heap(1)
    for _ in range(12):
        if what == "heights that move":
            batch.set_heights(0, height_rates=0.1 * hills(2), world=1)
        elif what == "restitution":
            batch.set_parameters(0, restitution=1.0, world=1)
            batch.set_parameters(1, restitution=0.5, world=1)
        elif what == "rolling friction":
            batch.set_parameters(1, rolling_friction=0.01, world=1)
        else:  # a call that wakes all, in both worlds, while only the other one has anybody asleep
            batch.set_heights(0, hills(1))
            alone.set_heights(0, hills(1))
        batch.step(20)
        alone.step(20)
        for name in ("position", "linear_velocity", "sleeping"):
            np.testing.assert_array_equal(getattr(batch, name)[0], getattr(alone, name)[0])
