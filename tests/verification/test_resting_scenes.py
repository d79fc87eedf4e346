"""Rest on every kind of ground: each shape on each, edges on edges, sheets, valleys and planets."""

import math

import numpy as np
import pytest

from avalanche_gym import physics
from avalanche_gym.physics import Box, Capsule, Compound, HeightField, Plane, Sphere, TriangleMesh
from avalanche_gym.physics.scenes import HARD_CASES

GRAVITY = 9.81
UPRIGHT = (1.0, 0.0, 0.0, 0.0)


def gravity_scene():
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity((0, 0, -GRAVITY)))
    return scene


def world_of(scene):
    return physics.World(scene, options=physics.Options(time_step=1 / 240))


LYING = (math.sqrt(0.5), 0.0, math.sqrt(0.5), 0.0)  # axis z turned to x
DUMBBELL = Compound([(Sphere(0.1), (-0.2, 0, 0), UPRIGHT), (Box((0.1, 0.1, 0.1)), (0.2, 0, 0), UPRIGHT)])
LEGS = Compound(
    [
        (Box((0.2, 0.2, 0.05)), (0, 0, 0.2), UPRIGHT),
        *((Capsule(0.03, 0.1), (0.15 * x, 0.15 * y, 0.0), UPRIGHT) for x in (-1, 1) for y in (-1, 1)),
    ]
)
# Shape, orientation, and height of its origin at rest.
RESTING = {
    "sphere": (Sphere(0.1), UPRIGHT, 0.1),
    "capsule lying": (Capsule(0.1, 0.2), LYING, 0.1),
    "box": (Box((0.1, 0.2, 0.15)), UPRIGHT, 0.15),
    "compound": (DUMBBELL, UPRIGHT, 0.1),
    "legs": (LEGS, UPRIGHT, 0.13),
}


def flat_mesh(size=2.0, cells=5):
    x = np.linspace(-size, size, cells + 1)
    vertices = [(a, b, 0.0) for b in x for a in x]
    row = cells + 1
    corners = [i + row * j for j in range(cells) for i in range(cells)]
    faces = [(c, c + 1, c + 1 + row) for c in corners] + [(c, c + 1 + row, c + row) for c in corners]
    return TriangleMesh(vertices, faces)


GROUNDS = {
    "plane": (Plane(), (0, 0, 0)),
    "box": (Box((2.0, 2.0, 0.5)), (0, 0, -0.5)),
    "height field": (HeightField(np.full((6, 8), 0.25), size=(4.0, 4.0)), (0, 0, -0.25)),
    "mesh": (flat_mesh(), (0, 0, 0)),
}


@pytest.mark.parametrize("ground", GROUNDS)
def test_everything_rests_on_flat_ground(ground):
    """Dropped from 5 mm, one behind the other, in a general place and heading of the ground."""
    scene = gravity_scene()
    shape, position = GROUNDS[ground]
    scene.add_body(shape, motion="static", position=position)
    x = np.linspace(-1.6, 1.6, len(RESTING))
    for (body, orientation, height), place in zip(RESTING.values(), x, strict=True):
        scene.add_body(body, density=500.0, position=(place, 0.13, height + 0.005), orientation=orientation)
    world = world_of(scene)
    world.step(240)
    for handle, (name, (_, orientation, height)) in enumerate(RESTING.items(), start=1):
        np.testing.assert_allclose(world.position[0, handle], [x[handle - 1], 0.13, height], atol=1e-8, err_msg=name)
        assert abs(np.abs(world.orientation[0, handle] @ orientation) - 1.0) < 1e-12, name
        assert np.abs(world.linear_velocity[0, handle]).max() < 1e-9, name
    assert world.report().penetration[0] < 1e-9


