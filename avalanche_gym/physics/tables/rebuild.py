"""What the tables of a world take over when they are built anew: parameters, heights, contacts.

Colliders and height fields may have other numbers then; handles of bodies stay.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..layout import HEIGHT_POOLS
from ..model import HEIGHT_FIELD, SMOOTH_FIELD
from .parameters import COEFFICIENTS
from .storage import Storage


def carry_parameters(old: Storage, new: Storage, kept: list[int]) -> None:
    """Parameters set while running stay when the tables are built anew."""
    for name in ("mass", "inverse_mass", "inertia", "inverse_inertia", "flow", *COEFFICIENTS):
        new.arrays["bodies"][name][:, kept] = old.arrays["bodies"][name][:, kept]
    new.arrays["proportions"][:, kept] = old.arrays["proportions"][:, kept]


def carry_memories(old: Storage, new: Storage, kept: list[int]) -> None:
    """What driven bodies did before, and how crowds were solved, stays; where bodies stood is to be asked again."""
    for name in old.arrays["rest"].dtype.names or ():
        if name not in ("asleep", "seen"):
            new.arrays["rest"][name][:, kept] = old.arrays["rest"][name][:, kept]


def carry_heights(old: Storage, new: Storage, kept: list[int]) -> None:
    """Moved samples stay where they are when the tables are built anew."""
    shift = _first_colliders(old) - _first_colliders(new)[: old.num_bodies]
    for number, collider in enumerate(new.arrays["colliders"]):
        if collider["shape"] not in (HEIGHT_FIELD, SMOOTH_FIELD) or int(collider["body"]) not in kept:
            continue
        before = old.arrays["colliders"][number + shift[collider["body"]]]
        source = old.arrays["height_fields"][before["data"]]
        target = new.arrays["height_fields"][collider["data"]]
        size = int(source["size"])
        for name in HEIGHT_POOLS:
            values = old.arrays[name][:, source["first"] : source["first"] + size]
            new.arrays[name][:, target["first"] : target["first"] + size] = values
    new.bound_heights()


def carry_contacts(old: Storage, new: Storage, changed: int) -> None:
    """Contacts that do not concern the body ``changed`` keep their impulses; their colliders may have new numbers."""
    count = int(old.arrays["num_contacts"][0])
    rows = old.arrays["contacts"][0, :count]
    rows = rows[(rows["body_a"] != changed) & (rows["body_b"] != changed)].copy()
    num_old, num_new = len(old.arrays["colliders"]), len(new.arrays["colliders"])
    shift = _first_colliders(new)[: old.num_bodies] - _first_colliders(old)
    if len(rows):
        first, second = np.divmod(rows["pair"], num_old)
        rows["pair"] = (first + shift[rows["body_a"]]) * num_new + second + shift[rows["body_b"]]
    if len(rows) > new.arrays["contacts"].shape[1]:
        new.resize_contacts(len(rows))
    new.arrays["contacts"][0, : len(rows)] = rows
    new.arrays["num_contacts"][0] = len(rows)


def renumbered(saved: dict[str, NDArray[Any]], new: Storage) -> dict[str, NDArray[Any]]:
    """What ``Storage.save`` returned, for tables built anew, in the order of the handles."""
    bodies = saved["bodies"].copy()
    tables = {name: saved[name].copy() for name in ("contacts", "asleep_contacts")}
    own = new.arrays["bodies"]
    shift = own["first_collider"] - bodies["first_collider"]
    for name in ("first_collider", "material"):
        bodies[name] = own[name]
    count = len(new.arrays["colliders"])
    for name, contacts in tables.items():
        for rows, moved, number in zip(contacts, shift, saved[f"num_{name}"].tolist(), strict=True):
            used = rows[:number]
            first, second = np.divmod(used["pair"], max(count, 1))
            used["pair"] = (first + moved[used["body_a"]]) * count + second + moved[used["body_b"]]
    return {**saved, "bodies": bodies, **tables}


def _first_colliders(storage: Storage) -> NDArray[np.int64]:
    """(bodies,) number of the first collider of each body."""
    first: NDArray[np.int64] = storage.arrays["bodies"]["first_collider"][0]
    return first
