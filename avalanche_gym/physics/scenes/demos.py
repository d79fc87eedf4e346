"""The four demos: bodies rain on a slab, on frictionless terrain, on a waving carpet, and orbit a small planet.

Each is a scene function, which says what stands and what pulls, and a ``Demo``, which says what falls and when it has
left (falling_bodies.py). Shapes, extents, rates and gravity are those of the Avalanche Engine's demos, with z up.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..scene import Material, PointGravity, Scene, UniformGravity
from ..shapes import Box, HeightField, Shape
from ..shapes.planet import bumpy_planet
from ..shapes.terrain import grid, octaves
from ..world import World
from .falling_bodies import Demo, Vector, falling_shapes

GRAVITY = UniformGravity((0.0, 0.0, -9.81))  # [m/s^2]
DENSITY = 1.0  # [kg/m^3] light enough that energies are numbers one can read


def showcase_scene() -> Scene:
    """A slab of 20 x 20 x 1 m, its top at z = 0."""
    scene = Scene()
    scene.add_field(GRAVITY)
    material = Material(friction=0.5, restitution=0.7)
    scene.add_body(Box((10.0, 10.0, 0.5)), motion="static", position=(0, 0, -0.5), material=material, name="slab")
    return scene


class Showcase(Demo):
    """Cuboids, spheres, octahedra and dodecahedra rain on a slab, one a second."""

    name = "showcase"
    title = "Showcase"
    description = "Bodies rain on a slab, one a second. Click one to kick it."
    interval = 1.0
    max_bodies = 60  # what one core steps in real time, all of them in contact

    material = Material(friction=0.5, restitution=0.5)

    def make_shapes(self) -> list[Shape]:
        return falling_shapes(1.6)

    def make_scene(self) -> Scene:
        return showcase_scene()

    def start(self) -> dict[str, Any]:
        x, y = self.generator.uniform(-5.0, 5.0, 2)
        spin = self.generator.normal(0.0, 1.5, 3)
        return {"position": (x, y, 9.0), "angular_velocity": spin, "density": DENSITY, "material": self.material}

    def has_left(self, position: Vector) -> NDArray[np.bool_]:
        return position[:, 2] < -15.0


TERRAIN_SIZE = 20.0  # [m]
TERRAIN_HEIGHT = 8.0  # [m]
TERRAIN_SAMPLES = 65


def terrain_scene() -> Scene:
    """Hills of 20 x 20 m, heights 0 to 8 m, without friction."""
    scene = Scene()
    scene.add_field(GRAVITY)
    size = (TERRAIN_SIZE, TERRAIN_SIZE)
    x, y = grid(TERRAIN_SAMPLES, TERRAIN_SAMPLES, size)
    hills = octaves(
        TERRAIN_SAMPLES, TERRAIN_SAMPLES, size, np.random.default_rng(4), amplitude=3.0, period=9.0, count=3
    )
    # A mountain in the middle, so that bodies find a way down and off.
    heights = hills + 6.0 * np.exp(-(x * x + y * y) / 60.0)
    heights = TERRAIN_HEIGHT * (heights - heights.min()) / np.ptp(heights)
    ground = HeightField(heights, size)
    scene.add_body(ground, motion="static", material=Material(friction=0.0), name="terrain")
    return scene


class Terrain(Demo):
    """Twelve bodies a second slide down hills without friction; gravity can be switched to a point below them."""

    name = "terrain"
    title = "Terrain"
    description = "Twelve bodies a second slide down hills without friction. Key G: gravity towards a point."
    interval = 1.0 / 12.0
    max_bodies = 100

    material = Material(friction=0.0, restitution=0.3)
    # Below the middle of the hills; as strong as the other gravity 10 m above it.
    point = PointGravity((0.0, 0.0, -5.0), 981.0)  # [m], [m^3/s^2]

    def make_shapes(self) -> list[Shape]:
        return falling_shapes(0.8)

    def make_scene(self) -> Scene:
        return terrain_scene()

    def start(self) -> dict[str, Any]:
        x, y = self.generator.uniform(-4.0, 4.0, 2)
        return {"position": (x, y, TERRAIN_HEIGHT + 3.0), "density": DENSITY, "material": self.material}

    def has_left(self, position: Vector) -> NDArray[np.bool_]:
        return (position[:, 2] < -10.0) | (np.abs(position).max(axis=1) > 3.0 * TERRAIN_SIZE)

    @property
    def has_point_gravity(self) -> bool:
        return any(isinstance(field, PointGravity) for field in self.world.scene.fields)

    def set_point_gravity(self, on: bool) -> None:
        """Pull towards a point instead of down, or down again; every body keeps its motion."""
        scene = self.world.scene.copy()
        scene.fields = [self.point if on else GRAVITY]
        old, self.world = self.world, World(scene, options=self.options)
        for handle in self._moving:
            self.world.set_state(
                handle,
                position=old.position[0, handle],
                orientation=old.orientation[0, handle],
                linear_velocity=old.linear_velocity[0, handle],
                angular_velocity=old.angular_velocity[0, handle],
            )


CARPET_SIZE = 30.0  # [m]
CARPET_SAMPLES = 61
WAVE_HEIGHT = 0.8  # [m]
WAVE_LENGTH = 10.0  # [m]
WAVE_PERIOD = 4.0  # [s]


def carpet_heights(time: float) -> Vector:
    """(samples, samples) [m] heights of the carpet at ``time`` [s]: a wave along x, a slower one across."""
    x, y = grid(CARPET_SAMPLES, CARPET_SAMPLES, (CARPET_SIZE, CARPET_SIZE))
    along = np.sin(2.0 * np.pi * (x / WAVE_LENGTH - time / WAVE_PERIOD))
    across = np.sin(2.0 * np.pi * (y / (1.7 * WAVE_LENGTH) - time / (2.3 * WAVE_PERIOD)))
    return WAVE_HEIGHT * (along + 0.6 * across)


def carpet_scene() -> Scene:
    """A carpet of 30 x 30 m in its first shape."""
    scene = Scene()
    scene.add_field(GRAVITY)
    carpet = HeightField(carpet_heights(0.0), (CARPET_SIZE, CARPET_SIZE))
    scene.add_body(carpet, motion="kinematic", material=Material(friction=0.6, restitution=0.5), name="carpet")
    return scene


class Carpet(Demo):
    """Waves run through a carpet and carry the bodies that fall on it."""

    name = "carpet"
    title = "Carpet"
    description = "Waves run through the ground and carry what falls on it."
    interval = 1.0
    max_bodies = 60

    material = Material(friction=0.6, restitution=0.5)

    def make_shapes(self) -> list[Shape]:
        return falling_shapes(1.6)

    def make_scene(self) -> Scene:
        return carpet_scene()

    def drive(self, duration: float) -> None:
        # Heights advance at even rates within the call and arrive at the wave of its end, so the ground never jumps.
        now, then = carpet_heights(self.time), carpet_heights(self.time + duration)
        self.world.set_heights(0, now, (then - now) / duration)

    def start(self) -> dict[str, Any]:
        x, y = self.generator.uniform(-8.0, 8.0, 2)
        return {"position": (x, y, 7.0), "density": DENSITY, "material": self.material}

    def has_left(self, position: Vector) -> NDArray[np.bool_]:
        return position[:, 2] < -15.0


PLANET_RADIUS = 5.0  # [m]
PLANET_MU = 100.0  # [m^3/s^2]: 4 m/s^2 on the ground


def planet_scene() -> Scene:
    """A bumpy planet of radius 5 m with mu = 100 m^3/s^2 about the origin."""
    scene = Scene()
    scene.add_field(PointGravity((0.0, 0.0, 0.0), PLANET_MU))
    ground = bumpy_planet(PLANET_RADIUS, np.random.default_rng(3), amplitude=0.07, bumps=120, width=0.16)
    material = Material(friction=0.5, restitution=0.5)
    scene.add_body(ground, motion="static", material=material, name="planet")
    return scene


class Planet(Demo):
    """Bodies come in around a small planet, bounce, roll into its hollows and stay."""

    name = "planet"
    title = "Small planet"
    description = "Bodies fly by, fall, bounce and come to rest all around a small planet."
    interval = 3.3
    max_bodies = 60

    material = Material(friction=0.5, restitution=0.5)

    def make_shapes(self) -> list[Shape]:
        return falling_shapes(0.9)

    def make_scene(self) -> Scene:
        return planet_scene()

    def start(self) -> dict[str, Any]:
        up = self.generator.normal(size=3)
        up /= np.linalg.norm(up)
        side = np.cross(up, self.generator.normal(size=3))
        side /= np.linalg.norm(side)
        radius = self.generator.uniform(1.8, 2.4) * PLANET_RADIUS
        # Slower than a circular orbit by enough to come down within the first turn.
        speed = self.generator.uniform(0.3, 0.7) * math.sqrt(PLANET_MU / radius)
        spin = self.generator.normal(0.0, 1.0, 3)
        return {
            "position": radius * up,
            "linear_velocity": speed * side,
            "angular_velocity": spin,
            "density": DENSITY,
            "material": self.material,
        }

    def has_left(self, position: Vector) -> NDArray[np.bool_]:
        return np.linalg.norm(position, axis=1) > 20.0 * PLANET_RADIUS


DEMOS: dict[str, type[Demo]] = {demo.name: demo for demo in (Showcase, Terrain, Carpet, Planet)}