def test_a_height_field_lies_as_its_rows_and_columns_say():
    """Rows along y from -y, columns along x from -x, nothing outside."""
    heights = np.zeros((5, 9))
    heights[3:, 6:] = 0.5
    scene = gravity_scene()
    scene.add_body(HeightField(heights, size=(8.0, 4.0)), motion="static", position=(10, 20, 1))
    places = {(13, 21.5): 1.6, (13, 18.5): 1.1, (7, 21.5): 1.1, (7, 18.5): 1.1, (14.2, 20): None, (10, 22.2): None}
    for x, y in places:
        scene.add_body(Sphere(0.1), mass=1.0, position=(x, y, 1.75))
    world = world_of(scene)
    world.step(180)
    for height, z in zip(places.values(), world.position[0, 1:, 2], strict=True):
        assert z == pytest.approx(height if height else 1.75 - 0.5 * GRAVITY * 0.75**2, abs=1e-8)


@pytest.mark.parametrize("two_sided", [False, True])
def test_an_open_sheet_acts_on_its_front_or_on_both_sides(two_sided):
    vertices = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]
    scene = gravity_scene()
    for side, faces in ((-2, [(0, 1, 2), (0, 2, 3)]), (2, [(0, 2, 1), (0, 3, 2)])):
        scene.add_body(TriangleMesh(vertices, faces, two_sided=two_sided), motion="static", position=(side, 0, 0))
        scene.add_body(Sphere(0.1), mass=1.0, position=(side, 0.2, 0.2))
    world = world_of(scene)
    world.step(120)
    front, back = world.position[0, [1, 3], 2]
    assert front == pytest.approx(0.1, abs=1e-9)
    if two_sided:
        assert back == pytest.approx(0.1, abs=1e-9)
    else:
        # It falls through, hardly disturbed: overlap with the front is removed without a change of velocity.
        assert back < -1.0 and world.linear_velocity[0, 3, 2] == pytest.approx(-GRAVITY * 0.5, rel=1e-12)


def test_a_kinematic_plane_pushes():
    scene = gravity_scene()
    scene.add_body(Plane(), motion="kinematic", linear_velocity=(0, 0, 0.5))
    box = scene.add_body(Box((0.1, 0.1, 0.1)), mass=1.0, position=(0, 0, 0.1))
    world = world_of(scene)
    world.step(240)
    assert world.position[0, box, 2] == pytest.approx(0.6, abs=1e-9)
    assert world.linear_velocity[0, box, 2] == pytest.approx(0.5, abs=1e-12)


def test_a_ball_settles_in_the_corner_of_a_valley():
    """Two slopes of a height field meet at the ball: it ends where it touches both."""
    slope = math.tan(math.radians(30))
    heights = np.abs(np.linspace(-1, 1, 5)) * slope
    scene = gravity_scene()
    scene.add_body(HeightField(np.broadcast_to(heights, (3, 5)), size=(2.0, 2.0)), motion="static")
    ball = scene.add_body(Sphere(0.1), mass=1.0, position=(0.0, 0.1, 0.3))
    world = world_of(scene)
    world.step(240)
    np.testing.assert_allclose(world.position[0, ball], [0, 0.1, 0.1 / math.cos(math.radians(30))], atol=1e-8)
    contacts = world.contacts()
    assert len(contacts) == 2
    np.testing.assert_allclose(np.abs(contacts["normal"]), [[0.5, 0, math.cos(math.radians(30))]] * 2, atol=1e-7)


def test_point_gravity_holds_a_box_on_a_ball():
    scene = physics.Scene()
    scene.add_field(physics.PointGravity(center=(0, 0, 0), mu=100.0))
    scene.add_body(Sphere(5.0), motion="static")
    box = scene.add_body(Box((0.1, 0.1, 0.1)), mass=1.0, position=(0, 0, 5.1))
    world = world_of(scene)
    world.step(240)
    np.testing.assert_allclose(world.position[0, box], [0, 0, 5.1], atol=1e-8)
    weight = 100.0 / 5.1**2
    force = world.contacts()["impulse"].sum(axis=0) * 240
    # The impulse answers to gravity along the free fall of a step, g h^2 / 2 deep.
    np.testing.assert_allclose(force, [0, 0, weight], atol=weight * weight / 240**2 / 5.1)


