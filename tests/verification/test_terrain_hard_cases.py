"""Terrain that is dirty, far away, tiny or huge; beams across beams; every pair of shapes."""

import itertools

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from avalanche_gym import physics
from avalanche_gym.physics.shapes import terrain
from tests.oracles import terrain_oracle as oracle

CUBE = trimesh.creation.box((0.4, 0.3, 0.2))
SHAPES = {
    "sphere": physics.Sphere(0.1),
    "capsule": physics.Capsule(0.1, 0.2),
    "box": physics.Box((0.2, 0.15, 0.1)),
    "cylinder": physics.Cylinder(0.12, 0.1),
    "hull": physics.ConvexHull(CUBE.vertices),
    "mesh": physics.TriangleMesh(CUBE.vertices, CUBE.faces),
}
GROUNDS = {
    "plane": physics.Plane(),
    "field": physics.HeightField(np.zeros((9, 9)), (8.0, 8.0)),
    "floor": physics.TriangleMesh(*oracle.grid_mesh(np.zeros((9, 9)), (8.0, 8.0))),
}


def scene_with(ground, gravity=9.81):
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity((0.0, 0.0, -gravity)))
    scene.add_body(ground, motion="static")
    return scene


@pytest.mark.parametrize("pair", list(itertools.product(SHAPES, GROUNDS)), ids="-".join)
def test_every_shape_rests_on_every_ground(pair):
    name, ground = pair
    scene = scene_with(GROUNDS[ground])
    height = 0.1 if name != "capsule" else 0.3
    scene.add_body(SHAPES[name], mass=2.0, position=(0.1, 0.2, height + 0.01))
    world = physics.World(scene)
    world.step(240)
    assert world.position[0, 1, 2] == pytest.approx(height, abs=1e-6)
    total = world.contacts()["impulse"][:, 2].sum()
    assert abs(total) == pytest.approx(2.0 * 9.81 / 240, rel=1e-6)


@pytest.mark.parametrize("pair", list(itertools.combinations_with_replacement(SHAPES, 2)), ids="-".join)
def test_every_shape_meets_every_shape(pair):
    scene = scene_with(physics.Plane())
    for name, height in zip(pair, (0.3, 1.0), strict=True):
        scene.add_body(SHAPES[name], mass=2.0, position=(0.0, 0.0, height))
    world = physics.World(scene)
    before = world.kinetic_energy() + world.potential_energy()
    world.step(120)
    assert (world.position[0, 1:, 2] > 0.05).all()
    assert world.kinetic_energy() + world.potential_energy() <= before + 1e-9


def test_a_dirty_floor_is_a_clean_one():
    """Degenerate, duplicate, needle and flipped triangles: the same motion as on the clean mesh."""
    vertices, faces = oracle.grid_mesh(np.zeros((9, 9)), (8.0, 8.0))
    more = np.array([(0.0, 0.0, 0.0), (0.5, 0.0, 0.0), (0.25, 1e-12, 0.0)])
    n = len(vertices)
    dirty = [faces, faces[3:9], [(n, n + 1, n + 2), (0, 0, 1)]]
    flipped = np.concatenate(dirty)
    flipped[10:14] = flipped[10:14, ::-1]
    needle = np.array([(-4.0, -4.0, 0.0)])  # one corner again, torn apart by nothing
    places = []
    for mesh in ((vertices, faces), (np.concatenate([vertices, more, needle]), flipped)):
        scene = scene_with(physics.TriangleMesh(*mesh))
        scene.add_body(SHAPES["box"], mass=1.0, position=(-2.0, -1.0, 0.1), linear_velocity=(3.0, 1.5, 0.0), name="box")
        world = physics.World(scene)
        world.step(480)
        places.append(np.concatenate([world.position[0, 1], world.orientation[0, 1]]))
    np.testing.assert_allclose(places[1], places[0], rtol=0.0, atol=1e-9)


TILTED = oracle.rotation_matrix((0.1, -0.2, 0.3))


