"""The kernels against the slow twins of oracles/terrain_oracle.py, on random terrain."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from avalanche_gym.physics.model import BOX, CAPSULE, SPHERE
from avalanche_gym.physics.shapes.mesh_preparation import prepare_mesh
from tests.oracles import terrain_oracle as oracle

EXTENT = (2.0, 1.6)
SHAPES = [(SPHERE, (0.3, 0.0, 0.0)), (CAPSULE, (0.15, 0.3, 0.0)), (BOX, (0.35, 0.25, 0.15))]


@st.composite
def scenes(draw):
    """A shape over a rough 5 x 6 terrain: heights, shape, size, position, rotation."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    heights = draw(st.sampled_from([0.02, 0.1, 0.3])) * rng.normal(size=(5, 6))
    if draw(st.booleans()):
        heights = np.round(heights, 1)  # flat parts and ties
    shape, size = draw(st.sampled_from(SHAPES))
    rotation = oracle.rotation_matrix(rng.normal(size=3) if draw(st.booleans()) else (0.0, 0.0, rng.normal()))
    place = rng.uniform(-0.5, 0.5, 2) * EXTENT
    return heights, shape, size, np.array([*place, 0.0]), rotation


def lowered(heights, shape, size, position, rotation, gap):
    """The shape let down until it is about ``gap`` from the terrain: a step by the distance never cuts it."""
    vertices, faces = oracle.grid_mesh(heights, EXTENT)
    height = heights.max() + 1.0
    for _ in range(12):
        drop = oracle.distance(shape, position + np.array([0.0, 0.0, height]), rotation, size, vertices[faces]) - gap
        height -= max(drop, 0.0)
        if drop < 1e-3 or height < -2.0:
            break
    return position + np.array([0.0, 0.0, height])


@settings(max_examples=40, deadline=None)
@given(scene=scenes(), gap=st.sampled_from([0.001, 0.02, 0.1]))
def test_smallest_gap_is_the_distance(scene, gap):
    heights, shape, size, position, rotation = scene
    position = lowered(*scene, gap)
    vertices, faces = oracle.grid_mesh(heights, EXTENT)
    expected = oracle.distance(shape, position, rotation, size, vertices[faces])
    for contacts in (
        oracle.field_contacts(shape, position, rotation, size, oracle.height_field(heights, EXTENT), 0.12),
        oracle.mesh_contacts(shape, position, rotation, size, prepare_mesh(vertices, faces), 0.12),
    ):
        assert len(contacts) <= 12
        if expected <= 0.12:
            assert contacts["gap"].min() == pytest.approx(expected, abs=1e-9)
            assert len(set(contacts["feature"])) == len(contacts)


@settings(max_examples=40, deadline=None)
@given(scene=scenes(), depth=st.sampled_from([0.0, 1e-9, 1e-3, 0.03]))
def test_height_field_and_its_mesh_agree(scene, depth):
    """Also where the shape has sunk in, apart from the rim, where the field has walls."""
    heights, shape, size, position, rotation = scene
    position = lowered(heights, shape, size, position * (0.2, 0.2, 1.0), rotation, 0.0) - (0.0, 0.0, depth)
    field = oracle.field_contacts(shape, position, rotation, size, oracle.height_field(heights, EXTENT), 0.02)
    mesh = oracle.mesh_contacts(shape, position, rotation, size, prepare_mesh(*oracle.grid_mesh(heights, EXTENT)), 0.02)
    if len(field):
        assert field["gap"].min() == pytest.approx(mesh["gap"].min(), abs=1e-9)
    if len(field) < 12 and len(mesh) < 12:
        assert len(field) == len(mesh)
        np.testing.assert_allclose(np.sort(field["gap"]), np.sort(mesh["gap"]), atol=1e-9)


@settings(max_examples=60, deadline=None)
@given(scene=scenes(), height=st.floats(-0.5, 0.5))
def test_contacts_are_sound(scene, height):
    """Unit normals that look down, small gaps, and positions whose other end of the gap belongs to the shape."""
    heights, shape, size, position, rotation = scene
    position = position * (0.8, 0.8, 1.0) + (0.0, 0.0, height)
    half, radius = oracle.core(shape, size)
    frame = np.reshape(rotation, (3, 3))
    for contact in oracle.field_contacts(shape, position, rotation, size, oracle.height_field(heights, EXTENT), 0.02):
        normal = contact["normal"]
        assert np.linalg.norm(normal) == pytest.approx(1.0, abs=1e-12)
        assert normal[2] < 1e-9 and contact["gap"] <= 0.02
        on_shape = contact["position"] - 0.5 * contact["gap"] * normal
        local = (on_shape - position) @ frame
        # A ball at the end of a capsule that has sunk in ends inside the capsule; the others on its surface.
        assert np.linalg.norm(local - np.clip(local, -half, half)) <= radius + 1e-9


@settings(max_examples=40, deadline=None)
@given(scene=scenes(), gap=st.sampled_from([-1e-3, 0.0, 0.02]))
def test_hull_of_a_box_is_a_box(scene, gap):
    heights, _, _, position, rotation = scene
    half = np.array([0.35, 0.25, 0.15])
    solid = oracle.hull(half * list(itertools.product((-1.0, 1.0), repeat=3)))
    position = lowered(heights, BOX, half, position, rotation, max(gap, 0.0))
    position = position - (0.0, 0.0, max(-gap, 0.0))
    mesh = prepare_mesh(*oracle.grid_mesh(heights, EXTENT))
    field = oracle.height_field(heights, EXTENT)
    for expected, contacts in (
        (
            oracle.field_contacts(BOX, position, rotation, half, field, 0.05),
            oracle.hull_contacts(position, rotation, solid, field, 0.05),
        ),
        (
            oracle.mesh_contacts(BOX, position, rotation, half, mesh, 0.05),
            oracle.hull_contacts(position, rotation, solid, mesh, 0.05),
        ),
    ):
        assert len(set(contacts["feature"])) == len(contacts)
        if len(expected):
            assert contacts["gap"].min() == pytest.approx(expected["gap"].min(), abs=1e-9)
        else:
            assert len(contacts) == 0


@settings(max_examples=25, deadline=None)
@given(scene=scenes(), lies=st.sampled_from(["standing", "lying", "anyhow"]))
def test_smallest_gap_of_a_cylinder(scene, lies):
    """Where it lies nearly along an edge or nearly flat on it, the gap is that of the ends of the contact."""
    heights, _, _, position, rotation = scene
    if lies != "anyhow":
        turn = np.reshape(oracle.rotation_matrix((0.0, 0.0, position[0])), (3, 3))
        lean = 0.0 if lies == "standing" else np.pi / 2
        side = np.reshape(oracle.rotation_matrix((lean, 0.0, 0.0)), (3, 3))
        rotation = oracle.floats((turn @ side).ravel())
    vertices, faces = oracle.grid_mesh(heights, EXTENT)
    position = position - (0.0, 0.0, -heights.max() - 1.0)
    for _ in range(15):
        apart = oracle.cylinder_distance(position, rotation, 0.2, 0.3, vertices[faces])
        if apart < 0.011:
            break
        position = position - (0.0, 0.0, apart - 0.01)
    if apart >= 0.011:
        return  # beside a slope that is too steep
    for terrain in (oracle.height_field(heights, EXTENT), prepare_mesh(vertices, faces)):
        contacts = oracle.cylinder_contacts(position, rotation, (0.2, 0.3, 0.0), terrain, 0.03)
        assert contacts["gap"].min() == pytest.approx(apart, abs=5e-5)
        assert len(set(contacts["feature"])) == len(contacts)
