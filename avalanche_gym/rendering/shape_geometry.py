"""The mesh of each collision shape."""

from __future__ import annotations

from ..physics.shapes import (
    Box,
    Capsule,
    Compound,
    ConvexHull,
    Cylinder,
    HeightField,
    Plane,
    Shape,
    Sphere,
    TriangleMesh,
)
from . import primitives
from .geometry import Geometry
from .terrain_colors import as_terrain

PLANE_HALF_EXTENT = 200.0  # [m] of the tile that stands for a plane where the size of the scene is not known
PLANE_SQUARE = 1.0  # [m]


def geometry_of(shape: Shape) -> Geometry:
    """A mesh that looks like the shape; equal simple shapes share one.

    Args:
        shape: any shape of ``avalanche_gym.physics.shapes``. A plane becomes a tile of 400 m; SceneView fits it to the
            scene. A height field is coloured by height and slope.

    Raises:
        TypeError: not a shape.
    """
    if isinstance(shape, Sphere):
        return primitives.sphere(shape.radius)
    if isinstance(shape, Capsule):
        return primitives.capsule(shape.radius, shape.half_length)
    if isinstance(shape, Box):
        x, y, z = shape.half_extents
        return primitives.box((float(x), float(y), float(z)))
    if isinstance(shape, Cylinder):
        return primitives.cylinder(shape.radius, shape.half_length)
    if isinstance(shape, ConvexHull):
        return Geometry.smoothed(shape.vertices, shape.faces)
    if isinstance(shape, TriangleMesh):
        return Geometry.smoothed(shape.vertices, shape.faces, two_sided=shape.two_sided)
    if isinstance(shape, HeightField):
        return as_terrain(primitives.height_field(shape.heights, shape.extent))
    if isinstance(shape, Plane):
        return primitives.tile(PLANE_HALF_EXTENT, PLANE_SQUARE)
    if isinstance(shape, Compound):
        return Geometry.merged((geometry_of(part), place, turn) for part, place, turn in shape.parts())
    raise TypeError(
        f"geometry_of(shape) got a {type(shape).__name__}; allowed are the shapes of avalanche_gym.physics.shapes, "
        "for other things give a Geometry."
    )
