"""What is drawn to look inside: which bodies rest, and the cells of the broad phase."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..physics.world import World

REST_SPEED = 0.02  # [sizes of the body per second] below which a body seems to stand still
REST_TIME = 0.5  # [s] that it must do so, so that the top of a bounce is no rest


class RestWatch:
    """Tells which bodies stand still, by watching them."""

    def __init__(self) -> None:
        self._world: World | None = None
        self._still = np.zeros(0)  # (bodies,) [s] that each has stood still
        self._bodies: list[object] = []
        self._radius = np.zeros(0)

    def update(self, world: World, duration: float) -> NDArray[np.bool_]:
        """(bodies,) whether each is at rest; ``duration`` [s] has passed since the last call."""
        bodies = world.scene.bodies
        if bodies != self._bodies:
            still = np.zeros(len(bodies))
            same = [index for index, (a, b) in enumerate(zip(bodies, self._bodies, strict=False)) if a is b]
            still[same] = self._still[same]
            self._still, self._bodies = still, list(bodies)
            # What cannot move does not rest, it stands: the comparison with NaN is false, as it is for removed bodies.
            self._radius = np.array(
                [body.shape.bounding_radius if body and body.motion == "dynamic" else np.nan for body in bodies]
            )
        linear = np.abs(world.linear_velocity[0]).max(axis=1)
        angular = np.abs(world.angular_velocity[0]).max(axis=1)
        slow = linear + angular * self._radius <= 2.0 * REST_SPEED * self._radius
        self._still = np.where(slow, self._still + duration, 0.0)
        return self._still >= REST_TIME


def occupied_cells(world: World) -> NDArray[np.float64]:
    """(n, 4) lowest corner [m] and edge [m] of the cells of a uniform grid that moving bodies lie in.

    The edge is the diameter of the largest body, so that no body reaches into more than eight cells.
    """
    moving = [index for index, body in enumerate(world.scene.bodies) if body is not None and body.motion == "dynamic"]
    if not moving:
        return np.zeros((0, 4))
    radius = np.array([world.scene.bodies[index].shape.bounding_radius for index in moving])  # type: ignore[union-attr]
    center = world.position[0, moving]
    edge = 2.0 * float(radius.max())
    low = np.floor((center - radius[:, None]) / edge).astype(np.int64)
    high = np.floor((center + radius[:, None]) / edge).astype(np.int64)
    corners = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)])
    cells = np.unique(np.where(corners[:, None] == 1, high, low).reshape(-1, 3), axis=0)
    return np.concatenate([cells * edge, np.full((len(cells), 1), edge)], axis=1)
