"""Concave bodies: they come to rest, and move as their primitives do."""

import numpy as np
import pytest

from avalanche_gym import physics
from avalanche_gym.physics.scenes import HARD_CASES
from avalanche_gym.physics.scenes.case import GRAVITY
from avalanche_gym.physics.scenes.concave import LENGTH, PEG, RING, TUBE, rabbits, torus_pendulum
from avalanche_gym.physics.scenes.recording import record
from avalanche_gym.physics.shapes.icosphere import icosphere
from avalanche_gym.physics.shapes.rabbit import rabbit
from avalanche_gym.physics.shapes.ring_solids import gear, torus
from tests.oracles import terrain_oracle
from tests.oracles.polygon_oracle import hang

BOX = (0.2, 0.15, 0.1)
BOX_FACES = [
    (0, 2, 3), (0, 3, 1), (4, 5, 7), (4, 7, 6), (0, 1, 5), (0, 5, 4),
    (2, 6, 7), (2, 7, 3), (0, 4, 6), (0, 6, 2), (1, 3, 7), (1, 7, 5),
]  # fmt: skip


def box_mesh():
    corners = np.array([(x, y, z) for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)]) * BOX
    return physics.TriangleMesh(corners, BOX_FACES)


def slid(shape, seconds=0.5, **motion):
    """Position and orientation after a while on a plane."""
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity((0.0, 0.0, -9.81)))
    material = physics.Material(friction=0.3)
    scene.add_body(physics.Plane(), motion="static", material=material)
    scene.add_body(shape, mass=1.0, material=material, **motion)
    world = physics.World(scene)
    world.step(round(240 * seconds))
    return world.position[0, 1].copy(), world.orientation[0, 1].copy()


def test_a_box_slides_alike_as_a_mesh():
    start = {"position": (0, 0, BOX[2]), "linear_velocity": (1.0, 0.3, 0.0), "angular_velocity": (0.0, 0.0, 0.5)}
    mesh, box = slid(box_mesh(), **start), slid(physics.Box(BOX), **start)
    for one, other in zip(mesh, box, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-7)


GROUNDS = {
    "plane": (physics.Plane(), 0.0),
    "box": (physics.Box((2.0, 2.0, 0.5)), -0.5),
    "ramp": (physics.HeightField(np.tile(np.linspace(-0.8, 0.8, 9), (9, 1)), (8.0, 8.0)), 0.0),
    "rough": (physics.HeightField(0.1 * np.random.default_rng(7).random((21, 21)), (4.0, 4.0)), 0.0),
}


def tumbled(shape, ground, seed):
    """Positions (240, 3) of a box that falls on the ground, bounces on its corners, and slides."""
    rng = np.random.default_rng(seed)
    turn = rng.normal(size=4)
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity((0.0, 0.0, -9.81)))
    material = physics.Material(friction=0.5)
    body, height = GROUNDS[ground]
    scene.add_body(body, motion="static", position=(0, 0, height), material=material)
    start = {"linear_velocity": rng.uniform(-0.5, 0.5, 3), "angular_velocity": rng.uniform(-5.0, 5.0, 3)}
    turn /= np.linalg.norm(turn)
    scene.add_body(shape, mass=1.0, position=(0, 0, 0.6), orientation=turn, material=material, **start)
    world = physics.World(scene)
    path = np.zeros((240, 3))
    for step in range(240):
        world.step(1)
        path[step] = world.position[0, 1]
    return path


@pytest.mark.parametrize(
    ("ground", "tolerance", "seeds"), [("plane", 1e-10, 3), ("box", 1e-5, 3), ("ramp", 1e-6, 3), ("rough", 1e-8, 8)]
)
def test_a_box_tumbles_alike_as_a_mesh(ground, tolerance, seeds):
    """On rough facets too: there its edges cross ridges, and both turn the normal.

    On the plane to what predictions leave: their sweeps take the contacts in another order, and what has come true to
    1e-6 of the size (response/places.py, FORESEEN) is not predicted again.
    """
    for seed in range(seeds):
        off = np.linalg.norm(tumbled(box_mesh(), ground, seed) - tumbled(physics.Box(BOX), ground, seed), axis=1)
        assert off.max() < tolerance


def stacked(shape):
    """Positions (2, 3) and orientations (2, 4) of two boxes, of which one slides over two sides of the other."""
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity((0.0, 0.0, -9.81)))
    material = physics.Material(friction=0.4)
    scene.add_body(physics.Plane(), motion="static", material=material)
    scene.add_body(shape, mass=1.0, position=(0, 0, BOX[2]), material=material)
    above = {"position": (0.05, 0.02, 3 * BOX[2]), "linear_velocity": (0.5, 0.1, 0.0)}
    scene.add_body(shape, mass=1.0, material=material, **above)
    world = physics.World(scene)
    world.step(120)
    assert world.report().penetration[0] < 1e-6
    return world.position[0, 1:].copy(), world.orientation[0, 1:].copy()


