"""The answers that the hard cases are measured against, each by another formula than the scenes use."""

import math

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
from scipy.special import ellipj

from avalanche_gym.physics.scenes import (
    HARD_CASES,
    bounces,
    flight,
    friction,
    swinging_plate,
    terrain,
    tops,
    travelling_wave,
)
from avalanche_gym.physics.scenes import flight_reference as exact
from avalanche_gym.physics.scenes.case import GRAVITY, Recording, angle_between, rotation_matrices
from tests.oracles.top_oracle import top_motion


def still(case, time, position, orientation=None, velocity=None, spin=None):
    """A recording of given places (n, bodies, 3), the rest at zero."""
    position = np.asarray(position, float)
    shape = position.shape
    turn = np.zeros((*shape[:2], 4))
    turn[..., 0] = 1.0
    return Recording(
        np.asarray(time, float),
        position,
        turn if orientation is None else np.asarray(orientation, float),
        np.zeros(shape) if velocity is None else np.asarray(velocity, float),
        np.zeros(shape) if spin is None else np.asarray(spin, float),
    )


@pytest.mark.parametrize("name", HARD_CASES)
def test_every_case_can_be_run_on_the_whole_ladder(name):
    """Duration and sampling are multiples of 1/30 s; its scene builds or is refused."""
    case = HARD_CASES[name]
    assert case.duration * 30 == pytest.approx(round(case.duration * 30), abs=1e-9)
    if math.isfinite(case.sampling):
        assert case.sampling * 30 == pytest.approx(round(case.sampling * 30), abs=1e-9)
    assert case.title and case.truth and case.unit and 1 <= case.number <= 30
    if case.refusal == "required":
        with pytest.raises(ValueError, match="culprit"):
            case.scene()
        return
    if name == "pile_1000":
        return
    scene = case.scene()
    assert any(body.motion == "dynamic" for body in scene.bodies)
    # A motion that has gone to pieces has an infinite error, whatever the case measures.
    broken = np.full((2, len(scene.bodies), 3), np.nan)
    motion = still(case, [0.0, case.duration], broken)
    assert case.errors(motion, *[motion for _ in case.companions]) == {case.error: math.inf}


def test_rotation_follows_jacobi_and_a_symmetric_top_precesses():
    inertia, spin = np.array((0.1, 0.2, 0.3)), np.array((0.05, 5.0, 0.0))
    times = np.linspace(0.0, 20.0, 9)
    turns = rotation_matrices(exact.free_rotation(tuple(inertia), tuple(spin), tuple(times)))
    momentum = inertia * spin  # constant in the world, so the body's rates follow from the attitude
    rates = np.einsum("nji,j->ni", turns, momentum) / inertia
    # Landau and Lifshitz, par. 37, eqs. 37.10 to 37.12, for L^2 > 2 T I2: w1 = A1 cn, w2 = A2 sn, w3 = A3 dn.
    i1, i2, i3 = inertia
    energy, square = (inertia * spin**2).sum(), (momentum**2).sum()
    if square > energy * i2:
        big, small = i3, i1
    else:
        big, small = i1, i3
    amplitude = math.sqrt((energy * big - square) / (i2 * (big - i2)))
    rate = math.sqrt((big - i2) * (square - energy * small) / (i1 * i2 * i3))
    modulus = (i2 - small) * (energy * big - square) / ((big - i2) * (square - energy * small))
    from scipy.special import ellipk

    period = ellipk(modulus)
    middle = amplitude * ellipj(period + rate * times, modulus)[0]  # starts at its largest
    np.testing.assert_allclose(np.abs(rates[:, 1]), np.abs(middle), atol=1e-7)
    # A symmetric top turns about its momentum at L / I1 and about its axis at (1 - I3 / I1) w3.
    inertia, spin = np.array((0.2, 0.2, 0.3)), np.array((1.0, 2.0, 3.0))
    attitude = exact.free_rotation(tuple(inertia), tuple(spin), (0.0, 2.5))[1]
    momentum = inertia * spin
    size = np.linalg.norm(momentum)
    half = 0.5 * size / 0.2 * 2.5
    about_momentum = np.concatenate([[math.cos(half)], math.sin(half) * momentum / size])
    half = 0.5 * (1 - 0.3 / 0.2) * 3.0 * 2.5
    about_axis = np.array([math.cos(half), 0.0, 0.0, math.sin(half)])
    w, v = about_momentum[0] * about_axis[0] - about_momentum[1:] @ about_axis[1:], None
    v = about_momentum[0] * about_axis[1:] + about_axis[0] * about_momentum[1:]
    v = v + np.cross(about_momentum[1:], about_axis[1:])
    assert angle_between(attitude, np.array([w, *v])) < 1e-13


