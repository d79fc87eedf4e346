"""Free rotation, against elliptic functions in many digits, DOP853 and conservation laws."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from avalanche_gym import physics
from avalanche_gym.physics.integrator import euler_top
from avalanche_gym.physics.integrator.flight import flow_class
from avalanche_gym.physics.model import FLOW_SPHERE, FLOW_SYMMETRIC, FLOW_TRIAXIAL
from tests.oracles import flight_oracle as oracle
from tests.oracles.flight_oracle import Flyer, mp

EPS = 2.0**-53


def random_orientation(rng):
    q = rng.normal(size=4)
    return q / np.linalg.norm(q)


def random_body(rng):
    """Moments of a solid that is up to ten times longer one way than another, at any scale."""
    a, b, c = 10 ** rng.uniform(-1, 1, 3)
    return np.array([b + c, c + a, a + b]) * 10 ** rng.uniform(-9, 9)


def assert_exact(body: Flyer, time: float) -> None:
    """The orientation after one step is as near to the exact one as the round-off of the arguments allows."""
    q = [mp.mpf(float(x)) for x in body.orientation]
    exact, _ = oracle.free_rotation(body.inertia, q, body.angular_velocity, time)
    error = oracle.angle_between(body.after(time).orientation, exact)
    if error < 20 * EPS:
        return
    arguments = [mp.mpf(float(a)) for a in (*body.orientation, *body.angular_velocity, *body.inertia, time)]
    speed = float(np.linalg.norm(body.angular_velocity))

    def solution(a):
        return [x for row in oracle.free_rotation(a[7:10], a[:4], a[4:7], a[10])[0] for x in row]

    scales = [0, 0, 0, 0, speed, speed, speed, *body.inertia, abs(time)]
    assert error < 10 * (oracle.sensitivity(solution, arguments, scales) + 2 * EPS)


def angle(a: Flyer, b: Flyer) -> float:
    return oracle.angle_between(a.orientation, oracle.rotation_matrix([mp.mpf(float(x)) for x in b.orientation]))


def test_flow_class():
    assert flow_class((2.0, 2.0, 2.0)) == FLOW_SPHERE
    assert flow_class((2.0, 2.0 * (1 + 1e-15), 2.0)) == FLOW_SPHERE
    for moments in ((1.0, 1.0, 2.0), (2.0, 1.0, 1.0), (1.0, 0.3, 1.0), (1.0, 1.0 + 1e-15, 0.5)):
        assert flow_class(moments) == FLOW_SYMMETRIC
    assert flow_class((1.0, 2.0, 2.5)) == FLOW_TRIAXIAL
    assert flow_class((1.0, 1.0 + 1e-9, 1.5)) == FLOW_TRIAXIAL
    assert flow_class((1e-20, 1e-20, 1e-20)) == FLOW_SPHERE


def test_sphere_turns_steadily():
    omega = np.array([0.3, -0.4, 1.2])
    q = random_orientation(np.random.default_rng(1))
    end = Flyer(orientation=q, angular_velocity=omega, inertia=(0.4, 0.4, 0.4)).after(1 / 64, 640)
    exact = Rotation.from_rotvec(10 * omega) * Rotation.from_quat(q, scalar_first=True)
    np.testing.assert_allclose(end.rotation(), exact.as_matrix(), atol=1e-14)
    np.testing.assert_array_equal(end.angular_velocity, omega)


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("axial", [0.01, 0.9, 1.1, 2.0])
def test_symmetric_top(axis, axial):
    inertia = np.ones(3)
    inertia[axis] = axial
    q = random_orientation(np.random.default_rng(axis))
    top = Flyer(orientation=q, angular_velocity=(3.0, -2.0, 5.0), inertia=inertia)
    r = Rotation.from_quat(q, scalar_first=True)
    e = np.eye(3)[axis]
    momentum = top.angular_momentum()
    spin = (1 / axial - 1.0) * (r.apply(e) @ momentum)
    exact = Rotation.from_rotvec(10 * momentum) * r * Rotation.from_rotvec(10 * spin * e)
    # 10 s at once, and in steps; a fast spin about the axis costs digits of the angle.
    tolerance = 1e-15 * 10 * (np.linalg.norm(momentum) + abs(spin)) + 1e-15
    for end in (top.after(10.0), top.after(1 / 64, 640)):
        np.testing.assert_allclose(end.rotation(), exact.as_matrix(), atol=20 * tolerance)
        np.testing.assert_allclose(end.angular_momentum(), momentum, atol=1e-12)
        assert end.rotational_energy() == pytest.approx(top.rotational_energy(), rel=1e-13)


@pytest.mark.parametrize("turns", [0.01, 1.0, 1e2, 1e7])
def test_triaxial_body_is_as_good_as_its_arguments(turns):
    rng = np.random.default_rng(2)
    for _ in range(3):
        omega = rng.normal(size=3)
        omega *= turns / np.linalg.norm(omega)
        body = Flyer(orientation=random_orientation(rng), angular_velocity=omega, inertia=random_body(rng))
        assert_exact(body, float(rng.choice([-1.0, 1.0])))


@pytest.mark.parametrize("difference", [1e-3, 1e-9, 1e-12])
def test_near_symmetry(difference):
    rng = np.random.default_rng(3)
    for inertia in (
        (1.0, 1.0 + difference, 1.6),
        (1.0, 1.6, 1.6 + difference),
        (1.0 + difference, 0.05, 1.0),
        (1.0, 1.0 + 2 * difference, 1.0 + difference),
    ):
        body = Flyer(orientation=random_orientation(rng), angular_velocity=rng.normal(size=3) * 10, inertia=inertia)
        assert_exact(body, 1.0)
        end = body.after(1 / 60, 600)
        np.testing.assert_allclose(end.angular_momentum(), body.angular_momentum(), atol=1e-12)
        assert end.rotational_energy() == pytest.approx(body.rotational_energy(), rel=1e-13)


def test_near_a_stable_axis():
    rng = np.random.default_rng(4)
    for axis in (0, 2):
        for offset in (1e-3, 1e-8, 1e-15):
            omega = 7 * np.eye(3)[axis] + offset * rng.normal(size=3)
            body = Flyer(angular_velocity=omega, inertia=(0.1, 0.2, 0.3))
            assert_exact(body, 3.0)


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("spin", [-2.0, 1e9])
def test_principal_axes_are_steady(axis, spin):
    omega = spin * np.eye(3)[axis]
    end = Flyer(angular_velocity=omega, inertia=(0.1, 0.2, 0.3)).after(0.75)
    exact = Rotation.from_rotvec(math.remainder(0.75 * spin, 4 * math.pi) * np.eye(3)[axis])
    np.testing.assert_allclose(end.rotation(), exact.as_matrix(), atol=1e-15 + EPS * abs(spin))
    np.testing.assert_allclose(end.angular_velocity, omega, rtol=1e-15)


def test_unstable_axis_falls_over_and_back():
    # The angular momentum leaves the middle axis and is close to its opposite half a period later.
    body = Flyer(angular_velocity=(1e-5, 5.0, 0.0), inertia=(0.1, 0.2, 0.3))
    spin = [body.after(t).rotation()[:, 1] @ np.array([0.0, 1.0, 0.0]) for t in np.linspace(0, 12, 400)]
    assert min(spin) < -0.999
    assert spin[0] == 1.0


@pytest.mark.parametrize("offset", [1e-9, 1e-30, 1e-160, 1e-300])
def test_fast_spin_at_the_separatrix_ends_finite(offset):
    body = Flyer(angular_velocity=(offset, 1e9, offset), inertia=(0.1, 0.2, 0.3))
    end = body.after(1 / 60)
    assert np.linalg.norm(end.orientation) == pytest.approx(1.0, abs=1e-12)
    np.testing.assert_allclose(end.angular_momentum(), body.angular_momentum(), atol=1e-6)
    assert end.rotational_energy() == pytest.approx(body.rotational_energy(), rel=1e-9)


@pytest.mark.parametrize("omega", [(math.nan, 0, 0), (math.inf, 1, 0), (1e200, 1e200, 0)])
def test_undefined_rotation_is_not_finite(omega):
    end = Flyer(angular_velocity=omega, inertia=(0.1, 0.2, 0.3)).after(1 / 60)
    assert not np.isfinite([*end.orientation, *end.angular_velocity]).all()


@pytest.mark.parametrize("omega", [(0, 0, 0), (1e-320, 0, 1e-320), (1e-200, 1e-200, 1e-200)])
def test_slowest_rotations(omega):
    end = Flyer(angular_velocity=omega, inertia=(0.1, 0.2, 0.3)).after(1 / 60)
    np.testing.assert_array_equal(end.orientation[0], 1.0)
    # Some units of the smallest float.
    np.testing.assert_allclose(end.angular_velocity, omega, rtol=1e-14, atol=1e-322)


def test_units_do_not_matter():
    body = Flyer(angular_velocity=(1.0, 2.0, 3.0), inertia=(0.1, 0.2, 0.25))
    end = body.after(0.3)
    for time, moment in ((2.0**40, 2.0**60), (2.0**-60, 2.0**-90)):
        scaled = Flyer(
            angular_velocity=np.array(body.angular_velocity) / time, inertia=np.array(body.inertia) * moment
        ).after(0.3 * time)
        np.testing.assert_array_equal(scaled.orientation, end.orientation)
        np.testing.assert_array_equal(scaled.angular_velocity * time, end.angular_velocity)


def test_torque_against_dop853():
    body = Flyer(angular_velocity=(1.0, -2.0, 3.0), inertia=(0.1, 0.2, 0.25), torque=(0.2, 0.1, -0.3), mass=2.0)
    reference = body.integrated(2.0)
    end = body.after(1 / 480, 960)
    assert angle(end, reference) < 2e-5
    np.testing.assert_allclose(
        end.angular_momentum(), body.angular_momentum() + 2.0 * np.array(body.torque), atol=1e-13
    )
    ball = Flyer(angular_velocity=(0.0, 0.0, 1.0), inertia=(0.5, 0.5, 0.5), torque=(0.0, 0.0, 1.0)).after(2.0)
    np.testing.assert_allclose(ball.angular_velocity, [0.0, 0.0, 5.0], rtol=1e-15)
    np.testing.assert_allclose(ball.orientation, [math.cos(3.0), 0.0, 0.0, math.sin(3.0)], rtol=1e-14)


@pytest.mark.parametrize("inertia", [(0.1, 0.2, 0.3), (0.2, 0.2, 0.3)])
@pytest.mark.parametrize("change", ["angular_velocity", "orientation", "inertia"])
def test_changes_from_outside_are_noticed(inertia, change):
    """Whatever the state remembers of an earlier flight gives way to what was written into it since."""
    states, bodies, fields = Flyer(angular_velocity=(1.0, 2.0, 3.0), inertia=inertia).tables()
    oracle.fly_steps(states, bodies, fields, 0.1, 3)
    if change == "inertia":
        bodies["inertia"] *= [1.0, 1.0, 0.9]
    else:
        states[change] = np.roll(states[change], 1)
    fresh = np.zeros_like(states)
    for name in ("orientation", "angular_velocity"):
        fresh[name] = states[name]
    for table in (states, fresh):
        oracle.fly_steps(table, bodies, fields, 0.1, 3)
    for name in ("orientation", "angular_velocity"):
        np.testing.assert_array_equal(states[name], fresh[name])


finite = st.floats(-10.0, 10.0)
side = st.floats(0.1, 10.0)


@given(
    sides=st.tuples(side, side, side),
    omega=st.tuples(finite, finite, finite),
    h=st.floats(-1.0, 1.0),
    part=st.floats(0.0, 1.0),
)
def test_flow_is_a_group(sides, omega, h, part):
    """Any cut of a step, and the way back, ends where the exact flow does; momentum and energy stay."""
    a, b, c = sides
    body = Flyer(angular_velocity=omega, inertia=(b + c, c + a, a + b))
    whole = body.after(h)
    cut = body.after(part * h).after((1 - part) * h)
    back = whole.after(-h)
    # Rates reach |omega| times the ratio of moments; at the separatrix an error grows like exp(rate h).
    rate = float(np.linalg.norm(body.angular_momentum())) / min(body.inertia)
    growth = 1e-14 * (1 + rate) * math.exp(min(3 * abs(h) * _lyapunov(body), 600.0))
    assert angle(cut, whole) < growth
    assert angle(back, body) < growth
    scale = float(np.linalg.norm(body.angular_momentum()))
    np.testing.assert_allclose(whole.angular_momentum(), body.angular_momentum(), atol=1e-14 * scale + 1e-300)
    assert whole.rotational_energy() == pytest.approx(body.rotational_energy(), rel=1e-13, abs=1e-300)


def _lyapunov(body: Flyer) -> float:
    """Rate [1/s] at which neighbouring rotations part near the middle axis, at most."""
    i1, i2, i3 = sorted(body.inertia)
    momentum = float(np.linalg.norm(body.angular_momentum()))
    return momentum / i2 * math.sqrt((i3 - i2) * (i2 - i1) / (i1 * i3))


def test_orientation_is_exact_over_whole_periods():
    # The remainder after whole periods, against the same time in pieces of less than a period.
    body = Flyer(angular_velocity=(300.0, 200.0, -500.0), inertia=(0.1, 0.2, 0.25))
    assert angle(body.after(1.0), body.after(1 / 1024, 1024)) < 1e-11


def test_period_of_the_pendulum_limits():
    # agm(1, sqrt(1 - k^2)) at k = 0 and k^2 = 1/2 (lemniscate), with lambda = 1.
    assert euler_top.period((0.0, 1.0, 1.0)) == pytest.approx(2 * math.pi, rel=1e-15)
    assert euler_top.period((0.0, 1.0, 0.5)) == pytest.approx(4 * 1.854074677301372, rel=1e-15)
    assert euler_top.period((0.0, 1.0, 0.0)) == math.inf


@pytest.mark.parametrize("shape", [physics.Cylinder(0.05, 0.17), physics.Sphere(0.1), physics.Box((0.1, 0.2, 0.05))])
@pytest.mark.parametrize("spin", [30.0, 80.0, 180.0, 1000.0])
def test_fast_spins_stay_unit_turns(shape, spin):
    """Whole turns in a step: an error of the length of the quaternion must not grow from step to step."""
    scene = physics.Scene()
    body = scene.add_body(shape, mass=1.0, angular_velocity=(0.15 * spin, -0.07 * spin, spin))
    world = physics.World(scene, options=physics.Options(time_step=1 / 30))
    energy = world.kinetic_energy()[0]
    world.step(600)
    assert np.linalg.norm(world.orientation[0, body]) == pytest.approx(1.0, abs=1e-14)
    assert world.kinetic_energy()[0] == pytest.approx(energy, rel=1e-12)
