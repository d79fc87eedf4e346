"""What free flight does not foresee within a step, and what turning shows, is parted where the bodies end."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from avalanche_gym import physics
from avalanche_gym.physics.scenes.piles import pile

STEP = 1.0 / 60.0


def falling(scale: float) -> physics.World:
    """A ball that meets the ground within the step, and one on top that falls with it, a tenth of a radius apart."""
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity((0.0, 0.0, -9.81 * scale)))
    scene.add_body(physics.Plane(), motion="static")
    for height in (1.05, 3.15):
        scene.add_body(
            physics.Sphere(0.1 * scale),
            density=1000.0,
            position=(0.0, 0.0, 0.1 * height * scale),
            linear_velocity=(0.0, 0.0, -3.0 * scale),
        )
    return physics.World(scene, options=physics.Options(time_step=STEP, events=False))


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_a_body_that_falls_on_while_another_is_stopped_does_not_end_in_it(scale: float) -> None:
    world = falling(scale)
    world.step(1)
    low, high = world.position[0, 1:, 2]
    assert low >= 0.1 * scale * (1 - 2e-3)
    assert high - low >= 0.2 * scale * (1 - 2e-3)
    assert world.report().penetration[0] <= 1e-3 * scale


def test_a_body_that_turns_far_does_not_end_in_its_neighbour() -> None:
    scene = physics.Scene()
    scene.add_body(physics.Box((0.2, 0.05, 0.05)), mass=1.0, angular_velocity=(0.0, 0.0, 25.0))
    ball = scene.add_body(physics.Sphere(0.05), mass=1.0, position=(0.18, 0.13, 0.0))
    world = physics.World(scene, options=physics.Options(time_step=STEP, events=False))
    for _ in range(4):
        world.step(1)
        nearest = world.closest_point(world.position[0, ball], ignore=ball)
        assert nearest["distance"] >= 0.05 * (1 - 4e-3)


def test_nothing_is_added_to_the_velocities() -> None:
    world = falling(1.0)
    world.step(1)
    assert np.isclose(world.linear_velocity[0, 2, 2], -3.0 - 9.81 * STEP, rtol=1e-12)


@pytest.mark.verify
@pytest.mark.parametrize("count", [100, 1000])
def test_a_pile_never_overlaps_by_much(count: int) -> None:
    """Balls against balls in closed form, all others as reported: 3 mm at any time, 1 mm for 99 of 100 contacts."""
    world = physics.World(pile(count), options=physics.Options(time_step=STEP, sleeping=False))
    shapes = [None if body is None else body.shape for body in pile(count).bodies]
    balls = [index for index, shape in enumerate(shapes) if isinstance(shape, physics.Sphere)]
    radius = np.array([shapes[index].radius for index in balls])  # type: ignore[union-attr]
    depths = []
    for _ in range(120 if count == 100 else 60):
        world.step(1)
        assert world.report().penetration[0] <= 3e-3
        depths.append(np.maximum(-world.contacts()["gap"], 0.0))
        place = world.position[0, balls]
        apart = np.linalg.norm(place[:, None] - place[None], axis=2) - radius[:, None] - radius[None]
        assert apart[np.triu_indices(len(balls), 1)].min() >= -3e-3
    gaps = np.concatenate(list(itertools.chain(depths)))
    assert np.percentile(gaps, 99) <= 1e-3
