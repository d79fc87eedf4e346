"""A box on a plate that swings: it sticks while friction can hold it, and slides where it cannot.

A body on a plate that swings along x with a sin(w t) stays iff a w^2 <= mu g. Beyond that phases of sticking and of
sliding follow each other; each has a closed form, and only the instants between them have to be searched for.
"""

from __future__ import annotations

import math
from functools import partial

from ..scene import Material, Scene, UniformGravity
from ..shapes import Box
from .case import GRAVITY, Actuated, HardCase, Recording

SWING_FRICTION, SWING_RATE = 0.5, 2.0 * math.pi * 2.0


def swing_amplitude(ratio: float) -> float:
    """[m] at which the plate's largest acceleration is ``ratio`` times what friction can give."""
    return ratio * SWING_FRICTION * GRAVITY / SWING_RATE**2


def swinging_plate(ratio: float) -> Scene:
    """A box that rests on the plate as it passes the middle."""
    scene = Scene()
    scene.add_field(UniformGravity((0.0, 0.0, -GRAVITY)))
    speed = (swing_amplitude(ratio) * SWING_RATE, 0.0, 0.0)
    material = Material(friction=SWING_FRICTION)
    scene.add_body(Box((2.0, 2.0, 0.1)), motion="kinematic", linear_velocity=speed, material=material)
    scene.add_body(Box((0.1, 0.1, 0.05)), mass=1.0, position=(0, 0, 0.15), linear_velocity=speed, material=material)
    return scene


def swing(ratio: float, simulation: Actuated, time: float, step: float) -> None:
    """The plate goes in straight pieces from one point of the sine to the next."""
    amplitude = swing_amplitude(ratio)
    here, there = (amplitude * math.sin(SWING_RATE * t) for t in (time, time + step))
    simulation.set_state(0, position=(here, 0.0, 0.0), linear_velocity=((there - here) / step, 0.0, 0.0))


def swing_motion(ratio: float, end: float) -> float:
    """[m] where the body is at ``end``: it sticks until the plate is too fast to follow, slides, and sticks again.

    Each phase of sliding has constant acceleration, so only the instants of sticking need a root find.
    """
    from scipy.optimize import brentq

    amplitude, most = swing_amplitude(ratio), SWING_FRICTION * GRAVITY

    def plate(t: float) -> float:
        return amplitude * math.sin(SWING_RATE * t)

    def plate_speed(t: float) -> float:
        return amplitude * SWING_RATE * math.cos(SWING_RATE * t)

    offset, time = 0.0, 0.0
    critical = math.asin(min(1.0, 1.0 / ratio)) / SWING_RATE
    half = math.pi / SWING_RATE
    while ratio > 1.0:
        # Next instant at which the plate's acceleration outgrows friction: it is -a w^2 sin(w t).
        turns = math.floor(time / half)
        release = turns * half + critical
        if release < time:
            # Inside the part of the swing where the plate is too fast, it lets go at once.
            release = time if time < (turns + 1) * half - critical else release + half
        if release >= end:
            break
        sign = -math.copysign(1.0, math.sin(SWING_RATE * (release + 1e-9 * half)))
        place, speed = offset + plate(release), plate_speed(release)

        def slip(t: float, release: float = release, speed: float = speed, sign: float = sign) -> float:
            return sign * (plate_speed(t) - (speed + sign * most * (t - release)))

        low = release + 1e-3 * half
        high = low
        while slip(high) > 0.0:
            high += 1e-2 * half
        time = brentq(slip, max(low, high - 1e-2 * half), high, xtol=1e-15)
        if time >= end:
            return place + speed * (end - release) + 0.5 * sign * most * (end - release) ** 2
        offset = place + speed * (time - release) + 0.5 * sign * most * (time - release) ** 2 - plate(time)
    return offset + plate(end)


def measure_swing(ratio: float, recording: Recording) -> dict[str, float]:
    truth = swing_motion(ratio, recording.time[-1])
    return {"position": abs(recording.position[-1, 1, 0] - truth) / swing_amplitude(ratio)}


CASES = tuple(
    HardCase(
        f"swing_{name}", 24, f"A box on a plate that swings with {ratio} times what friction can hold",
        "the stick-slip motion in closed form between its events", partial(swinging_plate, ratio), 2.0,
        partial(measure_swing, ratio), "position", "amplitudes", 1e-3, goal={240: 1e-4}, drive=partial(swing, ratio),
    )
    for name, ratio in (("sticks", 0.95), ("slips", 1.6))
)  # fmt: skip
