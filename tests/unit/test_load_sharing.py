"""Contacts of one pair of bodies share what the contact law leaves open as equal springs would (solver/sharing.py)."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from avalanche_gym.physics.solver.sharing import _are_independent
from avalanche_gym.physics.solver.workspace import ROW
from tests.oracles.solver_oracle import GRAVITY, Island

STEP = 1.0 / 240.0  # [s]
TILT = Rotation.from_rotvec([0.2, 0.28, 0.1])
UP = TILT.apply([0.0, 0.0, 1.0])


def prism(corners, loads=None, spin=2.0, height=0.1, bias=None):
    """A body that slides and turns on a tilted plane with contacts at ``corners`` (n, 2) [m] below its centre."""
    island = Island()
    ground = island.ground()
    body = island.body(
        (0.0, 0.0, 0.0), 1.0, (0.005, 0.008, 0.01), orientation=TILT.as_quat(scalar_first=True),
        velocity=TILT.apply([1.5, 0.8, 0.0]), angular_velocity=spin * UP,
    )  # fmt: skip
    island.accelerate(GRAVITY, STEP)
    for number, (x, y) in enumerate(corners):
        impulse = np.zeros(3) if loads is None else loads[number] * UP
        island.contact(
            ground, body, TILT.apply([x, y, -height]), UP, 0.3,
            impulse=impulse, bias=0.0 if bias is None else bias[number],
        )  # fmt: skip
    return island


def pressed(corners, island):
    """Normal impulses of the solution, and those of springs: the affine function that is fitted to what bears."""
    solution = island.solve()
    assert solution.residual <= 1e-12
    loads = solution.impulses @ UP
    design = np.column_stack([np.ones(len(corners)), corners])
    bears = loads > 0.0
    springs = design @ np.linalg.lstsq(design[bears], loads[bears], rcond=None)[0]
    return loads, springs, solution


BOX = np.array([(-0.2, -0.15), (0.2, -0.15), (-0.2, 0.15), (0.2, 0.15)])


def test_the_load_does_not_depend_on_the_start():
    rng = np.random.default_rng(0)
    expected = prism(BOX).solve()
    for _ in range(10):
        loads, springs, solution = pressed(BOX, prism(BOX, rng.uniform(0.0, 0.03, 4)))
        np.testing.assert_allclose(loads, springs, rtol=0.0, atol=1e-14)
        np.testing.assert_allclose(solution.impulses, expected.impulses, rtol=0.0, atol=1e-13)
        np.testing.assert_allclose(solution.velocities, expected.velocities, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("height", [0.1, 0.2, 0.3, 0.36, 0.42, 0.45])
def test_what_springs_would_pull_bears_nothing(height):
    """Friction tips a high body onto its leading corners: r_n = max(0, affine function)."""
    turns = np.arange(8) * np.pi / 4.0
    corners = 0.2 * np.column_stack([np.cos(turns), np.sin(turns)])
    spared = 0
    for spin in (-3.0, 0.5, 4.0):
        loads, springs, _ = pressed(corners, prism(corners, spin=spin, height=height))
        np.testing.assert_allclose(loads, np.maximum(springs, 0.0), rtol=0.0, atol=1e-14)
        spared += np.count_nonzero(loads == 0.0)
    assert spared == 0 if height == 0.1 else spared > 0 or height < 0.36


def test_a_corner_that_is_apart_has_no_part_in_it():
    """Three corners bear, and the law alone says how; the fourth keeps its distance."""
    loads, _, solution = pressed(BOX, prism(BOX, bias=(0.0, 0.0, 0.0, 1e-3)))
    assert loads[3] == 0.0 or loads[0] == 0.0 or loads[1] == 0.0 or loads[2] == 0.0
    again = prism(BOX, np.full(4, 0.01), bias=(0.0, 0.0, 0.0, 1e-3)).solve()
    np.testing.assert_allclose(again.impulses, solution.impulses, rtol=0.0, atol=1e-13)


@pytest.mark.parametrize("count", [3, 4, 5, 6])
@pytest.mark.parametrize("tilt", [0.0, 1e-9, 1e-2, 1.0])
def test_contacts_on_uneven_ground_are_plainly_independent(count, tilt):
    """And such of them that touch a plane, or one that is flat but for the last digits, are not."""
    rng = np.random.default_rng(count)
    for _ in range(20):
        rows = np.zeros(count + 1, ROW)
        normals = np.array([0.0, 0.0, 1.0]) + tilt * rng.normal(size=(count + 1, 3))
        rows["normal"] = normals / np.linalg.norm(normals, axis=1, keepdims=True)
        rows["arm_b"] = rng.normal(size=(count + 1, 3)) * (1.0, 1.0, tilt)
        apart = rng.integers(count + 1)
        rows["shared"] = 1
        rows["shared"][apart] = 0
        marked = np.delete(rows, apart)
        reach = np.linalg.norm(marked["arm_b"] - marked["arm_b"].mean(axis=0), axis=1).max()
        turns = np.cross(marked["arm_b"] - marked["arm_b"].mean(axis=0), marked["normal"]) / reach
        smallest = np.linalg.svd(np.hstack([marked["normal"], turns]), compute_uv=False)[-1]
        independent = _are_independent(rows, 0, count + 1, count, True)
        assert not independent or smallest > 1e-6
        if smallest > 1e-2:
            assert independent
