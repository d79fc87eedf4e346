"""What the arguments ``body`` and ``world`` of a call mean, checked."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .given import real_array

if TYPE_CHECKING:
    from .readings import Readings

WorldIndex = int | slice | NDArray[np.bool_] | None


def select_body(world: Readings, call: str, body: Any, moving: str | None = None) -> int:
    """The handle of a body that exists, and has the motion ``moving`` if that is given."""
    bodies = world.scene.bodies
    if isinstance(body, bool) or not isinstance(body, (int, np.integer)):
        raise TypeError(f"{call}(body={body!r}): give the handle that add_body returned, an int.")
    if not 0 <= body < len(bodies):
        there = f"this world has handles 0 to {len(bodies) - 1}" if bodies else "this world has no body; add one"
        raise IndexError(f"{call}(body={body}): {there}.")
    description = bodies[body]
    if description is None:
        raise ValueError(f"{call}(body={body}): this body was removed; give the handle of one that is there.")
    if moving is not None and description.motion != moving:
        raise ValueError(
            f"{call}: body {description.name!r} is {description.motion}; only a {moving} body can be pushed. "
            "Move a kinematic body with set_state(linear_velocity=..., angular_velocity=...)."
        )
    return int(body)


def select_world(world: Readings, call: str, which: Any) -> int:
    """The number of one world."""
    if isinstance(which, bool) or not isinstance(which, (int, np.integer)):
        raise TypeError(f"{call}(world={which!r}): give one int.")
    return int(np.flatnonzero(select_worlds(world, call, which))[0])


def select_worlds(world: Readings, call: str, which: Any) -> NDArray[np.bool_]:
    """Boolean mask (worlds,) of an int, slice, boolean mask, or ``None`` for all."""
    count = world.num_worlds
    if which is None:
        return np.ones(count, np.bool_)
    mask = np.zeros(count, np.bool_)
    if isinstance(which, (int, np.integer)) and not isinstance(which, bool) and not -count <= which < count:
        raise IndexError(f"{call}(world={which}): there are worlds 0 to {count - 1}.")
    if not isinstance(which, (int, np.integer, slice)) or isinstance(which, bool):
        which = np.asarray(which)
        if which.dtype != np.bool_ or which.shape != (count,):
            raise TypeError(
                f"{call}(world={which.tolist()!r}): give an int, a slice, a boolean mask of shape ({count},), or None "
                "for all worlds."
            )
    try:
        mask[which] = True
    except (TypeError, ValueError) as error:
        raise TypeError(
            f"{call}(world={which!r}): {error}; give a slice of whole numbers, such as slice(0, 4)."
        ) from None
    return mask


def spread(name: str, value: ArrayLike, mask: NDArray[np.bool_], width: int) -> NDArray[np.float64]:
    """One row for all selected worlds, or one each, as (worlds, width); checked finite."""
    chosen = int(mask.sum())
    allowed = f"shape ({width},) or ({chosen}, {width})"
    try:
        array = real_array(value)
    except (TypeError, ValueError):
        raise TypeError(f"{name}={value!r} is not numeric; give {allowed}.") from None
    if array.shape not in ((width,), (1, width), (chosen, width)):
        raise ValueError(f"{name} has shape {array.shape}; give {allowed}.")
    if not np.isfinite(array).all():
        raise ValueError(
            f"{name}={array.tolist()!r} holds values that are not finite; give {allowed} of finite numbers."
        )
    rows = np.zeros((len(mask), width))
    rows[mask] = array
    return rows
