"""What shapes answer, what they refuse, and that nothing can change them."""

import dataclasses
import math

import numpy as np
import pytest
import trimesh
from PIL import Image

from avalanche_gym.physics import model
from avalanche_gym.physics.shapes import (
    Box,
    Capsule,
    Compound,
    ConvexHull,
    Cylinder,
    HeightField,
    Plane,
    RadialTerrain,
    Sphere,
    TriangleMesh,
    terrain,
)
from avalanche_gym.physics.shapes.icosphere import icosphere
from avalanche_gym.physics.shapes.planet import bumpy_planet, cratered_planet

IDENTITY = (1.0, 0.0, 0.0, 0.0)
CUBE = trimesh.creation.box((2.0, 2.0, 2.0))


@pytest.mark.parametrize(
    ("shape", "code", "size", "radius", "thin"),
    [
        (Sphere(2), model.SPHERE, (2, 0, 0), 2, 2),
        (Capsule(1, 2), model.CAPSULE, (1, 2, 0), 3, 1),
        (Box((1, 2, 2)), model.BOX, (1, 2, 2), 3, 1),
        (Cylinder(3, 4), model.CYLINDER, (3, 4, 0), 5, 3),
        (ConvexHull(CUBE.vertices), model.HULL, (0, 0, 0), math.sqrt(3), 1),
        (TriangleMesh(CUBE.vertices, CUBE.faces), model.MESH, (0, 0, 0), math.sqrt(3), 1),
        (Plane(), model.PLANE, (0, 0, 0), math.inf, math.inf),
        (HeightField([[0, 0], [0, 1]], (4, 4)), model.HEIGHT_FIELD, (4, 4, 0), 3, 2),
    ],
)
def test_answers(shape, code, size, radius, thin):
    assert shape.code == code
    assert shape.size == size
    assert shape.bounding_radius == pytest.approx(radius)
    assert shape.smallest_half_extent == pytest.approx(thin)
    ((part, position, orientation),) = shape.parts()
    assert part is shape
    assert position.tolist() == [0, 0, 0]
    assert orientation.tolist() == [1, 0, 0, 0]


def test_arrays_are_copied_and_read_only():
    heights = np.zeros((3, 3))
    field = HeightField(heights, (1.0, 1.0))
    heights[:] = 7.0
    assert field.heights.max() == 0.0
    mesh = TriangleMesh(CUBE.vertices, CUBE.faces)
    for array in (field.heights, mesh.vertices, mesh.faces, ConvexHull(CUBE.vertices).vertices):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1
    with pytest.raises(dataclasses.FrozenInstanceError):
        Sphere(1.0).radius = 2.0


def test_compound_flattens():
    half = math.sqrt(0.5)
    quarter_turn = (half, 0.0, 0.0, half)  # about z: x to y
    inner = Compound([(Sphere(0.5), (1, 0, 0), IDENTITY), (Box((1, 1, 1)), (0, 0, 1), quarter_turn)])
    outer = Compound([(inner, (0, 0, 5), quarter_turn), (Capsule(0.1, 1.0), (0, 0, 0), IDENTITY)])
    sphere, box, capsule = outer.parts()
    np.testing.assert_allclose(sphere[1], (0, 1, 5), atol=1e-15)
    np.testing.assert_allclose(box[1], (0, 0, 6), atol=1e-15)
    np.testing.assert_allclose(box[2], (0, 0, 0, 1), atol=1e-15)
    assert isinstance(capsule[0], Capsule)
    assert outer.smallest_half_extent == 0.1
    assert outer.bounding_radius == pytest.approx(6.0 + math.sqrt(3.0))


def test_nearly_unit_quaternion_is_normalised():
    shape = Compound([(Sphere(1.0), (0, 0, 0), (1.0 + 5e-7, 0, 0, 0))])
    assert shape.parts()[0][2].tolist() == [1.0, 0.0, 0.0, 0.0]


