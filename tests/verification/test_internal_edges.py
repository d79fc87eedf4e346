"""Bodies that slide and spin over a flat floor move as on the analytic plane, however the floor is cut."""

import itertools

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from avalanche_gym import physics
from tests.oracles import terrain_oracle as oracle

PRISM = [
    (x, y, z) for x, y in [(0.25, 0.0), (0.1, 0.2), (-0.2, 0.15), (-0.22, -0.1), (0.05, -0.2)] for z in (-0.1, 0.1)
]
UPRIGHT, LYING = (1.0, 0.0, 0.0, 0.0), (np.sqrt(0.5), 0.0, np.sqrt(0.5), 0.0)
BODIES = {
    "sphere": (physics.Sphere(0.1), UPRIGHT),
    "capsule": (physics.Capsule(0.1, 0.2), LYING),
    "box": (physics.Box((0.2, 0.15, 0.1)), UPRIGHT),
    "hull": (physics.ConvexHull(PRISM), UPRIGHT),
    "standing cylinder": (physics.Cylinder(0.15, 0.1), UPRIGHT),
    "lying cylinder": (physics.Cylinder(0.1, 0.2), LYING),
}
ALLOWED = 1e-9  # [m]


def path(name, floor, friction, seconds, rate=240, spin=2.0):
    """(steps, 7) position and orientation of the body; ``floor``: a shape, or several with their positions."""
    shape, orientation = BODIES[name]
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity((0.0, 0.0, -9.81)))
    material = physics.Material(friction=friction)
    for piece, position in floor if isinstance(floor, list) else [(floor, (0.0, 0.0, 0.0))]:
        scene.add_body(piece, motion="static", material=material, position=position)
    scene.add_body(
        shape,
        mass=1.0,
        position=(-3.0, -1.5, 0.1),
        orientation=orientation,
        linear_velocity=(1.5, 0.8, 0.0),
        angular_velocity=(0.0, 0.0, spin),
        material=material,
    )
    world = physics.World(scene, options=physics.Options(time_step=1.0 / rate))
    places = []
    for _ in range(int(rate * seconds)):
        world.step()
        places.append(np.concatenate([world.position[0, -1], world.orientation[0, -1]]))
    return np.array(places)


def random_floor(rng):
    vertices, faces = oracle.random_floor(rng, size=12.0, points=150)
    return physics.TriangleMesh(vertices, faces)


def floor_with_seam():
    """Two chunks of different grids that meet at x = 0 in T-junctions, some faces given twice."""
    left, faces = oracle.grid_mesh(np.zeros((9, 9)), (6.0, 12.0))
    right, more = oracle.grid_mesh(np.zeros((14, 6)), (6.0, 12.0))
    vertices = np.concatenate([left - (3.0, 0.0, 0.0), right + np.array([3.0, 0.0, 0.0])])
    return physics.TriangleMesh(vertices, np.concatenate([faces, more + len(left), faces[:5]]))


def tiles():
    """Height fields of 1.5 m side by side, none of their rims where the body starts."""
    tile = physics.HeightField(np.zeros((4, 5)), (1.5, 1.5))
    return [(tile, (1.5 * i + 0.0123, 1.5 * j + 0.0071, 0.0)) for i in range(-3, 4) for j in range(-2, 3)]


def two_floors(rng):
    """Two bodies, meshes cut at random, that meet at x = -1.3 without a common vertex."""
    floors = []
    for low, high in ((-8.0, -1.3), (-1.3, 8.0)):
        vertices, faces = oracle.random_floor(rng, size=1.0, points=80)
        mesh = physics.TriangleMesh(vertices * (high - low, 12.0, 1.0), faces)
        floors.append((mesh, (0.5 * (low + high), 0.0, 0.0)))
    return floors


@pytest.mark.parametrize(("name", "friction"), list(itertools.product(BODIES, (0.0, 0.05))))
def test_cuts_in_a_floor_are_not_felt(name, friction):
    expected = path(name, physics.Plane(), friction, 2.0)
    rng = np.random.default_rng(1)
    field = physics.HeightField(np.zeros((41, 33)), (12.0, 12.0))
    for floor in (random_floor(rng), floor_with_seam(), field):
        np.testing.assert_allclose(path(name, floor, friction, 2.0), expected, rtol=0.0, atol=ALLOWED)


@pytest.mark.verify
@pytest.mark.parametrize(("name", "friction"), list(itertools.product(BODIES, (0.0, 0.05))))
def test_ten_triangulations_for_five_seconds(name, friction):
    expected = path(name, physics.Plane(), friction, 5.0)
    rng = np.random.default_rng(2)
    for _ in range(10):
        np.testing.assert_allclose(path(name, random_floor(rng), friction, 5.0), expected, rtol=0.0, atol=ALLOWED)


