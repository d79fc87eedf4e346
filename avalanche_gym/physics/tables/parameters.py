"""Changing what a running world is made of: parameters, heights, and what is carried over when bodies come and go."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..integrator.flight import flow_class
from ..layout import HEIGHT_POOLS
from ..mass_properties import check_inertia, check_mass, rotation_matrix
from ..model import HEIGHT_FIELD, SMOOTH_FIELD
from ..scene import Body, check_coefficient
from ..shapes.flatness import flattened
from ..shapes.height_spline import pool_of_field
from .storage import Storage

# What a body has of its shape.
OF_SHAPE = (
    *(
        "first_collider",
        "num_colliders",
        "radius",
        "size",
        "inner",
        "mass",
        "inverse_mass",
        "inertia",
        "inverse_inertia",
    ),
    *("principal", "origin", "flow"),
)
COEFFICIENTS = ("friction", "restitution", "rolling_friction", "torsional_friction")

# Products of inertia below this share of the largest moment are round-off of turning it to the principal axes.
SAME_AXES = 1e-12


def set_parameters(
    storage: Storage,
    choices: NDArray[Any] | None,
    body: Body | None,
    index: int,
    mask: NDArray[np.bool_],
    values: dict[str, ArrayLike],
) -> None:
    """Check all values, then write them into the table of bodies; see World.set_parameters."""
    assert body is not None
    rows = storage.arrays["bodies"]
    unknown = sorted(set(values) - {"shape", "mass", "inertia", *COEFFICIENTS})
    if unknown:
        allowed = ", ".join(("shape", "mass", "inertia", *COEFFICIENTS))
        raise TypeError(f"set_parameters({unknown[0]}=...): allowed are {allowed}.")
    chosen = int(mask.sum())
    changed = rows[mask, index]
    proportions = storage.arrays["proportions"][mask, index]
    values = dict(values)
    if "shape" in values:
        worn = _rows_with_shape(body, choices, values.pop("shape"), chosen)
        for name in OF_SHAPE:
            changed[name] = worn[name]
        for name in proportions.dtype.names or ():
            proportions[name] = worn[name]
    checked: dict[str, NDArray[np.float64]] = {}
    for name, value in values.items():
        label = f"Body {body.name!r}: {name}"
        if name in ("mass", "inertia") and body.motion != "dynamic":
            raise ValueError(f"{label} on a {body.motion} body, which has none; leave it out.")
        if name == "inertia":
            checked[name] = _principal_moments(label, value, changed["principal"])
            continue
        checked[name] = _one_each(name, value, chosen)
        for entry in checked[name].tolist():
            if name == "mass":
                check_mass(label, entry)
            else:
                check_coefficient(label, name, entry)
    if "mass" in checked:
        changed["mass"] = checked["mass"]
        changed["inertia"] = proportions["inertia"] * (checked["mass"] / proportions["mass"])[:, None]
    if "inertia" in checked:
        changed["inertia"] = proportions["inertia"] = checked["inertia"]
        proportions["mass"] = changed["mass"]
    if "mass" in checked or "inertia" in checked:
        changed["inverse_mass"] = 1.0 / changed["mass"]
        changed["inverse_inertia"] = 1.0 / changed["inertia"]
        changed["flow"] = [flow_class(moments) for moments in changed["inertia"].tolist()]
    for name in COEFFICIENTS:
        if name in checked:
            changed[name] = checked[name]
    rows[mask, index] = changed
    storage.arrays["proportions"][mask, index] = proportions
    storage.note_features()


def _rows_with_shape(body: Body, choices: NDArray[Any] | None, value: ArrayLike, chosen: int) -> NDArray[Any]:
    """(chosen,) of BODY: the body with the shapes of these numbers."""
    if choices is None:
        raise ValueError(
            f"Body {body.name!r}: shape={value!r}, but it has one shape alone; give add_body(alternatives=[...]) those "
            "that worlds may choose from."
        )
    numbers = np.asarray(value)
    known = numbers.dtype.kind in "iu" and numbers.shape in ((), (chosen,))
    if not known or (numbers < 0).any() or (numbers >= len(choices)).any():
        raise ValueError(
            f"Body {body.name!r}: shape={value!r}; give 0 for its own shape or 1 to {len(choices) - 1} for one of its "
            f"alternatives, one number or one for each of the {chosen} selected worlds."
        )
    rows: NDArray[Any] = choices[np.broadcast_to(numbers, (chosen,))]
    return rows


def _one_each(name: str, value: ArrayLike, chosen: int) -> NDArray[np.float64]:
    """``value`` as an array (chosen,)."""
    try:
        return np.broadcast_to(np.asarray(value, dtype=np.float64), (chosen,))
    except (TypeError, ValueError):
        allowed = f"one number, or one for each of the {chosen} selected worlds"
        raise ValueError(f"set_parameters({name}) is {value!r}; give {allowed}.") from None


def _principal_moments(label: str, value: ArrayLike, turns: NDArray[np.float64]) -> NDArray[np.float64]:
    """(chosen, 3) moments about the principal axes, of inertias (3,), (3, 3), (chosen, 3) or (chosen, 3, 3).

    ``turns`` (chosen, 4) lead from the body's axes to its principal axes, on which its tables rest.
    """
    chosen = len(turns)
    given = np.asarray(value, dtype=object)
    each = (given.shape == (chosen, 3) and given.shape != (3, 3)) or given.shape == (chosen, 3, 3)
    moments = np.empty((chosen, 3))
    for row, entry, turn in zip(moments, given if each else [value] * chosen, turns, strict=True):
        rotation = rotation_matrix(turn)
        tensor = rotation @ check_inertia(label, entry) @ rotation.T
        row[:] = np.diagonal(tensor)
        if np.abs(tensor - np.diag(row)).max() > SAME_AXES * row.max():
            raise ValueError(
                f"{label}={np.asarray(entry).tolist()!r} has other principal axes than the body was built with; while "
                "running the moments about those may change, not the axes. Build another world for other axes."
            )
    return moments


def set_heights(
    storage: Storage, row: int, mask: NDArray[np.bool_], heights: ArrayLike | None, height_rates: ArrayLike | None
) -> None:
    """Write samples and rates of one height field; see World.set_heights."""
    field = storage.arrays["height_fields"][row]
    shape = (int(field["rows"]), int(field["columns"]))
    chosen = int(mask.sum())
    given: dict[str, NDArray[np.float64]] = {}
    for name, value, unit in (("heights", heights, "m"), ("height_rates", height_rates, "m/s")):
        if value is None:
            continue
        label = f"set_heights({name})"
        try:
            array = np.asarray(value, dtype=np.float64)
        except (TypeError, ValueError):
            raise TypeError(f"{label} is not numeric; give {shape} or {(chosen, *shape)} [{unit}].") from None
        if array.shape not in (shape, (chosen, *shape)):
            raise ValueError(f"{label} has shape {array.shape}; give {shape} or {(chosen, *shape)} [{unit}].")
        if not np.isfinite(array).all():
            raise ValueError(f"{label} holds values that are not finite; replace them.")
        array = array.reshape(-1, *shape)
        if name == "heights":
            array = flattened(array, field["extent"])
        given[name] = pool_of_field(array, bool(field["smooth"]))
    if chosen == 0:
        return
    given.setdefault("height_rates", np.zeros((1, int(field["size"]))))
    # Each world advances its own moving heights, so those are never shared.
    moving = bool(given["height_rates"].any())
    if moving or not mask.all() or any(len(array) > 1 for array in given.values()):
        storage.separate_heights(moving)
    samples = slice(int(field["first"]), int(field["first"] + field["size"]))
    if not moving:
        # What rests has no past: it may start to move at once.
        given["height_rates_before"] = given["height_rate_changes"] = np.zeros((1, int(field["size"])))
    for name, array in given.items():
        _write_heights(storage.arrays[name][:, samples], mask, array)
    if "heights" in given:
        _widen_bounds(field, given["heights"])
    storage.note_features()


def heights_of(storage: Storage, row: int, world: int) -> NDArray[np.float64]:
    """(rows, columns) a copy of the samples of one height field in one world."""
    field, pool = storage.arrays["height_fields"][row], storage.arrays["heights"]
    rows, columns, first = int(field["rows"]), int(field["columns"]), int(field["first"])
    # Worlds that share their terrain have one row of samples.
    samples: NDArray[np.float64] = pool[world if len(pool) > 1 else 0, first : first + rows * columns]
    return samples.reshape(rows, columns).copy()


def reset_heights(storage: Storage, mask: NDArray[np.bool_], initial: NDArray[np.float64]) -> None:
    """Put the samples of the selected worlds back to ``initial`` (1, samples), at rest."""
    arrays = storage.arrays
    if not (mask.any() and initial.size):
        return
    shared = len(arrays["heights"]) != len(mask)
    if shared and not mask.all() and not np.array_equal(arrays["heights"], initial):
        storage.separate_heights(moving=False)
    _write_heights(arrays["heights"], mask, initial)
    for name in HEIGHT_POOLS[1:]:
        _write_heights(arrays[name], mask, np.zeros_like(initial))
    for field in arrays["height_fields"]:
        _widen_bounds(field, initial[:, field["first"] : field["first"] + field["size"]])
    storage.note_features()


def _write_heights(pool: NDArray[np.float64], mask: NDArray[np.bool_], values: NDArray[np.float64]) -> None:
    """Write ``values`` (1 or selected worlds, samples) into a pool (1 or worlds, samples)."""
    if len(pool) == len(mask):
        pool[mask] = values
    else:
        pool[0] = values[0]


def _widen_bounds(field: Any, heights: NDArray[np.float64]) -> None:
    field["lowest"] = min(float(field["lowest"]), float(heights.min()))
    field["highest"] = max(float(field["highest"]), float(heights.max()))


def carry_parameters(old: Storage, new: Storage, kept: list[int]) -> None:
    """Parameters set while running stay when the tables are built anew."""
    for name in ("mass", "inverse_mass", "inertia", "inverse_inertia", "flow", *COEFFICIENTS):
        new.arrays["bodies"][name][:, kept] = old.arrays["bodies"][name][:, kept]
    new.arrays["proportions"][:, kept] = old.arrays["proportions"][:, kept]


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
    bodies, contacts = saved["bodies"].copy(), saved["contacts"].copy()
    own = new.arrays["bodies"]
    shift = own["first_collider"] - bodies["first_collider"]
    for name in ("first_collider", "material"):
        bodies[name] = own[name]
    count = len(new.arrays["colliders"])
    for rows, moved, number in zip(contacts, shift, saved["num_contacts"].tolist(), strict=True):
        used = rows[:number]
        first, second = np.divmod(used["pair"], max(count, 1))
        used["pair"] = (first + moved[used["body_a"]]) * count + second + moved[used["body_b"]]
    return {**saved, "bodies": bodies, "contacts": contacts}


def _first_colliders(storage: Storage) -> NDArray[np.int64]:
    """(bodies,) number of the first collider of each body."""
    first: NDArray[np.int64] = storage.arrays["bodies"]["first_collider"][0]
    return first
