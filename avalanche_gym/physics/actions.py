"""What acts on the bodies of a World: impulses, forces, states and parameters that are set, heights, waking."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import frames
from .contacts.sleeping import wake
from .readings import Readings
from .selection import WorldIndex, select_body, select_worlds, spread
from .shapes import HeightField, checks
from .tables import height_samples, parameters


class Actions(Readings):
    """The part of a World that changes bodies between steps; none of it adds or removes one."""

    def apply_impulse(
        self, body: int, impulse: ArrayLike, point: ArrayLike | None = None, world: WorldIndex = None
    ) -> None:
        """Change the velocity of a dynamic body at once.

        An impulse so large that the kinetic energy would not be finite waits for the next ``step``, which refuses it.

        Args:
            body: handle.
            impulse: (3,) or (selected worlds, 3) [N s], world frame.
            point: (3,) or (selected worlds, 3) [m], world frame, where it acts; the centre of mass by default.
            world: which worlds: an index, a slice, a boolean mask, or ``None`` for all.
        """
        self._push("apply_impulse", "impulse", body, impulse, point, world, False)

    def apply_force(
        self, body: int, force: ArrayLike, point: ArrayLike | None = None, world: WorldIndex = None
    ) -> None:
        """Hold a force [N] on a dynamic body through every step of the next ``step`` call; calls add up.

        The moment about the centre of mass is that of the present place of ``point``. Arguments as in apply_impulse.
        """
        self._push("apply_force", "force", body, force, point, world, True)

    def _push(
        self,
        call: str,
        what: str,
        body: int,
        value: ArrayLike,
        point: ArrayLike | None,
        world: WorldIndex,
        hold: bool,
    ) -> None:
        index = select_body(self, call, body, moving="dynamic")
        mask = select_worlds(self, call, world)
        values = spread(f"{call}({what})", value, mask, 3)
        points = np.full((self.num_worlds, 3), np.nan)
        if point is not None:
            points = spread(f"{call}(point)", point, mask, 3)
        self._wake(mask, index)
        frames.apply_impulses(self._address, mask, index, values, points, hold)

    def set_state(
        self,
        body: int,
        *,
        position: ArrayLike | None = None,
        orientation: ArrayLike | None = None,
        linear_velocity: ArrayLike | None = None,
        angular_velocity: ArrayLike | None = None,
        world: WorldIndex = None,
    ) -> None:
        """Place a body and set its velocities; what is ``None`` stays. One value for all selected worlds, or one each.

        A kinematic body keeps the velocities until they are set again; a static one can be placed but has no velocity.
        """
        index = select_body(self, "set_state", body)
        mask = select_worlds(self, "set_state", world)
        given: dict[str, NDArray[np.float64]] = {}
        for name, value, width in (
            ("position", position, 3),
            ("orientation", orientation, 4),
            ("linear_velocity", linear_velocity, 3),
            ("angular_velocity", angular_velocity, 3),
        ):
            if value is not None:
                given[name] = spread(f"set_state({name})", value, mask, width)
        if orientation is not None:
            for number in np.flatnonzero(mask):
                given["orientation"][number] = checks.unit_quaternion(
                    "set_state(orientation)", given["orientation"][number]
                )
        description = self.scene.bodies[index]
        if description is not None and description.motion == "static":
            for name in ("linear_velocity", "angular_velocity"):
                if name in given and given[name].any():
                    raise ValueError(
                        f"set_state({name}) on the static body {description.name!r}, which has no velocity; give it "
                        "motion='kinematic' to move it."
                    )
        self._wake(mask, index)
        for name, values in given.items():
            self._storage.arrays[name][mask, index] = values[mask]
        frames.adopt(self._address, mask, index)

    def set_parameters(self, body: int, *, world: WorldIndex = None, **values: ArrayLike) -> None:
        """Change parameters of a body in some worlds, without a rebuild: domain randomisation.

        Args:
            body: handle.
            world: as in apply_impulse.
            values: any of ``shape``, the number of one of the alternatives of the body (0: its own), which brings
                its mass and inertia along (the frame that shapes are given in stays where it is), ``mass`` [kg] (the
                inertia follows in proportion), ``inertia`` (3,) or (3, 3) [kg m^2] with the principal axes that the
                shape has, ``friction``, ``restitution``, ``rolling_friction`` [m], ``torsional_friction`` [m]; one for
                all selected worlds or one each. Pairs fixed by ``Scene.set_pair`` keep their values.
        """
        index = select_body(self, "set_parameters", body)
        mask = select_worlds(self, "set_parameters", world)
        choices = self._tables.choices.get(index)
        parameters.set_parameters(self._storage, choices, self.scene.bodies[index], index, mask, values)
        self._wake(mask, index)
        self._forget_places(mask)
        if "shape" in values:
            frames.adopt(self._address, mask, index)
            self._prober = None

    def set_heights(
        self,
        body: int,
        heights: ArrayLike | None = None,
        height_rates: ArrayLike | None = None,
        *,
        world: WorldIndex = None,
    ) -> None:
        """Replace the samples of a height field, and how fast they move.

        Args:
            body: handle of a static or kinematic height field.
            heights: (rows, columns) or (selected worlds, rows, columns) [m]; ``None`` keeps them. Where they lie in one
                plane, but for 1e-9 of the size of the field, they are put into it.
            height_rates: the same [m/s]; heights advance by them, and contacts feel them as the velocity of the ground,
                until set again. ``None`` means at rest.
            world: as in apply_impulse. Worlds share terrain that is the same in all and at rest; otherwise each gets
                its own copy.
        """
        index = select_body(self, "set_heights", body)
        mask = select_worlds(self, "set_heights", world)
        description = self.scene.bodies[index]
        assert description is not None
        if not isinstance(description.shape, HeightField):
            kind = type(description.shape).__name__
            raise ValueError(f"set_heights: body {description.name!r} is a {kind}; give the handle of a HeightField.")
        if height_rates is not None and description.motion != "kinematic":
            raise ValueError(
                f"set_heights(height_rates): {description.name!r} is {description.motion}; moving ground needs "
                'motion="kinematic".'
            )
        row = self._tables.shapes.height_field_rows[index]
        height_samples.set_heights(self._storage, row, mask, heights, height_rates)
        self._wake(mask, index)
        self._forget_places(mask)

    def wake(self, body: int | None = None, *, world: WorldIndex = None) -> None:
        """Wake a body and all that rests on it or bears it; everything if ``body`` is ``None``, or is not dynamic.

        Args:
            body: handle.
            world: as in apply_impulse.
        """
        index = -1 if body is None else select_body(self, "wake", body)
        self._wake(select_worlds(self, "wake", world), index)

    def _wake(self, mask: NDArray[np.bool_], index: int) -> None:
        if self._storage.arrays["num_asleep_contacts"].any() or self.sleeping.any():
            wake(self._address, mask, index)

    def _forget_places(self, mask: NDArray[np.bool_]) -> None:
        """What stands where it did may have other contacts, or impulses, now."""
        self._storage.arrays["rest"]["seen"][mask] = 0.0