@pytest.mark.parametrize("eccentricity", [0.5, 0.9])
def test_orbit_is_the_one_of_newtons_law(eccentricity):
    place, speed = exact.apoapsis_start(flight.ATTRACTION, flight.AXIS, eccentricity)

    def rates(_, y):
        return np.concatenate([y[3:], -flight.ATTRACTION * y[:3] / np.linalg.norm(y[:3]) ** 3])

    time = 1.7 * flight.PERIOD
    found = solve_ivp(rates, (0, time), np.concatenate([place, speed]), "DOP853", rtol=1e-12, atol=1e-12).y[:3, -1]
    truth = exact.kepler_motion(flight.ATTRACTION, flight.AXIS, eccentricity, np.array([time]))[0]
    np.testing.assert_allclose(found, truth, atol=1e-7)


def test_bounces_round_a_planet_by_integration_with_events():
    radius = flight.PLANET_RADIUS + flight.LANDER_RADIUS

    def rates(_, y):
        return np.concatenate([y[2:], -flight.ATTRACTION * y[:2] / np.hypot(*y[:2]) ** 3])

    def ground(_, y):
        return np.hypot(*y[:2]) - radius

    ground.terminal, ground.direction = True, -1
    state, now, end = np.array([*flight.DESCENT[0][:2], *flight.DESCENT[1][:2]]), 0.0, 8.0
    while now < end:
        found = solve_ivp(rates, (now, end), state, "DOP853", events=ground, rtol=1e-12, atol=1e-12)
        state, now = found.y[:, -1], found.t[-1]
        if now < end:
            outward = state[:2] / np.hypot(*state[:2])
            state[2:] -= (1 + flight.PLANET_RESTITUTION) * (state[2:] @ outward) * outward
            state[:2] = outward * radius * (1 + 1e-15)
    truth = exact.planet_bounces(flight.ATTRACTION, *flight.DESCENT, radius, flight.PLANET_RESTITUTION, np.array([end]))
    np.testing.assert_allclose(state[:2], truth[0, :2], atol=1e-8)


@pytest.mark.parametrize("restitution", [0.5, 0.8, 1.0])
def test_bounce_heights_are_zero_at_the_series_of_bounces(restitution):
    first = math.sqrt(2.0 / GRAVITY)
    bounces_at = first * (1 + 2 * np.cumsum(restitution ** np.arange(1, 6)))
    np.testing.assert_allclose(bounces.bounce_heights(1.0, restitution, bounces_at), 0.0, atol=1e-14)
    tops = bounces_at[:-1] + first * restitution ** np.arange(2, 6)
    heights = bounces.bounce_heights(1.0, restitution, tops)
    np.testing.assert_allclose(heights, restitution ** (2.0 * np.arange(2, 6)), rtol=1e-12)
    assert bounces.bounce_heights(1.0, 0.5, np.array([3 * first, 5.0])).max() < 1e-14


def test_apexes_are_read_from_samples_that_miss_them():
    times = np.arange(0.0, 2.8, 0.017)
    height = bounces.bounce_heights(1.0, 0.8, times)
    speed = (bounces.bounce_heights(1.0, 0.8, times + 1e-7) - height) / 1e-7
    place = np.zeros((len(times), 2, 3))
    velocity = np.zeros_like(place)
    place[:, 0, 2], velocity[:, 0, 2] = height + bounces.RADIUS, speed
    found = bounces.apexes(still(None, times, place, velocity=velocity), 0)
    np.testing.assert_allclose(found[:4], 0.8 ** (2.0 * np.arange(1, 5)), rtol=1e-5)


