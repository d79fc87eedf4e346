"""Parts of the solver against NumPy: factorisation, elimination order, single contact, cones."""

import numpy as np
import pytest

from avalanche_gym.physics.solver import lorentz
from avalanche_gym.physics.solver.cone import project
from avalanche_gym.physics.solver.elimination import eliminate, order_at, rows_at, start_at
from avalanche_gym.physics.solver.exact import NEEDS_MEMORY, solve_island
from avalanche_gym.physics.solver.factorisation import factorise, solve
from avalanche_gym.physics.solver.local_contact import EXACTLY, solve_contact
from avalanche_gym.physics.solver.residual import contact_error
from avalanche_gym.physics.solver.workspace import NODE, ROW, Workspace
from tests.oracles.solver_oracle import Problem, pyramid


def random_graph(rng, count, edges):
    rows = np.zeros(edges, ROW)
    rows["a"] = rng.integers(0, count + 1, edges)  # ``count`` is the ground
    rows["b"] = rng.integers(0, count, edges)
    return rows


@pytest.mark.parametrize("symmetric", [1, 0])
@pytest.mark.parametrize(("count", "edges"), [(1, 2), (5, 8), (70, 120)])
def test_factorisation_solves_what_numpy_solves(symmetric, count, edges):
    rng = np.random.default_rng(count)
    rows = random_graph(rng, count, edges)
    index = np.zeros(20 * count + 4000, np.int64)
    slots, _ = eliminate(rows, edges, count, count, index)
    order = index[order_at(count) :][:count]
    start = index[start_at(count, count) :][: count + 1]
    pattern = index[rows_at(count, count) :][:slots]
    assert sorted(order) == list(range(count))
    blocks = np.zeros((count + 2 * slots, 36))
    dense = np.zeros((6 * count, 6 * count))

    def put(slot, i, j, block):
        blocks[slot] = block.ravel()
        dense[6 * i : 6 * i + 6, 6 * j : 6 * j + 6] = block

    for j in range(count):
        for s in range(start[j], start[j + 1]):
            i = pattern[s]
            lower = rng.normal(size=(6, 6))
            put(count + s, i, j, lower)
            put(count + slots + s, j, i, lower.T if symmetric else rng.normal(size=(6, 6)))
    for j in range(count):
        root = rng.normal(size=(6, 6))
        put(j, j, j, root @ root.T + 6 * np.abs(dense[6 * j : 6 * j + 6]).sum() * np.eye(6))
    if symmetric:
        blocks[count + slots :] = np.nan  # the upper triangle is not read
    nodes = np.zeros(count + 1, NODE)
    right = rng.normal(size=(count, 6))
    nodes["scaled"][order] = right
    factorise(blocks, index, count, count, slots, np.int64(symmetric))
    solve(blocks, index, nodes, count, count, slots)
    expected = np.linalg.solve(dense, right.ravel()).reshape(count, 6)
    np.testing.assert_allclose(nodes["scaled"][order], expected, rtol=1e-10, atol=1e-14)


def test_elimination_of_a_chain_has_no_fill():
    count = 100
    rows = np.zeros(count, ROW)
    rows["a"] = np.arange(count)
    rows["b"] = np.arange(1, count + 1)
    index = np.zeros(20 * count, np.int64)
    slots, products = eliminate(rows, count, count, count, index)
    assert slots == count - 1
    assert products == count - 1


def test_memory_is_asked_for_and_nothing_is_lost():
    island = pyramid(5)
    contacts, order, bodies, states, island_bodies = island.records()
    before = states.copy()
    workspace = Workspace(len(contacts), len(bodies))
    workspace.blocks = np.zeros((1, 36))
    workspace.index = np.zeros(len(bodies) + 2, np.int64)
    methods = []
    for _ in range(10):
        _, _, method = solve_island(
            contacts, order, len(contacts), bodies, states, island_bodies, len(island_bodies),
            1e-12, 60, *workspace.arrays,
        )  # fmt: skip
        methods.append(method)
        if method != NEEDS_MEMORY:
            break
        np.testing.assert_array_equal(states, before)
        workspace.grow()
    assert methods[0] == NEEDS_MEMORY
    np.testing.assert_array_equal(contacts["impulse"], pyramid(5).solve().impulses)


