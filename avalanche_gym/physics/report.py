"""What a call of World.step tells about itself, and what a scene makes the engine model."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

# Names of the codes of solver/exact.py; the larger, the farther down the chain of methods.
METHODS = ("certificate", "single contact", "newton", "newton with sweeps", "sweeps", "pile")


@dataclass(frozen=True)
class StepReport:
    """Arrays (worlds,) over the last call of ``step``: the worst value, or the sum."""

    residual: NDArray[np.float64]
    """Worst relative residual of the contact problem."""
    iterations: NDArray[np.int64]
    """Sum of factorisations and sweeps."""
    tier: NDArray[np.str_]
    """The last resort that the solver needed in any step."""
    events: NDArray[np.int64]
    """Impacts located in time."""
    event_limit: NDArray[np.int64]
    """Steps in which the limit of events was met."""
    penetration: NDArray[np.float64]
    """[m] deepest overlap at the end of any step."""
    energy_change: NDArray[np.float64]
    """[J] of kinetic plus potential energy of the dynamic bodies."""
    contacts: NDArray[np.int64]
    """Most contacts in any step."""
    steps: NDArray[np.int64]
    """Steps completed."""


def describe_steps(rows: NDArray[Any]) -> StepReport:
    """The report that the kernels left in a table (worlds,) of model.REPORT."""
    same = ("residual", "iterations", "events", "event_limit", "penetration", "contacts", "steps")
    return StepReport(
        tier=np.array(METHODS)[rows["method"]],
        energy_change=rows["energy_end"] - rows["energy_start"],
        **{name: rows[name].copy() for name in same},
    )


@dataclass(frozen=True)
class Features:
    """What this scene made the engine model, and what it left out; ``"friction" in features`` asks for one."""

    modelled: tuple[str, ...]
    left_out: tuple[str, ...]
    flows: dict[str, str]
    """Free motion of each moving body, by name."""

    def __contains__(self, feature: object) -> bool:
        return feature in self.modelled

    def __str__(self) -> str:
        flows = ", ".join(f"{name}: {flow}" for name, flow in self.flows.items())
        return f"modelled: {', '.join(self.modelled)}; left out: {', '.join(self.left_out)}; flight: {flows}"
