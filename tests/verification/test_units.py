"""Units do not matter: lengths, masses and times scaled by powers of two give the same motion, bit for bit."""

import itertools

import numpy as np
import pytest

from avalanche_gym import physics
from avalanche_gym.physics.shapes import terrain
from avalanche_gym.physics.shapes.rabbit import rabbit
from tests.oracles import terrain_oracle as oracle

RABBIT = rabbit(0.5, triangles=600)
POINTS = np.random.default_rng(11).normal(size=(14, 3))
POINTS /= 5.0 * np.linalg.norm(POINTS, axis=1, keepdims=True)
UPRIGHT = (1.0, 0.0, 0.0, 0.0)
SHAPES = {
    "sphere": lambda unit: physics.Sphere(0.15 * unit),
    "capsule": lambda unit: physics.Capsule(0.1 * unit, 0.15 * unit),
    "box": lambda unit: physics.Box((0.2 * unit, 0.15 * unit, 0.1 * unit)),
    "cylinder": lambda unit: physics.Cylinder(0.12 * unit, 0.15 * unit),
    "hull": lambda unit: physics.ConvexHull(POINTS * unit),
    "compound": lambda unit: physics.Compound(
        [
            (physics.Box((0.2 * unit, 0.05 * unit, 0.05 * unit)), (0.0, 0.0, 0.0), UPRIGHT),
            (physics.Cylinder(0.08 * unit, 0.06 * unit), (0.2 * unit, 0.0, 0.0), UPRIGHT),
            (physics.Sphere(0.08 * unit), (-0.2 * unit, 0.0, 0.0), UPRIGHT),
        ]
    ),
    "rabbit": lambda unit: physics.TriangleMesh(RABBIT.vertices * unit, RABBIT.faces),
}
HEIGHTS = terrain.octaves(33, 33, (8.0, 8.0), np.random.default_rng(3), amplitude=0.4, period=3.0, count=3)
FACETS = oracle.grid_mesh(HEIGHTS, (8.0, 8.0))
GROUNDS = {
    "field": lambda unit: physics.HeightField(HEIGHTS * unit, (8.0 * unit, 8.0 * unit)),
    "mesh": lambda unit: physics.TriangleMesh(FACETS[0] * unit, FACETS[1]),
    "smooth": lambda unit: physics.HeightField(HEIGHTS * unit, (8.0 * unit, 8.0 * unit), surface="smooth"),
    "plane": lambda unit: physics.Plane(),
}


def fall(shape, ground, length=1.0, mass=1.0, time=1.0):
    """Places, turns and velocities of a body that falls on hills, slides and rolls for a second, in these units."""
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity((0.0, 0.0, -9.81 * length / time**2)))
    material = physics.Material(friction=0.4, restitution=0.5, rolling_friction=0.005 * length)
    scene.add_body(GROUNDS[ground](length), motion="static", material=material)
    rng = np.random.default_rng(1)
    turn = rng.normal(size=4)
    body = scene.add_body(
        SHAPES[shape](length),
        mass=2.0 * mass,
        position=np.array((0.3, 0.4, 0.9)) * length,
        orientation=turn / np.linalg.norm(turn),
        linear_velocity=rng.normal(size=3) * (length / time),
        angular_velocity=rng.normal(size=3) * (3.0 / time),
        material=material,
    )
    world = physics.World(scene, options=physics.Options(time_step=time / 240.0))
    found = []
    for _ in range(6):
        world.step(40)
        velocity = world.linear_velocity[0, body] * (time / length)
        found.append([*(world.position[0, body] / length), *world.orientation[0, body], *velocity])
    return np.array(found)


@pytest.mark.parametrize("shape", SHAPES)
def test_millimetres_tons_and_milliseconds(shape):
    np.testing.assert_array_equal(fall(shape, "field", 2.0**10, 2.0**-10, 2.0**10), fall(shape, "field"))


@pytest.mark.verify
@pytest.mark.parametrize(("shape", "ground"), list(itertools.product(SHAPES, GROUNDS)))
def test_each_unit_on_every_ground(shape, ground):
    expected = fall(shape, ground)
    for unit, power in itertools.product(("length", "mass", "time"), (-10, 10)):
        np.testing.assert_array_equal(fall(shape, ground, **{unit: 2.0**power}), expected)