def test_a_box_on_a_box_moves_alike_as_a_mesh():
    """It stands on a corner of each, and where edges cross: these are no less through than corners are."""
    for one, other in zip(stacked(box_mesh()), stacked(physics.Box(BOX)), strict=True):
        np.testing.assert_allclose(one, other, atol=1e-6)


def test_a_ball_of_1280_faces_rolls_as_a_sphere_does_but_for_its_facets():
    vertices, faces = icosphere(3)
    ball = physics.TriangleMesh(0.1 * vertices, faces)
    start = {"position": (0, 0, 0.1), "linear_velocity": (1.0, 0.0, 0.0), "angular_velocity": (0.0, 10.0, 0.0)}
    mesh, sphere = slid(ball, 0.25, **start)[0], slid(physics.Sphere(0.1), 0.25, **start)[0]
    # Facets lie within 0.35 % of the radius of the sphere.
    assert abs(mesh[2] - sphere[2]) < 0.0035 * 0.1
    # Where a ball tips over an edge with kink k, e = 0, its spin falls by (I + m r^2 cos k) / (I + m r^2), or 5/14 k^2;
    # edges follow each other at k r, so over the way x half of 5/14 k x / r is lost of it.
    kink = np.linalg.norm(vertices[faces[:, 0]] - vertices[faces[:, 1]], axis=1).max()
    lost = 5.0 / 28.0 * kink * sphere[0] / 0.1
    assert 0.0 < 1.0 - mesh[0] / sphere[0] < lost


def test_a_rabbit_comes_to_rest_on_terrain():
    world = physics.World(rabbits(1))
    worst = 0.0
    for _ in range(64):
        world.step(15)
        worst = max(worst, world.report().penetration[0])
    assert np.linalg.norm(world.linear_velocity[0, 1]) < 1e-6
    assert np.linalg.norm(world.angular_velocity[0, 1]) < 1e-5
    assert worst < 1e-4
    weight = world.contacts()["impulse"].sum(axis=0) * 240
    np.testing.assert_allclose(np.abs(weight), (0.0, 0.0, 9.81), atol=1e-6)


@pytest.mark.parametrize(("segments", "swing"), [(64, 0.3), (128, 0.1), (512, 0.3)])
def test_a_hung_torus_moves_as_its_polygon_does(segments, swing):
    """Within facets, in a step or several to a step: an independent integration, with e = 0 at the creases."""
    world = physics.World(torus_pendulum(segments, swing))
    steps = 240
    solid = torus(RING, TUBE, segments=segments, sides=8).mass_properties()
    inertia = solid.inertia[2, 2] / solid.volume
    centre, energy = np.zeros((steps + 1, 2)), np.zeros(steps + 1)
    for step in range(steps + 1):
        centre[step] = world.position[0, 1, [0, 2]]
        velocity, spin = world.linear_velocity[0, 1], world.angular_velocity[0, 1]
        energy[step] = 0.5 * velocity @ velocity + 0.5 * inertia * spin @ spin + GRAVITY * centre[step, 1]
        world.step(1)
    apothem = (RING - TUBE) * np.cos(np.pi / segments)
    _, exact, exact_energy, losses = hang(apothem, PEG, segments, 1.0, inertia, GRAVITY, swing, steps / 240, steps)
    assert np.linalg.norm(centre - exact, axis=1).max() < 1e-3 * LENGTH
    assert energy[0] - energy[-1] == pytest.approx(losses.sum(), rel=0.05)
    assert exact_energy[0] - exact_energy[-1] == pytest.approx(losses.sum(), rel=1e-6)
    # It may only fall, but for what round-off and the order of the step leave of the swing's energy.
    assert np.diff(energy).max() < 1e-5 * (energy[0] + GRAVITY * LENGTH)


@pytest.mark.verify
@pytest.mark.parametrize("name", ["rabbit", "rabbit_on_rabbit", "torus_pendulum", "nut_holds", "nut_screws_down"])
def test_concave_hard_cases_are_survived(name):
    case = HARD_CASES[name]
    recording, others, _ = record(case, physics.Options())
    assert case.errors(recording, *others)[case.error] <= case.passes_at


