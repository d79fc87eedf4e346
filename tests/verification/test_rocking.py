"""A slender block that rocks from edge to edge: the impacts take its energy, and it comes to stand."""

import numpy as np
import pytest

from avalanche_gym import physics

HALF = (0.02, 0.02, 0.1)  # [m]: slender enough that the other edge comes up when one lands


def rock(lift, time_step, seconds=2.0):
    """Tilt [rad] and place [m] in the end of a block that was let go with one edge ``lift`` [m] above a plane."""
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity((0.0, 0.0, -9.81)))
    scene.add_body(physics.Plane(), motion="static")
    tilt = lift / (2.0 * HALF[0])
    height = HALF[2] * np.cos(tilt) + HALF[0] * np.sin(tilt)
    turned = (np.cos(0.5 * tilt), 0.0, np.sin(0.5 * tilt), 0.0)
    scene.add_body(physics.Box(HALF), density=500.0, position=(0.0, 0.0, height), orientation=turned)
    world = physics.World(scene, options=physics.Options(time_step=time_step, sleeping=False))
    world.step(round(seconds / time_step))
    return 2.0 * abs(world.orientation[0, 1, 2]), world.position[0, 1, 0]


@pytest.mark.parametrize("lift", [1e-5, 2e-5, 1e-4])
def test_rocking_ends(lift):
    """However long the steps are, and always in the same place. At 1/60 s it went on for ever, by 2e-5 m a step."""
    _, place = rock(lift, 1.0 / 960.0)
    assert place == pytest.approx(-2.5 * lift, rel=1e-3)  # the height of its middle times the tilt
    for rate in (60, 240):
        tilt, found = rock(lift, 1.0 / rate)
        assert tilt < 1e-6
        assert found == pytest.approx(place, rel=2e-3)
