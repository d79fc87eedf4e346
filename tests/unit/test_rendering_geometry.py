"""Meshes of shapes, normals, cameras."""

import numpy as np
import pytest

from avalanche_gym.physics import shapes
from avalanche_gym.physics.shapes.planet import bumpy_planet
from avalanche_gym.rendering import Camera, Geometry, as_planet, geometry_of, primitives
from avalanche_gym.rendering.geometry import rotation_matrix
from avalanche_gym.rendering.terrain_colors import terrain_colors

HALF = np.sqrt(0.5)


def volume(geometry):
    """Of a closed mesh that is seen from outside; negative if it is inside out."""
    a, b, c = (geometry.vertices[geometry.faces[:, k]] for k in range(3))
    return np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0


CLOSED = [
    (shapes.Sphere(0.7), 4.0 / 3.0 * np.pi * 0.7**3, 0.03),
    (shapes.Box((0.1, 0.2, 0.3)), 8 * 0.1 * 0.2 * 0.3, 1e-12),
    (shapes.Capsule(0.2, 0.5), np.pi * 0.04 * 1.0 + 4.0 / 3.0 * np.pi * 0.008, 0.04),
    (shapes.Cylinder(0.2, 0.5), np.pi * 0.04 * 1.0, 0.02),
    (shapes.ConvexHull([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]), 1.0 / 6.0, 1e-12),
    (
        shapes.Compound(
            [
                (shapes.Box((0.1, 0.1, 0.4)), (1, 0, 0), (HALF, HALF, 0, 0)),
                (shapes.Box((0.2, 0.1, 0.1)), (0, 0, 0), (1, 0, 0, 0)),
            ]
        ),
        8 * (0.1 * 0.1 * 0.4 + 0.2 * 0.1 * 0.1),
        1e-12,
    ),
]


@pytest.mark.parametrize(("shape", "expected", "tolerance"), CLOSED, ids=lambda value: type(value).__name__)
def test_solids_have_their_volume_and_face_outwards(shape, expected, tolerance):
    geometry = geometry_of(shape)
    assert volume(geometry) == pytest.approx(expected, rel=tolerance)
    np.testing.assert_allclose(np.linalg.norm(geometry.normals, axis=1), 1.0, rtol=1e-9)
    # The normal of a vertex lies on the side of each of its faces.
    a, b, c = (geometry.vertices[geometry.faces[:, k]] for k in range(3))
    face_normals = np.cross(b - a, c - a)
    for k in range(3):
        assert (np.einsum("ij,ij->i", face_normals, geometry.normals[geometry.faces[:, k]]) > 0.0).all()


def test_equal_shapes_share_their_mesh():
    assert geometry_of(shapes.Sphere(0.25)) is geometry_of(shapes.Sphere(0.25))


def test_the_bodies_lie_where_their_frames_say():
    part = geometry_of(shapes.Compound([(shapes.Box((0.1, 0.1, 0.4)), (1.0, 0.0, 0.0), (HALF, HALF, 0.0, 0.0))]))
    np.testing.assert_allclose(part.vertices.min(axis=0), [0.9, -0.4, -0.1], atol=1e-12)
    np.testing.assert_allclose(part.vertices.max(axis=0), [1.1, 0.4, 0.1], atol=1e-12)


