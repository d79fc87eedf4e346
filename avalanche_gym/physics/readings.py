"""What a World tells without changing: what is where, energies, contacts, the report of the last call."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .diagnostics import measure
from .queries import Prober
from .report import StepReport, describe_steps
from .scene import Scene
from .selection import WorldIndex, select_body, select_world
from .shapes import Shape
from .tables import height_samples
from .tables.construction import Tables
from .tables.storage import Storage

CONTACT_DTYPE = np.dtype(
    [
        ("body_a", np.int64),
        ("body_b", np.int64),
        ("position", np.float64, 3),  # [m] world frame
        ("normal", np.float64, 3),  # unit, from a to b
        ("gap", np.float64),  # [m] at the end of the step, positive apart
        ("impulse", np.float64, 3),  # [N s] on body_b, summed over the last step
    ]
)


class Readings:
    """The part of a World that reads its tables; those that inherit it change and build them."""

    scene: Scene
    _storage: Storage
    _tables: Tables
    _address: int
    _prober: Prober | None

    @property
    def num_worlds(self) -> int:
        return self._storage.num_worlds

    @property
    def num_bodies(self) -> int:
        """Handles in use or free: the length of axis 1 of every state array."""
        return self._storage.num_bodies

    # --- Asking where things are --------------------------------------------------------------------------------------

    def _ask(self) -> Prober:
        if self._prober is None:
            self._prober = Prober(self)
        return self._prober

    def ray_cast(
        self,
        origins: ArrayLike,
        directions: ArrayLike,
        *,
        max_distance: float = math.inf,
        world: WorldIndex = None,
        ignore: Any = None,
        only: Any = None,
    ) -> NDArray[Any]:
        """The first surface that each ray meets, in bodies where they are now.

        A ray that starts inside a solid meets it at distance 0, its normal against the ray. An open mesh is met on its
        counter-clockwise side only, a two-sided one on both.

        Args:
            origins: (3,), (n, 3), or (selected worlds, n, 3) [m], world frame.
            directions: the same, of any length but zero; one origin goes with many directions, and the reverse.
            max_distance: [m] what is farther does not count.
            world: as in apply_impulse.
            ignore: a handle, several, or a boolean mask (bodies,): bodies that do not count.
            only: the same: bodies that alone count.

        Returns:
            Records ``body`` (handle, -1 for a miss), ``distance`` [m] (infinite for a miss), ``position`` (3,) [m],
            ``normal`` (3,) unit, outward (both NaN for a miss): shape (selected worlds, n), without the first axis if
            ``world`` is an int, without the last for a single ray.
        """
        return self._ask().ray_cast(origins, directions, max_distance, world, ignore, only)

    def closest_point(
        self,
        points: ArrayLike,
        *,
        max_distance: float = math.inf,
        world: WorldIndex = None,
        ignore: Any = None,
        only: Any = None,
    ) -> NDArray[Any]:
        """The nearest surface to each point, in bodies where they are now.

        Args:
            points: (3,), (n, 3), or (selected worlds, n, 3) [m], world frame.
            max_distance, world, ignore, only: as in ray_cast.

        Returns:
            Records as of ray_cast; ``distance`` is negative inside a solid, where the deepest one counts, and
            ``position`` is the point of the surface: point - distance * normal.
        """
        return self._ask().closest_point(points, max_distance, world, ignore, only)

    def overlap(
        self,
        shape: Shape,
        position: ArrayLike,
        orientation: ArrayLike = (1.0, 0.0, 0.0, 0.0),
        *,
        world: WorldIndex = None,
        ignore: Any = None,
        only: Any = None,
    ) -> NDArray[np.bool_]:
        """Which bodies a Sphere, Capsule, Box or Cylinder would overlap or touch there; nothing is added to the world.

        Args:
            shape: what is placed; position (3,) [m] and orientation (4,) wxyz, world frame.
            world, ignore, only: as in ray_cast.

        Returns:
            (selected worlds, bodies), without the first axis if ``world`` is an int.
        """
        return self._ask().overlap(shape, position, orientation, world, ignore, only)

    # --- Reading ------------------------------------------------------------------------------------------------------

    def _measure(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        energies, momenta = np.empty((self.num_worlds, 2)), np.empty((self.num_worlds, 6))
        measure(self._address, energies, momenta)
        return energies, momenta

    def kinetic_energy(self) -> NDArray[np.float64]:
        """(worlds,) [J] of the dynamic bodies."""
        return self._measure()[0][:, 0]

    def potential_energy(self) -> NDArray[np.float64]:
        """(worlds,) [J]: the sum of -m g.x and -m mu/r over dynamic bodies."""
        return self._measure()[0][:, 1]

    def linear_momentum(self) -> NDArray[np.float64]:
        """(worlds, 3) [kg m/s] of the dynamic bodies."""
        return self._measure()[1][:, :3]

    def angular_momentum(self) -> NDArray[np.float64]:
        """(worlds, 3) [kg m^2/s] of the dynamic bodies about the world's origin."""
        return self._measure()[1][:, 3:]

    @property
    def sleeping(self) -> NDArray[np.bool_]:
        """(worlds, bodies) whether a body is asleep: in balance, and left alone until something disturbs it."""
        asleep: NDArray[np.bool_] = self._storage.arrays["rest"]["asleep"] > 0
        return asleep

    def contacts(self, world: int = 0) -> NDArray[Any]:
        """The contacts of the last step of one world, as records of CONTACT_DTYPE; those of what sleeps come last."""
        number = select_world(self, "contacts", world)
        arrays = self._storage.arrays
        rows = arrays["contacts"][number, : arrays["num_contacts"][number]]
        asleep = arrays["asleep_contacts"][number, : arrays["num_asleep_contacts"][number]]
        if len(asleep):
            rows = np.concatenate((rows, asleep))
        found = np.empty(len(rows), CONTACT_DTYPE)
        for name in CONTACT_DTYPE.names or ():
            found[name] = rows[name]
        found["impulse"] += rows["blow"]
        return found

    def heights(self, body: int, world: int = 0) -> NDArray[np.float64]:
        """(rows, columns) [m] the present samples of a height field in one world."""
        index = select_body(self, "heights", body)
        number = select_world(self, "heights", world)
        if index not in self._tables.shapes.height_field_rows:
            kind = type(getattr(self.scene.bodies[index], "shape", None)).__name__
            raise ValueError(f"heights({body}): this body is a {kind}; give the handle of a HeightField.")
        return height_samples.heights_of(self._storage, self._tables.shapes.height_field_rows[index], number)

    def report(self) -> StepReport:
        """What the last call of ``step`` did; see StepReport."""
        return describe_steps(self._storage.arrays["reports"])
