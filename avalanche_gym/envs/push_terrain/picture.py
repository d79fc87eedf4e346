"""How PushTerrain looks: terrain, pusher, body, and the goal as a translucent beam."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ...rendering import AGENT, Camera, Geometry, Marker, WorldView, primitives
from ..picture import Picture
from .scene import height_at

if TYPE_CHECKING:
    from .env import PushTerrainTask

BEAM_HEIGHT = 0.5  # [m] of the goal's beam above and below the ground


class PushTerrainPicture(Picture):
    """See Picture."""

    task: PushTerrainTask

    def make_view(self) -> WorldView:
        self._beams: dict[float, Geometry] = {}
        return WorldView(self.task.world, colors={"pusher": AGENT, "body": "#d9a441"})

    def prepare(self, lane: int) -> None:
        self.view.set_heights(self.task.ground, self.task.heights[lane])

    def camera(self, lane: int) -> Camera:
        x, y, z = self.task.world.position[lane, self.task.body]
        return Camera.orbit(target=(0.5 * x, 0.5 * y, 0.5 * z), distance=6.0, azimuth=-60.0, elevation=35.0)

    def markers(self, lane: int) -> list[Marker]:
        state = self.task.lanes[lane]
        x, y = map(float, state["goal"])
        radius = float(state["goal_radius"])
        if radius not in self._beams:
            self._beams[radius] = primitives.beam(radius, -BEAM_HEIGHT, BEAM_HEIGHT)
        return [Marker(self._beams[radius], position=(x, y, float(height_at(self.task.heights[lane], x, y))))]
