"""A ball that a wave of the ground carries along.

The ground is z = -A cos(k (x - c t)). Seen from the wave it stands still, and a ball without friction is a bead on the
curve that its centre keeps to, at a radius r from the ground,

    P(s) = (s - r z' / w, z + r / w),     w = sqrt(1 + z'^2),     z(s) = -A cos(k s),

    |P'|^2 s'' = -(P' . P'') s'^2 - g P'_z                (Lagrange's equation; gravity is the same in both frames),

integrated by DOP853 to 1e-12. Near a trough the ball swings to and fro, and goes with the wave.
"""

from __future__ import annotations

import math
from functools import lru_cache, partial

import numpy as np
from numpy.typing import NDArray

from ..scene import Material, Scene, UniformGravity
from ..shapes import HeightField, Sphere
from .case import GRAVITY, Actuated, HardCase, Recording

AMPLITUDE, WAVENUMBER, SPEED, RADIUS = 0.05, math.pi, 0.5, 0.1  # [m], [1/m], [m/s], [m]
WIDTH, DEPTH, COLUMNS, ROWS = 6.0, 1.0, 193, 5
START, START_RATE = -0.2, -0.1  # s [m] and s' [m/s] at the beginning


def center(s: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """P, P' and P'' (2, ...) of the curve of centres."""
    phase = WAVENUMBER * np.asarray(s, float)
    z = -AMPLITUDE * np.cos(phase)
    z1 = AMPLITUDE * WAVENUMBER * np.sin(phase)
    z2, z3 = -(WAVENUMBER**2) * z, -(WAVENUMBER**2) * z1
    w = np.sqrt(1.0 + z1 * z1)
    bend = RADIUS * z2 / w**3  # the curve of centres has P' = (1, z') (1 - r z'' / w^3)
    bend1 = RADIUS * (z3 / w**3 - 3.0 * z1 * z2 * z2 / w**5)
    place = np.array([s - RADIUS * z1 / w, z + RADIUS / w])
    first = np.array([1.0 - bend, z1 * (1.0 - bend)])
    second = np.array([-bend1, z2 * (1.0 - bend) - z1 * bend1])
    return place, first, second


@lru_cache(maxsize=8)
def motion(times: tuple[float, ...]) -> NDArray[np.float64]:
    """(2, n) [m] x and z of the centre at ``times`` [s]."""
    from scipy.integrate import solve_ivp

    def rates(time: float, state: NDArray[np.float64]) -> list[float]:
        _, first, second = center(state[0])
        pull = -(first @ second) * state[1] ** 2 - GRAVITY * first[1]
        return [state[1], pull / (first @ first)]

    found = solve_ivp(
        rates, (0.0, times[-1]), [START, START_RATE], method="DOP853", t_eval=times, rtol=1e-12, atol=1e-14
    )
    place = center(found.y[0])[0]
    place[0] += SPEED * np.array(times)
    return place


def heights(time: float) -> NDArray[np.float64]:
    """(rows, columns) [m] samples of the wave."""
    line = np.linspace(-0.5 * WIDTH, 0.5 * WIDTH, COLUMNS)
    return np.tile(-AMPLITUDE * np.cos(WAVENUMBER * (line - SPEED * time)), (ROWS, 1))


def carried(surface: str) -> Scene:
    """A ball near a trough of the wave, that moves with it."""
    frictionless = Material(friction=0.0)
    scene = Scene()
    scene.add_field(UniformGravity((0.0, 0.0, -GRAVITY)))
    ground = HeightField(heights(0.0), (WIDTH, DEPTH), surface=surface)
    scene.add_body(ground, motion="kinematic", material=frictionless)
    (x, z), (dx, dz), _ = center(np.array(START))
    scene.add_body(
        Sphere(RADIUS), mass=1.0, position=(x, 0.0, z), material=frictionless,
        linear_velocity=(SPEED + dx * START_RATE, 0.0, dz * START_RATE),
    )  # fmt: skip
    return scene


def travel(simulation: Actuated, time: float, step: float) -> None:
    """Heights at the start of the step, with the mean rate until its end."""
    here = heights(time)
    simulation.set_heights(0, here, (heights(time + step) - here) / step)


def measure_carried(recording: Recording) -> dict[str, float]:
    truth = motion(tuple(recording.time.tolist()))
    off = recording.position[:, 1][:, [0, 2]] - truth.T
    return {"position": np.linalg.norm(off, axis=1).max(), "sideways": np.abs(recording.position[:, 1, 1]).max()}


CASES = (
    HardCase(
        "wave", 24, "A ball without friction that a travelling wave carries, smooth surface",
        "a bead on the curve of centres, seen from the wave, by DOP853", partial(carried, "smooth"), 3.0,
        measure_carried, "position", "m", 1e-3, goal={240: 1e-4}, sampling=0.1, drive=travel,
    ),
)  # fmt: skip
