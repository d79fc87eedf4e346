"""Every shape, with its own centre of mass and with one that was given, lies still on every kind of ground."""

import numpy as np
import pytest

from avalanche_gym import physics
from avalanche_gym.physics.shapes.planet import bumpy_planet
from tests.oracles import terrain_oracle as oracle

GRAVITY, RATE = 9.81, 240
UPRIGHT, LYING = np.array([1.0, 0.0, 0.0, 0.0]), np.array([np.sqrt(0.5), 0.0, np.sqrt(0.5), 0.0])
PRISM = [(x, y, z) for x, y in [(0.2, 0.0), (0.0, 0.2), (-0.2, 0.1), (-0.1, -0.2)] for z in (-0.1, 0.1)]
HULL = physics.ConvexHull(PRISM)
# Feet of every shape below a plate; each reaches 0.1 m below the origin.
TABLE = physics.Compound(
    [
        (physics.Box((0.25, 0.25, 0.02)), (0.0, 0.0, 0.05), UPRIGHT),
        (physics.Sphere(0.05), (0.2, 0.2, -0.05), UPRIGHT),
        (physics.Capsule(0.03, 0.04), (-0.2, 0.2, -0.03), UPRIGHT),
        (physics.Cylinder(0.04, 0.06), (-0.2, -0.2, -0.04), UPRIGHT),
        (physics.Box((0.03, 0.03, 0.06)), (0.2, -0.2, -0.04), UPRIGHT),
        (HULL, (0.0, 0.0, 0.0), UPRIGHT),
    ]
)
SHAPES = {  # with the turn in which they lie 0.1 m above the ground
    "sphere": (physics.Sphere(0.1), UPRIGHT),
    "capsule": (physics.Capsule(0.1, 0.2), LYING),
    "box": (physics.Box((0.2, 0.15, 0.1)), UPRIGHT),
    "cylinder": (physics.Cylinder(0.15, 0.1), UPRIGHT),
    "hull": (HULL, UPRIGHT),
    "compound": (TABLE, UPRIGHT),
}
FLOOR = oracle.grid_mesh(np.zeros((9, 13)), (12.0, 8.0))
SHALLOW = 0.002 * oracle.grid_mesh(np.zeros((9, 13)), (12.0, 8.0))[0][:, :1].reshape(9, 13) ** 2
GROUNDS = {
    "plane": [(physics.Plane(), (0.0, 0.0, 0.0))],
    "facets": [(physics.HeightField(np.zeros((9, 13)), (12.0, 8.0)), (0.0, 0.0, 0.0))],
    "slope of facets": [(physics.HeightField(SHALLOW, (12.0, 8.0)), (0.0, 0.0, 0.0))],
    "smooth": [(physics.HeightField(SHALLOW, (12.0, 8.0), surface="smooth"), (0.0, 0.0, 0.0))],
    "mesh": [(physics.TriangleMesh(*FLOOR), (0.0, 0.0, 0.0))],
    "two meshes": [(physics.TriangleMesh(*FLOOR), (x, 0.0, 0.0)) for x in (-6.0, 6.0)],
    "boxes": [(physics.Box((0.7, 4.0, 0.5)), (1.4 * k, 0.0, -0.5)) for k in range(-4, 5)],
    "planet": [(bumpy_planet(3.0, np.random.default_rng(5), amplitude=0.02), (0.0, 0.0, 0.0))],
}
MATERIAL = physics.Material(friction=0.8, rolling_friction=0.02, torsional_friction=0.02)


def turned(q, direction):
    """(4,) the quaternion of the turn q, followed by one of z to a unit direction."""
    half = np.array([1.0 + direction[2], -direction[1], direction[0], 0.0])
    a, b = half / np.linalg.norm(half), q
    return np.concatenate([[a[0] * b[0] - a[1:] @ b[1:]], a[0] * b[1:] + b[0] * a[1:] + np.cross(a[1:], b[1:])])


def places(ground):
    """Position and upward direction of twelve bodies that do not touch one another."""
    for k in range(12):
        if ground == "planet":
            around = 2.399963 * k  # [rad] the golden angle: points of a spiral on the sphere
            z = 0.92 - k / 6.5
            up = np.array([np.sqrt(1.0 - z * z) * np.cos(around), np.sqrt(1.0 - z * z) * np.sin(around), z])
            yield 3.2 * up, up
        else:
            x, y = -4.0 + 1.6 * (k % 6), 1.3 * (k // 6) - 0.6
            rise = 0.002 * x * x if ground in ("slope of facets", "smooth") else 0.0
            yield np.array([x, y, rise + 0.11]), np.array([0.0, 0.0, 1.0])


@pytest.mark.parametrize("ground", GROUNDS)
def test_it_lies_still_and_its_contacts_bear_its_weight(ground):
    scene = physics.Scene()
    if ground == "planet":
        scene.add_field(physics.PointGravity((0.0, 0.0, 0.0), mu=9.0 * GRAVITY))
    else:
        scene.add_field(physics.UniformGravity((0.0, 0.0, -GRAVITY)))
    for shape, position in GROUNDS[ground]:
        scene.add_body(shape, motion="static", position=position, material=MATERIAL)
    handles = []
    for (position, up), name, center in zip(
        places(ground), 2 * list(SHAPES), 6 * [None] + 6 * [(0.01, 0.005, -0.01)], strict=True
    ):
        shape, turn = SHAPES[name]
        handles.append(
            scene.add_body(
                shape, mass=2.0, position=position, orientation=turned(turn, up), center_of_mass=center,
                material=MATERIAL, name=f"{name} {len(handles)}",
            )
        )  # fmt: skip
    world = physics.World(scene, options=physics.Options(time_step=1.0 / RATE, sleeping=False))
    # A capsule with an eccentric centre of mass swings for a while.
    for _ in range(10):
        world.step(3 * RATE)
        speeds = np.linalg.norm(world.linear_velocity[0, handles], axis=1)
        if speeds.max() < 1e-6:
            break
    assert speeds.max() < 1e-6, dict(zip(2 * list(SHAPES), speeds, strict=True))
    before = world.linear_velocity[0].copy()
    world.step()
    assert np.abs(world.linear_velocity[0, handles] - before[handles]).max() < 1e-6
    contacts = world.contacts()
    for handle in handles:
        impulse = contacts["impulse"][contacts["body_b"] == handle].sum(axis=0)
        distance = np.linalg.norm(world.position[0, handle])
        weight = 2.0 * GRAVITY * (9.0 / distance**2 if ground == "planet" else 1.0) / RATE
        assert np.linalg.norm(impulse) == pytest.approx(weight, rel=0.02 if ground == "planet" else 1e-6)
