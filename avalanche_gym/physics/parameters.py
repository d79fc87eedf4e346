"""Changing what a running world is made of: parameters, heights, and what is carried over when bodies come and go."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .mass_properties import check_inertia, check_mass
from .model import HEIGHT_FIELD
from .scene import Body, check_coefficient
from .storage import Storage

COEFFICIENTS = ("friction", "restitution", "rolling_friction", "torsional_friction")
IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])


def _one_each(name: str, value: ArrayLike, chosen: int, tail: tuple[int, ...] = ()) -> NDArray[np.float64]:
    """``value`` as an array (chosen, *tail)."""
    try:
        array = np.asarray(value, dtype=np.float64)
        return np.broadcast_to(array, (chosen, *tail))
    except (TypeError, ValueError):
        shapes = f"{tail or 'one number'} or one for each of the {chosen} selected worlds"
        raise ValueError(f"set_parameters({name}) has shape {np.shape(value)}; give {shapes}.") from None


def set_parameters(
    rows: NDArray[Any], body: Body | None, index: int, mask: NDArray[np.bool_], values: dict[str, ArrayLike]
) -> None:
    """Check all values, then write them into ``rows`` (worlds, bodies) of model.BODY."""
    assert body is not None
    unknown = sorted(set(values) - {"mass", "inertia", *COEFFICIENTS})
    if unknown:
        raise TypeError(f"set_parameters({unknown[0]}=...): allowed are mass, inertia, {', '.join(COEFFICIENTS)}.")
    chosen = int(mask.sum())
    checked: dict[str, NDArray[np.float64]] = {}
    for name, value in values.items():
        label = f"Body {body.name!r}: {name}"
        if name in ("mass", "inertia") and body.motion != "dynamic":
            raise ValueError(f"{label} on a {body.motion} body, which has none; leave it out.")
        checked[name] = _one_each(name, value, chosen, (3,) if name == "inertia" else ())
        for entry in checked[name]:
            if name == "mass":
                check_mass(label, float(entry))
            elif name == "inertia":
                check_inertia(label, entry)
            else:
                check_coefficient(label, name, float(entry))
    if "inertia" in checked and not np.array_equal(rows["principal"][0, index], IDENTITY):
        raise ValueError(
            f"Body {body.name!r}: inertia can be set while running only where the body axes are principal axes; "
            "scale its mass instead, or build another world."
        )
    changed = rows[mask, index]
    if "mass" in checked:
        changed["inertia"] *= (checked["mass"] / changed["mass"])[:, None]
        changed["mass"] = checked["mass"]
    if "inertia" in checked:
        changed["inertia"] = checked["inertia"]
    if "mass" in checked or "inertia" in checked:
        changed["inverse_mass"] = 1.0 / changed["mass"]
        changed["inverse_inertia"] = 1.0 / changed["inertia"]
    for name in COEFFICIENTS:
        if name in checked:
            changed[name] = checked[name]
    rows[mask, index] = changed


def set_heights(
    storage: Storage,
    row: int,
    mask: NDArray[np.bool_],
    heights: ArrayLike | None,
    height_rates: ArrayLike | None,
    all_worlds: bool,
) -> None:
    """Write samples and rates of one height field; see World.set_heights."""
    field = storage.arrays["height_fields"][row]
    shape = (int(field["rows"]), int(field["columns"]))
    chosen = int(mask.sum())
    given: dict[str, NDArray[np.float64]] = {}
    for name, value in (("heights", heights), ("height_rates", height_rates)):
        if value is None:
            continue
        array = np.asarray(value, dtype=np.float64)
        if array.shape not in (shape, (chosen, *shape)):
            raise ValueError(f"set_heights({name}) has shape {array.shape}; give {shape} or {(chosen, *shape)} [m].")
        if not np.isfinite(array).all():
            raise ValueError(f"set_heights({name}) holds values that are not finite; replace them.")
        given[name] = array.reshape(-1, shape[0] * shape[1])
    given.setdefault("height_rates", np.zeros((1, shape[0] * shape[1])))
    apart = not all_worlds or any(len(array) > 1 for array in given.values())
    if apart and storage.num_worlds > 1:
        storage.separate_heights()
    samples = slice(int(field["first"]), int(field["first"]) + shape[0] * shape[1])
    for name, array in given.items():
        pool = storage.arrays[name]
        if len(pool) == storage.num_worlds:
            pool[mask, samples] = array
        else:
            pool[0, samples] = array[0]
    if "heights" in given:
        field["lowest"] = min(float(field["lowest"]), float(given["heights"].min()))
        field["highest"] = max(float(field["highest"]), float(given["heights"].max()))
    storage.link()


def carry_parameters(old: NDArray[Any], new: NDArray[Any], kept: list[int]) -> None:
    """Parameters set while running stay when the tables are built anew."""
    for name in ("mass", "inverse_mass", "inertia", "inverse_inertia", *COEFFICIENTS):
        new[name][:, kept] = old[name][:, kept]


def carry_heights(old: Storage, new: Storage, kept: list[int]) -> None:
    """Moved samples stay where they are when the tables are built anew."""
    for collider in new.arrays["colliders"]:
        before = old.arrays["bodies"]["first_collider"][0]
        body = int(collider["body"])
        if collider["shape"] != HEIGHT_FIELD or body not in kept:
            continue
        source = old.arrays["height_fields"][old.arrays["colliders"][before[body]]["data"]]
        target = new.arrays["height_fields"][collider["data"]]
        size = int(source["rows"] * source["columns"])
        for name in ("heights", "height_rates"):
            values = old.arrays[name][:, source["first"] : source["first"] + size]
            new.arrays[name][:, target["first"] : target["first"] + size] = values
        target["lowest"], target["highest"] = source["lowest"], source["highest"]
    new.link()


def carry_contacts(old: Storage, new: Storage, changed: int) -> None:
    """Contacts that do not concern the body ``changed`` keep their impulses; their colliders may have new numbers."""
    count = int(old.arrays["num_contacts"][0])
    rows = old.arrays["contacts"][0, :count]
    rows = rows[(rows["body_a"] != changed) & (rows["body_b"] != changed)].copy()
    num_old, num_new = len(old.arrays["colliders"]), len(new.arrays["colliders"])
    shift = new.arrays["bodies"]["first_collider"][0, : old.num_bodies]
    shift = shift - old.arrays["bodies"]["first_collider"][0, : len(shift)]
    if len(rows):
        first, second = np.divmod(rows["pair"], num_old)
        rows["pair"] = (first + shift[rows["body_a"]]) * num_new + second + shift[rows["body_b"]]
    if len(rows) > new.arrays["contacts"].shape[1]:
        new.grow_contacts(len(rows))
    new.arrays["contacts"][0, : len(rows)] = rows
    new.arrays["num_contacts"][0] = len(rows)
