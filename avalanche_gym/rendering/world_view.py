"""The bodies of a physics world as something to draw: the only place where rendering knows of worlds."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING
from weakref import WeakKeyDictionary

import numpy as np

from ..physics.shapes import HeightField, Plane, Shape
from .color import STATIC, Color, palette_color
from .geometry import Geometry
from .primitives import sphere
from .scene_view import SceneView, Visual
from .shape_geometry import geometry_of

if TYPE_CHECKING:
    from ..physics.scene import Body
    from ..physics.world import World


class BodyLooks:
    """How the bodies of worlds look: colour, mesh and opacity of each.

    Args:
        colors: by the name of the body; others take the colours of the palette in turn, static ones grey. They multiply
            with the colours of a mesh, so ground that is coloured by height takes white.
        geometries: by the name of the body, drawn in place of its shape.
        hidden: names of bodies that are not drawn.
        opacities: by the name of the body, in [0, 1].
    """

    def __init__(
        self,
        colors: Mapping[str, Color] | None = None,
        geometries: Mapping[str, Geometry] | None = None,
        hidden: tuple[str, ...] = (),
        opacities: Mapping[str, float] | None = None,
    ) -> None:
        self._colors, self._geometries = dict(colors or {}), dict(geometries or {})
        self.hidden, self._opacities = hidden, dict(opacities or {})
        self._meshes: WeakKeyDictionary[Shape, Geometry] = WeakKeyDictionary()

    def check(self, world: World) -> None:
        """Raises: ValueError: a name that no body of the world has."""
        names = [body.name for body in world.scene.bodies if body is not None]
        for name in (*self._colors, *self._geometries, *self.hidden, *self._opacities):
            if name not in names:
                raise ValueError(f"WorldView got the name {name!r}, which no body has; there are {', '.join(names)}.")

    def visual(self, body: Body, index: int) -> Visual:
        """What is drawn for a body with this handle."""
        shape = body.shape if body.visual is None else body.visual
        geometry = self._geometries.get(body.name)
        if geometry is None:
            # Bodies that share a shape share its mesh.
            geometry = self._meshes.get(shape)
            if geometry is None:
                geometry = self._meshes[shape] = geometry_of(shape)
        is_ground = body.motion == "static"
        color = "#ffffff" if geometry.colors is not None else STATIC if is_ground else palette_color(index)
        return Visual(
            geometry,
            self._colors.get(body.name, color),
            opacity=self._opacities.get(body.name, 1.0),
            static=is_ground,
            gloss=0.0 if isinstance(shape, (HeightField, Plane)) else 0.12,
            position=body.position,  # type: ignore[arg-type]
            orientation=body.orientation,  # type: ignore[arg-type]
        )


class WorldView(SceneView):
    """One visual for each body of a world, at its handle.

    Args:
        world: from which bodies and first poses are taken. Every world of the batch is drawn with the same view, one
            ``update`` after the other.
        colors, geometries, hidden, opacities: see BodyLooks.

    Attributes:
        looks: the BodyLooks.

    Raises:
        ValueError: a name that no body has.
    """

    def __init__(
        self,
        world: World,
        colors: Mapping[str, Color] | None = None,
        geometries: Mapping[str, Geometry] | None = None,
        hidden: tuple[str, ...] = (),
        opacities: Mapping[str, float] | None = None,
    ) -> None:
        self.looks = BodyLooks(colors, geometries, hidden, opacities)
        self.looks.check(world)
        self._adopt(world)
        self.update(world)

    def _adopt(self, world: World) -> None:
        self._bodies = list(world.scene.bodies)
        gone = Visual(sphere(1.0), position=(np.nan, np.nan, np.nan))
        super().__init__(
            [gone if body is None else self.looks.visual(body, index) for index, body in enumerate(self._bodies)]
        )
        hidden = [body is None or body.name in self.looks.hidden for body in self._bodies]
        self.set_visible(~np.array(hidden, dtype=bool))

    def update(self, world: World, index: int = 0) -> None:
        """Take the poses of one world of the batch, and the bodies that have come or gone since."""
        bodies = world.scene.bodies
        if len(bodies) != len(self._bodies) or any(a is not b for a, b in zip(bodies, self._bodies, strict=True)):
            self._adopt(world)
        self.set_poses(world.position[index], world.orientation[index])

    def index(self, name: str) -> int:
        """The number of the visual of the body with this name."""
        for number, body in enumerate(self._bodies):
            if body is not None and body.name == name:
                return number
        raise ValueError(f"No body is named {name!r}.")
