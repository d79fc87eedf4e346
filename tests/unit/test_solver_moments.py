"""Islands whose contacts have rolling friction, where Newton's method alone does not get through."""

import numpy as np
import pytest

from avalanche_gym.physics.solver.exact import solve_rows
from avalanche_gym.physics.solver.residual import evaluate, free_violation
from avalanche_gym.physics.solver.workspace import Workspace

TOLERANCE, MOST = 1e-12, 60


def one_contact(rolling_friction, closing):
    """A slender body whose lower end slides over steep ground with much friction: its contact jams as it slides.

    Body 0 of the island on what cannot move, node 1; numbers of a compound of rods dropped on rough ground.
    """
    workspace = Workspace(4, 2)
    rows, nodes, _, _ = workspace.arrays
    nodes[0]["root"] = 1.3155
    nodes[0]["axes"] = (12.823, -15.970, -3.4024, -8.7319, -1.5878, -14.906, 14.553, 13.119, -5.9459)
    nodes[0]["trace"] = 1151.24
    normal = np.array([-0.44661837, -0.6281881, 0.63711203])
    for row, scale in zip(rows, (14.774, 383.75), strict=False):
        row["a"], row["b"], row["of"] = 1, 0, -1
        row["normal"] = normal / np.linalg.norm(normal)
        row["arm_b"] = (0.10413842, 0.02535201, -0.2068508)
        row["scale"], row["inverse"] = scale, 1.0 / scale
    rows[0]["friction"] = 0.878
    slip = np.array([-0.00408266, -0.53557527, -0.5360409])
    normal = rows[0]["normal"]
    rows[0]["free"] = slip - (slip @ normal + closing) * normal
    rows[0]["speed"], rows[1]["speed"] = 5.48, 33.0
    rows[1]["of"], rows[1]["friction"] = 0, rolling_friction
    rows[1]["free"] = (4.70505006, -3.2859736, 0.26584634)
    return workspace


@pytest.mark.parametrize("closing", [5e-4, 4e-3, 3e-2])
@pytest.mark.parametrize("rolling_friction", [0.0, 1e-3, 0.005, 0.01])
def test_a_contact_that_jams_as_it_slides_is_stopped(rolling_friction, closing):
    """Newton from no impulses finds no way, and sweeps of contact and moment in turn find none either."""
    workspace = one_contact(rolling_friction, closing)
    rows, nodes, blocks, index = workspace.arrays
    residual, _, _ = solve_rows(2, 1, 2, TOLERANCE, MOST, rows, nodes, blocks, index)
    assert residual <= TOLERANCE
    assert evaluate(rows, nodes, 2, 1, free_violation(rows, 2))[0] <= 1e-11
    contact = rows[0]
    assert contact["impulse"] @ contact["normal"] > 0.0
    assert abs(contact["velocity"] @ contact["normal"]) < 1e-12
