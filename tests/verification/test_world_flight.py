"""Free motion through the whole engine, with the default options but for the step."""

import math

import numpy as np
import pytest

from avalanche_gym import physics
from tests.oracles import flight_oracle as oracle
from tests.oracles.flight_oracle import mp

MU, A = 100.0, 10.0
PERIOD = 2 * math.pi * math.sqrt(A**3 / MU)


@pytest.mark.parametrize(("rate", "tolerance"), [(60, 1e-10), (240, 1e-10), (960, 1e-9)])
def test_dzhanibekov_in_a_world(rate, tolerance):
    scene = physics.Scene()
    omega = (0.05, 5.0, 0.0)
    body = scene.add_body(physics.Sphere(0.1), mass=1.0, inertia=(0.1, 0.2, 0.3), angular_velocity=omega)
    world = physics.World(scene, options=physics.Options(time_step=1 / rate))
    momentum, energy = world.angular_momentum()[0], world.kinetic_energy()[0]
    world.step(20 * rate)
    exact, _ = oracle.free_rotation((0.1, 0.2, 0.3), [mp.mpf(1), mp.mpf(0), mp.mpf(0), mp.mpf(0)], omega, 20.0)
    assert oracle.angle_between(world.orientation[0, body], exact) < tolerance
    assert np.abs(world.angular_momentum()[0] - momentum).max() < 1e-14
    assert world.kinetic_energy()[0] == pytest.approx(energy, rel=1e-13)


@pytest.mark.parametrize("rate", [60, pytest.param(960, marks=pytest.mark.verify)])
@pytest.mark.parametrize(("e", "tolerance"), [(0.5, 1e-9), (0.99, 1e-7)])
def test_orbit_in_a_world(rate, e, tolerance):
    scene = physics.Scene()
    scene.add_field(physics.PointGravity((0.0, 0.0, 0.0), MU))
    position, velocity = (A * (1 + e), 0.0, 0.0), (0.0, math.sqrt(MU / A * (1 - e) / (1 + e)), 0.0)
    body = scene.add_body(physics.Sphere(0.1), mass=2.0, position=position, linear_velocity=velocity)
    world = physics.World(scene, options=physics.Options(time_step=1 / rate))
    steps = int(100 * PERIOD * rate)
    world.step(steps)
    x, _ = oracle.kepler(position, velocity, MU, mp.mpf(steps) * mp.mpf(1 / rate))
    assert np.linalg.norm(world.position[0, body] - np.array(x, float)) < tolerance * A


@pytest.mark.parametrize("offset", [0.0, 1e3, 1e6])
def test_flight_far_from_the_origin(offset):
    """The difference to the flight at the origin grows as the spacing of floats."""
    ends = []
    for shift in (0.0, offset):
        scene = physics.Scene()
        scene.add_field(physics.PointGravity((shift, 0.0, 0.0), MU))
        body = scene.add_body(
            physics.Box((0.1, 0.2, 0.3)),
            mass=1.0,
            position=(A + shift, 0.0, 0.0),
            linear_velocity=(0.0, 3.0, 0.5),
            angular_velocity=(1.0, 2.0, 3.0),
        )
        world = physics.World(scene)
        world.step(2400)
        ends.append(world.position[0, body] - (shift, 0.0, 0.0))
    assert np.abs(ends[1] - ends[0]).max() < 1e-11 + 2400 * 8 * np.spacing(offset + A)


def test_huge_impulse_and_spin_are_finite_and_right():
    scene = physics.Scene()
    body = scene.add_body(physics.Box((0.1, 0.2, 0.3)), mass=2.0, angular_velocity=(0.0, 0.0, 1e9))
    world = physics.World(scene)
    world.apply_impulse(body, (1e12, 0.0, 0.0))
    world.step(240)
    assert world.linear_velocity[0, body, 0] == 5e11
    assert world.position[0, body, 0] == pytest.approx(5e11, rel=1e-13)
    assert np.linalg.norm(world.orientation[0, body]) == pytest.approx(1.0, rel=1e-14)
    assert np.allclose(world.angular_velocity[0, body], (0.0, 0.0, 1e9), rtol=1e-14)
