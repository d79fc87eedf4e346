"""Slow, obvious twins of the flight: classical solutions in many digits, and DOP853. None shares a formula with it.

And ``Flyer``, which lets a test fly one body without a scene.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import mpmath
import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from avalanche_gym.physics.integrator import flight
from avalanche_gym.physics.jit import entry_point
from avalanche_gym.physics.model import BODY, BODY_STATE, DYNAMIC, FIELD, POINT_GRAVITY, UNIFORM_GRAVITY

mp = mpmath.mp.clone()
mp.dps = 40

Vector = Sequence[float]


@entry_point
def fly_steps(states, bodies, fields, time_step, steps):
    for _ in range(steps):
        flight.fly(states[0], bodies[0], fields, time_step, states[0])


@dataclass
class Flyer:
    """A body in flight: what a scene would make of it."""

    center: Vector = (0.0, 0.0, 0.0)
    velocity: Vector = (0.0, 0.0, 0.0)
    orientation: Vector = (1.0, 0.0, 0.0, 0.0)
    angular_velocity: Vector = (0.0, 0.0, 0.0)
    force: Vector = (0.0, 0.0, 0.0)
    torque: Vector = (0.0, 0.0, 0.0)
    mass: float = 1.0
    inertia: Vector = (1.0, 1.0, 1.0)
    motion: int = DYNAMIC
    uniform: Sequence[Vector] = ()  # [m/s^2]
    points: Sequence[tuple[Vector, float]] = ()  # centre [m], mu [m^3/s^2]

    def tables(self):
        """One row of BODY_STATE, one of BODY, and those of FIELD."""
        states = np.zeros(1, BODY_STATE)
        bodies = np.zeros(1, BODY)
        fields = np.zeros(len(self.uniform) + len(self.points), FIELD)
        for field, vector in zip(fields, self.uniform, strict=False):
            field["kind"] = UNIFORM_GRAVITY
            field["vector"] = vector
        for field, (center, mu) in zip(fields[len(self.uniform) :], self.points, strict=True):
            field["kind"] = POINT_GRAVITY
            field["vector"] = center
            field["mu"] = mu
        bodies["motion"] = self.motion
        bodies["flow"] = flight.flow_class(self.inertia)
        bodies["mass"] = self.mass
        bodies["inverse_mass"] = 1.0 / self.mass
        bodies["inertia"] = self.inertia
        bodies["inverse_inertia"] = 1.0 / np.array(self.inertia)
        for name in ("center", "velocity", "orientation", "angular_velocity", "force", "torque"):
            states[name] = getattr(self, name)
        return states, bodies, fields

    def after(self, time_step: float, steps: int = 1) -> Flyer:
        """The same body after some steps of the engine's flight."""
        states, bodies, fields = self.tables()
        fly_steps(states, bodies, fields, time_step, steps)
        state = states[0]
        return replace(
            self,
            center=state["center"].copy(),
            velocity=state["velocity"].copy(),
            orientation=state["orientation"].copy(),
            angular_velocity=state["angular_velocity"].copy(),
        )

    def rotation(self) -> NDArray[np.float64]:
        """(3, 3) principal frame to world."""
        return np.array(rotation_matrix(self.orientation), float)

    def angular_momentum(self) -> NDArray[np.float64]:
        """(3,) [kg m^2/s] world frame."""
        r = self.rotation()
        return r @ (np.array(self.inertia) * (r.T @ np.array(self.angular_velocity)))

    def rotational_energy(self) -> float:
        return 0.5 * float(np.dot(self.angular_momentum(), self.angular_velocity))

    def acceleration(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """(3,) [m/s^2] under all fields and the held force, at the place x [m]."""
        total = np.array(self.force) / self.mass
        for g in self.uniform:
            total = total + np.array(g)
        for center, mu in self.points:
            arm = x - np.array(center)
            total = total - mu * arm / np.linalg.norm(arm) ** 3
        return total

    def integrated(self, time: float) -> Flyer:
        """The same body after ``time`` [s], by DOP853 with tolerances near the last bit."""
        inertia = np.array(self.inertia)

        def derivative(_, y):
            x, v, q, w = y[:3], y[3:6], y[6:10], y[10:]
            # w is in the body.
            q_rate = 0.5 * np.array(
                [
                    -q[1] * w[0] - q[2] * w[1] - q[3] * w[2],
                    q[0] * w[0] + q[2] * w[2] - q[3] * w[1],
                    q[0] * w[1] + q[3] * w[0] - q[1] * w[2],
                    q[0] * w[2] + q[1] * w[1] - q[2] * w[0],
                ]
            )
            torque = np.array(rotation_matrix(q), float).T @ np.array(self.torque)
            return np.concatenate([v, self.acceleration(x), q_rate, (torque - np.cross(w, inertia * w)) / inertia])

        w = self.rotation().T @ np.array(self.angular_velocity)
        start = np.concatenate([self.center, self.velocity, self.orientation, w])
        y = solve_ivp(derivative, (0.0, time), start, "DOP853", rtol=3e-14, atol=1e-14).y[:, -1]
        q = y[6:10] / np.linalg.norm(y[6:10])
        world = np.array(rotation_matrix(q), float) @ y[10:]
        return replace(self, center=y[:3], velocity=y[3:6], orientation=q, angular_velocity=world)


def rotation_matrix(q):
    """Rotation matrix, as a list of rows, of a quaternion (w, x, y, z) of any length."""
    w, x, y, z = q
    n = w * w + x * x + y * y + z * z
    return [
        [(w * w + x * x - y * y - z * z) / n, 2 * (x * y - w * z) / n, 2 * (x * z + w * y) / n],
        [2 * (x * y + w * z) / n, (w * w - x * x + y * y - z * z) / n, 2 * (y * z - w * x) / n],
        [2 * (x * z - w * y) / n, 2 * (y * z + w * x) / n, (w * w - x * x - y * y + z * z) / n],
    ]


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def _length(a):
    return mp.sqrt(mp.fdot(a, a))


def _product(a, b):
    return [[mp.fdot(row, column) for column in zip(*b, strict=True)] for row in a]


def _to_angular_momentum(l, p):
    """Rotation that takes the unit vector l to (0, 0, 1) and body axis p into the half plane y = 0, x > 0."""
    axis = [mp.mpf(i == p) for i in range(3)]
    sine = mp.sqrt(1 - l[p] ** 2)
    x = [(axis[i] - l[p] * l[i]) / sine for i in range(3)]
    return [x, cross(l, x), l]


def free_rotation(inertia, q, angular_velocity, time):
    """Rotation matrix (body to world) and world angular velocity [rad/s] after ``time`` [s], as lists of mpf.

    Three different moments; neither a steady rotation nor exactly on the separatrix. The angular momentum in the body
    by Jacobi's elliptic functions, the precession about it by the elliptic integral of the third kind (Landau and
    Lifshitz, Mechanics, sec. 37).
    """
    d = [1 / mp.mpf(i) for i in inertia]
    start = rotation_matrix([mp.mpf(x) for x in q])
    world = [mp.mpf(x) for x in angular_velocity]
    body = [mp.fdot([start[j][i] for j in range(3)], world) for i in range(3)]
    momentum = [body[i] / d[i] for i in range(3)]
    size = _length(momentum)
    l = [x / size for x in momentum]
    least, m, most = sorted(range(3), key=lambda i: d[i])
    energy = mp.fsum(d[i] * l[i] ** 2 for i in range(3))
    # s: the axis that the angular momentum circles in the body; p: the other stable axis, which it never meets.
    s, p = (least, most) if energy < d[m] else (most, least)
    a_m = mp.sqrt((energy - d[s]) / (d[m] - d[s]))
    a_p = mp.sqrt((energy - d[s]) / (d[p] - d[s]))
    a_s = mp.sign(l[s]) * mp.sqrt((d[p] - energy) / (d[p] - d[s]))
    factor = [size * (d[(i + 2) % 3] - d[(i + 1) % 3]) for i in range(3)]
    rate = factor[m] * a_s * a_p / a_m
    k2 = -factor[s] * a_m * a_p / (a_s * rate)
    phase = mp.ellipf(mp.atan2(l[m] / a_m, l[p] / a_p), k2)
    cycle = 4 * mp.ellipk(k2)

    def momentum_at(u):
        sn, cn, dn = (mp.ellipfun(name, u, m=k2) for name in ("sn", "cn", "dn"))
        v = [mp.mpf(0)] * 3
        v[m], v[p], v[s] = a_m * sn, a_p * cn, a_s * dn
        return v

    def third_kind(u):
        """Incomplete elliptic integral of the third kind, of the amplitude of u."""
        turns = mp.nint(u / cycle)
        amplitude = mp.atan2(mp.ellipfun("sn", u, m=k2), mp.ellipfun("cn", u, m=k2)) + 2 * mp.pi * turns
        return mp.ellippi(-(a_p**2) / (1 - a_p**2), amplitude, k2)

    time = mp.mpf(time)
    end = phase + rate * time
    # Rate of precession of axis p about L: size (d_p + (energy - d_p) / (1 - l_p^2)).
    share = size * (energy - d[p]) / (1 - a_p**2) / rate
    angle = size * d[p] * time + share * (third_kind(end) - third_kind(phase))
    turn = [[mp.cos(angle), -mp.sin(angle), 0], [mp.sin(angle), mp.cos(angle), 0], [0, 0, 1]]
    l_end = momentum_at(end)
    first = [list(row) for row in zip(*_to_angular_momentum(l, p), strict=True)]
    r = _product(start, _product(first, _product(turn, _to_angular_momentum(l_end, p))))
    return r, [mp.fsum(r[i][j] * d[j] * size * l_end[j] for j in range(3)) for i in range(3)]


def angle_between(q, reference):
    """Angle [rad] between the orientation q (floats) and a rotation matrix (mpf)."""
    r = rotation_matrix([mp.mpf(float(x)) for x in q])
    # |R - S|_F^2 = 8 sin^2(angle / 2)
    distance = mp.sqrt(mp.fsum((r[i][j] - reference[i][j]) ** 2 for i in range(3) for j in range(3)))
    return float(2 * mp.asin(min(distance / mp.sqrt(8), mp.mpf(1))))


def kepler(position, velocity, mu, time):
    """Position and velocity after ``time`` [s] about a centre at the origin, as lists of mpf.

    From the classical elements, for an attracting centre and every conic but the exact parabola: Kepler's equation in
    the eccentric anomaly, by Newton and bisection.
    """
    with mp.workdps(60):
        x = [mp.mpf(v) for v in position]
        v = [mp.mpf(c) for c in velocity]
        mu = mp.mpf(mu)
        time = mp.mpf(time)
        r = _length(x)
        radial = mp.fdot(x, v)
        a = 1 / (2 / r - mp.fdot(v, v) / mu)
        # r = a (1 - e cos E)
        e_cos = 1 - r / a
        h = cross(x, v)
        e_vector = [c / mu - u / r for c, u in zip(cross(v, h), x, strict=True)]
        e = _length(e_vector)
        p = [c / e for c in e_vector] if e > 0 else [c / r for c in x]
        unit = [c / _length(h) for c in h] if _length(h) > 0 else [mp.mpf(0)] * 3
        q = cross(unit, p)
        n = mp.sqrt(mu / abs(a) ** 3)
        if a > 0:
            cosine, sine, sign = mp.cos, mp.sin, 1
            e_sin = radial / mp.sqrt(mu * a)
            mean = mp.atan2(e_sin, e_cos) - e_sin + n * time
            u = mean
            low, high = mean - e - 1, mean + e + 1
        else:
            cosine, sine, sign = mp.cosh, mp.sinh, -1
            e_sin = radial / mp.sqrt(-mu * a)
            mean = e_sin - mp.asinh(e_sin / e) + n * time
            u = mp.asinh(mean / e)
            low, high = -mp.cbrt(6 * abs(mean)) - 1, mp.cbrt(6 * abs(mean)) + 1
        for _ in range(2000):
            error = sign * (u - e * sine(u)) - mean
            if error > 0:
                high = u
            else:
                low = u
            slope = sign * (1 - e * cosine(u))
            new = u - error / slope if slope != 0 else (low + high) / 2
            if not low <= new <= high:
                new = (low + high) / 2
            change, u = abs(new - u), new
            if change <= abs(u) * mp.mpf(10) ** -55:
                break
        b = mp.sqrt(abs(1 - e * e)) * abs(a)
        c, s = cosine(u), sine(u)
        rate = n / (sign * (1 - e * c))
        along, across = a * (c - e), b * s
        along_rate, across_rate = -sign * a * s * rate, b * c * rate
        return (
            [along * p[i] + across * q[i] for i in range(3)],
            [along_rate * p[i] + across_rate * q[i] for i in range(3)],
        )


def sensitivity(solution: Callable[[list], list], arguments: list, scales: list) -> float:
    """How far the result moves when arguments move by the round-off of their scales: the error nobody can avoid.

    ``solution`` maps a list of mpf to a list of mpf; the moves are small enough to be linear.
    """
    small = mp.mpf(10) ** -6
    start = solution(arguments)
    total = mp.mpf(0)
    for i, scale in enumerate(scales):
        moved = list(arguments)
        moved[i] += small * mp.mpf(2) ** -53 * scale
        total += _length([a - b for a, b in zip(solution(moved), start, strict=True)]) / small
    return float(total)
