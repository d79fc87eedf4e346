"""Which part of a scene the shadow map covers, and when its static half is drawn again."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from .camera import Camera, projection_record
from .lighting import Lighting
from .scene_view import SceneView
from .shadow import SHADOW
from .visibility import TRIANGLE, draw_instances

# Half a side of the map, in distances from the eye to its target, where the scene is larger than that; smaller is
# sharper.
REACH = 1.6
SNAP = 0.25  # the map's middle moves in steps of this share of its half side: in between, the static map stays valid
# Half sides are powers of this, so that a camera that draws near does not change the map in each frame.
GROWTH = 1.25


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
    ) -> tuple[NDArray[np.void], NDArray[np.float32]]:
        """The SHADOW record (1,) and the map (n, n) of a frame; ``projected`` is scratch for the view's vertices."""
        center, half = self._region(view, camera)
        record = self._record(center, half, lighting)
        if self._resolution == 0:
            return record, self._depth
        drawn = view.drawn()
        casting = drawn[(view.instances["casts_shadow"][drawn] == 1) & ~view.unbounded[drawn]]
        is_static = view.static[casting]
        key = (view.version, tuple(center), half, lighting.sun)
        if self._view is not view or self._drawn != key:
            self._static.fill(-np.inf)
            self._enter(view, casting[is_static], record, projected, self._static)
            self._view, self._drawn = view, key
        np.copyto(self._depth, self._static)
        self._enter(view, casting[~is_static], record, projected, self._depth)
        return record, self._depth

    def _enter(
        self,
        view: SceneView,
        order: NDArray[np.int64],
        record: NDArray[np.void],
        projected: NDArray[np.void],
        depth: NDArray[np.float32],
    ) -> None:
        # The sun's right and down; with these, its view along the rays is right-handed as a camera's is.
        rows = np.array([record["across"][0], record["along"][0], np.zeros(3), record["sun"][0]])
        offsets = np.array([record["offset"][0, 0], record["offset"][0, 1], 1.0, record["offset"][0, 2]])
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

    def _record(self, center: NDArray[np.float64], half: float, lighting: Lighting) -> NDArray[np.void]:
        sun = np.asarray(lighting.sun, dtype=np.float64)
        sun = sun / np.linalg.norm(sun)
        across = np.cross(np.eye(3)[np.argmin(np.abs(sun))], sun)
        across /= np.linalg.norm(across)
        scale = 0.5 * self._resolution / half
        record = np.zeros(1, dtype=SHADOW)
        record["sun"] = sun
        record["across"] = record["across32"] = scale * across
        # (across, along, away from the sun) is right-handed, as (right, down, forward) of a camera.
        record["along"] = record["along32"] = scale * np.cross(-sun, across)
        middle = 0.5 * (self._resolution - 1)
        record["offset"][0] = [
            middle - record["across"][0] @ center,
            middle - record["along"][0] @ center,
            -sun @ center,
        ]
        record["pixel"] = 2.0 * half / max(self._resolution, 1)
        return record
