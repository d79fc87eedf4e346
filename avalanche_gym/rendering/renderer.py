"""The renderer: a view and a camera in, a picture out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .camera import NEAR, Camera
from .development import develop, response
from .frame import frame_record
from .lanes import LANES
from .lighting import DAY, Lighting
from .overlay import Lines, Marker, Points, draw_strokes, stroke_arrays
from .scene_view import SceneView, Visual
from .shading import paint
from .shadow_map import ShadowMap
from .stars import paint_stars
from .visibility import PROJECTED, TRIANGLE, draw_instances

Overlay = Lines | Points | Marker
LARGEST = 8192  # [pixels] side of a frame before averaging


@dataclass(frozen=True)
class _Records:
    """What is the same for every surface of a frame."""

    camera: NDArray[np.void]
    projection: NDArray[np.void]
    frame: NDArray[np.void]
    shadow_depth: NDArray[np.float32]


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

    Raises:
        ValueError: a size that is not a whole number from 1, or a frame larger than 8192 pixels before averaging.
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
        self._reserve(view)
        height, width = self._depth.shape
        sun_view, shadow_depth = self._shadows.draw(view, camera, self.lighting, self._projected)
        records = _Records(
            camera.record(width, height),
            camera.projection(width, height),
            frame_record(camera, self.lighting, sun_view, view.size, width, height),
            shadow_depth,
        )
        drawn = view.drawn()
        is_translucent = view.is_translucent()[drawn]
        self._depth.fill(0.0)
        self._layer(view, drawn[~is_translucent], records, self._depth, backdrop=1)
        if self.lighting.stars > 0.0:
            paint_stars(records.camera, self.lighting.stars, self._depth, self._image)

        markers = self._marker_view([overlay for overlay in overlays if isinstance(overlay, Marker)])
        if markers is not None or is_translucent.any():
            # A line behind a translucent surface is seen, so these surfaces enter their depth into a copy.
            np.copyto(self._through, self._depth)
        for number in _farthest_first(view, drawn[is_translucent], camera):
            self._layer(view, np.array([number]), records, self._through, backdrop=0)
        if markers is not None:
            self._reserve(markers)
            for number in _farthest_first(markers, markers.drawn(), camera):
                self._layer(markers, np.array([number]), records, self._through, backdrop=0)
        for overlay in overlays:
            if not isinstance(overlay, Marker):
                ends, style = stroke_arrays(overlay, self.supersample)
                draw_strokes(ends, style, records.camera, NEAR * camera.distance, self._depth, self._image)

        frame = np.empty((self.height, self.width, 3), dtype=np.uint8)
        develop(self._image, response(), self.supersample, frame)
        return frame

    def _reserve(self, view: SceneView) -> None:
        if len(self._projected) < view.num_projected:
            self._projected = np.zeros(view.num_projected, dtype=PROJECTED)
        num_faces = int(view.instances["num_faces"].sum())
        # One at least: without any, draw_instances takes it that only the depth is wanted.
        if len(self._triangles) < max(num_faces, 1):
            self._triangles = np.zeros(max(num_faces, 1), dtype=TRIANGLE)

    def _layer(
        self, view: SceneView, order: NDArray[np.int64], records: _Records, depth: NDArray[np.float32], backdrop: int
    ) -> None:
        """Draw visuals over the image; of those drawn together only what is closest is seen."""
        height, width = depth.shape
        box = np.array([width, height, -1, -1])
        draw_instances(
            view.instances,
            order,
            records.projection,
            view.vertices,
            view.faces,
            self._projected,
            self._triangles,
            depth,
            self._ids,
            box,
        )
        if backdrop:
            box[:] = (0, 0, width - 1, height - 1)
        paint(
            view.instances,
            view.vertices,
            self._projected,
            self._triangles,
            records.frame,
            records.shadow_depth,
            box,
            backdrop,
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
