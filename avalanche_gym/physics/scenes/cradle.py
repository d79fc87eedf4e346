"""Newton's cradle: free spheres in a row, k in, k out."""

from __future__ import annotations

import numpy as np

from ..scene import Material, Scene
from ..shapes import Sphere
from .case import HardCase, Recording

BALLS, RADIUS, SPEED, GAP = 5, 0.1, 1.0, 0.25  # gap [m] that the striking balls fly first
STRIKERS = (1, 2, 3)


def cradle() -> Scene:
    """Rows of five touching spheres, without gravity and friction; into each fly as many as it has number."""
    scene = Scene()
    material = Material(friction=0.0, restitution=1.0)
    for row, strikers in enumerate(STRIKERS):
        for ball in range(BALLS):
            strikes = ball < strikers
            place = (2 * RADIUS * ball - (GAP if strikes else 0.0), float(row), 0.0)
            speed = (SPEED if strikes else 0.0, 0.0, 0.0)
            scene.add_body(Sphere(RADIUS), mass=1.0, position=place, linear_velocity=speed, material=material)
    return scene


def measure_cradle(recording: Recording) -> dict[str, float]:
    speed = recording.linear_velocity[-1].reshape(len(STRIKERS), BALLS, 3)
    place = recording.position[-1].reshape(len(STRIKERS), BALLS, 3)[:, :, 0]
    truth = np.array([[SPEED if ball >= BALLS - strikers else 0.0 for ball in range(BALLS)] for strikers in STRIKERS])
    # The striking train becomes part of the row at GAP / SPEED; as many leave at the other end at that instant, and
    # those that stay have moved up by what the strikers flew.
    left = recording.time[-1] - GAP / SPEED
    path = 2 * RADIUS * np.arange(BALLS) + np.where(truth > 0.0, left * SPEED, 0.0)
    struck = np.array([float(strikers) for strikers in STRIKERS])
    return {
        "velocity": max(np.abs(speed[:, :, 0] - truth).max(), np.abs(speed[:, :, 1:]).max()) / SPEED,
        "place": np.abs(place - path).max() / RADIUS,
        "momentum": np.abs(speed[:, :, 0].sum(axis=1) / (SPEED * struck) - 1.0).max(),
        "energy": np.abs((speed**2).sum(axis=(1, 2)) / (SPEED**2 * struck) - 1.0).max(),
    }


CASES = (
    HardCase(
        "cradle", 16, "Newton's cradle of free spheres, 1, 2 and 3 in", "as many out, with the same speed", cradle, 0.6,
        measure_cradle, "velocity", "relative", 1e-9, goal={60: 1e-12, 240: 1e-12, 960: 1e-12}, order=False,
    ),
)  # fmt: skip
