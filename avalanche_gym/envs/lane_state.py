"""The state of one lane, cut out of a batch, and put back into any lane of a task of the same kind."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import physics

CONTACT_TABLES = ("contacts", "asleep_contacts")


@dataclass(frozen=True, eq=False)
class LaneState:
    """Every bit that decides the future of one lane; can be kept, copied and pickled."""

    task: str  # which kind of environment it belongs to
    level: str
    world: dict[str, NDArray[Any]]  # of a snapshot of the physics, without the axis of worlds
    arrays: dict[str, NDArray[Any]]  # of the task
    observation: NDArray[np.float32]
    generator: dict[str, Any]  # state of the lane's random numbers
    elapsed: int = 0  # environment steps since the episode began; counted by vector environments only
    ended: bool = False  # the episode is over; known to vector environments only

    def with_elapsed(self, elapsed: int, ended: bool) -> LaneState:
        """The same state with what a vector environment counts."""
        return replace(self, elapsed=elapsed, ended=ended)


def world_of_lane(arrays: Mapping[str, NDArray[Any]], lane: int, num_worlds: int) -> dict[str, NDArray[Any]]:
    """One world of a snapshot; tables that all worlds share are kept whole."""
    found = {name: array[lane if len(array) == num_worlds else 0].copy() for name, array in arrays.items()}
    # Rows beyond the count are left over from earlier steps and say nothing.
    for name in CONTACT_TABLES:
        found[name] = found[name][: found[f"num_{name}"]].copy()
    return found


def restore_worlds(world: physics.World, lanes: Mapping[int, Mapping[str, NDArray[Any]]]) -> None:
    """Write worlds that ``world_of_lane`` cut out into the given lanes; the other lanes keep every bit."""
    snapshot = world.snapshot()
    arrays = snapshot.arrays
    for table in CONTACT_TABLES:
        most = max(len(saved[table]) for saved in lanes.values())
        contacts = arrays[table]
        if contacts.shape[1] < most:
            arrays[table] = np.zeros((len(contacts), most), contacts.dtype)
            arrays[table][:, : contacts.shape[1]] = contacts
    for lane, saved in lanes.items():
        for name, value in saved.items():
            array = arrays[name]
            if name in CONTACT_TABLES:
                array[lane, : len(value)] = value
            elif len(array) == world.num_worlds:
                array[lane] = value
            elif not np.array_equal(array[0], value):
                arrays[name] = np.repeat(array, world.num_worlds, axis=0)
                arrays[name][lane] = value
    world.restore(snapshot)
