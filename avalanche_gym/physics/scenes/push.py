"""The small scene that throughput is measured on: a ball and a box on a few hills, pushed every 20 ms."""

from __future__ import annotations

import numpy as np

from ..scene import Material, Scene, UniformGravity
from ..shapes import Box, HeightField, Sphere
from .case import GRAVITY

PUSH_STEP, PUSH_STEPS = 0.005, 4  # [s] and steps between two pushes
PUSHED, PUSH = 2, 0.6  # handle of the box, largest impulse [N s]
REST, REST_TURN = (-0.017627, 0.000488, 0.101062), (0.997874, -0.000632, -0.064811, 0.006775)  # of the box, settled


def push_scene() -> Scene:
    """A box of 1 kg at rest, to be pushed, and a ball of 0.5 kg in its way, on 33 x 33 samples of gentle hills."""
    line = np.linspace(-2.0, 2.0, 33)
    x, y = np.meshgrid(line, line)
    heights = 0.08 * np.sin(1.7 * x) * np.cos(1.3 * y) + 0.05 * (x**2 + y**2)
    scene = Scene()
    scene.add_field(UniformGravity((0.0, 0.0, -GRAVITY)))
    material = Material(friction=0.6)
    scene.add_body(HeightField(heights, (4.0, 4.0)), motion="static", material=material)
    scene.add_body(Sphere(0.12), mass=0.5, position=(0.24602, 0.09939, 0.157088), material=material)
    scene.add_body(Box((0.15, 0.15, 0.1)), mass=1.0, position=REST, orientation=REST_TURN, material=material)
    return scene


def push_impulses(generator: np.random.Generator, count: int) -> np.ndarray:
    """(count, 3) [N s] level pushes in random directions."""
    impulses = np.zeros((count, 3))
    impulses[:, :2] = generator.uniform(-PUSH, PUSH, (count, 2))
    return impulses
