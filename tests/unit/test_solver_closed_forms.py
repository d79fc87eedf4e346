"""The exact tier against answers known in closed form."""

import numpy as np
import pytest

from avalanche_gym.physics import model
from avalanche_gym.physics.solver.exact import CERTIFICATE, SINGLE
from tests.oracles.solver_oracle import GRAVITY, Island, problem_of, pyramid, stack

STEP = 1 / 60  # [s]
TOLERANCE = 1e-12


def box_on_incline(angle: float, friction: float) -> Island:
    """A box at rest on a plane tilted about y, after one step of gravity."""
    island = Island()
    ground = island.ground()
    q = (np.cos(angle / 2), 0.0, np.sin(angle / 2), 0.0)
    normal = np.array([np.sin(angle), 0.0, np.cos(angle)])
    along = np.array([np.cos(angle), 0.0, -np.sin(angle)])
    box = island.box((0, 0, 0), (0.2, 0.1, 0.1), orientation=q)
    for x in (-0.2, 0.2):
        for y in (-0.1, 0.1):
            island.contact(ground, box, x * along + (0, y, 0) - 0.1 * normal, normal, friction)
    island.accelerate(GRAVITY, STEP)
    return island


def sliding_box(direction: float, friction=0.5) -> Island:
    """A box that slides along x cos + y sin at 5 m/s, symmetric about that direction."""
    island = Island()
    ground = island.ground()
    velocity = 5 * np.array([np.cos(direction), np.sin(direction), 0.0])
    q = (np.cos(direction / 2), 0.0, 0.0, np.sin(direction / 2))
    box = island.box((0, 0, 0.1), (0.3, 0.2, 0.1), orientation=q, velocity=velocity)
    for x in (-0.3, 0.3):
        for y in (-0.2, 0.2):
            corner = (np.cos(direction) * x - np.sin(direction) * y, np.sin(direction) * x + np.cos(direction) * y, 0)
            island.contact(ground, box, corner, (0, 0, 1), friction)
    island.accelerate(GRAVITY, STEP)
    return island


@pytest.mark.parametrize("degrees", [10.0, 20.0, 40.0])
def test_box_on_incline_sticks_just_below_the_friction_angle(degrees):
    angle = np.radians(degrees)
    solution = box_on_incline(angle, np.tan(angle) * (1 + 1e-6)).solve()
    assert solution.residual <= TOLERANCE
    assert np.abs(solution.velocities[1]).max() < 1e-13


@pytest.mark.parametrize("degrees", [10.0, 20.0, 40.0])
def test_box_on_incline_slips_just_above_the_friction_angle(degrees):
    angle = np.radians(degrees)
    friction = np.tan(angle) * (1 - 1e-6)
    solution = box_on_incline(angle, friction).solve()
    speed = 9.81 * STEP * (np.sin(angle) - friction * np.cos(angle))
    along = np.array([np.cos(angle), 0.0, -np.sin(angle)])
    assert solution.residual <= TOLERANCE
    assert solution.velocities[1, :3] @ along == pytest.approx(speed, rel=1e-5)


def test_friction_is_the_same_in_all_directions():
    for direction in np.linspace(0, np.pi / 2, 10):
        solution = sliding_box(direction).solve()
        speed = 5 - 0.5 * 9.81 * STEP
        expected = speed * np.array([np.cos(direction), np.sin(direction), 0.0])
        assert np.abs(solution.velocities[1, :3] - expected).max() < 1e-12
        assert np.abs(solution.velocities[1, 3:]).max() < 1e-11


@pytest.mark.parametrize(("top", "accuracy"), [(1.0, 1e-10), (1e3, 1e-8), (1e6, 1e-6)])
def test_stack_bears_the_weights_above(top, accuracy):
    solution = stack(10, top=top).solve()
    weights = (np.arange(10)[::-1] + top) * 9.81 * STEP
    forces = solution.impulses[:, 2].reshape(10, 4).sum(axis=1)
    assert solution.residual <= TOLERANCE
    np.testing.assert_allclose(forces, weights, rtol=accuracy)
    assert np.abs(solution.velocities).max() < accuracy


