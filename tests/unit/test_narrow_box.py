"""Manifolds of two boxes with known answers, and their steadiness under round-off."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from avalanche_gym.physics.model import BOX
from tests.oracles.narrow_oracle import Placed, collide

FLAT = np.eye(3)
CUBE = Placed(BOX, (0.5, 0.5, 0.5))


def above(gap, size=(0.5, 0.5, 0.5), turn=FLAT, x=0.0, y=0.0):
    """A box whose lowest point hovers over the cube's top."""
    lowest = np.abs(turn) @ np.array(size)
    return Placed(BOX, size, np.array([x, y, 0.5 + gap + lowest[2]]), turn)


def about_z(angle):
    return Rotation.from_euler("z", angle).as_matrix()


def corners(contacts):
    return sorted(map(tuple, np.round(contacts["position"][:, :2], 12) + 0.0))


@pytest.mark.parametrize("gap", [0.01, 0.0, -0.01])
def test_flat_on_flat(gap):
    contacts = collide(CUBE, above(gap), 0.02)
    assert corners(contacts) == [(-0.5, -0.5), (-0.5, 0.5), (0.5, -0.5), (0.5, 0.5)]
    np.testing.assert_allclose(contacts["gap"], gap, atol=1e-15)
    np.testing.assert_array_equal(contacts["normal"], [[0, 0, 1]] * 4)
    np.testing.assert_allclose(contacts["position"][:, 2], 0.5 + gap / 2, atol=1e-15)


def test_small_on_large_and_large_on_small():
    small = (0.2, 0.3, 0.1)
    assert corners(collide(CUBE, above(0.001, small), 0.02)) == [(-0.2, -0.3), (-0.2, 0.3), (0.2, -0.3), (0.2, 0.3)]
    large = (2.0, 2.0, 0.1)
    assert corners(collide(CUBE, above(0.001, large), 0.02)) == [(-0.5, -0.5), (-0.5, 0.5), (0.5, -0.5), (0.5, 0.5)]


def test_overhang():
    contacts = collide(CUBE, above(1e-4, x=0.3, y=-0.2), 0.02)
    assert corners(contacts) == [(-0.2, -0.5), (-0.2, 0.3), (0.5, -0.5), (0.5, 0.3)]


def test_octagon_reduces_to_a_square():
    contacts = collide(CUBE, above(0.0, turn=about_z(math.pi / 4)), 0.02)
    assert len(contacts) == 4
    radii = np.linalg.norm(contacts["position"][:, :2], axis=1)
    np.testing.assert_allclose(radii, radii[0], atol=1e-14)
    np.testing.assert_allclose(contacts["position"][:, :2].sum(axis=0), 0.0, atol=1e-14)


def test_tilted_box_lands_on_all_corners_within_the_margin():
    tilt = Rotation.from_rotvec([0.004, 0.002, 0.0]).as_matrix()
    contacts = collide(CUBE, above(0.001, turn=tilt), 0.02)
    assert len(contacts) == 4
    assert contacts["gap"].min() == pytest.approx(0.001, abs=1e-15)
    assert contacts["gap"].max() == pytest.approx(0.001 + 0.004 + 0.002, abs=1e-4)
    # A closer margin drops the higher ones.
    assert len(collide(CUBE, above(0.001, turn=tilt), 0.004)) == 2


def test_crossed_edges():
    """Two ridges, one along x and one along y (HARD_CASES 22)."""
    lower = Placed(BOX, (1.0, 0.1, 0.1), rotation=Rotation.from_euler("x", 45, degrees=True).as_matrix())
    turn = Rotation.from_euler("y", 45, degrees=True).as_matrix()
    height = 2 * 0.1 * math.sqrt(2)
    for gap in (0.01, -0.01):
        (contact,) = collide(lower, Placed(BOX, (0.1, 1.0, 0.1), np.array([0.05, 0.03, height + gap]), turn), 0.02)
        assert contact["gap"] == pytest.approx(gap, abs=1e-15)
        np.testing.assert_allclose(contact["normal"], [0, 0, 1], atol=1e-15)
        np.testing.assert_allclose(contact["position"], [0.05, 0.0, (height + gap) / 2], atol=1e-15)


