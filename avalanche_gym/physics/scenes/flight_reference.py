"""Exact flight, computed without the engine: rotation by Taylor series, orbits by Kepler's equation."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

TAYLOR_ORDER = 24
TAYLOR_STEP = 0.5  # [rad] that the fastest spin turns within one series


@lru_cache(maxsize=16)
def free_rotation(inertia: tuple[float, ...], spin: tuple[float, ...], times: tuple[float, ...]) -> NDArray[np.float64]:
    """Attitudes (n, 4) at ``times`` [s], ascending, of a free body whose principal axes start along the world's.

    Euler's equations and q' = q w / 2 are quadratic, so their Taylor coefficients follow from one another:
    (k + 1) w_k+1 = I^-1 sum_j (I w_j) x w_k-j and 2 (k + 1) q_k+1 = sum_j q_j w_k-j. In 80-bit arithmetic, where the
    machine has it.

    Args:
        inertia: (3,) [kg m^2].
        spin: (3,) [rad/s] at time 0.
    """
    moments = np.asarray(inertia, np.longdouble)
    rate = np.asarray(spin, np.longdouble)
    attitude = np.array([1, 0, 0, 0], np.longdouble)
    longest = TAYLOR_STEP / float(np.linalg.norm(spin)) / float(moments.max() / moments.min()) ** 0.5
    found, now = [], np.longdouble(0)
    for time in np.asarray(times, np.longdouble):
        count = max(1, math.ceil(float(time - now) / longest))
        step = (time - now) / count
        for _ in range(count if time > now else 0):
            rate, attitude = _taylor_step(moments, rate, attitude, step)
        now = time
        found.append(attitude)
    return np.array(found, np.float64)


def _taylor_step(inertia: Any, rate: Any, attitude: Any, step: Any) -> tuple[Any, Any]:
    rates = np.zeros((TAYLOR_ORDER + 1, 3), np.longdouble)
    attitudes = np.zeros((TAYLOR_ORDER + 1, 4), np.longdouble)
    rates[0], attitudes[0] = rate, attitude
    for k in range(TAYLOR_ORDER):
        w, back, q = rates[: k + 1], rates[k::-1], attitudes[: k + 1]
        rates[k + 1] = _cross(inertia * w, back).sum(axis=0) / inertia / (k + 1)
        # A quaternion times the pure quaternion of a vector.
        attitudes[k + 1, 0] = -(q[:, 1:] * back).sum() / (2 * (k + 1))
        attitudes[k + 1, 1:] = (q[:, :1] * back + _cross(q[:, 1:], back)).sum(axis=0) / (2 * (k + 1))
    powers = step ** np.arange(TAYLOR_ORDER + 1)[:, None]
    attitude = (powers * attitudes).sum(axis=0)
    return (powers * rates).sum(axis=0), attitude / np.sqrt((attitude**2).sum())


def _cross(u: Any, v: Any) -> Any:
    return u[:, [1, 2, 0]] * v[:, [2, 0, 1]] - u[:, [2, 0, 1]] * v[:, [1, 2, 0]]


def apoapsis_start(mu: float, axis: float, eccentricity: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Position [m] and velocity [m/s] at the farthest point of an orbit with semi-major axis ``axis`` [m]."""
    farthest = axis * (1 + eccentricity)
    speed = math.sqrt(mu / axis * (1 - eccentricity) / (1 + eccentricity))
    return np.array([farthest, 0.0, 0.0]), np.array([0.0, speed, 0.0])


def kepler_motion(mu: float, axis: float, eccentricity: float, times: NDArray[np.float64]) -> NDArray[np.float64]:
    """Positions (n, 3) [m] of that orbit, ``times`` [s] after the apoapsis."""
    mean = math.sqrt(mu / axis**3) * np.asarray(times, np.longdouble) + np.longdouble(math.pi)
    anomaly = eccentric_anomaly(mean, eccentricity)
    # The apoapsis is on the positive x axis, so the periapsis is on the negative one.
    x = -axis * (np.cos(anomaly) - eccentricity)
    y = -axis * math.sqrt(1 - eccentricity**2) * np.sin(anomaly)
    return np.stack([x, y, np.zeros_like(x)], axis=-1).astype(np.float64)


