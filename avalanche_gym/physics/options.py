"""How a world computes: one default, good for every scene; a user turns the step size and the tolerance."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .given import real_number, whole_number

# Far above what memory holds, and products of two of them are still counted in 64 bits.
LARGEST_COUNT = 2**31 - 1


@dataclass(frozen=True)
class Options:
    """Settings of a World.

    Raises:
        ValueError: a field is outside its range; the text names the field, what was given and what is allowed.
    """

    time_step: float = 1.0 / 240.0
    """[s] of one step. Half the step costs twice the time; errors of sliding and rolling fall to a quarter."""
    tolerance: float = 1e-12
    """Relative residual that the contact solver aims at. 1e-6 saves iterations where bodies slide or jam."""
    substeps: int = 8
    """Substeps of the pile tier, for large islands that move. More leave less of the contact law undone."""
    max_iterations: int = 60
    """Factorisations that the exact tier may spend on one island and step. Only islands that stall get there."""
    events: bool = True
    """Locate impacts in time where that changes the outcome (docs/impacts.md). ``False`` is plain time stepping:
    rebounds become of order 1, and what is fast still does not pass."""
    sleeping: bool = True
    """Let islands in balance rest, at no cost, until something disturbs them. ``False`` computes every body always."""
    max_contacts: int | None = None
    """Contacts a world may have. ``None`` grows as needed; a number is a hard limit, and exceeding it an error."""
    threads: int = 1
    """Threads that share the worlds of a batch. Results are the same bits for every number."""

    def __post_init__(self) -> None:
        at_most = f" and at most {LARGEST_COUNT}"
        for name in ("time_step", "tolerance"):
            value = getattr(self, name)
            number = real_number(value)
            if number is None or not (math.isfinite(number) and number > 0.0):
                raise ValueError(f"Options({name}={value!r}): give a finite number greater than 0.")
            object.__setattr__(self, name, number)
        for name in ("substeps", "max_iterations", "threads"):
            value = getattr(self, name)
            count = whole_number(value)
            if count is None or not 1 <= count <= LARGEST_COUNT:
                raise ValueError(f"Options({name}={value!r}): give a whole number of at least 1{at_most}.")
            object.__setattr__(self, name, count)
        for name in ("events", "sleeping"):
            value = getattr(self, name)
            if not isinstance(value, (bool, np.bool_)):
                raise ValueError(f"Options({name}={value!r}): give True or False.")
            object.__setattr__(self, name, bool(value))
        if self.max_contacts is not None:
            limit = whole_number(self.max_contacts)
            if limit is None or not 1 <= limit <= LARGEST_COUNT:
                raise ValueError(
                    f"Options(max_contacts={self.max_contacts!r}): give a whole number of at least 1{at_most}, or None "
                    "to let it grow."
                )
            object.__setattr__(self, "max_contacts", limit)
