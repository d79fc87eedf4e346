"""The centre of mass in flight, against closed forms, the classical elements and DOP853."""

import math

import numpy as np
import pytest

from avalanche_gym.physics.integrator import fields, kepler
from avalanche_gym.physics.model import FIELD, KINEMATIC, STATIC
from tests.oracles import flight_oracle as oracle
from tests.oracles.flight_oracle import Flyer, mp

EPS = 2.0**-53


def kepler_error(position, velocity, mu, time):
    """Errors of position and velocity, each in units of what the round-off of the arguments does to it."""
    got = kepler.advance(tuple(position), tuple(velocity), mu, time)
    arguments = [mp.mpf(float(a)) for a in (*position, *velocity, mu, time)]
    r, v = float(np.linalg.norm(position)), float(np.linalg.norm(velocity))
    scales = [r, r, r, v, v, v, abs(mu), abs(time)]
    errors = []
    for part in range(2):

        def solution(a, part=part):
            return oracle.kepler(a[:3], a[3:6], a[6], a[7])[part]

        reference = solution(arguments)
        size = float(mp.sqrt(mp.fdot(reference, reference)))
        error = mp.sqrt(sum((mp.mpf(a) - b) ** 2 for a, b in zip(got[part], reference, strict=True)))
        errors.append(float(error) / (oracle.sensitivity(solution, arguments, scales) + EPS * size))
    return max(errors)


def direction(rng):
    u = rng.normal(size=3)
    return u / np.linalg.norm(u)


def test_parabola_is_exact_for_every_step():
    ball = Flyer((1.0, 2.0, 3.0), (4.0, 5.0, 6.0), uniform=[(0.0, 0.0, -9.81)])
    for h in (1e-6, 1 / 60, 1.0, 1e3, -2.0):
        end = ball.after(h)
        np.testing.assert_allclose(end.center, [1 + 4 * h, 2 + 5 * h, 3 + 6 * h - 0.5 * 9.81 * h * h], rtol=4 * EPS)
        np.testing.assert_allclose(end.velocity, [4, 5, 6 - 9.81 * h], rtol=4 * EPS)


def test_steps_of_a_parabola_add_up():
    end = Flyer((0.0, 0.0, 0.0), (3.0, 0.0, 20.0), uniform=[(0.0, 0.0, -9.81)]).after(1 / 960, 9600)
    np.testing.assert_allclose(end.center, [30.0, 0.0, 200.0 - 0.5 * 9.81 * 100.0], rtol=1e-11)


def test_force_is_a_constant_acceleration():
    ball = Flyer(velocity=(1.0, 0.0, 0.0), mass=4.0, force=(0.0, 8.0, 4.0), uniform=[(0.0, 0.0, -1.0), (0.5, 0.0, 0.0)])
    end = ball.after(2.0)
    np.testing.assert_allclose(end.center, [3.0, 4.0, 0.0], atol=1e-15)
    np.testing.assert_allclose(end.velocity, [2.0, 4.0, 0.0], atol=1e-15)


def test_kinematic_body_keeps_its_velocities():
    body = Flyer(velocity=(1.0, 0, 0), angular_velocity=(0.0, 0.0, 0.5), motion=KINEMATIC, inertia=(1.0, 2.0, 2.5))
    body.uniform = [(0.0, 0.0, -9.81)]
    end = body.after(0.1, 20)
    np.testing.assert_allclose(end.center, [2.0, 0.0, 0.0], rtol=1e-15)
    np.testing.assert_allclose(end.orientation, [math.cos(0.5), 0.0, 0.0, math.sin(0.5)], rtol=1e-14)
    np.testing.assert_array_equal(end.velocity, body.velocity)
    np.testing.assert_array_equal(end.angular_velocity, body.angular_velocity)


def test_kinematic_body_accelerates_as_it_is_driven():
    """What stands in the place of its force and torque is its acceleration [m/s^2], [rad/s^2]; fields do not act."""
    body = Flyer(velocity=(1.0, 0, 0), angular_velocity=(0.0, 0.0, 0.5), motion=KINEMATIC, mass=7.0)
    body.uniform = [(0.0, 0.0, -9.81)]
    body.force = (0.0, 1.0, 0.0)
    body.torque = (0.0, 0.0, 0.2)
    end = body.after(2.0)
    np.testing.assert_allclose(end.center, [2.0, 2.0, 0.0], rtol=1e-15)
    np.testing.assert_allclose(end.velocity, [1.0, 2.0, 0.0], rtol=1e-15)
    np.testing.assert_allclose(end.orientation, [math.cos(0.7), 0.0, 0.0, math.sin(0.7)], rtol=1e-14)
    np.testing.assert_allclose(end.angular_velocity, [0.0, 0.0, 0.9], rtol=1e-14)


