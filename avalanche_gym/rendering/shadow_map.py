"""Which part of a scene the shadow map covers, and when its static half is drawn again."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from .camera import Camera
from .lighting import Lighting
from .scene_view import SceneView
from .shadow import MAPPED, SHADOW, draw_casters

# Half a side of the map, in distances from the eye to its target, where the scene is larger than that. Smaller is sharper.
REACH = 1.6
SNAP = 0.25  # the map's middle moves in steps of this share of its half side: in between, the static map stays valid
# Half sides are powers of this, so that a camera that draws near does not change the map in each frame.
GROWTH = 1.25


class ShadowMap:
    """Depth maps of the sun for one renderer.

    Args:
        resolution: [pixels] side of the map; 0 for no shadows.
    """

    def __init__(self, resolution: int) -> None:
        self._resolution = resolution
        # A map without shadows still is an array: everything lies outside of it, where the sun shines.
        size = max(resolution, 1)
        self._static = np.full((size, size), np.inf, dtype=np.float32)
        self._depth = np.full((size, size), np.inf, dtype=np.float32)
        self._mapped = np.zeros(0, dtype=MAPPED)
        self._drawn: tuple[object, ...] | None = None
        self._view: SceneView | None = None

    def draw(
        self, view: SceneView, camera: Camera, lighting: Lighting
    ) -> tuple[NDArray[np.void], NDArray[np.float32]]:
        """The SHADOW record (1,) and the map (n, n) [m] for a frame."""
        center, half = self._region(view, camera)
        record = self._record(center, half, lighting)
        if self._resolution == 0:
            return record, self._depth
        if len(self._mapped) < view.num_projected:
            self._mapped = np.zeros(view.num_projected, dtype=MAPPED)
        drawn = view.drawn()
        casting = drawn[(view.instances["casts_shadow"][drawn] == 1) & ~view.is_unbounded()[drawn]]
        key = (view.version, tuple(center), half, lighting.sun)
        if self._view is not view or self._drawn != key:
            self._static.fill(np.inf)
            self._enter(view, casting[view.static[casting]], record, self._static)
            self._view, self._drawn = view, key
        np.copyto(self._depth, self._static)
        self._enter(view, casting[~view.static[casting]], record, self._depth)
        return record, self._depth

    def _enter(
        self, view: SceneView, order: NDArray[np.int64], record: NDArray[np.void], depth: NDArray[np.float32]
    ) -> None:
        draw_casters(view.instances, order, record, view.vertices, view.faces, self._mapped, depth)

    def _region(self, view: SceneView, camera: Camera) -> tuple[NDArray[np.float64], float]:
        """Middle (3,) [m] and half side [m] of the map: the whole scene, or if it is large, what lies about the target."""
        reach = REACH * camera.distance
        if view.size <= reach:
            return view.center, view.size
        half = GROWTH ** math.ceil(math.log(reach) / math.log(GROWTH))
        if half >= view.size:
            return view.center, view.size
        step = SNAP * half
        return np.round(np.array(camera.target) / step) * step, half

    def _record(self, center: NDArray[np.float64], half: float, lighting: Lighting) -> NDArray[np.void]:
        sun = np.asarray(lighting.sun, dtype=np.float64)
        sun = sun / np.linalg.norm(sun)
        across = np.cross(np.eye(3)[np.argmin(np.abs(sun))], sun)
        across /= np.linalg.norm(across)
        record = np.zeros(1, dtype=SHADOW)
        record["sun"] = sun
        record["across"] = across
        record["along"] = np.cross(sun, across)
        record["center"] = center
        record["scale"] = 0.5 * self._resolution / half
        record["pixel"] = 2.0 * half / max(self._resolution, 1)
        record["half"] = 0.5 * self._resolution
        return record