def test_single_contact_is_solved_exactly():
    rng = np.random.default_rng(0)
    normal = np.array([1.0, 0, 0])
    for _ in range(500):
        root = rng.normal(size=(3, 3))
        w = root @ root.T + 1e-2 * np.eye(3)
        q = rng.normal(size=3) * (2, 1, 1) - (1, 0, 0)
        friction = rng.choice([0.0, 0.2, 0.5, 1.0])
        r = solve_contact(w[0, 0], w[0, 1], w[0, 2], w[1, 1], w[1, 2], w[2, 2], *q, friction, EXACTLY)
        problem = Problem(w, q, normal[None], np.array([friction]), np.zeros((0, 3)))
        assert problem.residual(np.array([r])) < 1e-11


def test_projection_on_a_half_line():
    """Without friction, and exactly along the normal: nothing pulls."""
    assert project((0.0, 0.0, -0.5), (0.0, 0.0, 1.0), 0.0) == (0.0, 0.0, 0.0)
    assert project((0.0, 0.0, 0.5), (0.0, 0.0, 1.0), 0.0) == (0.0, 0.0, 0.5)


def test_projection_on_the_cone():
    rng = np.random.default_rng(0)
    for _ in range(200):
        normal = rng.normal(size=3)
        normal /= np.linalg.norm(normal)
        z = rng.normal() * normal if rng.random() < 0.2 else rng.normal(size=3)
        friction = rng.choice([0.0, 0.3, 2.0])
        twin = Problem(np.eye(3), np.zeros(3), normal[None], np.array([friction]), np.zeros((0, 3)))
        np.testing.assert_allclose(project(tuple(z), tuple(normal), friction), twin.project(z[None])[0], atol=1e-14)


def test_error_of_a_contact_is_the_way_to_its_projection():
    rng = np.random.default_rng(0)
    rows = np.zeros(1, ROW)
    cases = set()
    for _ in range(400):
        normal = rng.normal(size=3)
        normal /= np.linalg.norm(normal)
        friction = rng.choice([0.0, 0.3, 2.0])
        inverse = rng.uniform(0.5, 2.0)
        impulse, velocity = rng.normal(size=(2, 3))
        rows["normal"], rows["friction"], rows["inverse"] = normal, friction, inverse
        slip = np.linalg.norm(velocity - velocity @ normal * normal)
        corrected = inverse * (velocity + friction * slip * normal)
        kept = np.array(project(tuple(impulse - corrected), tuple(normal), friction))
        cases.add((bool(np.any(kept)), bool(np.all(kept == impulse - corrected))))
        error = contact_error(rows[0], tuple(impulse), tuple(velocity))
        np.testing.assert_allclose(error, (np.sum((impulse - kept) ** 2), np.sum(corrected**2)), rtol=1e-12)
    assert cases == {(False, False), (True, True), (True, False)}


def test_scaling_point_maps_one_vector_to_the_other():
    rng = np.random.default_rng(0)
    n = (0.0, 0.6, 0.8)
    for _ in range(100):
        x, z = (tuple(v + (1.1 * np.linalg.norm(v) - v @ n) * np.array(n)) for v in rng.normal(size=(2, 3)))
        w, stretch = lorentz.scaling_point(x, z, n)
        w_n = np.array(w)
        matrix = stretch * (2 * np.outer(w_n, w_n) - 2 * np.outer(n, n) + np.eye(3))
        np.testing.assert_allclose(matrix @ z, x, rtol=1e-9)
        once = lorentz.scale_by(w, n, z)
        np.testing.assert_allclose(stretch * np.array(lorentz.scale_by(w, n, once)), x, rtol=1e-9)
        np.testing.assert_allclose(lorentz.product(x, lorentz.divide(z, x, n), n), z, rtol=1e-9, atol=1e-12)


def test_step_to_the_surface_of_the_cone():
    rng = np.random.default_rng(1)
    n = (1.0, 0.0, 0.0)
    for _ in range(300):
        x = np.array([1.0, *rng.uniform(-0.6, 0.6, 2)])
        d = 3 * rng.normal(size=3)
        step = lorentz.step_to_surface(tuple(x), tuple(d), n)
        assert lorentz.determinant(tuple(x + 0.999 * step * d), n) > 0
        if step < 1:
            assert abs(lorentz.determinant(tuple(x + step * d), n)) < 1e-12 * (1 + d @ d)