def test_pendulum_in_the_bowl_by_integration_and_its_period_by_quadrature():
    times = np.linspace(0.0, 10.0, 6)
    found = solve_ivp(
        lambda _, y: [y[1], -GRAVITY / terrain.PENDULUM * math.sin(y[0])],
        (0.0, 10.0), [terrain.RELEASE, 0.0], "DOP853", t_eval=times, rtol=1e-12, atol=1e-12,
    )  # fmt: skip
    truth = terrain.pendulum_angle(terrain.RELEASE, terrain.PENDULUM, times)
    np.testing.assert_allclose(found.y[0], truth, atol=1e-9)
    k = math.sin(0.5 * terrain.RELEASE)
    period = 4 * math.sqrt(terrain.PENDULUM / GRAVITY)
    period *= quad(lambda a: 1 / math.sqrt(1 - (k * math.sin(a)) ** 2), 0, math.pi / 2)[0]
    back = terrain.pendulum_angle(terrain.RELEASE, terrain.PENDULUM, np.array([period]))[0]
    assert back == pytest.approx(terrain.RELEASE, abs=1e-9)


def test_trough_loses_the_energy_of_each_kink_and_no_more():
    corners, slopes = terrain.trough_track()
    # The centre of the ball stays one radius above the nearest facet.
    x = np.linspace(-0.5 * terrain.TROUGH_WIDTH, 0.5 * terrain.TROUGH_WIDTH, terrain.TROUGH_FACETS + 1)
    for k, slope in enumerate(slopes):
        middle = 0.5 * (corners[k] + corners[k + 1])
        distance = (middle[1] - terrain.trough_samples()[k]) * math.cos(slope) - (middle[0] - x[k]) * math.sin(slope)
        assert distance == pytest.approx(terrain.TROUGH_BALL, rel=1e-12)
    # Down to the middle, by energies.
    square, z = 0.0, 0.5 * (corners[0] + corners[1])[1]
    for k in range(1, 5):
        square += 2 * GRAVITY * (z - corners[k][1])
        square *= math.cos(slopes[k] - slopes[k - 1]) ** 2
        z = corners[k][1]
    times = np.linspace(0.0, 3.0, 30001)
    path = terrain.trough_motion(times)
    passing = np.flatnonzero(np.diff(np.sign(path[:, 0])) > 0)[0] + 2
    speed = np.linalg.norm(path[passing + 1] - path[passing]) / (times[1] - times[0])
    assert speed == pytest.approx(math.sqrt(square), rel=2e-3)


@pytest.mark.parametrize("ratio", [0.95, 1.6])
def test_swinging_plate_by_small_steps(ratio):
    """Stick-slip by brute force: friction gives what it can in each of many short steps."""
    end, count = 2.0, 400_000
    step = end / count
    amplitude, most = swinging_plate.swing_amplitude(ratio), swinging_plate.SWING_FRICTION * GRAVITY
    times = step * np.arange(1, count + 1)
    plate = amplitude * swinging_plate.SWING_RATE * np.cos(swinging_plate.SWING_RATE * times)
    place, speed, limit = 0.0, amplitude * swinging_plate.SWING_RATE, most * step
    for wanted in plate.tolist():
        speed += min(limit, max(-limit, wanted - speed))
        place += speed * step
    assert swinging_plate.swing_motion(ratio, end) == pytest.approx(place, abs=2e-5)


def test_steady_rolling_obeys_newton_and_euler():
    """Force and torque from differences of momenta along the claimed motion."""
    for kind, (theta, rate) in tops.DISKS.items():
        spin, speed = tops.steady_spin(theta, rate)
        if kind == "euler_disk":
            assert abs(speed) < 1e-12

        def motion(t, theta=theta, rate=rate, spin=spin, speed=speed):
            axis = np.array(
                [math.sin(theta) * math.cos(rate * t), math.sin(theta) * math.sin(rate * t), math.cos(theta)]
            )
            turning = np.array([0.0, 0.0, rate]) + spin * axis
            momentum = tops.DISK_ACROSS * turning + (tops.DISK_ALONG - tops.DISK_ACROSS) * (turning @ axis) * axis
            velocity = speed * np.array([-math.sin(rate * t), math.cos(rate * t), 0.0])
            return axis, turning, momentum, velocity

        axis, turning, _, velocity = motion(0.0)
        small = 1e-5
        force = tops.DISK_MASS * (motion(small)[3] - motion(-small)[3]) / (2 * small) + [0, 0, tops.DISK_MASS * GRAVITY]
        torque = (motion(small)[2] - motion(-small)[2]) / (2 * small)
        down = np.array([0.0, 0.0, -1.0])
        rim = down - (down @ axis) * axis
        arm = tops.DISK_RADIUS * rim / np.linalg.norm(rim) - tops.DISK_HALF * axis
        np.testing.assert_allclose(np.cross(arm, force), torque, atol=1e-6)
        np.testing.assert_allclose(velocity + np.cross(turning, arm), 0.0, atol=1e-12)
        assert np.hypot(*force[:2]) < 0.8 * force[2]