@pytest.mark.parametrize(
    ("make", "error", "texts"),
    [
        (lambda: Sphere(-1.0), ValueError, ["Sphere(radius)=-1.0", "positive"]),
        (lambda: Sphere(float("nan")), ValueError, ["Sphere(radius)=nan", "finite"]),
        (lambda: Sphere("big"), TypeError, ["Sphere(radius)='big'", "number"]),
        (lambda: Capsule(1.0, 0.0), ValueError, ["Capsule(half_length)=0.0", "positive"]),
        (lambda: Cylinder([1.0], 1.0), TypeError, ["Cylinder(radius)=[1.0]", "one real number"]),
        (lambda: Box(1.0), ValueError, ["Box(half_extents)", "shape ()", "(hx, hy, hz)"]),
        (lambda: Box((1.0, 1.0, 0.0)), ValueError, ["Box(half_extents)=[1.0, 1.0, 0.0]", "positive"]),
        (lambda: ConvexHull(np.eye(3)), ValueError, ["3 points", "at least 4"]),
        (lambda: ConvexHull([(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0)]), ValueError, ["one plane"]),
        (lambda: TriangleMesh(np.eye(3), [[0, 1, 3]]), ValueError, ["(faces)[0]=[0, 1, 3]", "0 ... 2"]),
        (lambda: TriangleMesh(np.eye(3), [[0.5, 1, 2]]), TypeError, ["integers"]),
        (lambda: TriangleMesh(np.eye(3), [0, 1, 2]), ValueError, ["shape (3,)", "(m, 3)"]),
        (lambda: TriangleMesh.from_file("nowhere.stl"), ValueError, ["nowhere.stl", "not a file"]),
        (lambda: TriangleMesh.from_file(__file__), ValueError, ["test_shapes.py", "STL"]),
        (lambda: HeightField([[0.0, float("inf")]] * 2, (1, 1)), ValueError, ["index (0, 1)", "finite"]),
        (lambda: HeightField([[0.0]], (1, 1)), ValueError, ["(1, 1)", "2 x 2"]),
        (lambda: HeightField(np.zeros((2, 2)), (1, -1)), ValueError, ["HeightField(size)=[1.0, -1.0]", "positive"]),
        (lambda: HeightField(np.zeros((2, 2)), (1, 1), "rough"), ValueError, ["'rough'", "'facets', 'smooth'"]),
        (lambda: Compound([]), ValueError, ["empty"]),
        (lambda: Compound([Sphere(1.0)]), TypeError, ["members)[0]", "(shape, position, orientation)"]),
        (lambda: Compound([(Plane(), (0, 0, 0), IDENTITY)]), ValueError, ["Plane", "body of its own"]),
        (lambda: Compound([(Sphere(1.0), (0, 0, 0), (0, 0, 0, 2))]), ValueError, ["norm 2", "unit quaternion"]),
        (lambda: Plane().mass_properties(), ValueError, ["Plane", "static"]),
        (lambda: HeightField(np.zeros((2, 2)), (1, 1)).mass_properties(), ValueError, ["HeightField", "static"]),
        (lambda: TriangleMesh(np.eye(3), [[0, 1, 2]]).mass_properties(), ValueError, ["open", "ConvexHull"]),
        (lambda: TriangleMesh(CUBE.vertices, CUBE.faces[:, ::-1]).mass_properties(), ValueError, ["-8", "Reverse"]),
    ],
)
def test_errors_name_what_was_given_and_the_remedy(make, error, texts):
    with pytest.raises(error) as raised:
        make()
    for text in texts:
        assert text in str(raised.value)


def test_closedness_agrees_with_trimesh():
    soup = TriangleMesh(CUBE.triangles.reshape(-1, 3), np.arange(36).reshape(-1, 3))  # corners repeated in each face
    assert soup.is_closed
    assert TriangleMesh(CUBE.vertices, CUBE.faces).is_closed == CUBE.is_watertight
    holed = trimesh.Trimesh(CUBE.vertices, CUBE.faces[1:], process=False)
    assert TriangleMesh(holed.vertices, holed.faces).is_closed == holed.is_watertight
    turned = CUBE.faces.copy()
    turned[0] = turned[0][::-1]
    assert not TriangleMesh(CUBE.vertices, turned).is_closed


def test_mesh_from_file(tmp_path):
    trimesh.creation.icosphere(subdivisions=2, radius=250.0).export(tmp_path / "ball.stl")
    ball = TriangleMesh.from_file(tmp_path / "ball.stl", scale=0.001)
    assert ball.is_closed
    assert ball.bounding_radius == pytest.approx(0.25)


