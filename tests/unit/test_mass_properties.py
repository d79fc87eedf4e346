"""Mass properties against closed forms, against trimesh, and under change of frame."""

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from avalanche_gym.physics import mass_properties
from avalanche_gym.physics.shapes import Box, Capsule, Compound, ConvexHull, Cylinder, Sphere, TriangleMesh
from avalanche_gym.physics.shapes.planet import bumpy_planet


def as_mesh(mesh):
    return TriangleMesh(mesh.vertices, mesh.faces)


def assert_same(a, b, relative):
    scale = abs(b.volume) ** (1 / 3)
    assert a.volume == pytest.approx(b.volume, rel=relative)
    np.testing.assert_allclose(a.center, b.center, atol=relative * scale)
    np.testing.assert_allclose(a.inertia, b.inertia, atol=relative * np.trace(b.inertia))


def random_quaternion(generator):
    q = generator.normal(size=4)
    return q / np.linalg.norm(q)


def test_box_mesh_has_the_closed_form():
    box = as_mesh(trimesh.creation.box((2.0, 4.0, 6.0)))
    assert_same(box.mass_properties(), Box((1.0, 2.0, 3.0)).mass_properties(), 1e-14)


@pytest.mark.parametrize(
    ("shape", "mesh"),
    [
        (Sphere(0.7), trimesh.creation.icosphere(subdivisions=5, radius=0.7)),
        (Cylinder(0.5, 1.0), trimesh.creation.cylinder(radius=0.5, height=2.0, sections=800)),
        (Capsule(0.5, 1.0), trimesh.creation.capsule(height=2.0, radius=0.5, count=[300, 300])),
    ],
)
def test_fine_meshes_approach_the_closed_forms(shape, mesh):
    center = mesh.bounds.mean(axis=0)
    # The error of a polyhedron falls with the square of its edges: here edges of a few hundredths of the size.
    assert_same(TriangleMesh(mesh.vertices - center, mesh.faces).mass_properties(), shape.mass_properties(), 2e-3)


@given(st.integers(0, 2**32 - 1), st.sampled_from([1e-3, 1.0, 1e4]))
@settings(max_examples=20, deadline=None)
def test_concave_mesh_agrees_with_trimesh_far_from_the_origin(seed, size):
    generator = np.random.default_rng(seed)
    planet = bumpy_planet(1.0, generator, subdivisions=2, amplitude=0.4)
    vertices = size * (planet.vertices + generator.uniform(-3.0, 3.0, 3))
    reference = trimesh.Trimesh(vertices, planet.faces, process=False)
    expected = mass_properties.MassProperties(reference.volume, reference.center_mass, reference.moment_inertia)
    assert_same(TriangleMesh(vertices, planet.faces).mass_properties(), expected, 1e-10)


def test_l_shape_from_boxes_equals_its_mesh():
    a, b = Box((1.0, 0.5, 0.5)), Box((0.5, 0.5, 1.0))
    compound = Compound([(a, (0, 0, 0), (1, 0, 0, 0)), (b, (0.5, 0, 1.5), (1, 0, 0, 0))])
    meshes = [trimesh.creation.box((2, 1, 1)), trimesh.creation.box((1, 1, 2))]
    meshes[1].apply_translation((0.5, 0, 1.5))
    joined = mass_properties.combined(as_mesh(mesh).mass_properties() for mesh in meshes)
    assert_same(compound.mass_properties(), joined, 1e-14)


def test_a_turned_part_turns_its_inertia():
    rng = np.random.default_rng(3)
    q, place = random_quaternion(rng), rng.normal(size=3)
    own = Box((0.2, 0.3, 0.9)).mass_properties()
    whole = Compound([(Box((0.2, 0.3, 0.9)), place, q)]).mass_properties()
    rotation = mass_properties.rotation_matrix(q)
    np.testing.assert_allclose(whole.center, place, atol=1e-15)
    np.testing.assert_allclose(whole.inertia, rotation @ own.inertia @ rotation.T, atol=1e-15)


def test_overlap_counts_twice():
    twice = Compound([(Sphere(1.0), (0, 0, 0), (1, 0, 0, 0))] * 2)
    assert twice.mass_properties().volume == 2.0 * Sphere(1.0).mass_properties().volume


def test_hull_of_box_corners_is_the_box():
    corners = np.array(np.meshgrid([-1.0, 1.0], [-2.0, 2.0], [-3.0, 3.0])).reshape(3, -1).T
    hull = ConvexHull(np.concatenate([corners, np.zeros((5, 3))]))
    assert len(hull.vertices) == 8
    assert_same(hull.mass_properties(), Box((1.0, 2.0, 3.0)).mass_properties(), 1e-14)


@pytest.mark.parametrize("moments", [(1.0, 2.0, 2.5), (3.0, 2.0, 1.5), (1.0, 1.0, 1.0), (2.0, 1.0, 2.0)])
def test_diagonal_inertia_keeps_its_axes(moments):
    found, q = mass_properties.principal_frame(np.diag(moments))
    assert q.tolist() == [1.0, 0.0, 0.0, 0.0]
    assert found.tolist() == list(moments)


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=100, deadline=None)
def test_principal_frame_diagonalises(seed):
    generator = np.random.default_rng(seed)
    moments = generator.uniform(1.0, 2.0, 3)
    rotation = mass_properties.rotation_matrix(random_quaternion(generator))
    inertia = rotation @ np.diag(moments) @ rotation.T
    found, q = mass_properties.principal_frame(inertia)
    to_principal = mass_properties.rotation_matrix(q)  # coordinates of the user's frame -> principal frame
    np.testing.assert_allclose(to_principal @ inertia @ to_principal.T, np.diag(found), atol=1e-13)
    assert q[0] >= 0.0
    assert np.linalg.norm(q) == pytest.approx(1.0, abs=1e-15)


def test_small_turn_gives_a_small_quaternion():
    turn = mass_properties.rotation_matrix([np.cos(0.05), np.sin(0.05), 0.0, 0.0])
    _, q = mass_properties.principal_frame(turn @ np.diag([3.0, 1.0, 2.5]) @ turn.T)
    np.testing.assert_allclose(q, [np.cos(0.05), -np.sin(0.05), 0.0, 0.0], atol=1e-14)


@pytest.mark.parametrize("mass", [0.0, -1.0, float("nan"), float("inf"), "heavy", None])
def test_bad_mass_is_refused(mass):
    with pytest.raises(ValueError, match="Body 'ball': mass=.*finite number above zero"):
        mass_properties.check_mass("Body 'ball': mass", mass)


@pytest.mark.parametrize(
    ("inertia", "text"),
    [
        ((1.0, 1.0, 3.0), "sum of the other"),
        ((1.0, 1.0, 0.0), "must be positive"),
        ((1.0, 1.0), "shape"),
        (np.array([[2.0, 0.1, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 2.0]]), "symmetric"),
        ((1.0, float("nan"), 1.0), "finite"),
        ("round", "numeric"),
    ],
)
def test_bad_inertia_is_refused(inertia, text):
    with pytest.raises(ValueError, match=f"(?s)Body 'ball': inertia.*{text}"):
        mass_properties.check_inertia("Body 'ball': inertia", inertia)


def test_flat_disc_is_allowed():
    assert mass_properties.check_inertia("inertia", (1.0, 1.0, 2.0)).tolist() == np.diag([1.0, 1.0, 2.0]).tolist()
