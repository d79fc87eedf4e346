"""What is drawn over a frame: lines, points and translucent markers."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..physics.jit import entry_point
from ..physics.maths import vec3
from .color import GOAL, Color, linear_color
from .geometry import Geometry
from .primitives import band, beam

# Relative amount by which a line is drawn closer than it is, so that one that lies on a surface is seen.
LINE_LIFT = 4e-3


@dataclass(frozen=True)
class Lines:
    """Straight lines of even width on the screen.

    Args:
        segments: (n, 2, 3) [m] both ends of each, world frame. ``Lines.path`` joins points.
        color: of all of them.
        width: [pixels] of the finished frame.
        opacity: in [0, 1].
        hidden_opacity: share of ``opacity`` where a surface lies in front; 1 draws through everything.
    """

    segments: ArrayLike
    color: Color = "#ffffff"
    width: float = 2.0
    opacity: float = 1.0
    hidden_opacity: float = 0.0

    @classmethod
    def path(cls, points: ArrayLike, **options: object) -> Lines:
        """The lines that join points (n, 3) [m] in turn."""
        array = np.asarray(points, dtype=np.float64)
        return cls(np.stack([array[:-1], array[1:]], axis=1), **options)  # type: ignore[arg-type]

    @classmethod
    def box(cls, low: ArrayLike, high: ArrayLike, **options: object) -> Lines:
        """The twelve edges of a box between two corners (3,) [m]."""
        ends = np.stack([np.asarray(low, dtype=np.float64), np.asarray(high, dtype=np.float64)])
        corner = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)])
        place = np.stack([ends[corner[:, axis], axis] for axis in range(3)], axis=1)
        pairs = [(i, j) for i in range(8) for j in range(i) if np.abs(corner[i] - corner[j]).sum() == 1]
        return cls(place[pairs], **options)  # type: ignore[arg-type]

    @classmethod
    def arrows(cls, start: ArrayLike, vector: ArrayLike, **options: object) -> Lines:
        """Arrows from (n, 3) [m] along (n, 3) [m], each with a head of four strokes."""
        a = np.asarray(start, dtype=np.float64).reshape(-1, 3)
        v = np.broadcast_to(np.asarray(vector, dtype=np.float64).reshape(-1, 3), a.shape)
        # Any direction that is not along the arrow will do to build the head on.
        other = np.eye(3)[np.argmin(np.abs(v), axis=1)]
        side = np.cross(v, other)
        length = np.linalg.norm(v, axis=1, keepdims=True)
        norm = np.linalg.norm(side, axis=1, keepdims=True)
        side = side / np.where(norm > 0.0, norm, 1.0) * length
        third = np.cross(v, side) / np.where(length > 0.0, length, 1.0)
        tip = a + v
        strokes = [(a, tip)] + [(tip, tip - 0.2 * v + 0.09 * s) for s in (side, -side, third, -third)]
        return cls(np.concatenate([np.stack(stroke, axis=1) for stroke in strokes]), **options)  # type: ignore[arg-type]


@dataclass(frozen=True)
class Points:
    """Round dots of even size on the screen.

    Args:
        positions: (n, 3) [m] world frame.
        color: of all of them.
        size: [pixels] diameter in the finished frame.
        opacity: in [0, 1].
        hidden_opacity: share of ``opacity`` where a surface lies in front; 1 draws through everything.
    """

    positions: ArrayLike
    color: Color = "#ffffff"
    size: float = 6.0
    opacity: float = 1.0
    hidden_opacity: float = 0.0


@dataclass(frozen=True)
class Marker:
    """A mesh drawn over the scene in this frame only, usually translucent: a goal, a region, a ghost of a body.

    Args:
        geometry: for example of ``primitives``: beam, disc, ring, box; pass the same one each frame.
        position: (3,) [m] world frame.
        orientation: (4,) wxyz.
        color: multiplied with the colours of the geometry.
        opacity: in [0, 1].
        lit: whether sun and shade fall on it; otherwise it shines by itself.
    """

    geometry: Geometry
    position: tuple[float, float, float] = (0.0, 0.0, 0.0)
    orientation: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)
    color: Color = GOAL
    opacity: float = 0.4
    lit: bool = False


def goal_markers(
    position: tuple[float, float, float] | NDArray[np.float64],
    radius: float,
    height: float | None = None,
    color: Color = GOAL,
    up: tuple[float, float, float] | NDArray[np.float64] = (0.0, 0.0, 1.0),
) -> list[Marker]:
    """A goal region: a ring on the ground and a tube of light above it that is seen from afar.

    Args:
        position: (3,) [m] its middle, on the ground.
        radius: [m].
        height: [m] where the light has faded away; None for three radii.
        color: of both.
        up: (3,) on a planet, the direction away from its centre.
    """
    tall = 3.0 * radius if height is None else height
    axis = np.asarray(up, dtype=np.float64) / np.linalg.norm(up)
    # The shortest turn from z to ``up``; from z to -z, half a turn about x.
    turn = np.array([1.0 + axis[2], -axis[1], axis[0], 0.0])
    turn = turn / np.linalg.norm(turn) if axis[2] > -1.0 else np.array([0.0, 1.0, 0.0, 0.0])
    place = tuple(float(value) for value in position)
    way = tuple(float(value) for value in turn)
    return [
        Marker(beam(radius, -0.7 * radius, tall), place, way, color, 0.75),  # type: ignore[arg-type]
        Marker(band(radius, -0.7 * radius, 0.12 * radius), place, way, color, 0.9),  # type: ignore[arg-type]
    ]


def stroke_arrays(overlay: Lines | Points, samples: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Ends (n, 2, 3) [m] of strokes, and (6,): colour, radius [pixels before averaging], opacity, hidden opacity."""
    if isinstance(overlay, Points):
        dots = np.asarray(overlay.positions, dtype=np.float64).reshape(-1, 1, 3)
        ends, width = np.repeat(dots, 2, axis=1), overlay.size
    else:
        ends, width = np.asarray(overlay.segments, dtype=np.float64).reshape(-1, 2, 3), overlay.width
    hidden = overlay.opacity * overlay.hidden_opacity
    color = linear_color(overlay.color, f"{type(overlay).__name__}(color)")
    return np.ascontiguousarray(ends), np.array([*color, 0.5 * width * samples, overlay.opacity, hidden])


