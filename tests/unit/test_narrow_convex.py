"""Manifolds of cylinders and convex hulls with known answers, and their steadiness under round-off."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from avalanche_gym.physics.model import BOX, CYLINDER, HULL, PLANE, SPHERE
from tests.oracles.narrow_oracle import Placed, collide, hull_of

LYING = Rotation.from_euler("y", 90, degrees=True).as_matrix()  # axis along x
CUBE = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
FLOOR = Placed(BOX, (2.0, 2.0, 0.5), np.array([0.0, 0.0, -0.5]))
PLANE_AT_ZERO = Placed(PLANE, ())
CAN = Placed(CYLINDER, (0.3, 0.5))
BLOCK = Placed(HULL, (0.0, 0.0, 0.0), hull=hull_of(CUBE))


def on_floor(placed, floor):
    """Contacts with the floor, the shape of the smaller code first."""
    return collide(placed, floor, 0.02) if placed.shape <= floor.shape else collide(floor, placed, 0.02)


def test_sphere_and_cylinder():
    beside, above = np.array([0.9, 0.0, 0.2]), np.array([0.1, 0.0, 0.9])
    (side,) = collide(Placed(SPHERE, (0.5,), beside), CAN, 0.2)
    np.testing.assert_allclose([side["gap"], *side["normal"]], [0.1, -1, 0, 0], atol=1e-15)
    (cap,) = collide(Placed(SPHERE, (0.3,), above), CAN, 0.2)
    np.testing.assert_allclose([cap["gap"], *cap["normal"]], [0.1, 0, 0, -1], atol=1e-15)
    (rim,) = collide(Placed(SPHERE, (0.1,), np.array([0.6, 0.0, 0.9])), CAN, 0.5)
    np.testing.assert_allclose([rim["gap"], *rim["normal"]], [0.4, -0.6, 0, -0.8], atol=1e-14)
    (inside,) = collide(Placed(SPHERE, (0.1,), np.array([0.25, 0.0, 0.0])), CAN, 0.0)
    np.testing.assert_allclose([inside["gap"], *inside["normal"]], [-0.15, -1, 0, 0], atol=1e-15)


@pytest.mark.parametrize(("floor", "points"), [(FLOOR, 4), (PLANE_AT_ZERO, 8)])
@pytest.mark.parametrize("gap", [0.001, 0.0, -0.001])
def test_standing_cylinder_has_a_regular_polygon_on_its_rim(floor, points, gap):
    contacts = on_floor(CAN.moved([0.0, 0.0, 0.5 + gap]), floor)
    assert len(contacts) == points
    np.testing.assert_allclose(contacts["gap"], gap, atol=1e-15)
    np.testing.assert_allclose(np.linalg.norm(contacts["position"][:, :2], axis=1), 0.3, atol=1e-15)
    np.testing.assert_allclose(contacts["position"][:, :2].sum(axis=0), 0.0, atol=1e-15)


@pytest.mark.parametrize("floor", [FLOOR, PLANE_AT_ZERO])
def test_lying_cylinder_has_a_contact_at_each_end(floor):
    contacts = on_floor(CAN._replace(rotation=LYING).moved([0.0, 0.0, 0.3]), floor)
    assert len(contacts) == 2
    np.testing.assert_allclose(contacts["gap"], 0.0, atol=1e-15)
    np.testing.assert_allclose(sorted(contacts["position"][:, 0]), [-0.5, 0.5], atol=1e-15)


@pytest.mark.parametrize("floor", [FLOOR, PLANE_AT_ZERO])
@pytest.mark.parametrize("tilt", [0.1, 0.7, 1.2])
def test_tilted_cylinder_touches_at_its_lowest_point(floor, tilt):
    turn = Rotation.from_euler("y", tilt).as_matrix()
    height = 0.5 * math.cos(tilt) + 0.3 * math.sin(tilt)
    contacts = on_floor(CAN._replace(rotation=turn).moved([0.0, 0.0, height + 0.001]), floor)
    lowest = contacts[contacts["gap"].argmin()]
    assert lowest["gap"] == pytest.approx(0.001, abs=1e-14)
    np.testing.assert_allclose(np.abs(lowest["normal"]), [0, 0, 1], atol=1e-14)


def test_cylinder_overhanging_a_box_keeps_the_chord():
    """Its tipping edge is where the rim crosses the side of the box."""
    contacts = on_floor(CAN.moved([1.9, 0.0, 0.5]), FLOOR)
    chord = math.sqrt(0.3**2 - 0.1**2)
    edge = contacts[np.abs(contacts["position"][:, 0] - 2.0) < 1e-12]
    np.testing.assert_allclose(sorted(edge["position"][:, 1]), [-chord, chord], atol=1e-14)


def test_box_on_a_wide_cap_keeps_its_corners():
    drum = Placed(CYLINDER, (2.0, 0.5), np.array([0.0, 0.0, -0.5]))
    contacts = collide(Placed(BOX, (0.5, 0.4, 0.1), np.array([0.0, 0.0, 0.1])), drum, 0.02)
    corners = sorted(map(tuple, np.round(contacts["position"][:, :2], 12)))
    assert corners == [(-0.5, -0.4), (-0.5, 0.4), (0.5, -0.4), (0.5, 0.4)]


def test_parallel_cylinders_touch_at_both_ends():
    a = CAN._replace(rotation=LYING)
    contacts = collide(a, a.moved([0.4, 0.0, 0.601]), 0.02)
    assert len(contacts) == 2
    np.testing.assert_allclose(contacts["gap"], 0.001, atol=1e-14)
    np.testing.assert_allclose(sorted(contacts["position"][:, 0]), [-0.1, 0.5], atol=1e-14)


def test_stacked_cylinders():
    contacts = collide(CAN, CAN.moved([0.1, 0.0, 1.0]), 0.02)
    assert len(contacts) == 4
    np.testing.assert_allclose(contacts["gap"], 0.0, atol=1e-15)
    for center in (0.0, 0.1):
        assert (np.hypot(contacts["position"][:, 0] - center, contacts["position"][:, 1]) <= 0.3 + 1e-8).all()


def test_hull_of_a_cube_rests_as_a_box_does():
    assert len(BLOCK.hull.faces) == 6
    for floor in (FLOOR, PLANE_AT_ZERO):
        contacts = on_floor(BLOCK.moved([0.0, 0.0, 0.499]), floor)
        corners = sorted(map(tuple, np.round(contacts["position"][:, :2], 12)))
        assert corners == [(-0.5, -0.5), (-0.5, 0.5), (0.5, -0.5), (0.5, 0.5)]
        np.testing.assert_allclose(contacts["gap"], -0.001, atol=1e-14)


def test_hull_face_with_many_corners_keeps_its_span():
    angles = 2 * np.pi * np.arange(100) / 100
    prism = hull_of([[math.cos(angle), math.sin(angle), z] for angle in angles for z in (-0.5, 0.5)])
    assert prism.faces["num_corners"].max() == 32
    contacts = on_floor(Placed(HULL, (0.0, 0.0, 0.0), np.array([0.0, 0.0, 0.5]), hull=prism), FLOOR)
    assert len(contacts) == 4
    np.testing.assert_allclose(np.linalg.norm(contacts["position"][:, :2], axis=1), 1.0, atol=1e-12)


@pytest.mark.parametrize(
    ("placed", "floor", "number"),
    [
        (CAN.moved([0.0, 0.0, 0.5]), FLOOR, 4),
        (CAN.moved([0.0, 0.0, 0.5]), PLANE_AT_ZERO, 8),
        (CAN._replace(rotation=LYING).moved([0.0, 0.0, 0.3]), FLOOR, 2),
        (CAN._replace(rotation=LYING).moved([0.0, 0.0, 0.3]), PLANE_AT_ZERO, 2),
        (BLOCK.moved([0.0, 0.0, 0.5]), FLOOR, 4),
        (BLOCK.moved([0.0, 0.0, 0.5]), PLANE_AT_ZERO, 4),
    ],
)
def test_round_off_changes_neither_features_nor_normal(placed, floor, number):
    rng = np.random.default_rng(3)
    seen = set()
    for _ in range(100):
        turn = Rotation.from_rotvec(1e-11 * rng.normal(size=3)).as_matrix() @ placed.rotation
        contacts = on_floor(placed._replace(rotation=turn).moved(1e-11 * rng.normal(size=3)), floor)
        np.testing.assert_allclose(np.abs(contacts["normal"]), [[0, 0, 1]] * number, atol=1e-9)
        seen.add(tuple(contacts["feature"]))
    assert len(seen) == 1
