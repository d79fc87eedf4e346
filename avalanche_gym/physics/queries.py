"""Ray cast, nearest point and overlap: checks of what comes in, and the kernels of probes/."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .given import real_array, real_number
from .jit import Stage
from .model import CONTACT, NUM_SHAPES
from .narrow_phase.pair_query import PAIR_QUERY, SCRATCH_ROWS
from .probes.ask import HIT_DTYPE, NEAREST_STAGES, RAY_STAGES, cast_rays, nearest_points
from .probes.overlap import overlapping_bodies
from .probes.probe import PROBE
from .selection import select_body, select_worlds
from .shapes import Box, Capsule, Cylinder, Shape, Sphere, checks
from .stages import pair_stage

if TYPE_CHECKING:
    from .readings import Readings
    from .selection import WorldIndex

MOST_CONTACTS = 64  # room for those of one pair of shapes


class Prober:
    """Asks one World; made anew when its tables are."""

    def __init__(self, world: Readings) -> None:
        self._world = world
        self._arrays = world._storage.arrays
        self._address = world._storage.address
        colliders = self._arrays["colliders"]
        self._shapes = sorted(set(colliders["shape"].tolist()))
        self._boxes = np.zeros((max(len(colliders), 1), 6))
        self._scratch = np.zeros((SCRATCH_ROWS, 8))
        self._probe = np.zeros(1, PROBE)
        self._probe["scratch"] = self._scratch.ctypes.data
        self._addresses: dict[str, NDArray[np.int64]] = {}

    def _functions(self, name: str, stages: dict[int, Stage]) -> NDArray[np.int64]:
        """(NUM_SHAPES,) addresses for the shapes of this world; these alone are compiled."""
        if name not in self._addresses:
            addresses = np.zeros(NUM_SHAPES, np.int64)
            for shape in self._shapes:
                addresses[shape] = stages[shape].address
            self._addresses[name] = addresses
        return self._addresses[name]

    def _worlds(self, call: str, world: WorldIndex) -> NDArray[np.int64]:
        return np.flatnonzero(select_worlds(self._world, call, world))

    def wanted(self, call: str, ignore: Any, only: Any) -> NDArray[np.bool_]:
        """(bodies,) which bodies count."""
        chosen = np.ones(self._world.num_bodies, np.bool_)
        if only is not None:
            chosen[:] = False
            chosen[self._handles(f"{call}(only)", only)] = True
        if ignore is not None:
            chosen[self._handles(f"{call}(ignore)", ignore)] = False
        return chosen

    def _handles(self, label: str, value: Any) -> list[int]:
        """Handles of one body, several, or a boolean mask (bodies,)."""
        if isinstance(value, np.ndarray) and value.dtype == np.bool_:
            if value.shape != (self._world.num_bodies,):
                raise ValueError(
                    f"{label} is a mask of shape {value.shape}; give one entry a body, ({self._world.num_bodies},)."
                )
            return [int(index) for index in np.flatnonzero(value)]
        # An array without axes claims to be iterable.
        single = isinstance(value, (str, bytes)) or (isinstance(value, np.ndarray) and value.ndim == 0)
        several = value if isinstance(value, Iterable) and not single else [value]
        return [select_body(self._world, label, one) for one in several]

    def ray_cast(
        self, origins: ArrayLike, directions: ArrayLike, max_distance: float, world: WorldIndex, ignore: Any, only: Any
    ) -> NDArray[Any]:
        """See World.ray_cast."""
        worlds = self._worlds("ray_cast", world)
        starts = _points("ray_cast(origins)", origins, worlds, world, "m")
        ways = _points("ray_cast(directions)", directions, worlds, world, "any length but zero")
        largest = np.abs(ways).max(axis=-1, keepdims=True)
        if not largest.all():
            where = tuple(int(i) for i in np.argwhere(largest[..., 0] == 0.0)[0])
            raise ValueError(f"ray_cast(directions) is zero at {where}; give a direction of any other length.")
        # By a power of two, which rounds nothing: squares of what is very long or short would not be floats.
        ways = np.ldexp(ways, -np.frexp(largest)[1])
        lengths = np.linalg.norm(ways, axis=-1, keepdims=True)
        count = _common("ray_cast", starts.shape[1], ways.shape[1], "origins", "directions")
        starts, ways = (
            np.ascontiguousarray(np.broadcast_to(array, (len(array), count, 3))) for array in (starts, ways / lengths)
        )
        results = np.empty((len(worlds), count), HIT_DTYPE)
        functions = self._functions("ray", RAY_STAGES)
        limit = _distance("ray_cast(max_distance)", max_distance)
        wanted = self.wanted("ray_cast", ignore, only)
        probe = self._probe.ctypes.data
        cast_rays(self._address, probe, functions, worlds, starts, ways, limit, wanted, self._boxes, results)
        single = np.ndim(origins) == 1 and np.ndim(directions) == 1
        return _unwrapped(results, world, single)

    def closest_point(
        self, points: ArrayLike, max_distance: float, world: WorldIndex, ignore: Any, only: Any
    ) -> NDArray[Any]:
        """See World.closest_point."""
        worlds = self._worlds("closest_point", world)
        places = np.ascontiguousarray(_points("closest_point(points)", points, worlds, world, "m"))
        results = np.empty((len(worlds), places.shape[1]), HIT_DTYPE)
        functions = self._functions("nearest", NEAREST_STAGES)
        limit = _distance("closest_point(max_distance)", max_distance)
        wanted = self.wanted("closest_point", ignore, only)
        probe = self._probe.ctypes.data
        nearest_points(self._address, probe, functions, worlds, places, limit, wanted, self._boxes, results)
        return _unwrapped(results, world, np.ndim(points) == 1)

    def overlap(
        self, shape: Shape, position: ArrayLike, orientation: ArrayLike, world: WorldIndex, ignore: Any, only: Any
    ) -> NDArray[np.bool_]:
        """See World.overlap."""
        if not isinstance(shape, (Sphere, Capsule, Box, Cylinder)):
            raise TypeError(f"overlap(shape={shape!r}): give a Sphere, Capsule, Box or Cylinder.")
        worlds = self._worlds("overlap", world)
        place = checks.finite_array("overlap(position)", position, (3,), "(x, y, z) in m")
        turn = checks.unit_quaternion("overlap(orientation)", orientation)
        functions = self._pair_functions(shape)
        query = np.zeros(1, PAIR_QUERY)
        contacts = np.zeros(MOST_CONTACTS, CONTACT)
        query["header"], query["contacts"], query["capacity"] = self._address, contacts.ctypes.data, len(contacts)
        query["scratch"], query["scratch_rows"] = self._scratch.ctypes.data, SCRATCH_ROWS
        results = np.zeros((len(worlds), self._world.num_bodies), np.bool_)
        overlapping_bodies(
            self._address,
            query.ctypes.data,
            functions,
            worlds,
            shape.code,
            np.array(shape.size),
            shape.bounding_radius,
            place,
            turn,
            self.wanted("overlap", ignore, only),
            results,
        )
        return results[0] if isinstance(world, (int, np.integer)) else results

    def _pair_functions(self, shape: Shape) -> NDArray[np.int64]:
        """(NUM_SHAPES,) addresses of the contact functions of the pairs with a shape."""
        name = f"overlap {shape.code}"
        if name not in self._addresses:
            addresses = np.zeros(NUM_SHAPES, np.int64)
            for other in self._shapes:
                addresses[other] = pair_stage((min(shape.code, other), max(shape.code, other))).address
            self._addresses[name] = addresses
        return self._addresses[name]


def _points(
    name: str, value: ArrayLike, worlds: NDArray[np.int64], world: WorldIndex, unit: str
) -> NDArray[np.float64]:
    """(1 or worlds, n, 3) of (3,), (n, 3) or, for several worlds, (selected worlds, n, 3)."""
    allowed = "(3,) or (n, 3)"
    one_world = isinstance(world, (int, np.integer))
    if not one_world:
        allowed += f", or ({len(worlds)}, n, 3)"
    try:
        array = real_array(value)
    except (TypeError, ValueError):
        raise TypeError(f"{name} is not numeric; give shape {allowed} [{unit}].") from None
    fits = array.ndim in (1, 2) or (array.ndim == 3 and len(array) == len(worlds) and not one_world)
    if not fits or array.shape[-1] != 3:
        raise ValueError(f"{name} has shape {array.shape}; give shape {allowed} [{unit}].")
    if not np.isfinite(array).all():
        where = tuple(int(i) for i in np.argwhere(~np.isfinite(array))[0])
        raise ValueError(f"{name} is {array[where]} at index {where}; give finite numbers.")
    return array if array.ndim == 3 else array.reshape(1, -1, 3)


def _common(call: str, a: int, b: int, name_a: str, name_b: str) -> int:
    if a != b and 1 not in (a, b):
        raise ValueError(f"{call}: {a} {name_a} and {b} {name_b}; give as many of both, or one of either.")
    return a if b == 1 else b


def _distance(name: str, value: float) -> float:
    number = real_number(value)
    if number is None or not number >= 0.0:
        raise ValueError(f"{name}={value!r}; give a distance of at least zero in m, or math.inf.")
    return number


def _unwrapped(results: NDArray[Any], world: WorldIndex, single: bool) -> NDArray[Any]:
    """Without the axis of worlds for one world, and without that of rays for a single one."""
    if single:
        results = results[:, 0]
    return results[0] if isinstance(world, (int, np.integer)) else results
