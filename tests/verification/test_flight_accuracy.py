"""The flight over long times and at several step sizes: what round-off remains, and the orders of the splittings."""

import math

import numpy as np
import pytest

from tests.oracles import flight_oracle as oracle
from tests.oracles.flight_oracle import Flyer, mp

MU, A = 100.0, 10.0
PERIOD = 2 * math.pi * math.sqrt(A**3 / MU)


def orientation_error(body: Flyer, time: float, rate: int) -> float:
    """Angle [rad] to the exact orientation after ``time`` [s] in steps of 1 / rate."""
    q = [mp.mpf(float(x)) for x in body.orientation]
    exact, _ = oracle.free_rotation(body.inertia, q, body.angular_velocity, time)
    return oracle.angle_between(body.after(1 / rate, round(time * rate)).orientation, exact)


@pytest.mark.parametrize("rate", [60, 240, 960])
@pytest.mark.parametrize("perturbation", [(0.05, 0.0), (0.0, 0.05), (0.05, 0.05), (-0.03, 0.04)])
def test_dzhanibekov(rate, perturbation):
    body = Flyer(angular_velocity=(perturbation[0], 5.0, perturbation[1]), inertia=(0.1, 0.2, 0.3))
    assert orientation_error(body, 20.0, rate) < (1e-10 if rate < 960 else 1e-9)


def random_tumbler(rng: np.random.Generator) -> Flyer:
    a, b, c = rng.uniform(0.1, 1.0, 3)
    q = rng.normal(size=4)
    omega = rng.normal(size=3)
    return Flyer(
        orientation=q / np.linalg.norm(q),
        angular_velocity=omega * rng.uniform(0, 10) / np.linalg.norm(omega),
        inertia=(b + c, c + a, a + b),
    )


@pytest.mark.verify
@pytest.mark.parametrize(("rate", "tolerance"), [(60, 1e-10), (240, 1e-10), (960, 1e-9)])
def test_random_tumblers(rate, tolerance):
    rng = np.random.default_rng(1)
    worst = max(orientation_error(random_tumbler(rng), 20.0, rate) for _ in range(200))
    assert worst < tolerance


@pytest.mark.verify
@pytest.mark.parametrize("offset", [1e-2, 1e-3, 1e-4])
def test_near_the_separatrix(offset):
    """The error is that of one rounding of the state in each step, wherever on the way it does most harm."""
    rng = np.random.default_rng(7)
    time, parts = 20.0, 12
    direction = rng.normal(size=3)
    body = Flyer(angular_velocity=5.0 * (np.array([0.0, 1.0, 0.0]) + offset * direction), inertia=(0.1, 0.2, 0.3))

    def exact(a):
        return [x for row in oracle.free_rotation(body.inertia, a[:4], a[4:], a_time)[0] for x in row]

    worst = 0.0
    for part in range(parts):
        on_the_way = body.after(time * part / parts)
        a_time = time * (parts - part) / parts
        arguments = [mp.mpf(float(x)) for x in (*on_the_way.orientation, *on_the_way.angular_velocity)]
        worst = max(worst, oracle.sensitivity(exact, arguments, [1.0] * 4 + [5.0] * 3))
    for rate in (60, 960):
        assert orientation_error(body, time, rate) < worst * math.sqrt(time * rate)


@pytest.mark.parametrize("rate", [60, 960])
@pytest.mark.parametrize(("e", "tolerance"), [(0.0, 1e-9), (0.5, 1e-9), (0.9, 1e-9), (0.99, 1e-7)])
@pytest.mark.parametrize("side", [-1, 1])
def test_orbit_of_100_periods(rate, e, tolerance, side):
    r = A * (1 + side * e)
    start = Flyer((r, 0.0, 0.0), (0.0, math.sqrt(MU / A * (1 - side * e) / (1 + side * e)), 0.0))
    start.points = [((0.0, 0.0, 0.0), MU)]
    steps = int(100 * PERIOD * rate)
    end = start.after(1 / rate, steps)
    x, _ = oracle.kepler(start.center, start.velocity, MU, mp.mpf(steps) * mp.mpf(1 / rate))
    assert np.linalg.norm(end.center - np.array(x, float)) < tolerance * A