def test_rolling_load_balances():
    a = friction.BALL_ACCELERATION
    upper = friction.PUSH - friction.LOAD_MASS * 2 * a
    lower = friction.BALLS * friction.BALL_MASS * a - upper
    spin = 0.4 * friction.BALLS * friction.BALL_MASS * a
    assert upper - lower == pytest.approx(spin)
    assert upper < 0.8 * friction.LOAD_MASS * GRAVITY
    assert abs(lower) < 0.4 * (friction.LOAD_MASS + friction.BALLS * friction.BALL_MASS) * GRAVITY


def test_painleve_rod_is_in_the_regime():
    """Genot and Brogliato (1999): the normal acceleration falls with the normal force."""
    c, s = math.cos(friction.ROD_ANGLE), math.sin(friction.ROD_ANGLE)
    assert 1 + 3 * c * (c - friction.ROD_FRICTION * s) < 0


def test_true_motions_have_no_error():
    """Each measure is zero on the motion it calls true; a shift of one per mille shows."""
    times = np.linspace(0.0, 1.0, 31)
    place = np.zeros((31, 2, 3))
    place[:, 1, 0] = 5 / 14 * GRAVITY * math.sin(friction.TILT) * times**2
    velocity = np.zeros_like(place)
    velocity[:, 1, 0] = 5 / 7 * GRAVITY * math.sin(friction.TILT) * times
    errors = HARD_CASES["roll_down"].errors(still(None, times, place, velocity=velocity))
    assert max(errors.values()) < 1e-12
    place[-1, 1, 0] *= 1.001
    assert HARD_CASES["roll_down"].errors(still(None, times, place))["position"] == pytest.approx(1e-3)


def test_cut_floors_cover_the_rectangle_without_overlap():
    area = 0.0
    for mesh in terrain.floor_meshes():
        corners = mesh.vertices[mesh.faces]
        area += 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2].sum()
        assert (np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2] > 0.0).all()
    assert area == pytest.approx(7.0 * 5.0, rel=1e-9)


@pytest.mark.verify
def test_tippe_tops_slide_over_or_roll():
    time, _, _ = top_motion(*tops.SLIDING_TOP, tops.TOP_SPIN, 12.0, 1e-11)
    assert time == pytest.approx(tops.INVERSION_TIME, rel=1e-8)
    time, lowest, phases = top_motion(*tops.ROLLING_TOP, tops.TOP_SPIN, 3.0, 1e-9)
    assert math.isinf(time)
    assert lowest == pytest.approx(math.cos(tops.ROLLING_TOP[1]), abs=1e-9)
    assert [mode for mode, _ in phases] == ["slides", "rolls"]


def test_a_ball_on_the_wave_keeps_its_energy_as_the_wave_sees_it():
    """Seen from the wave the ground stands still; and the centre is a radius from the ground, along its normal."""
    times = np.linspace(0.0, 3.0, 3001)
    x, z = travelling_wave.motion(tuple(times.tolist()))
    seen = x - travelling_wave.SPEED * times
    speed = [np.gradient(values, times, edge_order=2) for values in (seen, z)]
    energy = (0.5 * (speed[0] ** 2 + speed[1] ** 2) + GRAVITY * z)[5:-5]
    assert np.ptp(energy) < 1e-6
    line = np.linspace(-1.0, 1.0, 20001)
    ground = -travelling_wave.AMPLITUDE * np.cos(travelling_wave.WAVENUMBER * line)
    for place in (seen[0], z[0]), (seen[700], z[700]):
        apart = np.hypot(line - place[0], ground - place[1]).min()
        assert apart == pytest.approx(travelling_wave.RADIUS, abs=1e-8)
