"""Bounces: height after height, without loss, to rest, and flat on a face."""

from __future__ import annotations

import math
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..scene import Material, Scene, UniformGravity
from ..shapes import Box, Plane, Sphere
from .case import EVERY_STEP, GRAVITY, HardCase, Recording

RADIUS = 0.1  # [m] of every ball
LANES = (0.3, 0.5, 0.95)  # restitutions of balls side by side


def bouncing_balls(height: float, restitutions: tuple[float, ...]) -> Scene:
    """Balls that fall from ``height`` [m] of free fall onto a plane, 1 m apart."""
    scene = Scene()
    scene.add_field(UniformGravity((0.0, 0.0, -GRAVITY)))
    for lane, restitution in enumerate(restitutions):
        material = Material(friction=0.0, restitution=restitution)
        scene.add_body(Sphere(RADIUS), mass=1.0, position=(0.0, lane, RADIUS + height), material=material)
    scene.add_body(Plane(), motion="static", material=Material(friction=0.0, restitution=1.0))
    return scene


def bounce_heights(height: float, restitution: float, times: NDArray[np.float64]) -> NDArray[np.float64]:
    """[m] above the ground at ``times``: parabola after parabola until they have shrunk to nothing."""
    first = math.sqrt(2.0 * height / GRAVITY)
    end = first * (1 + restitution) / (1 - restitution) if restitution < 1.0 else math.inf
    found = []
    for time in times:
        if time >= end:
            found.append(0.0)
            continue
        begin, length, speed = -first, 2 * first, GRAVITY * first
        while time > begin + length and length > 0.0:
            begin += length
            length *= restitution
            speed *= restitution
        found.append((speed - 0.5 * GRAVITY * (time - begin)) * (time - begin))
    return np.array(found)


def apexes(recording: Recording, body: int) -> NDArray[np.float64]:
    """[m] heights of the bottom of a ball at the tops of its arcs; the parabola through the sample next to each top."""
    height = recording.position[:, body, 2] - RADIUS
    speed = recording.linear_velocity[:, body, 2]
    tops = np.flatnonzero((speed[:-1] > 0.0) & (speed[1:] <= 0.0))
    nearest = np.where(np.abs(speed[tops]) < np.abs(speed[tops + 1]), tops, tops + 1)
    return height[nearest] + speed[nearest] ** 2 / (2.0 * GRAVITY)


def measure_apexes(
    height: float, restitutions: tuple[float, ...], counts: tuple[int, ...], recording: Recording
) -> dict[str, float]:
    """The worst of the first tops, relative to each, and of the places at any time, relative to the first height."""
    errors = {"apex": 0.0, "position": 0.0}
    for lane, (restitution, count) in enumerate(zip(restitutions, counts, strict=True)):
        truth = height * restitution ** (2.0 * np.arange(1, count + 1))
        found = np.zeros(count)
        tops = apexes(recording, lane)[:count]
        found[: len(tops)] = tops
        errors["apex"] = max(errors["apex"], float(np.abs(found / truth - 1.0).max()))
        path = bounce_heights(height, restitution, recording.time)
        off = np.abs(recording.position[:, lane, 2] - RADIUS - path).max() / height
        errors["position"] = max(errors["position"], float(off))
    return errors


ZENO = 0.5  # restitution


def measure_rest(recording: Recording) -> dict[str, float]:
    """Height and speed once the ball should rest; when it last was above a thousandth of where it fell from."""
    end = math.sqrt(2.0 / GRAVITY) * (1 + ZENO) / (1 - ZENO)
    height = recording.position[:, 0, 2] - RADIUS
    rest = recording.time > end
    visible = bounce_heights(1.0, ZENO, recording.time) > 1e-3
    last = recording.time[np.flatnonzero(height > 1e-3)[-1]]
    return {
        "height": np.abs(height[rest]).max() / RADIUS,
        "speed": np.abs(recording.linear_velocity[rest, 0]).max(),
        "time of rest": abs(last / recording.time[np.flatnonzero(visible)[-1]] - 1.0),
        "path": np.abs(height - bounce_heights(1.0, ZENO, recording.time)).max(),
    }


