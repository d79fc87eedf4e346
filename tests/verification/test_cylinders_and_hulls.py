"""Cylinders and convex hulls at rest and sliding, against what a box or a point mass does."""

import itertools

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from avalanche_gym import physics

OCTAHEDRON = 0.2 * np.array([(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1.0)])
CUBE = 0.1 * np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)


def settle(shape, height, ground=None, seconds=2.0, **body):
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity((0.0, 0.0, -9.81)))
    scene.add_body(ground or physics.Plane(), motion="static")
    handle = scene.add_body(shape, mass=2.0, position=(0.0, 0.0, height), **body)
    world = physics.World(scene)
    world.step(round(240 * seconds))
    return world, handle


@pytest.mark.parametrize("ground", [None, physics.Box((1.0, 1.0, 0.5))])
@pytest.mark.parametrize(("shape", "rest"), [(physics.Cylinder(0.1, 0.2), 0.2), (physics.ConvexHull(CUBE), 0.1)])
def test_stands_on_its_face(shape, rest, ground):
    top = 0.0 if ground is None else 0.5
    world, body = settle(shape, top + rest + 0.01, ground)
    assert world.position[0, body] == pytest.approx((0.0, 0.0, top + rest), abs=1e-8)
    assert np.abs(world.linear_velocity[0, body]).max() < 1e-9
    weight = world.contacts()["impulse"].sum(axis=0) * 240
    assert np.abs(weight[2]) == pytest.approx(2.0 * 9.81, rel=1e-9)


def test_two_hulls_of_one_scene_keep_their_own_tables():
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity((0.0, 0.0, -9.81)))
    scene.add_body(physics.Plane(), motion="static")
    bodies = [
        scene.add_body(physics.ConvexHull(scale * CUBE), mass=1.0, position=(0.0, 0.0, z))
        for scale, z in ((1.0, 0.1), (0.5, 0.251), (2.0, 0.503))
    ]
    world = physics.World(scene)
    world.step(240)
    assert world.position[0, bodies, 2] == pytest.approx([0.1, 0.25, 0.5], abs=1e-8)


def test_hull_slides_as_a_point_mass():
    world, body = settle(physics.ConvexHull(CUBE), 0.1, seconds=0.5, linear_velocity=(5.0, 0.0, 0.0))
    assert world.linear_velocity[0, body, 0] == pytest.approx(5.0 - 0.5 * 9.81 * 0.5, rel=1e-9)


def test_octahedron_comes_to_rest_on_a_face():
    world, body = settle(physics.ConvexHull(OCTAHEDRON), 0.3, seconds=6.0, angular_velocity=(0.3, 0.2, 0.0))
    assert world.position[0, body, 2] == pytest.approx(0.2 / np.sqrt(3.0), abs=1e-7)
    assert world.kinetic_energy()[0] < 1e-12


@pytest.mark.parametrize("yaw", [0.0, 0.3, np.pi / 4])
def test_a_cylinder_that_leans_down_a_slope_stands_still(yaw):
    """What it weighs comes to bear at 0.9 of its radius: beyond the sides of a square in its rim."""
    slope = np.arctan(0.9 * 0.15 / 0.1)
    tilt = Rotation.from_rotvec([0.0, slope, 0.0])
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity((0.0, 0.0, -9.81)))
    rough = physics.Material(friction=3.0)
    scene.add_body(physics.Plane(), motion="static", orientation=tilt.as_quat(scalar_first=True), material=rough)
    turned = tilt * Rotation.from_rotvec([0.0, 0.0, yaw])
    start = tilt.apply([0.0, 0.0, 0.1])
    body = scene.add_body(
        physics.Cylinder(0.15, 0.1), mass=1.0, position=start, orientation=turned.as_quat(scalar_first=True),
        material=rough,
    )  # fmt: skip
    world = physics.World(scene)
    world.step(480)
    np.testing.assert_allclose(world.position[0, body], start, rtol=0.0, atol=1e-12)
    assert np.abs(world.linear_velocity[0, body]).max() < 1e-12


@pytest.mark.parametrize("ground", [physics.Plane(), physics.Box((40.0, 2.0, 0.5))])
@pytest.mark.parametrize("degrees", [5.0, 20.0, 40.0])
def test_rolls_down_a_slope_by_up_to_a_radian_a_step(degrees, ground):
    """x = g sin(theta) t^2 / 3 of a solid cylinder; its lowest line is another in every step."""
    tilt, seconds, rate = np.radians(degrees), 2.0, 60
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity((9.81 * np.sin(tilt), 0.0, -9.81 * np.cos(tilt))))
    grip = physics.Material(friction=1.0)
    low = 0.0 if isinstance(ground, physics.Plane) else -0.5
    scene.add_body(ground, motion="static", position=(0.0, 0.0, low), material=grip)
    lying = (np.sqrt(0.5), np.sqrt(0.5), 0.0, 0.0)
    body = scene.add_body(
        physics.Cylinder(0.1, 0.2), mass=2.0, position=(0.0, 0.0, 0.1), orientation=lying, material=grip
    )
    world = physics.World(scene, options=physics.Options(time_step=1.0 / rate))
    world.step(round(seconds * rate))
    assert world.position[0, body, 0] == pytest.approx(9.81 * np.sin(tilt) * seconds**2 / 3.0, rel=1e-9)
    assert world.position[0, body, 2] == pytest.approx(0.1, abs=1e-9)


@pytest.mark.parametrize("place", [0.0, 0.5, 1.0, 1.7])
def test_a_small_mesh_stands_on_a_wide_cap(place):
    """An edge of it that lies on the cap is not 1.5 m deep in the side of the cylinder."""
    corners = np.array(list(itertools.product((-0.1, 0.1), (-0.1, 0.1), (-0.05, 0.05))))
    hull = physics.ConvexHull(corners)
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity((0.0, 0.0, -9.81)))
    scene.add_body(physics.Cylinder(2.0, 0.1), motion="static", position=(0.0, 0.0, -0.1))
    mesh = physics.TriangleMesh(hull.vertices, hull.faces)
    body = scene.add_body(mesh, mass=1.0, position=(place, 0.0, 0.05))
    world = physics.World(scene)
    world.step(60)
    contacts = world.contacts()
    assert len(contacts) == 4
    np.testing.assert_allclose(np.abs(contacts["normal"][:, 2]), 1.0, atol=1e-12)
    np.testing.assert_allclose(world.position[0, body], (place, 0.0, 0.05), atol=1e-9)
