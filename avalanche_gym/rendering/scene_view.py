"""What a renderer draws: meshes with their places and colours, packed into the tables the kernels read."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .color import Color, linear_color
from .geometry import Geometry
from .primitives import grid_sides, grid_surface, round_length, tile
from .visibility import INSTANCE, VERTEX

# A tile that stands for a plane reaches this many sizes of the scene: beyond, it has faded into the haze.
TILE_REACH = 150.0
SQUARES = 5.0  # squares of a tile's pattern to the size of the scene, about


@dataclass(frozen=True)
class Visual:
    """One thing to be drawn.

    Args:
        geometry: its mesh; share it between things of the same form.
        color: sRGB, multiplied with the mesh's own colours.
        opacity: in [0, 1].
        static: never moves: its shadow is drawn once.
        casts_shadow: whether it throws one. Everything receives shadows.
        gloss: strength of the highlight of the sun.
        lit: whether sun and shade fall on it; otherwise it shines by itself.
        position: (3,) [m] where it is until ``set_poses`` says otherwise.
        orientation: (4,) wxyz.
    """

    geometry: Geometry
    color: Color = "#b9b4a7"
    opacity: float = 1.0
    static: bool = False
    casts_shadow: bool = True
    gloss: float = 0.12
    lit: bool = True
    position: Sequence[float] = (0.0, 0.0, 0.0)
    orientation: Sequence[float] = (1.0, 0.0, 0.0, 0.0)


class SceneView:
    """The visuals of a scene, numbered as given; visual i takes the i-th pose.

    Args:
        visuals: what is drawn. Tiles that stand for planes are fitted to the size of the rest.

    Attributes:
        center: (3,) [m] middle of the scene: of what is static, or of everything if nothing is.
        size: [m] its radius.
        static: (visuals,) bool.
        unbounded: (visuals,) bool, stands for an infinite surface.
        version: changes whenever something static does.
    """

    def __init__(self, visuals: Sequence[Visual]) -> None:
        self.visuals = list(visuals)
        self.version = 0
        self.instances = np.zeros(len(self.visuals), dtype=INSTANCE)
        self.static = np.array([visual.static for visual in self.visuals], dtype=bool)
        self.unbounded = np.array([visual.geometry.unbounded for visual in self.visuals], dtype=bool)
        for instance, visual in zip(self.instances, self.visuals, strict=True):
            geometry = visual.geometry
            low, high = geometry.vertices.min(axis=0), geometry.vertices.max(axis=0)
            instance["position"] = visual.position
            instance["orientation"] = visual.orientation
            instance["center"] = 0.5 * (low + high)
            instance["radius"] = np.linalg.norm(geometry.vertices - 0.5 * (low + high), axis=1).max()
            instance["color"] = linear_color(visual.color, "Visual(color)")
            instance["opacity"] = visual.opacity
            instance["gloss"] = visual.gloss
            instance["contrast"] = geometry.contrast
            instance["pattern_scale"] = 1.0 / np.array(geometry.cells)
            # Along an axis without cells, every place is the middle of one.
            instance["pattern_offset"] = np.where(np.isinf(geometry.cells), 0.5, 0.0)
            instance["two_sided"] = geometry.two_sided
            instance["unlit"] = not visual.lit
            instance["casts_shadow"] = visual.casts_shadow
            instance["visible"] = 1
        self.center, self.size = self._measure()
        self._pack()
        self._fade = np.array([visual.geometry.vertex_colors[:, 3].min() < 1.0 for visual in self.visuals], dtype=bool)

    def _measure(self) -> tuple[NDArray[np.float64], float]:
        """Centre (3,) [m] and radius [m] of the scene: of what is static, or of everything if nothing is."""
        bounded = ~self.unbounded & np.isfinite(self.instances["position"]).all(axis=1)
        chosen = bounded & self.static if (bounded & self.static).any() else bounded
        if not chosen.any():
            return np.zeros(3), 1.0
        low, high = np.full(3, np.inf), np.full(3, -np.inf)
        for instance in self.instances[chosen]:
            low = np.minimum(low, instance["position"] + instance["center"] - instance["radius"])
            high = np.maximum(high, instance["position"] + instance["center"] + instance["radius"])
        if chosen.sum() == 1:
            return 0.5 * (low + high), float(self.instances["radius"][chosen][0])
        return 0.5 * (low + high), 0.5 * float(np.linalg.norm(high - low))

    def _pack(self) -> None:
        """Lay the meshes one behind the other, each once."""
        first: dict[int, tuple[int, int]] = {}
        vertices: list[NDArray[np.void]] = [np.zeros(0, VERTEX)]
        faces: list[NDArray[np.integer]] = [np.zeros((0, 3), np.int32)]
        num_vertices = num_faces = num_projected = 0
        fitted: Geometry | None = None
        for instance, visual in zip(self.instances, self.visuals, strict=True):
            geometry = visual.geometry
            if geometry.unbounded:
                if fitted is None:
                    fitted = tile(TILE_REACH * self.size, round_length(self.size / SQUARES))
                geometry = fitted
                instance["radius"] = np.linalg.norm(geometry.vertices[0])
                instance["pattern_scale"] = 1.0 / np.array(geometry.cells)
            if id(geometry) not in first:
                first[id(geometry)] = (num_vertices, num_faces)
                rows = np.zeros(len(geometry.vertices), dtype=VERTEX)
                rows["position"] = geometry.vertices
                rows["normal"] = geometry.normals
                rows["color"] = geometry.vertex_colors
                vertices.append(rows)
                faces.append(geometry.faces)
                num_vertices += len(geometry.vertices)
                num_faces += len(geometry.faces)
            instance["first_vertex"], instance["first_face"] = first[id(geometry)]
            instance["num_vertices"] = len(geometry.vertices)
            instance["num_faces"] = len(geometry.faces)
            instance["first_projected"] = num_projected
            num_projected += len(geometry.vertices)
        self.vertices = np.concatenate(vertices)
        self.faces = np.concatenate(faces)
        self.num_projected = num_projected

    def set_poses(self, positions: ArrayLike, orientations: ArrayLike) -> None:
        """Place the first n visuals.

        Args:
            positions: (n, 3) [m] world frame. A row with NaN hides the visual.
            orientations: (n, 4) wxyz.
        """
        p = np.asarray(positions, dtype=np.float64)
        q = np.asarray(orientations, dtype=np.float64)
        n = len(p)
        if p.shape != (n, 3) or q.shape != (n, 4) or n > len(self.instances):
            raise ValueError(
                f"set_poses got positions of shape {p.shape} and orientations of shape {q.shape}; "
                f"allowed are (n, 3) and (n, 4) with n up to {len(self.instances)}, the number of visuals."
            )
        moved = (self.instances["position"][:n] != p).any(axis=1) | (self.instances["orientation"][:n] != q).any(axis=1)
        # A NaN differs from itself: a static visual that is gone must not make a change in every frame.
        gone = np.isnan(p).any(axis=1) & np.isnan(self.instances["position"][:n]).any(axis=1)
        if (moved & ~gone & self.static[:n]).any():
            self.version += 1
        self.instances["position"][:n] = p
        self.instances["orientation"][:n] = q

    def set_color(self, index: int, color: Color) -> None:
        """Give a visual another colour."""
        self.instances["color"][index] = linear_color(color)

    def set_opacity(self, opacity: ArrayLike, index: Any = slice(None)) -> None:
        """Make visuals translucent or opaque; ``index`` is a number, slice or mask of visuals."""
        self.instances["opacity"][index] = opacity

    def set_visible(self, visible: ArrayLike, index: Any = slice(None)) -> None:
        """Show or hide visuals; ``index`` is a number, slice or mask of visuals."""
        if not np.array_equal(self.instances["visible"][index], np.asarray(visible)):
            self.version += 1
        self.instances["visible"][index] = visible

    def set_heights(self, index: int, heights: ArrayLike) -> None:
        """Change the heights (rows, columns) [m] of a height field; visuals that share its geometry change with it."""
        grid = self.visuals[index].geometry.grid
        z = np.asarray(heights, dtype=np.float64)
        if grid is None or z.shape != grid:
            what = "is not a height field" if grid is None else f"has heights of shape {grid}"
            raise ValueError(f"set_heights({index}) got shape {z.shape}, but that visual {what}; give the same shape.")
        instance = self.instances[index]
        first, number = int(instance["first_vertex"]), int(instance["num_vertices"])
        vertices = self.vertices[first : first + number]
        extent = (float(np.ptp(vertices["position"][:, 0])), float(np.ptp(vertices["position"][:, 1])))
        points, normals = grid_surface(z, extent)
        vertices["position"][: z.size], vertices["normal"][: z.size] = points, normals
        if number > z.size:
            bottom = min(float(vertices["position"][-1, 2]), float(z.min()))
            vertices["position"][z.size :] = grid_sides(z, extent, bottom)[0]
        low, high = vertices["position"][:, 2].min(), vertices["position"][:, 2].max()
        instance["center"][2] = 0.5 * (low + high)
        instance["radius"] = 0.5 * np.linalg.norm([*extent, high - low])
        self.version += int(self.static[index])

    def drawn(self) -> NDArray[np.int64]:
        """Numbers of the visuals that are to be drawn."""
        shown = (self.instances["visible"] == 1) & (self.instances["opacity"] > 0.0)
        shown &= np.isfinite(self.instances["position"]).all(axis=1)
        return np.flatnonzero(shown & np.isfinite(self.instances["orientation"]).all(axis=1))

    def is_translucent(self) -> NDArray[np.bool_]:
        """(visuals,) whether something behind shows through."""
        return (self.instances["opacity"] < 1.0) | self._fade