FLAT_DROP, FLAT_RESTITUTION, FLAT_HALF = 0.5, 0.5, 0.1


def flat_drop() -> Scene:
    """A box that falls flat on a face."""
    scene = Scene()
    scene.add_field(UniformGravity((0.0, 0.0, -GRAVITY)))
    box = Box((0.2, 0.1, FLAT_HALF))
    material = Material(friction=0.5, restitution=FLAT_RESTITUTION)
    scene.add_body(box, mass=1.0, position=(0.0, 0.0, FLAT_HALF + FLAT_DROP), material=material)
    scene.add_body(Plane(), motion="static", material=Material(restitution=1.0))
    return scene


def measure_flat_drop(recording: Recording) -> dict[str, float]:
    height = recording.position[:, 0, 2] - FLAT_HALF
    speed = recording.linear_velocity[:, 0, 2]
    up = np.flatnonzero(speed > 0.0)
    rebound = 0.0
    if len(up):
        first = up[0]  # the speed at the ground, from the parabola that passes here
        rebound = math.sqrt(max(0.0, speed[first] ** 2 + 2.0 * GRAVITY * height[first]))
    truth = FLAT_RESTITUTION * math.sqrt(2.0 * GRAVITY * FLAT_DROP)
    return {
        "rebound": abs(rebound / truth - 1.0),
        "spin": np.abs(recording.angular_velocity[:, 0]).max(),
    }


def bounce_case(
    name: str, title: str, height: float, lanes: tuple[float, ...], counts: tuple[int, ...], **values: Any
) -> HardCase:
    return HardCase(
        name, 5, title, "h e^(2k) at the tops, parabolas between", partial(bouncing_balls, height, lanes),
        measure=partial(measure_apexes, height, lanes, counts), unit="relative", sampling=EVERY_STEP,
        **{"error": "apex", **values},
    )  # fmt: skip


CASES = (
    bounce_case(
        "bounce_e08", "Bounce, e = 0.8, four tops", 1.0, (0.8,), (4,), duration=2.8, passes_at=1e-6,
        goal={60: 1e-8, 240: 1e-8, 960: 1e-8},
    ),
    bounce_case(
        "bounce_path", "Bounce, e = 0.8, place at every instant", 1.0, (0.8,), (4,), duration=2.8, error="position",
        passes_at=1e-6, goal={60: 1e-8, 240: 1e-8, 960: 1e-8},
    ),
    bounce_case(
        "bounce_e1", "Bounce without loss for 20 s", 1.0, (1.0,), (21,), duration=20.0, passes_at=1e-8,
        goal={60: 1e-10, 240: 1e-10, 960: 1e-10},
    ),
    bounce_case(
        "rebound", "Rebound for e = 0.3, 0.5 and 0.95 from 2 m", 2.0, LANES, (1, 1, 1), duration=1.6, passes_at=1e-6,
        goal={60: 1e-8, 240: 1e-8, 960: 1e-8},
    ),
    HardCase(
        "zeno", 6, "A bouncing ball comes to rest", "at rest from t0 (1 + e) / (1 - e) on; parabolas before",
        partial(bouncing_balls, 1.0, (ZENO,)), 4.0, measure_rest, "height", "radii", 1e-9, sampling=EVERY_STEP,
        goal={60: 1e-9, 240: 1e-9}, order=False,
    ),
    HardCase(
        "flat_drop", 16, "A box dropped flat, e = 0.5", "rebounds flat with e sqrt(2 g h)", flat_drop, 0.6,
        measure_flat_drop, "rebound", "relative", 1e-6, sampling=EVERY_STEP, goal={60: 1e-10, 240: 1e-10},
    ),
)  # fmt: skip
