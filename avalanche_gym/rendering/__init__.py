"""Pictures of a scene without a display: a software rasteriser on Numba, and a window that shows its frames."""

from .camera import Camera
from .color import AGENT, DANGER, GOAL, PALETTE, palette_color
from .geometry import Geometry
from .lighting import DAY, SPACE, Lighting
from .overlay import Lines, Marker, Points, goal_markers
from .renderer import Renderer
from .scene_view import SceneView, Visual
from .shape_geometry import geometry_of
from .terrain_colors import DUNES, MEADOW, MOON, SNOW, TerrainPalette, as_planet, as_terrain
from .tiling import tile
from .window import Window
from .world_view import BodyLooks, WorldView

__all__ = [
    "AGENT",
    "DANGER",
    "DAY",
    "DUNES",
    "GOAL",
    "MEADOW",
    "MOON",
    "PALETTE",
    "SNOW",
    "SPACE",
    "BodyLooks",
    "Camera",
    "Geometry",
    "Lighting",
    "Lines",
    "Marker",
    "Points",
    "Renderer",
    "SceneView",
    "TerrainPalette",
    "Visual",
    "Window",
    "WorldView",
    "as_planet",
    "as_terrain",
    "geometry_of",
    "goal_markers",
    "palette_color",
    "tile",
]