@entry_point
def draw_strokes(ends, style, cameras, near, depth, image):
    """Blend straight strokes with round ends over an image; an end at the same point as the other makes a dot.

    Args:
        ends: (n, 2, 3) [m] world frame.
        style: (6,) linear colour, radius [pixels], opacity, opacity behind surfaces.
        cameras: (1,) CAMERA.
        near: [m] what is closer is cut away.
        depth: (height, width) float32, 1 / z of the surfaces.
        image: (height, width, 3) float32, linear.
    """
    camera = cameras[0]
    focal = 1.0 / camera.pixel
    height, width = depth.shape
    eye = vec3.load(camera.eye)
    forward = vec3.load(camera.forward)
    radius = style[3]
    reach = radius + 1.0
    for k in range(len(ends)):
        a = vec3.sub(vec3.load(ends[k, 0]), eye)
        b = vec3.sub(vec3.load(ends[k, 1]), eye)
        za = vec3.dot(forward, a)
        zb = vec3.dot(forward, b)
        if not (za >= near or zb >= near):
            continue
        if za < near:
            a = vec3.add_scaled(a, (near - za) / (zb - za), vec3.sub(b, a))
            za = near
        if zb < near:
            b = vec3.add_scaled(b, (near - zb) / (za - zb), vec3.sub(a, b))
            zb = near
        qa = 1.0 / za
        qb = 1.0 / zb
        ax = focal * vec3.dot(vec3.load(camera.right), a) * qa + camera.center[0]
        ay = focal * vec3.dot(vec3.load(camera.down), a) * qa + camera.center[1]
        bx = focal * vec3.dot(vec3.load(camera.right), b) * qb + camera.center[0]
        by = focal * vec3.dot(vec3.load(camera.down), b) * qb + camera.center[1]
        if not (math.isfinite(ax + ay) and math.isfinite(bx + by)):
            continue
        dx = bx - ax
        dy = by - ay
        length = dx * dx + dy * dy
        inverse = 1.0 / length if length > 0.0 else 0.0
        top = int(math.ceil(max(0.0, min(ay, by) - reach)))
        bottom = int(math.floor(min(height - 1.0, max(ay, by) + reach)))
        for j in range(top, bottom + 1):
            # The part of the stroke whose middle line comes within reach of this row.
            start = 0.0
            stop = 1.0
            if abs(dy) > reach:
                start = (j - reach - ay) / dy
                stop = (j + reach - ay) / dy
                if start > stop:
                    start, stop = stop, start
                start = max(start, 0.0)
                stop = min(stop, 1.0)
            xs = ax + start * dx
            xe = ax + stop * dx
            left = int(math.ceil(max(0.0, min(xs, xe) - reach)))
            right = int(math.floor(min(width - 1.0, max(xs, xe) + reach)))
            for i in range(left, right + 1):
                t = min(1.0, max(0.0, ((i - ax) * dx + (j - ay) * dy) * inverse))
                across = i - ax - t * dx
                down = j - ay - t * dy
                cover = min(1.0, radius + 0.5 - math.sqrt(across * across + down * down))
                if cover <= 0.0:
                    continue
                seen = (qa + t * (qb - qa)) * (1.0 + LINE_LIFT) >= depth[j, i]
                share = cover * (style[4] if seen else style[5])
                for channel in range(3):
                    image[j, i, channel] += share * (style[channel] - image[j, i, channel])