def eccentric_anomaly(mean: Any, eccentricity: Any) -> Any:
    """E with E - e sin E = ``mean``, by Newton's method from E = pi in each revolution, where it converges."""
    turns = np.floor(mean / (2 * np.pi)) * (2 * np.pi)
    target = mean - turns
    anomaly = np.full_like(target, np.pi)
    for _ in range(60):
        anomaly = anomaly - (anomaly - eccentricity * np.sin(anomaly) - target) / (1 - eccentricity * np.cos(anomaly))
    return anomaly + turns


def planet_bounces(
    mu: float,
    position: NDArray[np.float64],
    velocity: NDArray[np.float64],
    contact_radius: float,
    restitution: float,
    times: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Positions (n, 3) [m] at ``times`` of a body in the plane z = 0 that bounces off a smooth sphere round the centre.

    Between bounces an elliptic arc; at a bounce the velocity along the radius is reversed and multiplied by the
    restitution, the one across it stays.
    """
    place, speed = complex(*position[:2]), complex(*velocity[:2])
    begin, found = 0.0, []
    arc = _Arc(mu, place, speed)
    end = begin + arc.time_to(contact_radius)
    for time in times:
        while time > end:
            place, speed = arc.at(end - begin)
            outward = place / abs(place)
            normal = (speed * outward.conjugate()).real
            speed -= (1 + restitution) * normal * outward
            begin, arc = end, _Arc(mu, place, speed)
            end = begin + arc.time_to(contact_radius)
        at = arc.at(time - begin)[0]
        found.append((at.real, at.imag, 0.0))
    return np.array(found)


class _Arc:
    """An elliptic arc in the complex plane."""

    def __init__(self, mu: float, place: complex, speed: complex) -> None:
        r = abs(place)
        self.axis = 1.0 / (2.0 / r - abs(speed) ** 2 / mu)
        self.motion = math.sqrt(mu / self.axis**3)
        radial = (place.conjugate() * speed).real / math.sqrt(mu * self.axis)  # e sin E
        self.eccentricity = math.hypot(1.0 - r / self.axis, radial)
        self.first = math.atan2(radial, 1.0 - r / self.axis)
        self.side = math.copysign(1.0, (place.conjugate() * speed).imag)
        self.turn = 1.0 + 0j
        self.turn = place / self._shape(self.first)[0]
        self.turn /= abs(self.turn)

    def _shape(self, anomaly: float) -> tuple[complex, complex]:
        """Place and rate of change with the eccentric anomaly, periapsis on the real axis."""
        minor = self.side * math.sqrt(1.0 - self.eccentricity**2)
        place = self.axis * complex(math.cos(anomaly) - self.eccentricity, minor * math.sin(anomaly))
        rate = self.axis * complex(-math.sin(anomaly), minor * math.cos(anomaly))
        return place * self.turn, rate * self.turn

    def _mean(self, anomaly: float) -> float:
        return anomaly - self.eccentricity * math.sin(anomaly)

    def time_to(self, radius: float) -> float:
        """[s] until the arc meets ``radius`` on its way in; the start may lie on it, on the way out."""
        inbound = 2 * math.pi - math.acos((1.0 - radius / self.axis) / self.eccentricity)
        return (self._mean(inbound) - self._mean(self.first % (2 * math.pi))) / self.motion

    def at(self, time: float) -> tuple[complex, complex]:
        """Place [m] and velocity [m/s]."""
        mean = np.array(self._mean(self.first) + self.motion * time)
        anomaly = float(eccentric_anomaly(mean, self.eccentricity))
        place, rate = self._shape(anomaly)
        return place, rate * self.motion / (1.0 - self.eccentricity * math.cos(anomaly))