@pytest.mark.verify
@pytest.mark.parametrize("e", [0.5, 0.9, 0.99])
def test_energy_over_1e4_periods(e):
    r = A * (1 + e)
    ball = Flyer((r, 0.0, 0.0), (0.0, math.sqrt(MU / A * (1 - e) / (1 + e)), 0.0), points=[((0.0, 0.0, 0.0), MU)])
    steps = int(1e4 * PERIOD * 60)
    energies = []
    for _ in range(50):
        ball = ball.after(1 / 60, steps // 50)
        energies.append(0.5 * ball.velocity @ ball.velocity - MU / np.linalg.norm(ball.center))
    # Round-off at the pericentre, 1 / (1 - e) times that of the energy, in a random walk of ``steps``; a drift of a
    # tenth of the last bit in each step would be 100 times larger.
    bound = 2e-16 * math.sqrt(steps) * 4 / (1 - e)
    assert np.abs(np.array(energies) / (-MU / (2 * A)) - 1).max() < bound


def measured_order(body: Flyer, time: float, steps: int, distance) -> float:
    """Order of convergence from ``steps`` to twice as many, against DOP853."""
    reference = body.integrated(time)
    coarse = distance(body.after(time / steps, steps), reference)
    fine = distance(body.after(time / (2 * steps), 2 * steps), reference)
    return math.log2(coarse / fine)


def center_distance(a: Flyer, b: Flyer) -> float:
    return float(np.linalg.norm(np.subtract(a.center, b.center)))


def rotation_distance(a: Flyer, b: Flyer) -> float:
    return float(np.linalg.norm(a.rotation() - b.rotation()))


@pytest.mark.parametrize(
    ("uniform", "points", "force"),
    [
        ([(0.0, 0.0, -0.3)], [((0.0, 0.0, 0.0), 100.0)], (0.0, 0.0, 0.0)),
        ([], [((0.0, 0.0, 0.0), 100.0), ((0.0, 14.0, 3.0), 40.0)], (0.0, 0.0, 0.0)),
        ([], [((0.0, 0.0, 0.0), 100.0)], (0.1, 0.2, 0.3)),
        ([(0.0, 0.0, -9.81)], [((0.0, 0.0, 0.0), 100.0)], (0.0, 0.0, 0.0)),
    ],
)
def test_splitting_of_fields_has_order_2(uniform, points, force):
    ball = Flyer((8.0, 0.0, 0.0), (0.0, 3.0, 1.0), force=force, uniform=uniform, points=points)
    assert measured_order(ball, 2.0, 60, center_distance) == pytest.approx(2.0, abs=0.05)


@pytest.mark.parametrize("inertia", [(0.4, 0.4, 0.4), (0.2, 0.2, 0.3), (0.3, 0.2, 0.2), (0.1, 0.2, 0.25)])
def test_splitting_of_torque_has_order_2(inertia):
    body = Flyer(angular_velocity=(2.0, -1.0, 0.5), inertia=inertia, torque=(0.1, 0.3, -0.2))
    assert measured_order(body, 2.0, 60, rotation_distance) == pytest.approx(2.0, abs=0.05)


def test_splitting_is_symmetric_in_time():
    ball = Flyer(
        (8.0, 0.0, 0.0),
        (0.0, 3.0, 1.0),
        angular_velocity=(1.0, 2.0, -1.0),
        inertia=(0.1, 0.2, 0.25),
        torque=(0.1, 0.3, -0.2),
        uniform=[(0.0, 0.0, -0.3)],
        points=[((0.0, 0.0, 0.0), 100.0)],
    )
    back = ball.after(0.05, 40).after(-0.05, 40)
    assert center_distance(back, ball) < 1e-12
    assert rotation_distance(back, ball) < 1e-12