def test_a_rabbit_that_a_package_carries_comes_to_rest():
    # Only pybullet, of the extra ``bench``, carries a mesh: the bunny of the original, at which that engine failed.
    data = pytest.importorskip(
        "pybullet_data", reason="needs the bunny that pybullet carries: pip install -e '.[bench]'"
    )
    folder = data.getDataPath()
    bunny = physics.TriangleMesh.from_file(f"{folder}/bunny.obj", scale=0.1)
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity((0.0, 0.0, -9.81)))
    material = physics.Material(friction=0.5, rolling_friction=0.005)
    scene.add_body(physics.Plane(), motion="static", material=material)
    scene.add_body(bunny, mass=1.0, position=(0, 0, 0.3), material=material)
    world = physics.World(scene)
    world.step(720)
    assert np.linalg.norm(world.linear_velocity[0, 1]) < 1e-6


def plate_mesh():
    return physics.TriangleMesh(box_mesh().vertices / BOX * (0.1, 0.1, 0.005), BOX_FACES)


def needle():
    """A tetrahedron with an acute tip: where that touches, what lies straight behind the face is beside it."""
    corners = 0.2 * np.array([(0.0, 0.0, 0.0), (1.0, 0.1, 0.0), (0.95, 0.0, 0.12), (1.0, 0.0, -0.1)])
    return physics.TriangleMesh(corners - corners.mean(axis=0), [(0, 2, 1), (0, 3, 2), (0, 1, 3), (1, 2, 3)])


def rested(shape, winding, two_sided, seed):
    """Position and orientation of a body that fell on a rough mesh, and how deep it ever was."""
    heights = 0.05 * np.random.default_rng(seed + 1).random((11, 11))
    points, faces = terrain_oracle.grid_mesh(heights, (2.0, 2.0))
    rng = np.random.default_rng(seed)
    turn = rng.normal(size=4)
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity((0.0, 0.0, -9.81)))
    material = physics.Material(friction=0.5, rolling_friction=0.005)
    mesh = physics.TriangleMesh(points, faces[:, ::winding], two_sided=two_sided)
    scene.add_body(mesh, motion="static", material=material)
    turn /= np.linalg.norm(turn)
    fall = {"position": (0.01, 0.02, 0.4), "orientation": turn, "angular_velocity": rng.uniform(-3.0, 3.0, 3)}
    scene.add_body(shape, mass=1.0, material=material, **fall)
    world = physics.World(scene)
    deepest = 0.0
    for _ in range(480):
        world.step(1)
        deepest = max(deepest, world.report().penetration[0])
    assert np.linalg.norm(world.linear_velocity[0, 1]) < 1e-6
    return np.concatenate([world.position[0, 1], world.orientation[0, 1]]), deepest


@pytest.mark.parametrize(
    ("make", "seed"),
    [
        (plate_mesh, 0),
        (plate_mesh, 3),
        (needle, 0),
        (lambda: physics.Box((0.1, 0.1, 0.005)), 0),
        (lambda: physics.Box((0.1, 0.1, 0.005)), 3),
        (lambda: rabbit(0.2, triangles=2000), 3),
    ],
    ids=["plate", "other plate", "needle", "box", "other box", "rabbit"],
)
def test_a_rough_two_sided_sheet_holds_as_ground_of_one_side_does(make, seed):
    """Whichever way its faces are turned; the planes of its faces lead over and under thin bodies, which fell through.

    But for what faces listed in another order leave: 1e-6.
    """
    ground, deepest = rested(make(), 1, False, seed)
    assert deepest < 1e-4
    for winding in (1, -1):
        sheet, deepest = rested(make(), winding, True, seed)
        np.testing.assert_allclose(sheet, ground, atol=1e-6)
        assert deepest < 1e-4


@pytest.mark.parametrize("seed", [0, 3])
def test_a_small_solid_on_a_large_box_is_never_deep_in_it(seed):
    """An edge just below the top of the box is no way out to an edge of the box, a metre off."""
    rng = np.random.default_rng(seed)
    turn, place = rng.normal(size=4), (*rng.uniform(-0.4, 0.4, 2), 0.4)
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity((0.0, 0.0, -9.81)))
    material = physics.Material(friction=0.5, rolling_friction=0.005)
    scene.add_body(physics.Box((1.0, 1.0, 0.5)), motion="static", position=(0, 0, -0.5), material=material)
    scene.add_body(
        gear(0.1, 0.05), density=rng.uniform(300.0, 3000.0), position=place,
        orientation=turn / np.linalg.norm(turn), linear_velocity=rng.uniform(-0.5, 0.5, 3),
        angular_velocity=rng.uniform(-5.0, 5.0, 3), material=material,
    )  # fmt: skip
    world = physics.World(scene)
    for _ in range(480):
        world.step(1)
        assert world.report().penetration[0] < 1e-4
