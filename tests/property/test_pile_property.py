"""The pile tier against the dense twin of the solver: what its sweeps settle on obeys the same law."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from avalanche_gym.physics.solver.pile import law_error, relaxed
from avalanche_gym.physics.solver.pile_memory import PILE_MOMENT, PILE_NODE, PILE_ROW
from avalanche_gym.physics.solver.pile_moments import moment_error, prepare_moment, relax_moment
from avalanche_gym.physics.solver.pile_response import prepare_response, push_bodies
from tests.oracles.pile_oracle import contact_response, law_residual, moment_residual, spin_response


def make(seed: int) -> tuple[np.ndarray, np.ndarray]:
    generator = np.random.default_rng(seed)
    rows, nodes = np.zeros(1, PILE_ROW), np.zeros(2, PILE_NODE)
    frame = np.linalg.qr(generator.normal(size=(3, 3)))[0]
    row = rows[0]
    row["a"], row["b"], row["friction"] = 0, 1, generator.uniform(0.0, 1.5)
    for name, vector in zip(("normal", "t1", "t2"), frame, strict=True):
        row[name] = vector
    row["arm_a"], row["arm_b"] = generator.normal(size=(2, 3))
    for node in nodes:
        node["inverse_mass"] = 10.0 ** generator.uniform(-2, 2)
        turn = np.linalg.qr(generator.normal(size=(3, 3)))[0]
        inertia = turn @ np.diag(node["inverse_mass"] * generator.uniform(0.5, 3.0, 3)) @ turn.T
        node["inverse_inertia"] = inertia[np.triu_indices(3)]
    return rows, nodes


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_repeated_steps_of_one_contact_reach_the_exact_law(seed: int) -> None:
    rows, nodes = make(seed)
    row = rows[0]
    prepare_response(row, nodes)
    response = contact_response(row, nodes)
    packed = response[np.triu_indices(3)]
    assert np.allclose(row["local"], packed, rtol=1e-12, atol=1e-12 * packed.max())
    free = np.random.default_rng(seed + 1).normal(size=3)
    impulse = np.zeros(3)
    for _ in range(4000):
        impulse = np.array(relaxed(row, tuple(impulse), *(free + response @ impulse)))
    velocity = free + response @ impulse
    residual = law_residual(row["friction"], response, impulse, velocity)
    assert residual <= 1e-8 * max(np.linalg.norm(impulse), np.linalg.norm(free) / response.trace())
    error, scale = law_error(row, tuple(impulse), tuple(velocity))
    assert np.isclose(np.sqrt(error / scale), residual, rtol=1e-6, atol=1e-14)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_an_impulse_moves_the_contact_by_its_response(seed: int) -> None:
    rows, nodes = make(seed)
    row = rows[0]
    change = np.random.default_rng(seed + 1).normal(size=3)
    push_bodies(row, nodes, tuple(change))
    frame = np.array([row["normal"], row["t1"], row["t2"]])
    ends = [
        node["velocity"] + np.cross(node["spin"], row[arm]) for node, arm in zip(nodes, ("arm_a", "arm_b"), strict=True)
    ]
    expected = contact_response(row, nodes) @ change
    assert np.allclose(frame @ (ends[1] - ends[0]), expected, rtol=1e-10, atol=1e-12 * np.abs(expected).max())


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_repeated_steps_of_one_moment_reach_its_law(seed: int) -> None:
    rows, nodes = make(seed)
    row, moment = rows[0], np.zeros(1, PILE_MOMENT)[0]
    generator = np.random.default_rng(seed + 1)
    load = generator.uniform(0.0, 2.0)
    row["impulse"][0] = row["total"][0] = load
    moment["rolling"], moment["torsion"] = generator.uniform(0.0, 1.0, 2) * generator.integers(0, 2, 2)
    moment["prescribed"] = generator.normal(size=3)
    for node in nodes:
        node["spin"] = generator.normal(size=3)
    prepare_moment(row, moment, nodes)
    response = spin_response(row, nodes)
    assert np.isclose(moment["scale"], response.trace() / 3.0, rtol=1e-12)
    assert moment["stiffness"] * np.linalg.eigvalsh(response)[-1] <= 1.0 + 1e-12
    for _ in range(2000):
        relax_moment(row, moment, nodes)
    found = moment["impulse"].copy()
    frame = np.array([row["normal"], row["t1"], row["t2"]])
    spin = moment["prescribed"] + frame @ (nodes[1]["spin"] - nodes[0]["spin"])
    limits = moment["rolling"] * load, moment["torsion"] * load
    residual = moment_residual(*limits, moment["scale"], found, spin)
    assert residual <= 1e-9 * (1.0 + np.linalg.norm(spin) / moment["scale"])
    moment["total"] = found
    error, _ = moment_error(row, moment, nodes)
    assert np.isclose(np.sqrt(error / moment["scale"]), residual, atol=1e-12)
