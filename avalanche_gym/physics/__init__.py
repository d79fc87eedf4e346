"""The rigid-body engine. It knows nothing of Gymnasium."""

from .numba_start import load_numba

load_numba()

# ruff: noqa: E402  (Numba has to be loaded before the modules with kernels)
from .errors import PhysicsError
from .options import Options
from .report import Features, StepReport
from .scene import Material, PointGravity, Scene, UniformGravity
from .shapes import (
    Box,
    Capsule,
    Compound,
    ConvexHull,
    Cylinder,
    HeightField,
    Plane,
    RadialTerrain,
    Shape,
    Sphere,
    TriangleMesh,
)
from .world import Snapshot, World

__all__ = [
    "Box",
    "Capsule",
    "Compound",
    "ConvexHull",
    "Cylinder",
    "Features",
    "HeightField",
    "Material",
    "Options",
    "PhysicsError",
    "Plane",
    "PointGravity",
    "RadialTerrain",
    "Scene",
    "Shape",
    "Snapshot",
    "Sphere",
    "StepReport",
    "TriangleMesh",
    "UniformGravity",
    "World",
]