def test_hyperstatic_table_bears_its_weight_symmetrically():
    island = Island()
    ground = island.ground()
    table = island.box((0, 0, 0.7), (0.6, 0.4, 0.02), mass=20.0)
    island.face(ground, table, (0, 0, 0), (0.55, 0.35))
    island.accelerate(GRAVITY, STEP)
    solution = island.solve()
    np.testing.assert_allclose(solution.impulses[:, 2], 20 * 9.81 * STEP / 4, rtol=1e-12)
    assert np.abs(solution.impulses[:, :2]).max() < 1e-12


def test_certificate_recognises_a_solution():
    island = pyramid(4)
    first = island.solve()
    for contact, impulse in zip(island.contacts, first.impulses, strict=True):
        contact["impulse"] = impulse
    again = island.solve()
    assert again.method == CERTIFICATE
    assert again.iterations == 0
    np.testing.assert_array_equal(again.impulses, first.impulses)


def test_separating_contacts_lose_their_warm_start():
    island = stack(3)
    for body in island.bodies[1:]:
        body["velocity"] = np.array([0, 0, 1.0])
    for contact in island.contacts:
        contact["impulse"] = np.array([0.1, 0, 1.0])
    solution = island.solve()
    # The lowest box leaves the ground and the boxes keep their distance: nothing is transmitted.
    assert solution.residual == 0.0
    np.testing.assert_array_equal(solution.impulses, 0.0)


def test_sphere_in_the_middle_of_a_single_contact():
    island = Island()
    ground = island.ground()
    sphere = island.body((0, 0, 0.1), 2.0, (0.008,) * 3, velocity=(1.0, 0, -0.5))
    island.contact(ground, sphere, (0, 0, 0), (0, 0, 1), friction=0.3)
    solution = island.solve()
    # It slips, so r_t = -mu r_n, and turns by the moment of r_t at the arm (0, 0, -0.1).
    assert solution.method == SINGLE
    np.testing.assert_allclose(solution.impulses, [[-0.3, 0, 1.0]], rtol=1e-12)
    np.testing.assert_allclose(solution.velocities[1], [1 - 0.15, 0, 0, 0, 0.03 / 0.008, 0], atol=1e-12)


def test_conveyor_and_kinematic_body_carry_along():
    for moving_surface in (True, False):
        island = Island()
        belt = island.body(motion=model.KINEMATIC, velocity=(0, 0, 0) if moving_surface else (0.01, 0, 0))
        box = island.box((0, 0, 0.1), (0.1, 0.1, 0.1))
        # ``surface_velocity`` is that of b's surface against a's: the belt's own would be the negative.
        island.face(
            belt, box, (0, 0, 0), (0.1, 0.1), 0.5, surface_velocity=(-0.01, 0, 0) if moving_surface else (0, 0, 0)
        )
        island.accelerate(GRAVITY, STEP)
        solution = island.solve()
        np.testing.assert_allclose(solution.velocities[box, :3], [0.01, 0, 0], atol=1e-14)


def test_bias_lets_a_gap_close_and_no_more():
    island = Island()
    ground = island.ground()
    box = island.box((0, 0, 0.11), (0.1, 0.1, 0.1), velocity=(0, 0, -3.0))
    island.face(ground, box, (0, 0, 0.01), (0.1, 0.1), bias=0.01 / STEP)
    solution = island.solve()
    assert solution.velocities[box, 2] == pytest.approx(-0.01 / STEP, rel=1e-12)


def test_body_that_cannot_turn():
    island = Island()
    ground = island.ground()
    box = island.body((0, 0, 0.1), 1.0, (0.0, 0.0, 0.0), velocity=(0, 0, -1.0))
    island.contact(ground, box, (0.3, 0.2, 0), (0, 0, 1))
    island.contact(ground, box, (0.1, 0.2, 0), (0, 0, 1))
    solution = island.solve()
    assert solution.residual <= TOLERANCE
    np.testing.assert_allclose(solution.velocities[box], 0.0, atol=1e-12)


