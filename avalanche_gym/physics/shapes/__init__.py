"""The shapes a body can have: one file a shape, each checked when it is made and immutable from then on."""

from .box import Box
from .capsule import Capsule
from .compound import Compound
from .convex_hull import ConvexHull
from .cylinder import Cylinder
from .height_field import HeightField
from .plane import Plane
from .radial_terrain import RadialTerrain
from .shape import Shape
from .sphere import Sphere
from .triangle_mesh import TriangleMesh

__all__ = [
    "Box",
    "Capsule",
    "Compound",
    "ConvexHull",
    "Cylinder",
    "HeightField",
    "Plane",
    "RadialTerrain",
    "Shape",
    "Sphere",
    "TriangleMesh",
]