def test_a_height_field_has_its_rows_along_y_and_its_diagonals_as_the_collider():
    heights = np.array([[0.0, 1.0, 2.0], [3.0, 4.0, 5.0]])
    geometry = geometry_of(shapes.HeightField(heights, (4.0, 6.0)))
    np.testing.assert_allclose(geometry.vertices[:3], [(-2, -3, 0), (0, -3, 1), (2, -3, 2)])
    np.testing.assert_allclose(geometry.vertices[3:6], [(-2, 3, 3), (0, 3, 4), (2, 3, 5)])
    diagonals = {tuple(sorted((int(f[i]), int(f[i - 1])))) for f in geometry.faces[:4] for i in range(3)}
    assert (0, 4) in diagonals
    assert (1, 3) not in diagonals
    a, b, c = (geometry.vertices[geometry.faces[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    assert (normals[:4, 2] > 0.0).all()
    middles = (a + b + c)[4:] / 3.0
    assert (np.einsum("ij,ij->i", normals[4:, :2], middles[:, :2]) > 0.0).all()


def test_normals_of_a_slope_are_those_of_the_plane():
    x = np.linspace(-1.0, 1.0, 5)
    geometry = primitives.height_field(0.5 * x[None, :] - 0.25 * x[:, None], (2.0, 2.0), skirt=0.0)
    expected = np.array([-0.5, 0.25, 1.0]) / np.linalg.norm([-0.5, 0.25, 1.0])
    np.testing.assert_allclose(geometry.normals, np.tile(expected, (25, 1)), atol=1e-12)


def test_a_crease_divides_and_a_gentle_bend_does_not():
    faces = [(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1)]
    faces += [(2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)]
    box = shapes.TriangleMesh([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)], faces)
    flat = geometry_of(box)
    assert len(flat.vertices) == 24
    assert np.isin(np.abs(flat.normals).round(9), (0.0, 1.0)).all()
    smooth = Geometry.smoothed(box.vertices, box.faces, crease=180.0)
    assert len(smooth.vertices) == 8
    # Weighted by angle, the three faces at a corner count alike, though some come in two triangles.
    np.testing.assert_allclose(np.abs(smooth.normals), np.sqrt(1.0 / 3.0), rtol=1e-6)


def test_a_planet_is_smooth():
    planet = bumpy_planet(2.0, np.random.default_rng(0), subdivisions=3)
    geometry = as_planet(geometry_of(planet))
    assert len(geometry.vertices) == len(planet.vertices)
    assert geometry.colors.shape == (len(geometry.vertices), 4)


def test_terrain_colours_stay_in_range_and_depend_on_slope():
    heights = np.linspace(-3.0, 40.0, 200)
    level, steep = (terrain_colors(heights, np.full(200, cosine)) for cosine in (1.0, 0.3))
    for colors in (level, steep):
        assert colors.min() >= 0.0
        assert colors.max() <= 1.0
    # Level ground changes with height from sand to snow; rock is the same everywhere.
    assert level[-10:, :3].mean() > level[90:110, :3].mean() + 0.2
    assert np.ptp(steep[:, 1]) < 0.1 * steep[:, 1].mean() + 0.05
    assert (terrain_colors(np.zeros(5), np.ones(5)) > 0.0).all()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (((np.zeros((3, 2)), [(0, 1, 2)], np.zeros((3, 2)))), "smoothed"),
        (((np.zeros((3, 3)), [(0, 1, 2, 0)], np.zeros((3, 3)))), "split polygons"),
        (((np.zeros((3, 3)), [(0, 1, 3)], np.zeros((3, 3)))), "count from zero"),
        (((np.zeros((3, 3)), [(0, 1, 2)], np.zeros((3, 3)), np.zeros((3, 3)))), "colors"),
    ],
)
def test_wrong_meshes_are_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        Geometry(*arguments)


def test_only_shapes_have_a_mesh():
    with pytest.raises(TypeError, match="shapes"):
        geometry_of("sphere")


# --- Cameras ----------------------------------------------------------------------------------------------------------


def pixel_of(camera, point, width=640, height=480):
    projection = camera.projection(width, height)[0]
    x, y, w, _ = projection["rows"] @ point + projection["offsets"]
    return x / w, y / w


def test_the_target_is_in_the_middle_and_up_is_up():
    for camera in (
        Camera.fixed((3.0, 2.0, 1.0), (0.0, 1.0, 0.0)),
        Camera.orbit((0.0, 1.0, 0.0), 4.0, 120.0, 30.0),
        Camera.orbit((0.0, 1.0, 0.0), 4.0, 10.0, 90.0),
        Camera.follow((0.0, 1.0, 0.0), (1.0, 1.0, 0.3), 3.0, 1.0),
    ):
        middle = pixel_of(camera, np.array(camera.target))
        np.testing.assert_allclose(middle, (319.5, 239.5), atol=1e-9)
        above = pixel_of(camera, np.array(camera.target) + 0.01 * np.array(camera.up))
        assert above[1] < 239.5
        assert above[0] == pytest.approx(319.5, abs=1e-6)


def test_the_field_of_view_spans_the_height():
    camera = Camera((0.0, -1.0, 0.0), (0.0, 0.0, 0.0), fov=90.0)
    assert pixel_of(camera, np.array([0.0, 0.0, 1.0]))[1] == pytest.approx(-0.5)
    assert pixel_of(camera, np.array([0.0, 0.0, -1.0]))[1] == pytest.approx(479.5)
    assert pixel_of(camera, np.array([1.0, 0.0, 0.0]))[0] == pytest.approx(319.5 + 240.0)


def test_follow_stands_behind_and_above():
    camera = Camera.follow((1.0, 2.0, 3.0), (0.0, 5.0, 2.0), 4.0, 1.5)
    np.testing.assert_allclose(camera.eye, (1.0, -2.0, 4.5))
    around = Camera.follow((0.0, 0.0, -5.0), (1.0, 0.0, 0.0), 4.0, 1.0, up=(0.0, 0.0, -1.0))
    np.testing.assert_allclose(around.eye, (-4.0, 0.0, -6.0))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Camera((0, 0, 0), (0, 0, 0)), "move one"),
        (lambda: Camera((0, 0), (0, 0, 1)), "three finite"),
        (lambda: Camera((0, 0, np.nan), (0, 0, 1)), "three finite"),
        (lambda: Camera((0, 0, 0), (0, 1, 0), fov=180.0), "degrees"),
        (lambda: Camera((0, 0, 0), (0, 0, 1)).record(4, 4), "parallel"),
        (lambda: Camera.follow((0, 0, 0), (0, 0, 1), 1.0, 1.0), "parallel"),
    ],
)
def test_cameras_that_cannot_look_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_rotation_matrix_turns_as_the_quaternion():
    np.testing.assert_allclose(rotation_matrix((HALF, 0.0, 0.0, HALF)) @ (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), atol=1e-12)