def contacts_near(scale, offset, name):
    """Contacts with rough ground, all lengths times ``scale``, the whole moved by ``offset`` [m]."""
    heights = scale * terrain.octaves(17, 17, (4.0, 4.0), np.random.default_rng(2), amplitude=0.2, period=2.0, count=3)
    field = oracle.height_field(heights, (4.0 * scale, 4.0 * scale))
    height = heights[8, 8] + 0.1 * scale
    place = (oracle.floats(offset), oracle.IDENTITY)
    position = np.array([0.03 * scale, 0.02 * scale, height]) + offset
    if name == "cylinder":
        return oracle.cylinder_contacts(position, TILTED, (0.12 * scale, 0.1 * scale, 0.0), field, 0.02 * scale, place)
    solid = oracle.hull(scale * CUBE.vertices)
    return oracle.hull_contacts(position, TILTED, solid, field, 0.02 * scale, place)


@pytest.mark.parametrize("name", ["cylinder", "hull"])
def test_size_and_place_do_not_matter(name):
    """Contacts scale with all lengths, and the error far away is the spacing of floats there."""
    expected = contacts_near(1.0, np.zeros(3), name)
    assert len(expected) > 1
    for scale in (1e-4, 1e4):
        contacts = contacts_near(scale, np.zeros(3), name)
        assert (contacts["feature"] == expected["feature"]).all()
        np.testing.assert_allclose(contacts["gap"], scale * expected["gap"], rtol=0.0, atol=1e-13 * scale)
        np.testing.assert_allclose(contacts["normal"], expected["normal"], rtol=0.0, atol=1e-9)
    for far in (1e3, 1e6):
        offset = np.full(3, far)
        contacts = contacts_near(1.0, offset, name)
        np.testing.assert_allclose(contacts["gap"], expected["gap"], rtol=0.0, atol=20.0 * np.spacing(far))


@pytest.mark.parametrize("lower", ["box", "hull", "mesh"])
@pytest.mark.parametrize("upper", ["box", "hull", "cylinder"])
def test_a_beam_rests_across_a_beam(lower, upper):
    """Edge on edge: the lower beam stands on its edge, the upper one lies across it on its own edge, or flat."""
    beam = trimesh.creation.box((4.0, 0.2, 0.2))
    made = {
        "box": physics.Box((2.0, 0.1, 0.1)),
        "hull": physics.ConvexHull(beam.vertices),
        "mesh": physics.TriangleMesh(beam.vertices, beam.faces),
        "cylinder": physics.Cylinder(0.1, 2.0),
    }
    quarter, eighth = np.sqrt(0.5), np.pi / 8
    on_edge = np.array([np.cos(eighth), np.sin(eighth), 0.0, 0.0])
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity((0.0, 0.0, -9.81)))
    scene.add_body(made[lower], motion="static", orientation=on_edge)
    # Turned about z by a right angle, then on its edge; a cylinder's axis is laid along y.
    across = np.array([quarter * on_edge[0], quarter * on_edge[1], quarter * on_edge[1], quarter * on_edge[0]])
    height = 2.0 * np.sqrt(0.02)
    if upper == "cylinder":
        across = np.array([quarter, quarter, 0.0, 0.0])
        height = np.sqrt(0.02) + 0.1
    scene.add_body(made[upper], mass=5.0, position=(0.0, 0.0, height + 0.05), orientation=across)
    world = physics.World(scene)
    world.step(240)
    assert world.position[0, 1, 2] == pytest.approx(height, abs=1e-5)
    np.testing.assert_allclose(world.linear_velocity[0, 1], 0.0, atol=1e-6)


