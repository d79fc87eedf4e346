"""Bodies that fall into a scene, one after the other: what a demo is, whatever stands in it.

A ``Demo`` builds a world from the scene of its subclass, drops bodies into it at an even rate, and takes out those that
left, or the oldest when there are too many.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from ..errors import PhysicsError
from ..options import Options
from ..scene import Scene
from ..shapes import Box, ConvexHull, Shape, Sphere
from ..world import World

GOLDEN = 0.5 * (1.0 + math.sqrt(5.0))

Vector = NDArray[np.float64]


def octahedron(radius: float) -> ConvexHull:
    """A regular octahedron; ``radius`` [m] is that of its corners."""
    return ConvexHull(radius * np.concatenate([np.eye(3), -np.eye(3)]))


def dodecahedron(radius: float) -> ConvexHull:
    """A regular dodecahedron; ``radius`` [m] is that of its corners."""
    cube = np.array([(x, y, z) for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
    # The other twelve corners are (0, +-1/g, +-g) and its cyclic permutations.
    roof = np.array([(0.0, y / GOLDEN, z * GOLDEN) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
    corners = np.concatenate([cube, *(np.roll(roof, shift, axis=1) for shift in range(3))])
    return ConvexHull(radius / math.sqrt(3.0) * corners)


def falling_shapes(size: float) -> list[Shape]:
    """The shapes that rain: cuboids, spheres, octahedra, dodecahedra, of about ``size`` [m] across."""
    half = 0.5 * size
    return [
        Box((half, 0.8 * half, 0.6 * half)),
        Box((0.7 * half, 0.7 * half, 0.7 * half)),
        Sphere(half),
        Sphere(0.7 * half),
        octahedron(1.2 * half),
        dodecahedron(half),
    ]


def random_orientation(generator: np.random.Generator) -> Vector:
    """(4,) uniform over all rotations: a normal vector in four dimensions has no preferred direction."""
    q = generator.normal(size=4)
    return q / np.linalg.norm(q)


class Demo(ABC):
    """A world that bodies fall into.

    Args:
        seed: of where and how they start; ``reset`` begins the same sequence anew.
        options: of the world.

    Attributes:
        world: the running world, ``num_worlds=1``.
    """

    name: ClassVar[str]
    title: ClassVar[str]
    description: ClassVar[str]
    interval: ClassVar[float]  # [s] between two bodies
    max_bodies: ClassVar[int]  # the oldest makes room for the next

    def __init__(self, seed: int = 0, options: Options | None = None) -> None:
        self.seed = seed
        self.options = options or Options()
        self.shapes = self.make_shapes()
        self.reset()

    @abstractmethod
    def make_shapes(self) -> list[Shape]:
        """What falls; bodies of one form share it."""

    @abstractmethod
    def make_scene(self) -> Scene:
        """What stands, and what pulls."""

    @abstractmethod
    def start(self) -> dict[str, Any]:
        """Where and how the next body starts: arguments of World.add_body."""

    @abstractmethod
    def has_left(self, position: Vector) -> NDArray[np.bool_]:
        """(bodies,) which of the bodies at ``position`` (bodies, 3) [m] are gone for good."""

    def reset(self) -> None:
        """Begin anew."""
        self.generator = np.random.default_rng(self.seed)
        self.world = World(self.make_scene(), options=self.options)
        self.time = 0.0  # [s]
        self._next = 0.0  # [s] when the next body falls
        self._moving: list[int] = []  # handles of the bodies that fell, the oldest first

    def advance(self, num_steps: int = 1) -> None:
        """Take steps of the world; a body whose motion the engine cannot go on with is taken out."""
        if self.time >= self._next:
            self._next += self.interval
            self._drop()
        self.drive(num_steps * self.options.time_step)
        try:
            self.world.step(num_steps)
        except PhysicsError as error:
            names = [repr(body.name) if body else "" for body in self.world.scene.bodies]
            for _, name, *_ in error.failures:
                self._take_out(names.index(name))
        self.time += num_steps * self.options.time_step
        if self._moving:
            gone = self.has_left(self.world.position[0, self._moving])
            for handle in [handle for handle, left in zip(self._moving, gone, strict=True) if left]:
                self._take_out(handle)

    def drive(self, duration: float) -> None:  # noqa: B027
        """Move what the demo moves by itself over the next ``duration`` [s]."""

    def _drop(self) -> None:
        if len(self._moving) >= self.max_bodies:
            self._take_out(self._moving[0])
        shape = self.shapes[self.generator.integers(len(self.shapes))]
        orientation = random_orientation(self.generator)
        self._moving.append(self.world.add_body(shape, orientation=orientation, **self.start()))

    def _take_out(self, handle: int) -> None:
        self.world.remove_body(handle)
        self._moving.remove(handle)
