"""Crowds on ground at rest gain no energy in any step, whatever their masses, friction and restitution."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from avalanche_gym import physics

GRAVITY = 9.81  # [m/s^2]
LIFT = 0.1  # [m] the energy that lifts all of a crowd by so much is what gains are compared with
# Of that, in a step. Overlap that is parted lifts what lies on it, at no velocity: that is not counted.
GAIN = 2e-4
# Plain time stepping is of order 1 where a body that turns far rebounds: what parts it from the ground turns it too.
REBOUND_GAIN = 2e-2


def crowd(seed: int, friction: float, restitution: float, decades: float) -> physics.Scene:
    """Eighty bodies of all kinds above a bowl, their masses apart by so many decades."""
    generator = np.random.default_rng(seed)
    material = physics.Material(friction, restitution)
    x, y = np.meshgrid(*[np.linspace(-5.0, 5.0, 41)] * 2)
    heights = 0.06 * (x * x + y * y) + 0.1 * np.sin(2.0 * x) * np.cos(2.3 * y)
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity((0.0, 0.0, -GRAVITY)))
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


def falling(world: physics.World, masses: np.ndarray, offsets: np.ndarray) -> float:
    """[N s] sum of m v_z of the centres of mass, ``offsets`` (bodies, 3) [m] from the frames of the bodies."""
    turns = Rotation.from_quat(np.roll(world.orientation[0], -1, axis=1))
    centers = world.linear_velocity[0] + np.cross(world.angular_velocity[0], turns.apply(offsets))
    return float(masses @ centers[:, 2])


def worst_gain(scene: physics.Scene, options: physics.Options, seconds: float) -> float:
    """Kinetic energy gained in a step above the work of gravity, m g . h (v + v') / 2."""
    world = physics.World(scene, options=options)
    masses = np.array([0.0 if body is None or body.mass is None else body.mass for body in scene.bodies])
    offsets = np.array(
        [(0.0, 0.05, 0.0) if isinstance(body.shape, physics.Compound) else 3 * (0.0,) for body in scene.bodies]
    )
    worst = 0.0
    kinetic, momentum = float(world.kinetic_energy()[0]), falling(world, masses, offsets)
    for _ in range(round(seconds / options.time_step)):
        world.step()
        before, kinetic = kinetic, float(world.kinetic_energy()[0])
        earlier, momentum = momentum, falling(world, masses, offsets)
        worst = max(worst, kinetic - before + GRAVITY * options.time_step * 0.5 * (earlier + momentum))
    return worst / (GRAVITY * LIFT * float(masses.sum()))


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