def test_corner_to_corner():
    offset = np.array([1.01, 1.02, 1.02])
    (contact,) = collide(CUBE, CUBE.moved(offset), 0.1)
    assert contact["gap"] == pytest.approx(0.03, abs=1e-15)
    np.testing.assert_allclose(contact["normal"], [1 / 3, 2 / 3, 2 / 3], atol=1e-13)
    np.testing.assert_allclose(contact["position"], offset / 2, atol=1e-15)


def test_corner_to_edge():
    turn = Rotation.align_vectors([[-1.0, 0.0, -1.0]], [[1, 1, 1]])[0].as_matrix()
    reach = 0.5 * math.sqrt(3) + 0.02
    center = np.array([0.5, 0.1, 0.5]) + reach * np.array([1, 0, 1]) / math.sqrt(2)
    (contact,) = collide(CUBE, Placed(BOX, CUBE.size, center, turn), 0.05)
    assert contact["gap"] == pytest.approx(0.02, abs=1e-15)
    np.testing.assert_allclose(contact["normal"], np.array([1, 0, 1]) / math.sqrt(2), atol=1e-12)


def test_edges_side_by_side_get_two_contacts():
    contacts = collide(CUBE, CUBE.moved([1.01, 0.3, 1.01]), 0.05)
    assert len(contacts) == 2
    np.testing.assert_allclose(contacts["gap"], 0.01 * math.sqrt(2), atol=1e-15)
    np.testing.assert_allclose(sorted(contacts["position"][:, 1]), [-0.2, 0.5], atol=1e-15)


def test_crossed_beams_deep_in_each_other_part_along_their_thin_sides():
    a = Placed(BOX, (2.0, 0.1, 0.1))
    b = Placed(BOX, (0.1, 2.0, 0.1), np.array([0.0, 0.0, 0.02]))
    contacts = collide(a, b, 0.0)
    assert len(contacts) == 4
    np.testing.assert_allclose(contacts["gap"], -0.18, atol=1e-15)
    np.testing.assert_array_equal(contacts["normal"], [[0, 0, 1]] * 4)


@pytest.mark.parametrize("turn", [0.0, 0.3, math.pi / 4])
@pytest.mark.parametrize("offset", [(0.0, 0.0), (0.5, 0.0), (0.3, 0.2)])
def test_round_off_changes_neither_features_nor_normal(turn, offset):
    """A box at rest moves by less than 1e-10 of its size from step to step; nothing may depend on that."""
    rng = np.random.default_rng(2)
    expected = None
    for _ in range(200):
        disturbed = Rotation.from_rotvec(1e-11 * rng.normal(size=3)).as_matrix() @ about_z(turn)
        moved = above(0.0, turn=about_z(turn), x=offset[0], y=offset[1])
        moved = moved._replace(rotation=disturbed).moved(1e-11 * rng.normal(size=3))
        contacts = collide(CUBE, moved, 0.01)
        features = list(contacts["feature"])
        expected = expected or features
        assert features == expected and len(features) == 4
        np.testing.assert_allclose(contacts["normal"], [[0, 0, 1]] * 4, atol=1e-9)


def test_turning_a_little_renames_nothing():
    features = [
        tuple(collide(CUBE, above(-1e-6, turn=about_z(angle)), 0.01)["feature"]) for angle in np.linspace(0.1, 0.4, 50)
    ]
    assert len(set(features)) == 1


def test_far_from_the_origin():
    """Contacts move along; what changes is of the size of the spacing of floats there."""
    a, b = CUBE, above(0.001, turn=about_z(0.3))
    near = collide(a, b, 0.02)
    far = collide(a.moved([1e6, -1e6, 0.0]), b.moved([1e6, -1e6, 0.0]), 0.02)
    assert list(far["feature"]) == list(near["feature"])
    np.testing.assert_allclose(far["gap"], near["gap"], atol=1e-9)
    np.testing.assert_allclose(far["position"] - [1e6, -1e6, 0.0], near["position"], atol=1e-9)