EDGE_UP = (math.cos(math.pi / 8), math.sin(math.pi / 8), 0.0, 0.0)  # about x
EDGE_DOWN = (math.cos(math.pi / 8), 0.0, math.sin(math.pi / 8), 0.0)  # about y


@pytest.mark.parametrize(
    ("orientation", "thickness"), [(UPRIGHT, 0.05), (EDGE_DOWN, 0.05 * math.sqrt(2))], ids=["face", "edge"]
)
def test_crossed_beams_touch_with_their_edges(orientation, thickness):
    """A beam along y falls across the upper edge of one along x; vertices and faces of neither reach the other."""
    scene = gravity_scene()
    scene.add_body(Box((0.5, 0.05, 0.05)), motion="static", orientation=EDGE_UP)
    top = 0.05 * math.sqrt(2) + thickness
    beam = scene.add_body(Box((0.05, 0.5, 0.05)), mass=1.0, position=(0, 0, top + 0.02), orientation=orientation)
    world = world_of(scene)
    world.step(120)
    np.testing.assert_allclose(world.position[0, beam], [0, 0, top], atol=1e-7)
    force = world.contacts()["impulse"].sum(axis=0) * 240
    np.testing.assert_allclose(force, [0, 0, GRAVITY], atol=1e-6 * GRAVITY)


@pytest.mark.parametrize("name", ["stick", "stack", "stack_heavy", "table", "card_house"])
def test_a_scene_at_rest_that_is_awake_takes_no_factorisation(name):
    """The error that a certificate accepts is not handed on: it would double, and be solved for again and again."""
    world = physics.World(HARD_CASES[name].scene(), options=physics.Options(sleeping=False))
    world.step(60)
    place, turn = world.position.copy(), world.orientation.copy()
    world.step(120)
    assert world.report().iterations[0] == 0
    assert world.report().tier[0] == "certificate"
    np.testing.assert_array_equal(world.position, place)
    np.testing.assert_array_equal(world.orientation, turn)


@pytest.mark.parametrize("sleeping", [True, False])
@pytest.mark.parametrize("mass", [1.0, 1000.0])
def test_deep_overlap_parts_at_a_bounded_pace_and_is_reported(mass, sleeping):
    """A hundredth of the size in a step, no velocity from it, and no sleep before it is gone."""
    scene = gravity_scene()
    scene.add_body(Plane(), motion="static")
    scene.add_body(Box((0.1, 0.1, 0.1)), mass=1.0, position=(0, 0, 0.1))
    upper = scene.add_body(Box((0.1, 0.1, 0.1)), mass=mass, position=(0, 0.001, 0.2))
    world = physics.World(scene, options=physics.Options(sleeping=sleeping))
    for step in range(1, 106):
        before = world.position[0, upper].copy()
        world.step(1)
        assert np.linalg.norm(world.position[0, upper] - before) < 1.01e-3
        assert world.report().penetration[0] == pytest.approx(max(0.1 - 1e-3 * step, 0.0), abs=1e-7)
        assert world.kinetic_energy()[0] < 1e-12
    assert world.position[0, upper, 2] == pytest.approx(0.3, abs=1e-7)


@pytest.mark.parametrize("rate", [30, 60, 120, 960])
@pytest.mark.parametrize("name", ["stack_heavy", "table", "card_house"])
def test_what_is_placed_at_rest_stands_from_the_first_step_on(name, rate):
    """Without a warm start the solver takes what it needs, in islands of any size."""
    world = physics.World(HARD_CASES[name].scene(), options=physics.Options(time_step=1 / rate))
    start = world.position.copy()
    world.step(30)
    assert world.report().residual[0] <= 1e-10
    np.testing.assert_allclose(world.position, start, rtol=0.0, atol=1e-12)
