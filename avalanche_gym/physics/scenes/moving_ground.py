"""Ground that moves, with known answers: a turntable, an oscillating plate, the travelling wave of a carpet.

``excess`` is the ratio of the friction that there is to what a body needs to stay: above 1 it sticks, below it slides.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .. import Box, Cylinder, HeightField, Material, Scene, Sphere, UniformGravity

GRAVITY = 9.81  # [m/s^2]
PLACE, SPIN = 1.0, 1.5  # [m] from the axis, [rad/s] of the turntable
PLATE_FRICTION, PLATE_FREQUENCY = 0.5, 6.0  # -, [rad/s]
AMPLITUDE, WAVE_NUMBER, FREQUENCY = 0.05, 2.0, 3.0  # [m], [1/m], [rad/s] of the carpet: z = A sin(w t + k x)
CARPET, SAMPLES = 8.0, 65  # [m], samples along x and y
BALL = 0.1  # [m] its radius


def _scene() -> Scene:
    scene = Scene()
    scene.add_field(UniformGravity((0.0, 0.0, -GRAVITY)))
    return scene


def turntable(excess: float) -> Scene:
    """Body 1, a box, turns with body 0, a kinematic disk: mu g = excess r w^2."""
    rubber = Material(friction=excess * PLACE * SPIN**2 / GRAVITY)
    scene = _scene()
    disk = Cylinder(2.0 * PLACE, 0.1)
    spin = (0.0, 0.0, SPIN)
    scene.add_body(disk, motion="kinematic", position=(0.0, 0.0, -0.1), angular_velocity=spin, material=rubber)
    scene.add_body(
        Box((0.1, 0.1, 0.1)),
        mass=1.0,
        position=(PLACE, 0.0, 0.1),
        linear_velocity=(0.0, SPIN * PLACE, 0.0),
        angular_velocity=spin,
        material=rubber,
    )
    return scene


def place_on_turntable(position: NDArray[np.float64], time: float) -> NDArray[np.float64]:
    """(2,) [m] where a point of the world is on the disk."""
    cosine, sine = np.cos(SPIN * time), np.sin(SPIN * time)
    return np.array([cosine * position[0] + sine * position[1], cosine * position[1] - sine * position[0]])


def plate_amplitude(excess: float) -> float:
    """[m] mu g = excess a w^2."""
    return PLATE_FRICTION * GRAVITY / (excess * PLATE_FREQUENCY**2)


def oscillating_plate(excess: float) -> Scene:
    """Body 1, a box, on body 0, a kinematic plate at x = a sin(w t); the caller gives it ``plate_velocity``."""
    rubber = Material(friction=PLATE_FRICTION)
    scene = _scene()
    scene.add_body(Box((5.0, 5.0, 0.1)), motion="kinematic", position=(0.0, 0.0, -0.1), material=rubber)
    start = (plate_amplitude(excess) * PLATE_FREQUENCY, 0.0, 0.0)
    scene.add_body(Box((0.1, 0.1, 0.1)), mass=1.0, position=(0.0, 0.0, 0.1), linear_velocity=start, material=rubber)
    return scene


def plate_velocity(excess: float, time: float, time_step: float) -> NDArray[np.float64]:
    """(3,) [m/s] the mean over the coming step: it ends where the sine does."""
    phase = PLATE_FREQUENCY * time, PLATE_FREQUENCY * (time + time_step)
    return np.array([plate_amplitude(excess) * (np.sin(phase[1]) - np.sin(phase[0])) / time_step, 0.0, 0.0])


def carpet_heights(time: float) -> NDArray[np.float64]:
    """(SAMPLES, SAMPLES) [m] of the wave."""
    x = np.linspace(-0.5 * CARPET, 0.5 * CARPET, SAMPLES)
    return np.tile(AMPLITUDE * np.sin(FREQUENCY * time + WAVE_NUMBER * x), (SAMPLES, 1))


def carpet_rates(time: float, time_step: float) -> NDArray[np.float64]:
    """(SAMPLES, SAMPLES) [m/s] the mean over the coming step: it ends where the wave does."""
    return (carpet_heights(time + time_step) - carpet_heights(time)) / time_step


def ball_on_carpet(place: NDArray[np.float64] | float, time: float) -> NDArray[np.float64]:
    """(x, z) [m] of the centre of a ball that touches the wave above x = ``place``."""
    phase = FREQUENCY * time + WAVE_NUMBER * place
    slope = AMPLITUDE * WAVE_NUMBER * np.cos(phase)
    stretch = np.hypot(1.0, slope)
    return np.array([place - BALL * slope / stretch, AMPLITUDE * np.sin(phase) + BALL / stretch])


def carpet(place: float, surface: str = "smooth") -> Scene:
    """Body 1, a frictionless ball, on body 0, the wave, at rest along x; the caller moves the heights."""
    ice = Material(friction=0.0)
    scene = _scene()
    scene.add_body(HeightField(carpet_heights(0.0), (CARPET, CARPET), surface), motion="kinematic", material=ice)
    x, z = ball_on_carpet(place, 0.0)
    instant = 1e-5
    vx, vz = (ball_on_carpet(place, instant) - ball_on_carpet(place, -instant)) / (2.0 * instant)
    scene.add_body(Sphere(BALL), mass=1.0, position=(x, 0.0, z), linear_velocity=(vx, 0.0, vz), material=ice)
    return scene
