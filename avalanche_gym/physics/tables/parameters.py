"""Parameters of bodies in a running world: checked, and written for the worlds that are meant."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..given import real_array
from ..integrator.flight import flow_class
from ..mass_properties import check_inertia, check_mass, check_range, rotation_matrix
from ..scene import Body, check_coefficient
from .storage import Storage

# What a body has of its shape.
OF_SHAPE = (
    *("first_collider", "num_colliders", "radius", "size", "inner", "mass", "inverse_mass", "inertia"),
    *("inverse_inertia", "principal", "origin", "flow"),
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
        for mass, moments in zip(changed["mass"].tolist(), changed["inertia"].tolist(), strict=True):
            check_range(f"Body {body.name!r}", mass, moments)
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
        if np.asarray(value).dtype == np.bool_:
            raise TypeError("truth values")
        return np.broadcast_to(real_array(value), (chosen,))
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
