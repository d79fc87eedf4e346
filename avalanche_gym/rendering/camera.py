"""Where the viewer stands: an immutable camera and the ways to place it.

The image plane is spanned by ``right`` and ``down``; (right, down, forward) is right-handed. A point at camera
coordinates (x, y, z) along these axes falls on the pixel (f x / z + c_x, f y / z + c_y) with the focal length f
[pixels]; whole numbers are the centres of pixels, row 0 is on top.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .visibility import PROJECTION

CAMERA = np.dtype(
    [
        ("eye", np.float64, 3),  # [m] world frame
        ("right", np.float64, 3),  # unit, world frame
        ("down", np.float64, 3),
        ("forward", np.float64, 3),
        ("pixel", np.float64),  # [rad] 1 / focal length: the angle of a pixel in the middle of the picture
        ("center", np.float64, 2),  # [pixels] of the optical axis
    ],
    align=True,
)

# Share of the distance to the target. Depth is kept as 1 / z in floating point, which does not lose precision to a near
# plane that lies close, so this only has to be closer than anything a user wants to see.
NEAR = 1e-3


@dataclass(frozen=True)
class Camera:
    """A pinhole camera.

    Args:
        eye: (3,) [m], world frame.
        target: (3,) [m] the point in the middle of the picture.
        up: (3,) the direction that points upwards in the picture; need not be a unit vector.
        fov: [degrees] vertical field of view.
    """

    eye: tuple[float, float, float]
    target: tuple[float, float, float]
    up: tuple[float, float, float] = (0.0, 0.0, 1.0)
    fov: float = 40.0

    def __post_init__(self) -> None:
        for name in ("eye", "target", "up"):
            vector = tuple(float(value) for value in getattr(self, name))
            if len(vector) != 3 or not all(map(math.isfinite, vector)):
                raise ValueError(f"Camera({name})={getattr(self, name)!r}; give three finite numbers.")
            object.__setattr__(self, name, vector)
        if not 0.0 < self.fov < 180.0:
            raise ValueError(f"Camera(fov)={self.fov!r}; allowed is 0 to 180 degrees, 40 looks natural.")
        if self.distance == 0.0:
            raise ValueError(f"Camera(eye) and Camera(target) are both {self.eye}; move one of them.")

    @property
    def distance(self) -> float:
        """[m] from the eye to the target."""
        return math.dist(self.eye, self.target)

    @classmethod
    def fixed(
        cls, eye: Sequence[float], target: Sequence[float], up: Sequence[float] = (0.0, 0.0, 1.0), fov: float = 40.0
    ) -> Camera:
        """A camera that stands still."""
        return cls(eye, target, up, fov)  # type: ignore[arg-type]

    @classmethod
    def orbit(
        cls,
        target: Sequence[float],
        distance: float,
        azimuth: float,
        elevation: float,
        fov: float = 40.0,
    ) -> Camera:
        """A camera on a sphere about its target.

        Args:
            target: (3,) [m].
            distance: [m].
            azimuth: [degrees] of the eye about z, from x towards y.
            elevation: [degrees] of the eye above the horizontal plane; 90 looks straight down.
            fov: [degrees] vertical field of view.
        """
        a, e = math.radians(azimuth), math.radians(elevation)
        away = np.array([math.cos(e) * math.cos(a), math.cos(e) * math.sin(a), math.sin(e)])
        # The direction of growing elevation: it is never parallel to the view, straight down included.
        up = np.array([-math.sin(e) * math.cos(a), -math.sin(e) * math.sin(a), math.cos(e)])
        return cls(np.asarray(target, dtype=np.float64) + distance * away, target, up, fov)  # type: ignore[arg-type]

    @classmethod
    def follow(
        cls,
        target: Sequence[float],
        direction: Sequence[float],
        distance: float,
        height: float,
        up: Sequence[float] = (0.0, 0.0, 1.0),
        fov: float = 40.0,
    ) -> Camera:
        """A camera behind and above a moving target; make a new one for each frame.

        Args:
            target: (3,) [m] position of what is followed.
            direction: (3,) where it goes: the eye stands on the other side. Its part along ``up`` is ignored.
            distance: [m] behind the target.
            height: [m] above the target, along ``up``.
            up: (3,) for a planet, the direction from its centre to the target.
            fov: [degrees] vertical field of view.
        """
        axis = np.asarray(up, dtype=np.float64) / np.linalg.norm(up)
        heading = np.asarray(direction, dtype=np.float64)
        heading = heading - axis * (heading @ axis)
        length = np.linalg.norm(heading)
        if length == 0.0:
            raise ValueError(f"Camera.follow(direction)={direction!r} is parallel to up={up!r}; give another one.")
        eye = np.asarray(target, dtype=np.float64) - heading * (distance / length) + axis * height
        return cls(eye, target, up, fov)  # type: ignore[arg-type]

    def record(self, width: int, height: int) -> NDArray[np.void]:
        """The CAMERA record (1,) for an image of this size [pixels]."""
        forward = (np.array(self.target) - np.array(self.eye)) / self.distance
        right = np.cross(forward, self.up)
        length = np.linalg.norm(right)
        if length <= 1e-12 * np.linalg.norm(self.up):
            raise ValueError(f"Camera(up)={self.up} is parallel to the view from {self.eye} to {self.target}; turn it.")
        right /= length
        record = np.zeros(1, dtype=CAMERA)
        record["eye"] = self.eye
        record["right"] = right
        record["down"] = np.cross(forward, right)
        record["forward"] = forward
        record["pixel"] = math.tan(0.5 * math.radians(self.fov)) / (0.5 * height)
        record["center"] = (0.5 * (width - 1), 0.5 * (height - 1))
        return record

    def projection(self, width: int, height: int) -> NDArray[np.void]:
        """The PROJECTION record (1,) for an image of this size [pixels]."""
        camera = self.record(width, height)[0]
        forward, eye = camera["forward"], camera["eye"]
        rows = np.zeros((4, 3))
        rows[0] = camera["right"] / camera["pixel"] + camera["center"][0] * forward
        rows[1] = camera["down"] / camera["pixel"] + camera["center"][1] * forward
        rows[2] = forward
        offsets = -rows @ eye
        offsets[3] = 1.0
        return projection_record(rows, offsets, NEAR * self.distance, width, height)


def projection_record(
    rows: NDArray[np.float64], offsets: NDArray[np.float64], near: float, width: int, height: int
) -> NDArray[np.void]:
    """The PROJECTION record (1,) of rows (4, 3) and offsets (4,), with the sides of the space that the image shows."""
    record = np.zeros(1, dtype=PROJECTION)
    record["rows"], record["offsets"], record["near"] = rows, offsets, near
    system = np.concatenate([rows, offsets[:, None]], axis=1)
    x, y, w = system[:3]
    behind = np.array([0.0, 0.0, 0.0, near])
    planes = np.array([x, (width - 1) * w - x, y, (height - 1) * w - y, w - behind])
    lengths = np.linalg.norm(planes[:, :3], axis=1)
    # Under parallel rays W is constant, and the last plane says nothing.
    lengths[lengths == 0.0] = 1.0
    record["planes"] = planes[:, :3] / lengths[:, None]
    record["distances"] = planes[:, 3] / lengths
    return record
