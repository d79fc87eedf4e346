"""The demos as shows: how each looks and from where it is seen."""

from __future__ import annotations

from dataclasses import dataclass, field

from ..physics.scenes.demos import DEMOS, PLANET_RADIUS, TERRAIN_HEIGHT, Carpet, Planet, Showcase, Terrain
from ..physics.scenes.falling_bodies import Demo
from ..physics.shapes import HeightField
from ..physics.world import World
from ..rendering import (
    DAY,
    DUNES,
    MOON,
    SPACE,
    BodyLooks,
    Camera,
    Geometry,
    Lighting,
    as_planet,
    as_terrain,
    geometry_of,
    primitives,
)
from .show import Show

FRAME_RATE = 60.0  # [1/s] frames at real time


@dataclass(frozen=True)
class DemoPicture:
    """How a demo looks."""

    camera: Camera
    lighting: Lighting = DAY
    colors: dict[str, str] = field(default_factory=dict)
    geometries: dict[str, Geometry] = field(default_factory=dict)


def picture_of(demo: Demo) -> DemoPicture:
    """How this demo looks."""
    ground = demo.world.scene.bodies[0]
    assert ground is not None
    shape = ground.shape
    if isinstance(demo, Planet):
        camera = Camera.orbit((0.0, 0.0, 0.0), 4.5 * PLANET_RADIUS, -105.0, 22.0)
        return DemoPicture(camera, SPACE, geometries={ground.name: as_planet(geometry_of(shape), MOON)})
    if isinstance(demo, Carpet):
        assert isinstance(shape, HeightField)
        cloth = as_terrain(primitives.height_field(shape.heights, shape.extent, skirt=0.0), DUNES)
        # A cloth is of one colour; its waves show by light and shade.
        cloth = cloth.with_options(colors=None, cells=(1.5, 1.5, float("inf")), contrast=0.1)
        camera = Camera.orbit((0.0, 0.0, 0.0), 36.0, -60.0, 28.0)
        return DemoPicture(camera, colors={ground.name: "#5f7fb5"}, geometries={ground.name: cloth})
    if isinstance(demo, Terrain):
        return DemoPicture(Camera.orbit((0.0, 0.0, 0.3 * TERRAIN_HEIGHT), 34.0, -60.0, 30.0))
    assert isinstance(demo, Showcase)
    slab = geometry_of(shape).with_options(cells=(2.0, 2.0, float("inf")), contrast=0.06)
    return DemoPicture(Camera.orbit((0.0, 0.0, 1.0), 30.0, -60.0, 24.0), geometries={ground.name: slab})


class DemoShow(Show):
    """One of the demos of ``avalanche_gym.physics.scenes.demos``."""

    def __init__(self, name: str, seed: int = 0) -> None:
        self.demo = DEMOS[name](seed)
        self.name = name
        self.title = self.demo.title
        self.description = self.demo.description
        self._picture = picture_of(self.demo)
        self.looks = BodyLooks(self._picture.colors, self._picture.geometries)

    @property
    def world(self) -> World:
        return self.demo.world

    def advance(self, speed: float) -> float:
        time_step = self.demo.options.time_step
        num_steps = max(1, round(speed / (FRAME_RATE * time_step)))
        self._step(num_steps)
        return num_steps * time_step

    def single_step(self) -> None:
        self._step(1)

    def _step(self, num_steps: int) -> None:
        self.demo.advance(num_steps)
        self.energy_change += float(self.world.report().energy_change[0])

    def reset(self) -> None:
        self.demo.reset()
        self.energy_change = 0.0

    def camera(self) -> Camera:
        return self._picture.camera

    def lighting(self) -> Lighting:
        return self._picture.lighting

    @property
    def point_gravity(self) -> bool | None:
        return self.demo.has_point_gravity if isinstance(self.demo, Terrain) else None

    def set_point_gravity(self, on: bool) -> None:
        if not isinstance(self.demo, Terrain):
            return super().set_point_gravity(on)
        return self.demo.set_point_gravity(on)
