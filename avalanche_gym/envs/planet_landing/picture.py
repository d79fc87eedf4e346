"""How PlanetLanding looks: a moon against the stars, the lander, its flame and the site."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ...rendering import AGENT, MOON, SPACE, Camera, Lighting, Marker, WorldView, as_planet, geometry_of, primitives
from ..picture import Picture
from .scene import PLANET_RADIUS, turn_from_z

if TYPE_CHECKING:
    from .env import PlanetLandingTask

FLAME = 0.6  # [m] length at full thrust
BEAM_HEIGHT = 1.0  # [m]


class PlanetLandingPicture(Picture):
    """See Picture."""

    task: PlanetLandingTask

    def make_view(self) -> WorldView:
        self._site = primitives.beam(max(float(self.task.ranges.site_radius[0]), 0.1), -BEAM_HEIGHT, BEAM_HEIGHT)
        self._flame = primitives.capsule(0.08, 0.5 * FLAME)
        planet = as_planet(geometry_of(self.task.planet), MOON)
        return WorldView(self.task.world, colors={"lander": AGENT}, geometries={"planet": planet})

    def lighting(self, lane: int) -> Lighting:
        # The sun stands high wherever the lander is: no picture of a landing at night.
        up = self.task.world.position[lane, self.task.lander]
        up = up / np.linalg.norm(up)
        side = np.cross(up, np.eye(3)[np.argmin(np.abs(up))])
        sun = up + 0.8 * side / np.linalg.norm(side)
        return replace(SPACE, sun=tuple(np.round(sun, 1).tolist()))

    def camera(self, lane: int) -> Camera:
        world, lander = self.task.world, self.task.lander
        place, velocity = world.position[lane, lander], world.linear_velocity[lane, lander]
        up = place / np.linalg.norm(place)
        # Seen from the side of its motion; standing still, from where the world's axes say.
        side = np.cross(velocity, up)
        if np.linalg.norm(side) < 0.2:
            side = np.cross(up, np.eye(3)[np.argmin(np.abs(up))])
        altitude = float(self.task.lanes["altitude"][lane])
        return Camera.follow(place, side.tolist(), distance=5.0 + altitude, height=1.5 + 0.3 * altitude, up=up)

    def markers(self, lane: int) -> list[Marker]:
        state, world, lander = self.task.lanes[lane], self.task.world, self.task.lander
        shown = []
        share = float(state["burnt"]) / (self.task.control_interval * self.task.max_thrust)
        if share > 0.05:
            q = world.orientation[lane, lander]
            w, x, y, z = q
            axis = np.array([2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)])
            place = world.position[lane, lander] - axis * (0.2 + 0.5 * FLAME * share)
            shown.append(Marker(self._flame, tuple(place), tuple(q), color="#ffb347", opacity=0.3 + 0.6 * share))
        if state["site_radius"] > 0.0:
            site = tuple(float(value) for value in state["site"])
            place = PLANET_RADIUS * np.array(site)
            shown.append(Marker(self._site, tuple(place), turn_from_z(site)))
        return shown
