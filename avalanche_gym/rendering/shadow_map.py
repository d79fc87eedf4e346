"""Which part of a scene the shadow map covers, and when its static half is drawn again."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .camera import Camera, projection_record
from .lighting import Lighting
from .scene_view import SceneView
from .visibility import TRIANGLE, draw_instances

# Half a side of the map, in distances from the eye to its target, where the scene is larger than that; smaller is
# sharper.
REACH = 1.6
SNAP = 0.25  # the map's middle moves in steps of this share of its half side: in between, the static map stays valid
# Half sides are powers of this, so that a camera that draws near does not change the map in each frame.
GROWTH = 1.25


@dataclass(frozen=True)
class SunView:
    """How the sun sees: column, row [map pixels] and nearness [m] of a point are rows . point + offsets.

    Args:
        rows: (3, 3), world frame; the last one is the unit direction towards the sun.
        offsets: (3,).
        pixel: [m] side of a map pixel.
    """

    rows: NDArray[np.float64]
    offsets: NDArray[np.float64]
    pixel: float


class ShadowMap:
    """Depth maps of the sun for one renderer.

    Static surfaces are drawn once into a map of their own, which is copied before the moving ones are added.

    Args:
        resolution: [pixels] side of the map; 0 for no shadows.
    """

    def __init__(self, resolution: int) -> None:
        self._resolution = resolution
        # Without shadows there still is a map: everything lies outside of it, where the sun shines.
        size = max(resolution, 1)
        self._static = np.full((size, size), -np.inf, dtype=np.float32)
        self._depth = np.full((size, size), -np.inf, dtype=np.float32)
        self._ids = np.zeros((1, 1), dtype=np.int32)
        self._box = np.zeros(4, dtype=np.int64)
        self._triangles = np.zeros(0, dtype=TRIANGLE)
        self._drawn: tuple[object, ...] | None = None
        self._view: SceneView | None = None

    def draw(
        self, view: SceneView, camera: Camera, lighting: Lighting, projected: NDArray[np.void]
    ) -> tuple[SunView, NDArray[np.float32]]:
        """How the sun sees, and the map (n, n) of a frame; ``projected`` is scratch for the view's vertices."""
        center, half = self._region(view, camera)
        sun_view = self._sun_view(center, half, lighting)
        if self._resolution == 0:
            return sun_view, self._depth
        drawn = view.drawn()
        casting = drawn[(view.instances["casts_shadow"][drawn] == 1) & ~view.unbounded[drawn]]
        is_static = view.static[casting]
        key = (view.version, tuple(center), half, lighting.sun)
        if self._view is not view or self._drawn != key:
            self._static.fill(-np.inf)
            self._enter(view, casting[is_static], sun_view, projected, self._static)
            self._view, self._drawn = view, key
        np.copyto(self._depth, self._static)
        self._enter(view, casting[~is_static], sun_view, projected, self._depth)
        return sun_view, self._depth

    def _enter(
        self,
        view: SceneView,
        order: NDArray[np.int64],
        sun_view: SunView,
        projected: NDArray[np.void],
        depth: NDArray[np.float32],
    ) -> None:
        # Parallel rays: W is one everywhere.
        rows = np.insert(sun_view.rows, 2, 0.0, axis=0)
        offsets = np.insert(sun_view.offsets, 2, 1.0)
        # With the least number there is as near plane, nothing is too near.
        projection = projection_record(rows, offsets, np.finfo(np.float64).tiny, *depth.shape)
        draw_instances(
            view.instances,
            order,
            projection,
            view.vertices,
            view.faces,
            projected,
            self._triangles,
            depth,
            self._ids,
            self._box,
        )

    def _region(self, view: SceneView, camera: Camera) -> tuple[NDArray[np.float64], float]:
        """Middle (3,) and half side [m] of the map: the whole scene, or where that is large, about the target."""
        reach = REACH * camera.distance
        if view.size <= reach:
            return view.center, view.size
        half = GROWTH ** math.ceil(math.log(reach) / math.log(GROWTH))
        if half >= view.size:
            return view.center, view.size
        step = SNAP * half
        return np.round(np.array(camera.target) / step) * step, half

    def _sun_view(self, center: NDArray[np.float64], half: float, lighting: Lighting) -> SunView:
        sun = lighting.direction
        across = np.cross(np.eye(3)[np.argmin(np.abs(sun))], sun)
        across /= np.linalg.norm(across)
        scale = 0.5 * self._resolution / half
        # (across, down, away from the sun) is right-handed, as (right, down, forward) of a camera.
        rows = np.array([scale * across, scale * np.cross(-sun, across), sun])
        middle = 0.5 * (self._resolution - 1)
        return SunView(rows, (middle, middle, 0.0) - rows @ center, 2.0 * half / max(self._resolution, 1))