@pytest.mark.parametrize("subdivisions", [0, 1, 3])
def test_icosphere_is_closed_and_faces_outward(subdivisions):
    vertices, faces = icosphere(subdivisions)
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    assert len(faces) == 20 * 4**subdivisions
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.volume > 0.0
    np.testing.assert_allclose(np.linalg.norm(vertices, axis=1), 1.0, atol=1e-15)


def test_planet_is_as_bumpy_as_asked_and_repeatable():
    make = [bumpy_planet(30.0, np.random.default_rng(5), subdivisions=3, amplitude=0.1) for _ in range(2)]
    radii = np.linalg.norm(make[0].vertices, axis=1)
    assert np.abs(radii - 30.0).max() == pytest.approx(3.0)
    assert make[0].is_closed
    np.testing.assert_array_equal(make[0].vertices, make[1].vertices)


def test_terrain_generators_keep_their_bounds_and_seeds():
    def build(seed):
        generator = np.random.default_rng(seed)
        args = (40, 60, (12.0, 8.0), generator)
        return [
            terrain.octaves(*args, amplitude=0.5, period=4.0, count=3),
            terrain.octaves(*args, amplitude=0.5, period=4.0, count=3, gradients=False),
            terrain.ridges(*args, amplitude=0.5, period=4.0),
            terrain.craters(*args, count=5, radius=(0.5, 2.0)),
            terrain.valley(*args, depth=1.0, width=1.0, meander=0.5),
        ]

    first, again, other = build(1), build(1), build(2)
    for heights, same, different in zip(first, again, other, strict=True):
        assert heights.shape == (40, 60)
        np.testing.assert_array_equal(heights, same)
        assert not np.array_equal(heights, different)
    for noise in first[:3]:
        assert np.abs(noise).max() <= 0.5 * (1.0 + 0.5 + 0.25)
    assert first[3].min() < -0.1
    assert first[4].min() == pytest.approx(-1.0, abs=0.02)
    assert first[4].max() <= 0.0


def test_radial_terrain_from_radii_and_from_a_function():
    directions = RadialTerrain.directions(2)
    radii = 2.0 + 0.1 * directions[:, 2]
    planet = RadialTerrain(radii)
    assert planet.subdivisions == 2 and planet.is_closed and len(planet.faces) == 320
    np.testing.assert_allclose(np.linalg.norm(planet.vertices, axis=1), radii)
    same = RadialTerrain(lambda d: 2.0 + 0.1 * d[:, 2], subdivisions=2)
    np.testing.assert_array_equal(same.vertices, planet.vertices)
    for wrong, text in ((np.ones(13), "12, 42"), (-radii, "not positive"), (np.full(12, np.nan), "finite")):
        with pytest.raises(ValueError, match=text):
            RadialTerrain(wrong)
    craters = [cratered_planet(10.0, np.random.default_rng(1), subdivisions=3) for _ in range(2)]
    np.testing.assert_array_equal(craters[0].radii, craters[1].radii)
    assert craters[0].is_closed and craters[0].radii.min() < 9.9 and craters[0].radii.max() > 10.0


def test_height_field_from_a_picture(tmp_path):
    pixels = np.array([[0, 255], [51, 102], [255, 0]], np.uint8)
    field = HeightField.from_image(pixels, (1.0, 2.0), lowest=-1.0, highest=4.0)
    np.testing.assert_allclose(field.heights, [[4.0, -1.0], [0.0, 1.0], [-1.0, 4.0]])
    with pytest.raises(ValueError, match="from 0 to 1"):
        HeightField.from_image(pixels.astype(float), (1.0, 2.0))
    with pytest.raises(ValueError, match="not a file"):
        HeightField.from_image(tmp_path / "absent.png", (1.0, 2.0))
    Image.fromarray(pixels).save(tmp_path / "grey.png")
    deep = pixels.astype(np.uint16) * 257
    Image.fromarray(deep).save(tmp_path / "deep.png")
    for name in ("grey.png", "deep.png"):
        read = HeightField.from_image(tmp_path / name, (1.0, 2.0), lowest=-1.0, highest=4.0)
        np.testing.assert_allclose(read.heights, field.heights, atol=1e-12)
