"""A height field is solid below and ends at its rectangle: bodies from the side meet upright walls."""

import itertools

import numpy as np
import pytest

from avalanche_gym import physics
from avalanche_gym.physics.model import BOX, SPHERE
from tests.oracles import terrain_oracle as oracle

FIELD = oracle.height_field(np.zeros((5, 5)), (2.0, 2.0))


def touch(shape, position, size):
    return oracle.field_contacts(shape, position, oracle.IDENTITY, size, FIELD, 0.02)


def test_sphere_beside_the_field():
    (wall,) = touch(SPHERE, (1.09, 0.2, -5.0), (0.1, 0.0, 0.0))
    assert wall["gap"] == pytest.approx(-0.01) and wall["normal"].tolist() == [-1.0, 0.0, 0.0]
    assert wall["position"] == pytest.approx([0.995, 0.2, -5.0])
    (corner,) = touch(SPHERE, (1.06, -1.08, -0.3), (0.1, 0.0, 0.0))
    assert corner["gap"] == pytest.approx(0.0) and corner["normal"] == pytest.approx([-0.6, 0.8, 0.0])
    (rim,) = touch(SPHERE, (1.06, 0.2, 0.08), (0.1, 0.0, 0.0))
    assert rim["gap"] == pytest.approx(0.0) and rim["normal"] == pytest.approx([-0.6, 0.0, -0.8])
    assert len(touch(SPHERE, (1.13, 0.0, -0.5), (0.1, 0.0, 0.0))) == 0


@pytest.mark.parametrize("overlap", [-0.01, 0.0, 1e-9, 0.003])
def test_box_against_a_wall_is_pushed_back_by_it(overlap):
    contacts = touch(BOX, (0.1, 1.2 - overlap, -0.5), (0.3, 0.2, 0.1))
    assert len(contacts) == 4 == len(set(contacts["feature"]))
    np.testing.assert_allclose(contacts["gap"], -overlap, atol=1e-14)
    np.testing.assert_allclose(contacts["normal"], np.tile((0.0, -1.0, 0.0), (4, 1)))


@pytest.mark.parametrize("surface", ["facets", "smooth"])
def test_bodies_from_the_side_stop_at_the_wall(surface):
    ice = physics.Material(friction=0.0)
    scene = physics.Scene()
    scene.add_body(physics.HeightField(np.zeros((9, 9)), (4.0, 4.0), surface=surface), motion="static", material=ice)
    shapes = (
        physics.Sphere(0.2),
        physics.Box((0.2, 0.2, 0.2)),
        physics.Cylinder(0.2, 0.3),
        physics.Capsule(0.2, 0.3),
        physics.ConvexHull(list(itertools.product((-0.2, 0.2), repeat=3))),
    )
    for number, shape in enumerate(shapes):
        place, way = (3.0, 0.8 * number - 1.6, -0.6), (-3.0, 0.0, 0.0)
        scene.add_body(shape, mass=1.0, position=place, linear_velocity=way, material=ice)
    world = physics.World(scene)
    world.step(120)
    np.testing.assert_allclose(world.position[0, 1:, 0], 2.2, atol=1e-8)
    np.testing.assert_allclose(world.position[0, 1:, 2], -0.6, atol=1e-8)
    np.testing.assert_allclose(world.linear_velocity[0, 1:], 0.0, atol=1e-8)


@pytest.mark.parametrize("surface", ["facets", "smooth"])
@pytest.mark.parametrize("turn", [0.0, 0.3, 0.7, 1.9])
def test_a_standing_cylinder_meets_a_wall_with_both_rims(surface, turn):
    """However it is turned about its axis, and from whichever side: it stops, upright, where it touches."""
    ice = physics.Material(friction=0.0)
    scene = physics.Scene()
    scene.add_body(physics.HeightField(np.zeros((9, 9)), (4.0, 4.0), surface=surface), motion="static", material=ice)
    sides = np.array([(1.0, 0.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, -1.0, 0.0)])
    upright = (np.cos(0.5 * turn), 0.0, 0.0, np.sin(0.5 * turn))
    for side in sides:
        place = 3.0 * side + (0.0, 0.0, -0.6)
        scene.add_body(
            physics.Cylinder(0.2, 0.3),
            mass=1.0,
            position=place,
            orientation=upright,
            linear_velocity=-3.0 * side,
            material=ice,
        )
    world = physics.World(scene)
    world.step(120)
    np.testing.assert_allclose(world.position[0, 1:], 2.2 * sides + (0.0, 0.0, -0.6), atol=1e-8)
    np.testing.assert_allclose(world.orientation[0, 1:], np.tile(upright, (4, 1)), atol=1e-8)
