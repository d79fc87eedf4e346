"""Crowds of bullets: many fast bodies, thin and whirling ones too, strike one free plate within a step.

In worlds of twelve and more bodies such a crowd is one island, of a size that is otherwise for the pile tier.
"""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from avalanche_gym import physics

PLATE = 0
HALF = np.array([0.01, 1.0, 1.0])
SHAPES: dict[str, physics.Shape] = {
    "sphere": physics.Sphere(0.02),
    "box": physics.Box((0.02, 0.02, 0.02)),
    "cylinder": physics.Cylinder(0.01, 0.02),
    "stick": physics.Capsule(0.005, 0.2),
    "rod": physics.Box((0.005, 0.005, 0.2)),
}


def crowd(shape: physics.Shape, seed: int, speed: float, restitution: float) -> physics.Scene:
    rng = np.random.default_rng(seed)
    scene = physics.Scene()
    material = physics.Material(friction=0.3, restitution=1.0)
    scene.add_body(physics.Box(tuple(HALF)), mass=20.0, material=material)
    bullet = physics.Material(friction=0.3, restitution=restitution)
    for number in range(15):
        turn = rng.normal(size=4)
        scene.add_body(
            shape,
            mass=0.01,
            position=(-rng.uniform(0.3, 3.0), rng.uniform(-0.8, 0.8), -0.8 + 0.11 * number),
            orientation=turn / np.linalg.norm(turn),
            linear_velocity=(speed, 0, 0),
            angular_velocity=10.0 * rng.normal(size=3),
            material=bullet,
        )
    return scene


def seen_from_the_plate(world: physics.World) -> NDArray[np.float64]:
    """(bodies, 3) [m] centres in the frame of the plate."""
    turn = Rotation.from_quat(world.orientation[0, PLATE], scalar_first=True)
    seen: NDArray[np.float64] = turn.inv().apply(world.position[0] - world.position[0, PLATE])
    return seen


@pytest.mark.parametrize("restitution", [0.0, 0.5])
@pytest.mark.parametrize("name", SHAPES)
def test_none_passes_and_energy_never_grows(name: str, restitution: float) -> None:
    """Linear and angular momentum stay too, for the plate is free."""
    for seed in range(2):
        for speed in (300.0, 1000.0):
            world = physics.World(crowd(SHAPES[name], seed, speed, restitution))
            momentum = world.linear_momentum()[0].copy()
            spin = world.angular_momentum()[0].copy()
            single = momentum[0] / 15 * np.linalg.norm(world.position[0, 1:, 1:], axis=1).sum()
            start = before = float(world.kinetic_energy()[0])
            beside = np.full(world.num_bodies, False)
            for _ in range(15):
                world.step(1)
                energy = float(world.kinetic_energy()[0])
                assert energy <= before * (1.0 + 1e-3)  # what a smooth part may gain (docs/impacts.md)
                assert energy <= start
                before = energy
                places = seen_from_the_plate(world)
                within = np.all(np.abs(places[:, 1:]) < HALF[1:], axis=1)
                beside |= ~within  # what has left sideways may come round
                passed = within & ~beside & (places[:, 0] > 0.0)
                passed[PLATE] = False
                assert not passed.any()
            np.testing.assert_allclose(world.linear_momentum()[0], momentum, rtol=0, atol=1e-9 * momentum[0])
            # Smooth parts keep it to second order in their turns.
            np.testing.assert_allclose(world.angular_momentum()[0], spin, rtol=0, atol=1e-3 * single)
