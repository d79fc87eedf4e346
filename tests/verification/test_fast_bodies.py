"""Fast bodies: bullets and spinning sticks stop on walls and sheets, meet each other, and rebound within a step."""

from __future__ import annotations

import math

import numpy as np
import pytest

from avalanche_gym import physics


def world_of(scene: physics.Scene, time_step: float, **options: bool) -> physics.World:
    return physics.World(scene, options=physics.Options(time_step=time_step, **options))


def sheet() -> physics.TriangleMesh:
    corners = [(0, -2, -2), (0, 2, -2), (0, 2, 2), (0, -2, 2)]
    return physics.TriangleMesh(corners, [(0, 1, 2), (0, 2, 3)], two_sided=True)


@pytest.mark.parametrize("speed", [300.0, 1000.0])
@pytest.mark.parametrize(("target", "half"), [(physics.Box((0.01, 2, 2)), 0.01), (sheet(), 0.0)], ids=["wall", "sheet"])
@pytest.mark.parametrize("turned", [False, True])
def test_bullets_stop_on_the_surface(speed: float, target: physics.Shape, half: float, turned: bool) -> None:
    for phase in range(64):
        scene = physics.Scene()
        scene.add_body(target, motion="static")
        start = 1.0 + speed / 60 * phase / 64
        slant = np.array([1.0, 0.3, -0.2]) if turned else np.array([1.0, 0.0, 0.0])
        place = np.array([0.0, 0.11, 0.23]) - start * slant
        bullet = scene.add_body(
            physics.Sphere(0.02),
            mass=0.1,
            position=place,
            linear_velocity=speed * slant,
            material=physics.Material(0.0),
        )
        world = world_of(scene, 1 / 60)
        world.step(math.ceil(start / speed * 60) + 1)
        assert world.position[0, bullet, 0] == pytest.approx(-half - 0.02, abs=1e-9)


@pytest.mark.parametrize("shape", [physics.Capsule(0.01, 0.5), physics.Box((0.01, 0.01, 0.5))], ids=["capsule", "box"])
@pytest.mark.parametrize("spin", [0.0, 40.0, 150.0, 400.0])
@pytest.mark.parametrize(("time_step", "events"), [(1 / 60, True), (1 / 240, True), (1 / 60, False)])
def test_spinning_sticks_do_not_pass_a_thin_wall(
    shape: physics.Shape, spin: float, time_step: float, events: bool
) -> None:
    for phase in range(8):
        scene = physics.Scene()
        scene.add_body(physics.Box((0.01, 3, 3)), motion="static")
        stick = scene.add_body(
            shape, mass=0.1, position=(-1 - 0.3 * phase / 8, 0.1, 0.2), linear_velocity=(20, 0, 0),
            angular_velocity=(0, spin, 0),
        )  # fmt: skip
        world = world_of(scene, time_step, events=events)
        for _ in range(round(0.25 / time_step)):
            world.step(1)
            w, x, y, z = world.orientation[0, stick]
            reach = 0.5 * abs(2 * (x * z + w * y))
            assert world.position[0, stick, 0] + reach < -0.01 + 1e-6


def test_two_bullets_meet() -> None:
    """Head on in mid air, within one step, both faster than their size a step."""
    scene = physics.Scene()
    material = physics.Material(friction=0.0, restitution=1.0)
    for side in (-1.0, 1.0):
        scene.add_body(
            physics.Sphere(0.01), mass=0.1, position=(side * 2.0, 0, 0), linear_velocity=(-side * 500.0, 0, 0),
            material=material,
        )  # fmt: skip
    world = world_of(scene, 1 / 60)
    world.step(2)
    np.testing.assert_allclose(world.linear_velocity[0, :, 0], [-500.0, 500.0], rtol=1e-12)


def test_a_rebound_finds_what_stands_behind() -> None:
    """A ball thrown at a wall meets, on its way back in the same step, one that no contact of the start knows of."""
    scene = physics.Scene()
    material = physics.Material(friction=0.0, restitution=1.0)
    scene.add_body(physics.Box((0.1, 2, 2)), motion="static", position=(1.0, 0, 0), material=material)
    fast = scene.add_body(
        physics.Sphere(0.05), mass=1.0, position=(0.5, 0, 0), linear_velocity=(300.0, 0, 0), material=material
    )
    behind = scene.add_body(physics.Sphere(0.05), mass=1.0, position=(-0.5, 0, 0), material=material)
    world = world_of(scene, 1 / 60)
    world.step(1)
    assert world.linear_velocity[0, behind, 0] == pytest.approx(-300.0, rel=1e-12)
    assert abs(world.linear_velocity[0, fast, 0]) < 1e-9


def test_without_events_nothing_passes_either() -> None:
    for phase in range(16):
        scene = physics.Scene()
        scene.add_body(physics.Box((0.01, 2, 2)), motion="static")
        bullet = scene.add_body(
            physics.Sphere(0.02), mass=0.1, position=(-1 - 5 * phase / 16, 0.1, 0.2), linear_velocity=(300.0, 0, 0)
        )
        world = world_of(scene, 1 / 60, events=False)
        world.step(10)
        assert world.position[0, bullet, 0] < 0.0
        assert int(world.report().events[0]) == 0
