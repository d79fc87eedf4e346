"""The renderer: a view and a camera in, a picture out."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from .camera import Camera
from .color import to_srgb
from .frame import BRIGHTEST, STEPS, develop, draw_opaque, draw_translucent
from .lanes import LANES
from .lighting import DAY, Lighting
from .overlay import Lines, Marker, Points, draw_strokes, stroke_arrays
from .scene_view import SceneView, Visual
from .shadow_map import ShadowMap
from .visibility import PROJECTED, TRIANGLE

Overlay = Lines | Points | Marker
LARGEST = 8192  # [pixels] side of a frame before averaging
SHOULDER = 0.8  # brightness above which light is compressed towards white, so that highlights keep their form


@lru_cache(maxsize=1)
def _response() -> NDArray[np.uint8]:
    """The byte of each linear brightness k / STEPS."""
    light = np.arange(int(BRIGHTEST * STEPS)) / STEPS
    room = 1.0 - SHOULDER
    bright = np.maximum(light - SHOULDER, 0.0)
    # Slope one at the shoulder, and white at the brightest.
    scale = room * (BRIGHTEST - SHOULDER) / ((BRIGHTEST - SHOULDER) - room)
    light = np.minimum(light, SHOULDER) + bright / (1.0 + bright / scale)
    return np.round(255.0 * to_srgb(light)).astype(np.uint8)


class Renderer:
    """Draws frames without a display, the same bytes in every process and thread.

    A renderer owns its buffers: use one in each thread.

    Args:
        width: [pixels] of the frame.
        height: [pixels] of the frame.
        supersample: the frame is drawn this many times larger each way and averaged: 1 for learning from pixels, 2 for
            video at about three times the cost.
        lighting: sun, sky and haze, for example ``DAY`` or ``SPACE``.
        shadows: False saves about a quarter of the time.
        shadow_resolution: [pixels] side of the shadow map.
    """

    def __init__(
        self,
        width: int = 480,
        height: int = 480,
        supersample: int = 1,
        lighting: Lighting = DAY,
        shadows: bool = True,
        shadow_resolution: int = 1024,
    ) -> None:
        for name, value in (("width", width), ("height", height)):
            if not (isinstance(value, int) and 1 <= value and 1 <= supersample and value * supersample <= LARGEST):
                raise ValueError(
                    f"Renderer({name}={value!r}, supersample={supersample!r}); allowed are whole numbers from 1 whose "
                    f"product is at most {LARGEST} pixels."
                )
        self.width, self.height, self.supersample = width, height, supersample
        self.lighting = lighting
        self._shadows = ShadowMap(shadow_resolution if shadows else 0)
        shape = (height * supersample, width * supersample)
        self._depth = np.zeros(shape, dtype=np.float32)
        self._through = np.zeros(shape, dtype=np.float32)
        self._ids = np.full(shape, -1, dtype=np.int32)
        self._image = np.zeros((*shape, 3), dtype=np.float32)
        self._projected = np.zeros(0, dtype=PROJECTED)
        self._triangles = np.zeros(0, dtype=TRIANGLE)
        self._lanes = np.zeros(1, dtype=LANES)
        self._markers: tuple[tuple[object, ...], SceneView] | None = None

    def render(self, view: SceneView, camera: Camera, overlays: Sequence[Overlay] = ()) -> NDArray[np.uint8]:
        """Draw one frame.

        Args:
            view: what is seen.
            camera: from where.
            overlays: lines, points and markers over it. Markers come first, then the others in their order.

        Returns:
            (height, width, 3) uint8, sRGB; a new array each time.
        """
        record = camera.record(self._image.shape[1], self._image.shape[0])
        light = self.lighting.record(view.size)
        shadow, shadow_depth = self._shadows.draw(view, camera, self.lighting)

        drawn = view.drawn()
        translucent = view.is_translucent()[drawn]
        self._draw(draw_opaque, view, drawn[~translucent], record, light, shadow, shadow_depth, self._depth)
        markers = self._marker_view([overlay for overlay in overlays if isinstance(overlay, Marker)])
        if translucent.any() or markers is not None:
            np.copyto(self._through, self._depth)
        if translucent.any():
            order = _farthest_first(view, drawn[translucent], camera)
            self._draw(draw_translucent, view, order, record, light, shadow, shadow_depth, self._through)
        if markers is not None:
            order = _farthest_first(markers, markers.drawn(), camera)
            self._draw(draw_translucent, markers, order, record, light, shadow, shadow_depth, self._through)
        for overlay in overlays:
            if not isinstance(overlay, Marker):
                ends, style = stroke_arrays(overlay, self.supersample)
                draw_strokes(ends, style, record, self._depth, self._image)

        frame = np.empty((self.height, self.width, 3), dtype=np.uint8)
        develop(self._image, _response(), self.supersample, frame)
        return frame

    def _draw(
        self,
        kernel: object,
        view: SceneView,
        order: NDArray[np.int64],
        record: NDArray[np.void],
        light: NDArray[np.void],
        shadow: NDArray[np.void],
        shadow_depth: NDArray[np.float32],
        depth: NDArray[np.float32],
    ) -> None:
        if len(self._projected) < view.num_projected:
            self._projected = np.zeros(view.num_projected, dtype=PROJECTED)
        num_faces = int(view.instances["num_faces"].sum())
        if len(self._triangles) < num_faces:
            self._triangles = np.zeros(num_faces, dtype=TRIANGLE)
        kernel(  # type: ignore[operator]
            view.instances,
            order,
            record,
            light,
            shadow,
            shadow_depth,
            view.vertices,
            view.faces,
            self._projected,
            self._triangles,
            depth,
            self._ids,
            self._lanes,
            self._image,
        )

    def _marker_view(self, markers: list[Marker]) -> SceneView | None:
        """The markers as a view; its meshes are packed again only if they change."""
        if not markers:
            return None
        key = tuple((marker.geometry, marker.color, marker.lit) for marker in markers)
        if self._markers is None or self._markers[0] != key:
            visuals = [Visual(m.geometry, m.color, lit=m.lit, casts_shadow=False, gloss=0.0) for m in markers]
            self._markers = (key, SceneView(visuals))
        view = self._markers[1]
        view.set_poses([marker.position for marker in markers], [marker.orientation for marker in markers])
        view.set_opacity([marker.opacity for marker in markers])
        return view


def _farthest_first(view: SceneView, numbers: NDArray[np.int64], camera: Camera) -> NDArray[np.int64]:
    distance = np.linalg.norm(view.instances["position"][numbers] - np.array(camera.eye), axis=1)
    return numbers[np.argsort(-distance, kind="stable")]
