"""How PushTerrain looks: terrain, pusher, body, and the goal as a ring of light."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ...rendering import AGENT, Camera, Marker, WorldView, goal_markers
from ..picture import Picture
from .scene import height_at

if TYPE_CHECKING:
    from .env import PushTerrainTask

BODY = "#7a6fe0"


class PushTerrainPicture(Picture):
    """See Picture."""

    task: PushTerrainTask

    def make_view(self) -> WorldView:
        return WorldView(self.task.world, colors={"pusher": AGENT, "body": BODY})

    def prepare(self, lane: int) -> None:
        self.view.set_heights(self.task.ground, self.task.heights[lane])

    def camera(self, lane: int) -> Camera:
        # The middle between body and goal, from near enough to see both well.
        body, goal = self.task.world.position[lane, self.task.body], self.task.lanes["goal"][lane]
        middle = (0.5 * (body[0] + goal[0]), 0.5 * (body[1] + goal[1]), float(body[2]))
        return Camera.orbit(target=middle, distance=4.4, azimuth=-60.0, elevation=32.0)

    def markers(self, lane: int) -> list[Marker]:
        state = self.task.lanes[lane]
        x, y = map(float, state["goal"])
        place = (x, y, float(height_at(self.task.heights[lane], x, y)))
        return goal_markers(place, float(state["goal_radius"]), height=0.6)
