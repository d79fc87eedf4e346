"""Manifolds of spheres, capsules and planes with known answers."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from avalanche_gym.physics.model import BOX, CAPSULE, PLANE, SPHERE
from tests.oracles.narrow_oracle import Placed, collide

LYING = Rotation.from_euler("y", 90, degrees=True).as_matrix()  # capsule along x
TILTED_PLANE = Rotation.from_euler("x", 0.3).as_matrix()


def test_spheres_apart():
    (contact,) = collide(Placed(SPHERE, (0.5,)), Placed(SPHERE, (0.25,), np.array([1.0, 0, 0])), 0.3)
    assert contact["gap"] == 0.25
    np.testing.assert_array_equal(contact["normal"], [1, 0, 0])
    np.testing.assert_array_equal(contact["position"], [0.625, 0, 0])


def test_beyond_the_margin_nothing():
    assert len(collide(Placed(SPHERE, (0.5,)), Placed(SPHERE, (0.25,), np.array([1.0, 0, 0])), 0.2)) == 0


@pytest.mark.parametrize(
    ("a", "b"),
    [
        (Placed(SPHERE, (0.5,)), Placed(SPHERE, (0.25,))),
        (Placed(SPHERE, (0.5,)), Placed(CAPSULE, (0.25, 1.0))),
        (Placed(SPHERE, (0.5,)), Placed(BOX, (0.25, 1.0, 0.5))),
        (Placed(CAPSULE, (0.5, 1.0)), Placed(CAPSULE, (0.25, 1.0))),
        (Placed(CAPSULE, (0.5, 1.0)), Placed(CAPSULE, (0.25, 1.0), rotation=LYING)),
        (Placed(CAPSULE, (0.5, 1.0)), Placed(BOX, (0.25, 1.0, 0.5))),
        (Placed(BOX, (0.25, 1.0, 0.5)), Placed(BOX, (0.25, 1.0, 0.5))),
    ],
)
def test_same_centre_gives_a_finite_normal(a, b):
    contacts = collide(a, b, 0.0)
    assert len(contacts) >= 1
    np.testing.assert_allclose(np.linalg.norm(contacts["normal"], axis=1), 1.0, rtol=1e-14)
    assert np.isfinite(contacts["position"]).all() and (contacts["gap"] < 0.0).all()


def test_sphere_inside_a_box_leaves_through_the_nearest_face():
    (contact,) = collide(Placed(SPHERE, (0.1,), np.array([0.3, 0.0, -0.2])), Placed(BOX, (0.5, 1.0, 0.5)), 0.0)
    np.testing.assert_array_equal(contact["normal"], [-1, 0, 0])
    assert contact["gap"] == pytest.approx(-0.3, abs=1e-15)
    np.testing.assert_allclose(contact["position"], [0.35, 0, -0.2], atol=1e-15)


def test_crossing_capsules_part_across_both_axes():
    (contact,) = collide(Placed(CAPSULE, (0.1, 1.0)), Placed(CAPSULE, (0.2, 1.0), rotation=LYING), 0.0)
    np.testing.assert_allclose(np.abs(contact["normal"]), [0, 1, 0], atol=1e-15)
    assert contact["gap"] == pytest.approx(-0.3, abs=1e-15)


def test_parallel_capsules_touch_at_both_ends_of_the_common_stretch():
    a = Placed(CAPSULE, (0.1, 1.0), rotation=LYING)
    b = Placed(CAPSULE, (0.2, 1.0), np.array([0.5, 0, 0.31]), LYING)
    contacts = collide(a, b, 0.1)
    assert sorted(contacts["feature"]) == [0, 1]
    np.testing.assert_allclose(contacts["gap"], 0.01, atol=1e-15)
    np.testing.assert_allclose(sorted(contacts["position"][:, 0]), [-0.5, 1.0], atol=1e-15)
    np.testing.assert_allclose(contacts["normal"], [[0, 0, 1]] * 2, atol=1e-15)


def test_nearly_parallel_capsules_that_cross_keep_the_closest_point():
    turned = Rotation.from_euler("z", 0.02).as_matrix() @ LYING
    contacts = collide(
        Placed(CAPSULE, (0.1, 1.0), rotation=LYING), Placed(CAPSULE, (0.1, 1.0), np.array([0, 0, 0.21]), turned), 0.1
    )
    assert len(contacts) == 3
    assert contacts["gap"].min() == pytest.approx(0.01, abs=1e-15)


def test_round_off_does_not_change_the_contacts_of_parallel_capsules():
    rng = np.random.default_rng(1)
    for _ in range(200):
        disturbed = Rotation.from_rotvec(1e-10 * rng.normal(size=3)).as_matrix() @ LYING
        offset = np.array([0, 0, 0.2]) + 1e-10 * rng.normal(size=3)
        a = Placed(CAPSULE, (0.1, 1.0), rotation=LYING)
        assert list(collide(a, Placed(CAPSULE, (0.1, 1.0), offset, disturbed), 0.01)["feature"]) == [0, 1]
        floor = Placed(BOX, (2.0, 0.5, 0.1), np.array([0, 0, -0.2]))
        assert list(collide(a._replace(rotation=disturbed), floor, 0.01)["feature"]) == [0, 1]


def test_capsule_overhanging_a_box_touches_at_its_end_and_at_the_rim():
    contacts = collide(
        Placed(CAPSULE, (0.1, 1.0), np.array([0.9, 0.0, 0.59]), LYING), Placed(BOX, (0.5, 0.5, 0.5)), 0.05
    )
    assert len(contacts) == 2
    np.testing.assert_allclose(contacts["gap"], -0.01, atol=1e-15)
    np.testing.assert_allclose(contacts["normal"], [[0, 0, -1]] * 2, atol=1e-15)
    np.testing.assert_allclose(sorted(contacts["position"][:, 0]), [-0.1, 0.5], atol=1e-15)


def test_capsule_along_an_edge_of_a_box_gets_two_contacts():
    along_y = Rotation.from_euler("x", 90, degrees=True).as_matrix()
    offset = np.array([0.5 + 0.1, 0.0, 0.5 + 0.1])
    contacts = collide(Placed(CAPSULE, (0.1, 0.3), offset, along_y), Placed(BOX, (0.5, 0.5, 0.5)), 0.1)
    assert len(contacts) == 2
    np.testing.assert_allclose(contacts["gap"], 0.1 * (math.sqrt(2) - 1), atol=1e-15)
    np.testing.assert_allclose(contacts["normal"], [[-math.sqrt(0.5), 0, -math.sqrt(0.5)]] * 2, atol=1e-14)


def test_capsule_through_a_box_leaves_along_its_thin_side():
    standing = Placed(CAPSULE, (0.1, 2.0), np.array([0.02, 0.0, 0.0]))
    contacts = collide(standing, Placed(BOX, (0.2, 1.0, 1.0)), 0.0)
    assert len(contacts) == 2
    np.testing.assert_allclose(contacts["normal"], [[-1, 0, 0]] * 2, atol=1e-15)
    np.testing.assert_allclose(contacts["gap"], -0.28, atol=1e-15)
    np.testing.assert_allclose(sorted(contacts["position"][:, 2]), [-1.0, 1.0], atol=1e-15)


def test_plane():
    plane = Placed(PLANE, (), np.array([0.0, 0.0, 1.0]), TILTED_PLANE)
    up = TILTED_PLANE[:, 2]
    (contact,) = collide(Placed(SPHERE, (0.5,), plane.position + 0.6 * up), plane, 0.2)
    assert contact["gap"] == pytest.approx(0.1, abs=1e-15)
    np.testing.assert_allclose(contact["normal"], -up, atol=1e-15)
    np.testing.assert_allclose(contact["position"], plane.position + 0.05 * up, atol=1e-15)

    capsule = Placed(CAPSULE, (0.2, 0.5), plane.position + 0.25 * up, LYING)
    contacts = collide(capsule, plane, 0.1)
    assert list(contacts["feature"]) == [0, 1]
    np.testing.assert_allclose(contacts["gap"], 0.05, atol=1e-15)


def test_box_on_a_plane():
    flat = collide(Placed(BOX, (1, 2, 3), np.array([0, 0, 2.99])), Placed(PLANE, ()), 0.1)
    assert sorted(flat["feature"]) == [0, 1, 2, 3]
    np.testing.assert_allclose(flat["gap"], -0.01, atol=1e-15)

    eighth = Rotation.from_euler("x", 45, degrees=True).as_matrix()
    on_edge = collide(Placed(BOX, (1, 1, 1), np.array([0, 0, math.sqrt(2)]), eighth), Placed(PLANE, ()), 0.1)
    np.testing.assert_allclose(on_edge["gap"], [0, 0], atol=1e-15)

    corner = Rotation.align_vectors([[0, 0, -1]], [[1, 1, 1]])[0].as_matrix()
    on_corner = collide(Placed(BOX, (1, 1, 1), np.array([0, 0, math.sqrt(3)]), corner), Placed(PLANE, ()), 0.1)
    assert len(on_corner) == 1
    np.testing.assert_allclose(on_corner["position"][0], 0.0, atol=1e-14)