@pytest.mark.parametrize("lower", ["box", "hull", "mesh", "cylinder"])
@pytest.mark.parametrize("upper", ["box", "hull", "mesh"])
def test_a_beam_rests_across_a_beam_at_any_angle(lower, upper):
    """Off the middle of the lower one; near parallel the edges touch over a stretch that is ill-defined."""
    beam = trimesh.creation.box((4.0, 0.2, 0.2))
    made = {
        "box": physics.Box((2.0, 0.1, 0.1)),
        "hull": physics.ConvexHull(beam.vertices),
        "mesh": physics.TriangleMesh(beam.vertices, beam.faces),
        "cylinder": physics.Cylinder(0.1, 2.0),
    }
    on_edge, lying = Rotation.from_euler("x", 45, degrees=True), Rotation.from_euler("y", 90, degrees=True)
    height = np.sqrt(0.02) + (0.1 if lower == "cylinder" else np.sqrt(0.02))
    for angle in (60.0, 30.0, 10.0):
        scene = physics.Scene()
        scene.add_field(physics.UniformGravity((0.0, 0.0, -9.81)))
        below = lying if lower == "cylinder" else on_edge
        scene.add_body(made[lower], motion="static", orientation=below.as_quat(scalar_first=True))
        turned = (Rotation.from_euler("z", angle, degrees=True) * on_edge).as_quat(scalar_first=True)
        scene.add_body(made[upper], mass=5.0, position=(0.3, 0.0, height + 0.05), orientation=turned)
        world = physics.World(scene)
        world.step(240)
        assert world.position[0, 1, 2] == pytest.approx(height, abs=1e-5)
        np.testing.assert_allclose(world.linear_velocity[0, 1], 0.0, atol=1e-6)
        np.testing.assert_allclose(world.angular_velocity[0, 1], 0.0, atol=1e-5)


@pytest.mark.parametrize("far", [1e3, 1e6])
@pytest.mark.parametrize("name", ["box", "sphere"])
def test_a_cut_floor_far_away_is_a_plane_there(name, far):
    """Sliding and spinning with friction: the difference stays below the spacing of floats."""
    offset = np.array([far, -far, far / 3.0])
    floor = physics.TriangleMesh(*oracle.random_floor(np.random.default_rng(1), size=14.0, points=150))
    material = physics.Material(friction=0.2)
    places = []
    for ground in (physics.Plane(), floor, physics.HeightField(np.zeros((41, 33)), (14.0, 14.0))):
        scene = physics.Scene()
        scene.add_field(physics.UniformGravity((0.0, 0.0, -9.81)))
        scene.add_body(ground, motion="static", position=offset, material=material)
        scene.add_body(
            SHAPES[name], mass=1.0, position=offset + np.array([-3.0, -1.5, 0.1]), linear_velocity=(1.5, 0.8, 0.0),
            angular_velocity=(0.0, 0.0, 2.0), material=material,
        )  # fmt: skip
        world = physics.World(scene)
        world.step(480)
        places.append(np.concatenate([world.position[0, 1] - offset, world.orientation[0, 1]]))
    for place in places[1:]:
        np.testing.assert_allclose(place, places[0], rtol=0.0, atol=np.spacing(far))


@pytest.mark.parametrize("half", [0.02, 1.0, 2.0, 4.0])
def test_a_plate_of_any_size_rests_on_hills(half):
    """Smaller than a cell, and over a hundred cells: no hilltop is in it, and it lies still after 15 s."""
    for seed in range(2):
        heights = terrain.octaves(33, 33, (16.0, 16.0), np.random.default_rng(seed), amplitude=0.5, period=4.0, count=4)
        extents = np.array([half, 0.8 * half, 0.05 * max(half, 0.3)])
        scene = scene_with(physics.HeightField(heights, (16.0, 16.0)))
        turn = Rotation.from_rotvec([0.2, 0.1, 0.4]).as_quat(scalar_first=True)
        material = physics.Material(friction=0.5, rolling_friction=0.005)
        start = (0.1, 0.2, heights.max() + 0.1 + 0.3 * half)
        scene.add_body(physics.Box(extents), density=500.0, position=start, orientation=turn, material=material)
        world = physics.World(scene, options=physics.Options(sleeping=False))
        world.step(3600)
        np.testing.assert_allclose(world.linear_velocity[0, 1], 0.0, atol=1e-6)
        x, y = terrain.grid(33, 33, (16.0, 16.0))
        samples = np.column_stack([x.ravel(), y.ravel(), heights.ravel()]) - world.position[0, 1]
        inside = Rotation.from_quat(world.orientation[0, 1].copy(), scalar_first=True).inv().apply(samples)
        assert (extents - np.abs(inside)).min(axis=1).max() < 1e-6 * half
