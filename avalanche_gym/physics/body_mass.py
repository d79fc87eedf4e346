"""Mass, centre of mass and inertia of a body: from its shape, and from what the user says of them."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from .given import LARGEST_MASS
from .mass_properties import MassProperties, check_inertia, check_mass, check_range, principal_frame
from .shapes import Shape, checks


def mass_of(
    label: str,
    shape: Shape,
    motion: str,
    mass: float | None,
    density: float | None,
    inertia: ArrayLike | None,
    center_of_mass: ArrayLike | None,
) -> MassProperties:
    """Mass (as ``volume``), centre and inertia of a body; zeros for one that is not dynamic."""
    if motion != "dynamic":
        given = {"mass": mass, "density": density, "inertia": inertia, "center_of_mass": center_of_mass}
        for name, value in given.items():
            if value is not None:
                raise ValueError(f"Body {label!r}: {name}={value!r} on a {motion} body, which has none; leave it out.")
        return MassProperties(0.0, np.zeros(3), np.zeros((3, 3)))
    if mass is not None and density is not None:
        raise ValueError(f"Body {label!r}: mass={mass!r} and density={density!r}; give one of them.")
    for name, value in (("mass", mass), ("density", density)):
        if value is not None:
            check_mass(f"Body {label!r}: {name}", value)
    if center_of_mass is not None:
        center_of_mass = checks.finite_array(
            f"Body {label!r}: center_of_mass", center_of_mass, (3,), "three finite numbers"
        )
    with np.errstate(all="ignore"):  # sizes whose cubes are no floats show in the mass and the inertia
        try:
            own = shape.mass_properties()
        except ValueError as error:
            raise ValueError(f"Body {label!r}: {error}") from None
        except OverflowError:
            own = MassProperties(math.inf, np.zeros(3), np.full((3, 3), math.inf))
        total = float(mass) if mass is not None else own.volume * float(1000.0 if density is None else density)
        center = own.center
        tensor = own.inertia * float(np.float64(total) / own.volume)
        if center_of_mass is not None:
            center = np.asarray(center_of_mass)
            # Parallel axes: the shape's inertia about the point that the user calls the centre of mass.
            offset = center - own.center
            tensor = tensor + total * (float(offset @ offset) * np.eye(3) - np.outer(offset, offset))
    if inertia is not None:
        tensor = check_inertia(f"Body {label!r}: inertia", inertia)
    moments = principal_frame(tensor)[0] if np.abs(tensor).max() <= LARGEST_MASS else np.diagonal(tensor)
    check_range(f"Body {label!r}", total, moments.tolist())
    return MassProperties(total, center, tensor)
