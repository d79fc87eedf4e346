"""Crowds on ground at rest gain no energy in any step, whatever their masses, friction and restitution."""

from __future__ import annotations

import numpy as np
import pytest

from avalanche_gym import physics

LIFT = 0.1  # [m] the energy that lifts all of a crowd by so much is what gains are compared with
# Of that, in a step. Overlap that is parted lifts what lies on it; velocities may not grow by it.
GAIN = 1e-3
# Plain time stepping is of order 1 where a body that turns far rebounds: what parts it from the ground turns it too.
REBOUND_GAIN = 2e-2


def crowd(seed: int, friction: float, restitution: float, decades: float) -> physics.Scene:
    """Eighty bodies of all kinds above a bowl, their masses apart by so many decades."""
    generator = np.random.default_rng(seed)
    material = physics.Material(friction, restitution)
    x, y = np.meshgrid(*[np.linspace(-5.0, 5.0, 41)] * 2)
    heights = 0.06 * (x * x + y * y) + 0.1 * np.sin(2.0 * x) * np.cos(2.3 * y)
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity((0.0, 0.0, -9.81)))
    scene.add_body(physics.HeightField(heights, size=(10.0, 10.0)), motion="static", material=material)
    bars = [(physics.Box((0.15, 0.04, 0.04)), (0.0, y, 0.0), (1.0, 0.0, 0.0, 0.0)) for y in (0.0, 0.1)]
    bracket = physics.Compound(bars)
    for number in range(80):
        shape = (
            physics.Sphere(0.12),
            physics.Box(generator.uniform(0.04, 0.15, 3)),
            physics.Capsule(0.07, 0.1),
            physics.Cylinder(0.1, 0.08),
            bracket,
        )[number % 5]
        place = np.array([number % 4 - 1.5, number // 4 % 4 - 1.5, 3.0 + number // 16]) * 0.6
        turn = generator.normal(size=4)
        scene.add_body(
            shape,
            mass=10.0 ** generator.uniform(-0.5 * decades, 0.5 * decades),
            position=place + generator.uniform(-0.02, 0.02, 3),
            orientation=turn / np.linalg.norm(turn),
            material=material,
        )
    return scene


def worst_gain(scene: physics.Scene, options: physics.Options, seconds: float) -> float:
    world = physics.World(scene, options=options)
    lift = 9.81 * LIFT * sum(body.mass for body in scene.bodies if body is not None)
    worst = 0.0
    for _ in range(round(seconds / options.time_step)):
        world.step()
        worst = max(worst, float(world.report().energy_change[0]))
    return worst / lift


@pytest.mark.parametrize("time_step", [1 / 60, 1 / 240])
@pytest.mark.parametrize("friction", [0.8, 3.0])
def test_sweeps_give_no_energy(friction: float, time_step: float):
    for seed in range(3):
        options = physics.Options(time_step=time_step, events=False)
        assert worst_gain(crowd(seed, friction, 0.0, 4.0), options, 2.0) < GAIN


@pytest.mark.parametrize("friction", [0.0, 0.8])
def test_rebounds_give_no_energy(friction: float):
    for seed in range(2):
        options = physics.Options(time_step=1 / 240, events=False)
        assert worst_gain(crowd(seed, friction, 1.0, 2.0), options, 1.5) < REBOUND_GAIN
