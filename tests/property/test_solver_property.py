"""Random islands: what the solver reports is true, and it reaches the tolerance where a solution must exist."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.oracles.solver_oracle import problem_of, random_island


@settings(max_examples=60)
@given(st.integers(0, 10**6), st.integers(1, 6), st.integers(1, 20), st.sampled_from([1.0, 1e3]))
def test_the_reported_residual_is_the_residual(seed, bodies, contacts, ratio):
    island = random_island(np.random.default_rng(seed), bodies, contacts, ratio)
    solution = island.solve()
    assert np.isfinite(solution.velocities).all()
    assert solution.residual <= 1.0
    assert problem_of(island).residual(solution.impulses) == pytest.approx(solution.residual, rel=1e-3, abs=1e-13)


@settings(max_examples=12)
@given(st.integers(0, 10**6), st.integers(1, 4), st.integers(1, 10))
def test_without_friction_the_velocities_are_those_of_the_twin(seed, bodies, contacts):
    island = random_island(np.random.default_rng(seed), bodies, contacts, friction=0.0)
    solution = island.solve()
    assert solution.residual <= 1e-12
    problem = problem_of(island)
    impulses = problem.solve(sweeps=2000)
    assert problem.residual(impulses) < 1e-6
    # A convex problem: impulses may differ, velocities may not.
    difference = problem.response @ (solution.impulses - impulses).ravel()
    assert np.abs(difference).max() < 1e-4


@settings(max_examples=60)
@given(st.integers(0, 10**6), st.integers(1, 8))
def test_one_body_reaches_the_tolerance(seed, contacts):
    island = random_island(np.random.default_rng(seed), 1, contacts)
    assert island.solve().residual <= 1e-10