def tilted_path(name, floor, tilt, rate, seconds):
    """The same on a tilted floor, with more friction; round shapes roll about other axes too."""
    shape, orientation = BODIES[name]
    turned = tilt * Rotation.from_quat(orientation, scalar_first=True)
    spin = (0.0, 0.0, 2.0) if name in ("box", "hull", "standing cylinder") else (0.3, 0.2, 2.0)
    material = physics.Material(friction=0.3)
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity((0.0, 0.0, -9.81)))
    scene.add_body(floor, motion="static", orientation=tilt.as_quat(scalar_first=True), material=material)
    scene.add_body(
        shape, mass=1.0, position=tilt.apply([-3.0, -1.5, 0.1]), orientation=turned.as_quat(scalar_first=True),
        linear_velocity=tilt.apply([1.5, 0.8, 0.0]), angular_velocity=tilt.apply(spin), material=material,
    )  # fmt: skip
    world = physics.World(scene, options=physics.Options(time_step=1.0 / rate))
    places = []
    for _ in range(int(seconds * rate)):
        world.step()
        places.append(np.concatenate([world.position[0, -1], world.orientation[0, -1]]))
    return np.array(places)


@pytest.mark.parametrize("rate", [60, 240])
@pytest.mark.parametrize("name", BODIES)
def test_a_tilted_floor_with_spin_and_friction(name, rate):
    """No edge of it lies along an axis. How the points of a body share the load is a law, not round-off."""
    tilt = Rotation.from_rotvec([0.09, 0.12, 0.0])
    vertices, faces = oracle.random_floor(np.random.default_rng(1), size=14.0, points=150)
    expected = tilted_path(name, physics.Plane(), tilt, rate, 2.0)
    actual = tilted_path(name, physics.TriangleMesh(vertices, faces), tilt, rate, 2.0)
    np.testing.assert_allclose(actual, expected, rtol=0.0, atol=ALLOWED)


@pytest.mark.parametrize(("noise", "allowed"), [(1e-9, 1e-6), (1e-12, ALLOWED)])
@pytest.mark.parametrize("rate", [60, 240])
@pytest.mark.parametrize("name", ["box", "hull", "standing cylinder"])
def test_a_floor_flat_to_nine_digits_is_flat(name, rate, noise, allowed):
    """Normals that differ by as little leave all points their share, and do not make three of them bear all.

    What remains is that the floor leans, and lies lower or higher than the plane: by more than a body calls touching
    (1e-10 m), so that the first step begins with an impact.
    """
    tilt = Rotation.from_rotvec([0.09, 0.12, 0.0])
    rng = np.random.default_rng(5)
    vertices, faces = oracle.random_floor(rng, size=14.0, points=150)
    rough = physics.TriangleMesh(vertices + noise * rng.normal(size=vertices.shape), faces)
    expected = tilted_path(name, physics.Plane(), tilt, rate, 2.0)
    np.testing.assert_allclose(tilted_path(name, rough, tilt, rate, 2.0), expected, rtol=0.0, atol=allowed)


@pytest.mark.parametrize("rate", [60, 240])
@pytest.mark.parametrize("surface", ["facets", "smooth"])
@pytest.mark.parametrize("name", BODIES)
def test_samples_flat_to_nine_digits_are_flat(name, surface, rate):
    """Box and hull were off by 1e-3 to 0.1 m after 5 s; a cylinder on smooth ground by centimetres without any."""
    tilt = Rotation.from_rotvec([0.09, 0.12, 0.0])
    noise = 1e-9 * np.random.default_rng(1).normal(size=(65, 65))
    rough = physics.HeightField(noise, (40.0, 40.0), surface=surface)
    expected = tilted_path(name, physics.Plane(), tilt, rate, 3.0)
    np.testing.assert_allclose(tilted_path(name, rough, tilt, rate, 3.0), expected, rtol=0.0, atol=ALLOWED)


@pytest.mark.verify
@pytest.mark.parametrize("rate", [30, 60, 240])
@pytest.mark.parametrize("name", BODIES)
def test_ten_tilted_triangulations_for_five_seconds(name, rate):
    """From 0 to 20 degrees; large enough for what rolls down."""
    rng = np.random.default_rng(3)
    for angle in np.radians(np.linspace(0.0, 20.0, 10)):
        axis = rng.normal(size=3) * (1.0, 1.0, 0.3)
        tilt = Rotation.from_rotvec(angle * axis / np.linalg.norm(axis))
        vertices, faces = oracle.random_floor(rng, size=160.0, points=3000)
        expected = tilted_path(name, physics.Plane(), tilt, rate, 5.0)
        actual = tilted_path(name, physics.TriangleMesh(vertices, faces), tilt, rate, 5.0)
        np.testing.assert_allclose(actual, expected, rtol=0.0, atol=ALLOWED)


@pytest.mark.parametrize("rate", [60, 240])
@pytest.mark.parametrize("name", BODIES)
def test_seams_between_bodies_are_not_felt(name, rate):
    """Tiles with walls below their rims, and meshes with T-junctions along the seam."""
    for spin, friction in ((0.0, 0.05), (2.0, 0.0), (2.0, 0.5), (5.0, 0.2)):
        expected = path(name, physics.Plane(), friction, 2.0, rate, spin)
        for floor in (tiles(), two_floors(np.random.default_rng(5))):
            actual = path(name, floor, friction, 2.0, rate, spin)
            np.testing.assert_allclose(actual, expected, rtol=0.0, atol=ALLOWED)
