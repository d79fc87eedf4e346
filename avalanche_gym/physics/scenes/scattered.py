"""Mixed bodies scattered over rolling terrain: islands stay small, so a step costs a body the same in any number."""

from __future__ import annotations

import math

import numpy as np

from ..scene import Scene, UniformGravity
from ..shapes import Box, Capsule, HeightField, Sphere
from .case import GRAVITY

PITCH = 0.5  # [m] between bodies
SAMPLES = 4  # of the terrain along a pitch


def scattered(count: int) -> Scene:
    """``count`` spheres, boxes and capsules of 8 to 15 cm that fall onto a terrain whose area grows with them."""
    generator = np.random.default_rng(count)
    scene = Scene()
    scene.add_field(UniformGravity((0.0, 0.0, -GRAVITY)))
    side = math.ceil(math.sqrt(count))
    width = PITCH * (side + 2)
    line = np.linspace(-0.5, 0.5, SAMPLES * (side + 2)) * width
    x, y = np.meshgrid(line, line)
    scene.add_body(HeightField(0.15 * np.sin(2.0 * x) * np.cos(1.7 * y), size=(width, width)), motion="static")
    for number in range(count):
        cell = np.array([number % side, number // side]) - 0.5 * (side - 1)
        place = PITCH * cell + generator.uniform(-0.1, 0.1, 2)
        size = generator.uniform(0.08, 0.15)
        shape = (Sphere(size), Box((size, 0.7 * size, 0.6 * size)), Capsule(0.5 * size, 0.6 * size))[number % 3]
        scene.add_body(shape, density=1000.0, position=(*place, 0.5))
    return scene
