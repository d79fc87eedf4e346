"""Frames as bytes: what the page needs to draw one, so small that 100 bodies cost the simulation nothing to speak of.

All messages are little-endian words of four bytes. The first word says what follows:

- MESH: number, byte length of a JSON head (padded to whole words), the head, then positions and normals (n, 3), colours
  (n, 4) if the head says so, all float32, and the faces (m, 3), uint32.
- HEIGHTS: number of the mesh, then heights (rows, columns) float32.
- FRAME: show, frame, rows, contacts, cells (uint32); duration [s] until the next frame; camera: eye, target, up (3
  each) and field of view; direction to the sun (3); then the rows, contacts and cells.

A row stands for a body or a marker. Every frame names all of them with mesh and colour, so that a page which missed
frames is never out of step.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..physics.shapes import HeightField
from ..physics.world import World
from ..rendering import Camera, Geometry, Lighting, Marker
from ..rendering.color import linear_color, to_srgb
from .show import Show

MESH, HEIGHTS, FRAME = 1, 2, 3  # first word of a message

# A row: handle, mesh, colour, opacity, flags, position (3) [m], orientation (4) wxyz. Markers have handles below zero.
ROW_WIDTH = 12
PUSHABLE, RESTING, UNLIT, GROUND, SHADOWLESS = 1, 2, 4, 8, 16  # flags
CONTACT_WIDTH = 7  # position (3) [m], normal (3), size of the impulse [N s]
CELL_WIDTH = 4  # lowest corner (3) [m], edge [m]

Rows = NDArray[np.float32]


@dataclass(frozen=True)
class Mesh:
    """A mesh as the page gets it: once, and its heights again whenever they changed."""

    number: int
    message: bytes
    revision: int = 0
    heights: bytes = b""


@dataclass(frozen=True)
class Packet:
    """Everything that a page needs to be up to date."""

    show: int  # counts how often something else was shown
    frame: bytes
    meshes: tuple[Mesh, ...]
    about: str  # JSON: the show
    status: str = ""  # JSON: counters and settings; empty in most frames


@dataclass
class FrameEncoder:
    """Encodes the frames of one show."""

    show: Show
    number: int  # of the show
    about: str = ""
    _bodies: list[Any] = field(default_factory=list)
    _handles: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, np.int64))
    _rows: Rows = field(default_factory=lambda: np.zeros((0, ROW_WIDTH), np.float32))
    _meshes: dict[int, Mesh] = field(default_factory=dict)  # by the identity of the geometry
    _kept: list[Geometry] = field(default_factory=list)  # so that identities are not used twice
    _fields: dict[int, tuple[int, NDArray[np.float64]]] = field(default_factory=dict)  # geometry and samples by handle
    _frames: int = 0

    def encode(
        self,
        resting: NDArray[np.bool_],
        duration: float,
        contacts: NDArray[np.float32],
        cells: NDArray[np.float32],
        status: str = "",
    ) -> Packet:
        """The frame of this moment.

        Args:
            resting: (bodies,).
            duration: [s] until the next frame, as it is watched.
            contacts: (n, 7), see CONTACT_WIDTH.
            cells: (n, 4), see CELL_WIDTH.
            status: of the packet.
        """
        world = self.show.world
        if world.scene.bodies != self._bodies:
            self._adopt(world)
        rows, handles = self._rows, self._handles
        rows[:, 5:8] = world.position[0, handles]
        rows[:, 8:12] = world.orientation[0, handles]
        flags = rows[:, 4].astype(np.int64) & ~RESTING
        rows[:, 4] = flags | np.where(resting[handles], RESTING, 0)
        self._update_heights(world)
        markers = self._marker_rows(self.show.markers())
        self._frames += 1
        head = struct.pack("<6I", FRAME, self.number, self._frames, len(rows) + len(markers), len(contacts), len(cells))
        view = _view_floats(duration, self.show.camera(), self.show.lighting())
        parts = (head, view, rows.tobytes(), markers.tobytes(), contacts.tobytes(), cells.tobytes())
        return Packet(self.number, b"".join(parts), tuple(self._meshes.values()), self.about, status)

    def _adopt(self, world: World) -> None:
        """Rows of the bodies that are there now; what is the same in every frame is written here."""
        self._bodies = list(world.scene.bodies)
        hidden = self.show.looks.hidden
        shown = [(index, body) for index, body in enumerate(self._bodies) if body and body.name not in hidden]
        self._handles = np.array([index for index, _ in shown], np.int64)
        self._rows = np.zeros((len(shown), ROW_WIDTH), np.float32)
        self._fields = {}
        for row, (index, body) in zip(self._rows, shown, strict=True):
            visual = self.show.looks.visual(body, index)
            flags = PUSHABLE if body.motion == "dynamic" else GROUND
            row[:5] = (index, self._mesh_number(visual.geometry), _color_code(visual.color), visual.opacity, flags)
            if isinstance(body.shape, HeightField) and visual.geometry.grid is not None:
                self._fields[index] = (id(visual.geometry), body.shape.heights)
        # Meshes that bodies of this moment do not use are kept: bodies of their form will come again.

    def _mesh_number(self, geometry: Geometry) -> int:
        mesh = self._meshes.get(id(geometry))
        if mesh is None:
            number = len(self._meshes)
            mesh = self._meshes[id(geometry)] = Mesh(number, mesh_message(number, geometry))
            self._kept.append(geometry)
        return mesh.number

    def _update_heights(self, world: World) -> None:
        for handle, (identity, last) in self._fields.items():
            heights = world.heights(handle)
            if not np.array_equal(heights, last):
                self._fields[handle] = (identity, heights)
                old = self._meshes[identity]
                message = struct.pack("<2I", HEIGHTS, old.number) + heights.astype(np.float32).tobytes()
                self._meshes[identity] = Mesh(old.number, old.message, old.revision + 1, message)

    def _marker_rows(self, markers: Iterable[Marker]) -> Rows:
        rows = [
            (
                -1 - index,
                self._mesh_number(marker.geometry),
                _color_code(marker.color),
                marker.opacity,
                SHADOWLESS | (0 if marker.lit else UNLIT),
                *marker.position,
                *marker.orientation,
            )
            for index, marker in enumerate(markers)
        ]
        return np.array(rows, np.float32).reshape(-1, ROW_WIDTH)


def mesh_message(number: int, geometry: Geometry) -> bytes:
    """A mesh for the page."""
    head = {
        "vertices": len(geometry.vertices),
        "faces": len(geometry.faces),
        "colors": geometry.colors is not None,
        "twoSided": geometry.two_sided,
        # No pattern along an axis: JSON has no infinity.
        "cells": [cell if np.isfinite(cell) else 0.0 for cell in geometry.cells],
        "contrast": geometry.contrast,
        "grid": geometry.grid,
    }
    text = json.dumps(head).encode()
    text += b" " * (-len(text) % 4)
    arrays = [geometry.vertices, geometry.normals]
    if geometry.colors is not None:
        arrays.append(np.asarray(geometry.colors, np.float64))
    floats = b"".join(np.asarray(array, np.float32).tobytes() for array in arrays)
    faces = np.asarray(geometry.faces, np.uint32).tobytes()
    return struct.pack("<3I", MESH, number, len(text)) + text + floats + faces


def contact_rows(world: World) -> Rows:
    """(n, 7) the contacts of the last step."""
    contacts = world.contacts()
    rows = np.empty((len(contacts), CONTACT_WIDTH), np.float32)
    rows[:, :3] = contacts["position"]
    rows[:, 3:6] = contacts["normal"]
    rows[:, 6] = np.linalg.norm(contacts["impulse"], axis=1)
    return rows


def light_message(lighting: Lighting) -> dict[str, Any]:
    """What of the light stays the same through a show, colours in linear light."""
    colors = {name: color.tolist() for name, color in lighting.linear_colors().items()}
    haze = lighting.haze if np.isfinite(lighting.haze) else 0.0
    return {**colors, "glow": lighting.glow, "stars": lighting.stars, "haze": haze}


def _color_code(color: Any) -> float:
    """An sRGB colour as one number below 2^24, which float32 holds exactly."""
    red, green, blue = np.round(255.0 * to_srgb(np.array(linear_color(color)))).astype(int).tolist()
    return float(red << 16 | green << 8 | blue)


def _view_floats(duration: float, camera: Camera, lighting: Lighting) -> bytes:
    return struct.pack("<14f", duration, *camera.eye, *camera.target, *camera.up, camera.fov, *lighting.direction)