def test_contacts_that_cannot_move_carry_nothing():
    island = Island()
    a, b = island.ground(), island.ground()
    box = island.box((0, 0, 0.1), (0.1, 0.1, 0.1))
    island.contact(a, b, (0, 0, 0), (0, 0, 1), impulse=(1.0, 2.0, 3.0))
    island.face(a, box, (0, 0, 0), (0.1, 0.1))
    island.accelerate(GRAVITY, STEP)
    solution = island.solve()
    np.testing.assert_array_equal(solution.impulses[0], 0.0)
    assert solution.impulses[1:, 2].sum() == pytest.approx(9.81 * STEP, rel=1e-12)


@pytest.mark.parametrize("top", [1.0, 1e3])
def test_projection_takes_a_stack_apart_in_one_call(top):
    solution = stack(5, top=top).project(-0.01)
    lift = 0.01 * np.arange(1, 6)
    np.testing.assert_allclose(solution.velocities[1:, 2], lift, atol=1e-10)
    assert np.abs(solution.velocities[1:, 3:]).max() < 1e-10


def test_projection_parts_deep_overlaps_at_a_bounded_speed_and_keeps_gaps():
    island = stack(2)
    gaps = np.repeat([-0.2, 0.03], 4)
    solution = island.project(gaps, most_overlap=0.01)
    np.testing.assert_allclose(solution.velocities[1:, 2], [0.01, 0.0], atol=1e-12)


def test_units_do_not_matter():
    """The same stack in metres and kilograms, and in a unit 1000 times smaller and one 1e6 times larger."""
    reference = stack(4, top=10.0)
    expected = reference.solve()
    for length, mass in ((1e3, 1e-6), (1e-6, 1e6)):
        scaled = stack(4, half=0.1 * length, mass=mass, top=10.0, duration=STEP * length)
        solution = scaled.solve()
        unit = mass * length
        np.testing.assert_allclose(solution.impulses, expected.impulses * unit, rtol=1e-9, atol=1e-14 * unit)
        assert solution.residual <= TOLERANCE


def test_velocities_belong_to_the_impulses():
    island = pyramid(3)
    island.bodies[2]["velocity"] = island.bodies[2]["velocity"] + (0.7, 0.1, 0)
    solution = island.solve()
    free = np.array([np.r_[b["velocity"], b["angular_velocity"]] for b in island.bodies])
    change = (problem_of(island).response @ solution.impulses.ravel()).reshape(-1, 6)
    np.testing.assert_allclose(solution.velocities, free + change, atol=1e-12)


def test_projection_under_a_million_times_the_mass():
    """Uneven gaps of the size of round-off in a stack of boxes: no light body may be thrown about."""
    rng = np.random.default_rng(0)
    island = stack(10, top=1e6)
    for contact, impulse in zip(island.contacts, island.solve().impulses, strict=True):
        contact["impulse"] = impulse
    for _ in range(10):
        gaps = 1e-9 * rng.normal(size=40)
        solution = island.project(gaps, tolerance=1e-9)
        assert solution.residual <= 1e-9
        left = [
            gap
            + moved_b[2]
            - moved_a[2]
            + np.cross(moved_b[3:], contact["position"] - island.bodies[contact["body_b"]]["center"])[2]
            - np.cross(moved_a[3:], contact["position"] - island.bodies[contact["body_a"]]["center"])[2]
            for gap, contact in zip(gaps, island.contacts, strict=True)
            for moved_a, moved_b in [(solution.velocities[contact["body_a"]], solution.velocities[contact["body_b"]])]
        ]
        assert min(left) > 1e-2 * gaps.min()
        assert np.abs(solution.velocities).max() < 100 * np.abs(gaps).max()
