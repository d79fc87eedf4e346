"""A ball without friction crosses the creases of a trough of facets: each takes its cosine of the speed, no more."""

import numpy as np
import pytest

from avalanche_gym import physics
from avalanche_gym.physics.scenes import HARD_CASES
from avalanche_gym.physics.scenes.recording import record
from tests.oracles import terrain_oracle, track_oracle

FRICTIONLESS = physics.Material(friction=0.0)
PARABOLA = np.linspace(-1.0, 1.0, 9) ** 2
# Kinks of 1 to 25 degrees, facets of a fifth of the ball to five times the ball.
UNEVEN = np.concatenate([[0.0], np.cumsum(np.sort(np.random.default_rng(4).uniform(-1.2, 1.2, 14)))]) * 4.0 / 14.0


def trough(kind, heights, units=1.0):
    """A field, or the same facets as a mesh with other diagonals; 4 units wide along x, 2 along y."""
    if kind == "field":
        return physics.HeightField(np.tile(units * heights, (5, 1)), (4.0 * units, 2.0 * units))
    return physics.TriangleMesh(*terrain_oracle.grid_mesh(np.tile(units * heights, (5, 1)), (4.0 * units, 2.0 * units)))


@pytest.mark.parametrize("rate", [30, 60, 240])
@pytest.mark.parametrize("kind", ["field", "mesh"])
@pytest.mark.parametrize(("heights", "radius"), [(PARABOLA, 0.1), (UNEVEN, 0.05), (UNEVEN, 0.5)], ids=["1", "2", "3"])
def test_the_closed_form_after_five_seconds(kind, heights, radius, rate):
    x = np.linspace(-2.0, 2.0, len(heights))
    corners, _ = track_oracle.corners_of(x, heights, radius)
    start = 0.5 * (corners[0] + corners[1])
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity((0.0, 0.0, -track_oracle.GRAVITY)))
    scene.add_body(trough(kind, heights), motion="static", material=FRICTIONLESS)
    place = (start[0], 0.1, start[1])
    ball = scene.add_body(physics.Sphere(radius), mass=1.0, position=place, material=FRICTIONLESS)
    world = physics.World(scene, options=physics.Options(time_step=1.0 / rate))
    truth = track_oracle.slide(x, heights, radius, np.arange(1, 11) / 2.0)
    for here in truth:
        world.step(rate // 2)
        np.testing.assert_allclose(world.position[0, ball][[0, 2]], here[:2], rtol=0.0, atol=1e-10)
        np.testing.assert_allclose(world.linear_velocity[0, ball][[0, 2]], here[2:], rtol=0.0, atol=1e-10)


def test_the_scene_of_the_hard_case():
    case = HARD_CASES["trough"]
    for rate, goal in case.goal.items():
        recording, _, _ = record(case, physics.Options(time_step=1.0 / rate))
        assert case.errors(recording)["position"] <= goal


@pytest.mark.parametrize(("rate", "most", "sum_of_gains"), [(60, 2e-3, 0.01), (120, 4e-6, 2e-5), (240, 2e-6, 2e-5)])
def test_energy_in_a_bowl_of_facets(rate, most, sum_of_gains):
    """It falls at creases. What a step adds to 2.6 J at most, after the first one, which parts an overlap.

    At 1/60 s the ball crosses more creases in a step than impacts are located.
    """
    world = physics.World(HARD_CASES["bowl_facets"].scene(), options=physics.Options(time_step=1.0 / rate))
    energies = []
    for _ in range(5 * rate):
        world.step()
        energies.append(0.5 * np.sum(world.linear_velocity[0, 1] ** 2) + 9.81 * world.position[0, 1, 2])
    gains = np.maximum(np.diff(energies), 0.0)
    assert gains.max() < most
    assert gains.sum() < sum_of_gains
