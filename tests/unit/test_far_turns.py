"""A blow on a body that turns far within a step: the momentum is that after the blow, and so is the energy."""

import numpy as np
import pytest

from avalanche_gym.physics.integrator.flight import fly
from avalanche_gym.physics.jit import entry_point
from avalanche_gym.physics.maths import quat, vec3
from avalanche_gym.physics.response.bodies import end_orientation, moment_on, set_velocities, turn_by
from tests.oracles.flight_oracle import Flyer

STEP = 1.0 / 60.0


@entry_point
def blow(bodies, starts, flown, ends, fields, row, time_step):
    """A step in which an angular impulse acts on the inertia of the start."""
    fly(starts[0], bodies[0], fields, time_step, flown[0])
    moment = moment_on(row)
    angle = vec3.scale(time_step, turn_by(bodies[0], quat.load(starts[0].orientation), moment))
    quat.store(ends[0].orientation, end_orientation(bodies[0], starts[0], flown[0], moment, angle, time_step))
    set_velocities(bodies[0], flown[0], row, ends[0])


@pytest.mark.parametrize("speed", [30.0, 200.0, 1000.0])
@pytest.mark.parametrize("inertia", [(1.0, 1.0, 1e-3), (1.0, 1.01, 0.02), (1.0, 2.0, 2.5)], ids=["rod", "bar", "box"])
def test_momentum_and_energy_after_a_blow(inertia, speed):
    """The impulse adds to the momentum at the start, and what follows is free rotation: it keeps both."""
    rng = np.random.default_rng(5)
    inertia = np.array(inertia)
    orientation = rng.normal(size=4)
    omega = speed * rng.normal(size=3)
    body = Flyer(orientation=orientation / np.linalg.norm(orientation), angular_velocity=omega, inertia=inertia)
    impulse = speed * rng.normal(size=3) * inertia.max()
    frame = body.rotation()
    momentum = frame @ (inertia * (frame.T @ omega)) + impulse
    energy = 0.5 * np.sum((frame.T @ momentum) ** 2 / inertia)

    states, bodies, fields = body.tables()
    ends = states.copy()
    blow(bodies, states, states.copy(), ends, fields, np.concatenate([np.zeros(3), impulse]), STEP)

    end = Flyer(orientation=ends["orientation"][0], angular_velocity=ends["angular_velocity"][0], inertia=inertia)
    np.testing.assert_allclose(end.angular_momentum(), momentum, rtol=1e-11, atol=1e-11 * np.linalg.norm(momentum))
    assert end.rotational_energy() == pytest.approx(energy, rel=1e-9)