def test_static_body_stays():
    body = Flyer((1.0, 2.0, 3.0), motion=STATIC, uniform=[(0.0, 0.0, -9.81)])
    np.testing.assert_array_equal(body.after(1.0).center, body.center)


@pytest.mark.parametrize("kind", ["ellipse", "many revolutions", "hyperbola", "near parabola", "near radial", "radial"])
def test_kepler_arc_is_as_good_as_its_arguments(kind):
    rng = np.random.default_rng(5)
    for _ in range(8):
        mu, r = 10 ** rng.uniform(-3, 3), 10 ** rng.uniform(-2, 2)
        u, w = direction(rng), direction(rng)
        escape = math.sqrt(2 * mu / r)
        time = math.sqrt(r**3 / mu) * 10 ** rng.uniform(-4, 1.5) * rng.choice([-1, 1])
        match kind:
            case "ellipse":
                v = escape * rng.uniform(0.1, 0.95) * w
            case "many revolutions":
                v = escape * rng.uniform(0.1, 0.95) * w
                time *= 10 ** rng.uniform(1, 5)
            case "hyperbola":
                v = escape * 10 ** rng.uniform(0.01, 4) * w
            case "near parabola":
                v = escape * (1 + 10 ** rng.uniform(-15, -1)) * w
            case "near radial":
                v = escape * (rng.uniform(-1.5, 1.5) * u + 10 ** rng.uniform(-15, -1) * w)
            case _:
                u = np.eye(3)[rng.integers(3)]
                v = escape * rng.uniform(-2, 2) * u
        assert kepler_error(r * u, v, mu, float(time)) < 10


@pytest.mark.parametrize("speed", [1e2, 1e5, 1e9, 1e12])
@pytest.mark.parametrize("miss", [0.0, 1e-12, 1e-6])
def test_fast_passage_close_to_the_centre(speed, miss):
    x, v = oracle.kepler((10.0, 0.0, 0.0), (-speed, miss * speed, 0.0), 100.0, 1 / 60)
    x_got, v_got = kepler.advance((10.0, 0.0, 0.0), (-speed, miss * speed, 0.0), 100.0, 1 / 60)
    assert np.linalg.norm(np.subtract(x_got, np.array(x, float))) < 1e-14 * np.linalg.norm(np.array(x, float))
    assert np.linalg.norm(np.subtract(v_got, np.array(v, float))) < 1e-15 * np.linalg.norm(np.array(v, float))


def test_exact_parabola_orbit():
    # Barker: pericentre q = 2, mu = 1, v = 1 there; x = q (1 - s^2), y = 2 q s, t = sqrt(2 q^3) (s + s^3 / 3).
    for s in (1e-3, 0.5, 3.0, 40.0):
        x, v = kepler.advance((2.0, 0.0, 0.0), (0.0, 1.0, 0.0), 1.0, 4.0 * (s + s**3 / 3))
        np.testing.assert_allclose(x, [2 * (1 - s * s), 4 * s, 0.0], rtol=1e-14)
        np.testing.assert_allclose(v, [-s / (1 + s * s), 1 / (1 + s * s), 0.0], rtol=1e-14)


def test_repelling_centre():
    for velocity in ((0.0, 3.0, 0.0), (-3.0, 1.0, 0.0), (-30.0, 0.0, 0.0)):
        ball = Flyer((10.0, 0.0, 0.0), velocity, points=[((0.0, 0.0, 0.0), -100.0)])
        end, reference = ball.after(2.0), ball.integrated(2.0)
        np.testing.assert_allclose(end.center, reference.center, rtol=0, atol=2e-11)
        np.testing.assert_allclose(end.velocity, reference.velocity, rtol=0, atol=2e-11)


def test_centre_without_attraction():
    x, v = kepler.advance((1.0, 2.0, 3.0), (4.0, 5.0, 6.0), 0.0, 2.0)
    np.testing.assert_allclose(x, [9.0, 12.0, 15.0], rtol=1e-15)
    assert v == (4.0, 5.0, 6.0)


