"""Meshes that fly fast and spin at every kind of target: none passes, none is left in it, and nothing gains energy.

The flight is so long that the blow comes at another phase of the step for each start; between blow and end of the step
a body turns up to a hundred times.
"""

import itertools
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from avalanche_gym import physics
from avalanche_gym.physics.shapes.icosphere import icosphere
from avalanche_gym.physics.shapes.rabbit import rabbit

HALF, WIDE = 0.02, 2.0  # [m] half thickness and half width of a wall
FACING = (np.sqrt(0.5), 0.0, -np.sqrt(0.5), 0.0)  # the z axis of a ground turned to -x
BOX_FACES = [
    (0, 2, 3), (0, 3, 1), (4, 5, 7), (4, 7, 6), (0, 1, 5), (0, 5, 4),
    (2, 6, 7), (2, 7, 3), (0, 4, 6), (0, 6, 2), (1, 3, 7), (1, 7, 5),
]  # fmt: skip


def corners(half) -> NDArray[np.float64]:
    return np.array([(x, y, z) for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)]) * half


@cache
def bullet(name: str) -> physics.TriangleMesh:
    if name == "ball":
        vertices, faces = icosphere(2)
        return physics.TriangleMesh(0.05 * vertices, faces)
    if name == "stick":
        return physics.TriangleMesh(corners((0.3, 0.02, 0.02)), BOX_FACES)
    return rabbit(0.1, triangles=1000)


def target(name: str) -> tuple[physics.Shape, tuple[float, ...], tuple[float, ...]]:
    """Shape, position [m] and orientation of something that fills x > 0, as far as it is thick."""
    upright = (1.0, 0.0, 0.0, 0.0)
    wall = corners((HALF, WIDE, WIDE))
    flat = np.zeros((9, 9))
    return {
        "box": (physics.Box((HALF, WIDE, WIDE)), (HALF, 0.0, 0.0), upright),
        "mesh": (physics.TriangleMesh(wall, BOX_FACES), (HALF, 0.0, 0.0), upright),
        "hull": (physics.ConvexHull(wall), (HALF, 0.0, 0.0), upright),
        "plane": (physics.Plane(), (0.0, 0.0, 0.0), FACING),
        "field": (physics.HeightField(flat, (4.0, 4.0)), (0.0, 0.0, 0.0), FACING),
        "sphere": (physics.Sphere(0.3), (0.3, 0.0, 0.0), upright),
        "capsule": (physics.Capsule(0.1, 1.0), (0.1, 0.0, 0.0), upright),
        "cylinder": (physics.Cylinder(0.1, 1.0), (0.1, 0.0, 0.0), upright),
    }[name]  # fmt: skip


def shoot(shape: physics.TriangleMesh, at: str, rate: int, speed: float, spin: float, phase: int, flies: bool = False):
    """A world, without gravity and friction, in which body 1 has just had time to fly through body 0."""
    scene = physics.Scene()
    smooth = physics.Material(friction=0.0)
    rng = np.random.default_rng(phase)
    solid, position, orientation = target(at)
    place = {"position": position, "orientation": orientation, "material": smooth}
    if flies:
        scene.add_body(solid, mass=1.0, linear_velocity=(-0.3 * speed, 0.0, 0.0), **place)
    else:
        scene.add_body(solid, motion="static", **place)
    distance = 0.45 + speed / 60.0 * (phase + 0.5) / 8.0
    axis, turn = rng.normal(size=3), rng.normal(size=4)
    scene.add_body(
        shape, mass=0.1, position=(-distance, 0.013, 0.017), orientation=turn / np.linalg.norm(turn),
        linear_velocity=(speed, 0.0, 0.0), angular_velocity=spin * axis / np.linalg.norm(axis), material=smooth,
    )  # fmt: skip
    world = physics.World(scene, options=physics.Options(time_step=1.0 / rate))
    energy = world.kinetic_energy()[0]
    deepest = 0.0
    for _ in range(int(np.ceil(distance / speed * rate)) + 3):
        world.step(1)
        deepest = max(deepest, world.report().penetration[0])
    assert deepest < 1e-4
    assert world.kinetic_energy()[0] <= energy * (1.0 + 1e-9)
    return world


def farthest(world: physics.World, shape: physics.TriangleMesh) -> float:
    """[m] along x, of the vertices."""
    turn = Rotation.from_quat(world.orientation[0, 1][[1, 2, 3, 0]])
    return float((turn.apply(np.array(shape.vertices))[:, 0] + world.position[0, 1, 0]).max())


@pytest.mark.parametrize("spin", [0.0, 60.0, 1000.0])
@pytest.mark.parametrize("at", ["box", "mesh"])
def test_a_ball_of_facets_does_not_pass_a_wall(at: str, spin: float) -> None:
    for phase in range(8):
        for rate, speed in ((60, 1000.0), (60, 30.0), (240, 1000.0)):
            world = shoot(bullet("ball"), at, rate, speed, spin, phase)
            assert farthest(world, bullet("ball")) < 1e-4


WALLS = ("box", "mesh", "hull", "plane", "field")
SHOTS = list(itertools.product(("ball", "stick", "rabbit"), WALLS, (0.0, 60.0, 1000.0)))


@pytest.mark.verify
@pytest.mark.parametrize(("name", "at", "spin"), SHOTS)
def test_no_mesh_passes_a_wall(name: str, at: str, spin: float) -> None:
    for phase in range(8):
        for rate, speed in ((60, 1000.0), (60, 30.0), (240, 1000.0), (240, 30.0)):
            world = shoot(bullet(name), at, rate, speed, spin, phase)
            assert farthest(world, bullet(name)) < 1e-4


@pytest.mark.verify
@pytest.mark.parametrize("flies", [False, True])
@pytest.mark.parametrize("at", ["sphere", "capsule", "cylinder"])
def test_no_mesh_passes_through_what_is_round(at: str, flies: bool) -> None:
    """What passes beside it is stopped to its speed along the surface, at a slope of a tenth at most."""
    for phase in range(8):
        for rate, speed in ((60, 1000.0), (60, 30.0), (240, 1000.0)):
            for spin in (0.0, 60.0, 1000.0):
                world = shoot(bullet("ball"), at, rate, speed, spin, phase, flies)
                before = world.position[0, 1, 0] < world.position[0, 0, 0]
                assert before or world.linear_velocity[0, 1, 0] - world.linear_velocity[0, 0, 0] < 0.5 * speed
