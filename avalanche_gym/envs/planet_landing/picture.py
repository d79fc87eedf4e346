"""How PlanetLanding looks: a moon against the stars, the lander, its flame and the site."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...rendering import AGENT, MOON, SPACE, Camera, Lighting, Marker, WorldView, as_planet, geometry_of, primitives
from ..picture import Picture
from .scene import PLANET_RADIUS, turn_from_z

if TYPE_CHECKING:
    from .env import PlanetLandingTask

Vector = NDArray[np.float64]

FLAME = 0.6  # [m] length at full thrust
RING = (-1.2, 0.35)  # [m] bottom and top of the ring about the site: deep enough for hollows
BEACON = 5.0  # [m] height of the beam in its middle, which is seen from behind the horizon
# [m/s] at which the direction of motion and the axes of the world count the same for where the camera stands.
SLOW = 0.6


class PlanetLandingPicture(Picture):
    """See Picture."""

    task: PlanetLandingTask

    def make_view(self) -> WorldView:
        radius = max(float(self.task.ranges.site_radius[0]), 0.1)
        drop = 0.5 * radius**2 / PLANET_RADIUS  # of the round ground from the middle of the site to its rim
        self._ring = primitives.band(radius, RING[0] - drop, RING[1] - drop)
        self._beacon = primitives.beam(0.15, RING[0], BEACON)
        self._flame = primitives.capsule(0.08, 0.5 * FLAME)
        planet = as_planet(geometry_of(self.task.planet), MOON)
        return WorldView(self.task.world, colors={"lander": AGENT}, geometries={"planet": planet})

    def _directions(self, lane: int) -> tuple[Vector, Vector]:
        """Unit vectors: up, and the level one that the camera looks along, which shows the motion from the side."""
        place = self.task.world.position[lane, self.task.lander]
        velocity = self.task.world.linear_velocity[lane, self.task.lander]
        up = place / np.linalg.norm(place)
        standing = np.cross(up, np.eye(3)[np.argmin(np.abs(up))])
        ahead = np.cross(velocity, up) + SLOW * standing / np.linalg.norm(standing)
        state = self.task.lanes[lane]
        if state["site_radius"] > 0.0:
            # Rather look towards the site while it is far.
            to_site = np.array(state["site"]) - up * (up @ state["site"])
            ahead = ahead / np.linalg.norm(ahead) + 4.0 * to_site
        return up, ahead / np.linalg.norm(ahead)

    def lighting(self, lane: int) -> Lighting:
        # The sun stands high behind the camera, wherever the lander is: no landing at night, none against the light.
        up, ahead = self._directions(lane)
        sun = up - 0.5 * ahead + 0.6 * np.cross(ahead, up)
        return replace(SPACE, sun=tuple(np.round(sun, 1).tolist()))

    def camera(self, lane: int) -> Camera:
        up, ahead = self._directions(lane)
        altitude = float(self.task.lanes["altitude"][lane])
        # Between lander and ground, so that both are seen.
        target = self.task.world.position[lane, self.task.lander] - 0.4 * altitude * up
        distance, height = 4.5 + 1.3 * altitude, 1.8 + 0.5 * altitude
        return Camera.follow(target, ahead.tolist(), distance=distance, height=height, up=up.tolist())

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
            turn = turn_from_z(site)
            shown.append(Marker(self._ring, tuple(place), turn, opacity=0.6))
            shown.append(Marker(self._beacon, tuple(place), turn, opacity=0.9))
        return shown