def test_fall_through_the_centre_turns_round():
    # The radial ellipse from rest at r = 1, mu = 1 reaches the centre after pi / sqrt(8) and is back after twice that.
    fall = math.pi / math.sqrt(8)
    before, v_before = kepler.advance((1.0, 0.0, 0.0), (0.0, 0.0, 0.0), 1.0, fall - 0.1)
    after, v_after = kepler.advance((1.0, 0.0, 0.0), (0.0, 0.0, 0.0), 1.0, fall + 0.1)
    np.testing.assert_allclose(after, before, rtol=1e-14)
    np.testing.assert_allclose(v_after, np.negative(v_before), rtol=1e-14)
    back, _ = kepler.advance((1.0, 0.0, 0.0), (0.0, 0.0, 0.0), 1.0, 2 * fall)
    np.testing.assert_allclose(back, (1.0, 0.0, 0.0), rtol=1e-14)


@pytest.mark.parametrize(
    ("center", "velocity"),
    [
        ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
        ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0)),
        ((math.nan, 0.0, 0.0), (1.0, 0.0, 0.0)),
        ((1.0, 0.0, 0.0), (math.inf, 0.0, 0.0)),
        ((1.0, 0.0, 0.0), (1e200, 0.0, 0.0)),
    ],
)
def test_undefined_motion_is_not_finite(center, velocity):
    end = Flyer(center, velocity, points=[((0.0, 0.0, 0.0), 100.0)]).after(1 / 60)
    assert not np.isfinite([end.center, end.velocity]).all()


def test_impulse_of_1e12():
    end = Flyer((10.0, 0.0, 0.0), (0.0, 1e12, 0.0), points=[((0.0, 0.0, 0.0), 100.0)]).after(1 / 60)
    np.testing.assert_allclose(end.center, [10.0, 1e12 / 60, 0.0], rtol=1e-13)
    np.testing.assert_allclose(end.velocity, [0.0, 1e12, 0.0], rtol=1e-14, atol=1e-8)


def test_units_do_not_matter():
    # Powers of two scale every intermediate result without rounding.
    x, v, mu, h = np.array([1.0, 0.3, -0.2]), np.array([0.1, 0.9, 0.4]), 1.3, 0.7
    start = kepler.advance(tuple(x), tuple(v), mu, h)
    for length, time in ((2.0**40, 2.0**20), (2.0**-30, 2.0**-100)):
        scaled = kepler.advance(tuple(x * length), tuple(v * length / time), mu * length**3 / time**2, h * time)
        np.testing.assert_array_equal(np.array(scaled[0]) / length, start[0])
        np.testing.assert_array_equal(np.array(scaled[1]) / length * time, start[1])


def test_force_on_an_orbit_and_several_centres():
    ball = Flyer(
        (10.0, 0.0, 0.0),
        (0.0, 3.0, 0.5),
        mass=2.0,
        force=(0.02, 0.0, -0.04),
        uniform=[(0.0, 0.05, 0.0)],
        points=[((0.0, 0.0, 0.0), 100.0), ((0.0, 30.0, 0.0), 60.0)],
    )
    reference = ball.integrated(10.0)
    end = ball.after(1 / 960, 9600)
    np.testing.assert_allclose(end.center, reference.center, rtol=0, atol=1e-7)


def test_strongest_field_leads():
    # A weak centre beside strong gravity: the parabola leads, and the error is that of the weak field only.
    ball = Flyer((1.0, 0.0, 0.0), (0.0, 1.0, 5.0), uniform=[(0.0, 0.0, -9.81)], points=[((0.0, 0.0, 0.0), 1e-6)])
    np.testing.assert_allclose(ball.after(0.01, 100).center, ball.integrated(1.0).center, rtol=0, atol=1e-10)


def test_acceleration_and_potential():
    table = np.zeros(2, FIELD)
    table[0]["vector"] = (0.0, 0.0, -9.81)
    table[1]["kind"], table[1]["vector"], table[1]["mu"] = 1, (1.0, 0.0, 0.0), 100.0
    x = np.array([4.0, 4.0, 2.0])
    arm = x - [1.0, 0.0, 0.0]
    r = np.linalg.norm(arm)
    np.testing.assert_allclose(fields.acceleration(table, tuple(x)), [0, 0, -9.81] - 100 * arm / r**3, rtol=1e-15)
    assert fields.potential(table, tuple(x)) == pytest.approx(9.81 * 2.0 - 100.0 / r, rel=1e-15)
