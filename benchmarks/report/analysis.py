"""The arithmetic of the report: orders, fronts, thresholds, profiles. No engine in here."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

ROUND_OFF = 1e-11  # errors below this, in the unit of the case, tell nothing about an order


def fitted_order(steps: Sequence[float], errors: Sequence[float]) -> float:
    """Slope of log error over log step, by least squares; NaN with fewer than three points above round-off.

    Args:
        steps: [s].
        errors: same length; zeros, infinities and what is below ROUND_OFF are left out.
    """
    kept = [(h, e) for h, e in zip(steps, errors, strict=True) if math.isfinite(e) and e > ROUND_OFF]
    if len(kept) < 3:
        return math.nan
    x, y = np.log(np.array(kept)).T
    return float(np.polyfit(x, y, 1)[0])


def pareto_front(points: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
    """The (cost, error) that no other point beats in both, by rising cost."""
    front: list[tuple[float, float]] = []
    for cost, error in sorted(point for point in points if all(map(math.isfinite, point))):
        if not front or error < front[-1][1]:
            front.append((cost, error))
    return front


def cost_to_reach(points: Sequence[tuple[float, float]], threshold: float) -> float:
    """Smallest cost of a point whose error, and that of every dearer point of the same engine, stays within it.

    A coarse step that is right by luck does not count. Infinite if the threshold is not reached.
    """
    best = math.inf
    for cost, error in sorted(points, reverse=True):
        if not error <= threshold:
            break
        best = cost
    return best


def performance_profile(costs: Mapping[str, Sequence[float]], ratios: Sequence[float]) -> dict[str, list[float]]:
    """Dolan and More (2002), eq. 2.1: the share of problems that each engine solves within a ratio of the best cost.

    Args:
        costs: for each engine its cost of every problem, infinite where it fails; problems that all fail are left out.
        ratios: >= 1.
    """
    table = np.array([costs[name] for name in costs], dtype=float)
    table = table[:, np.isfinite(table).any(axis=0)]
    if table.size == 0:
        return {name: [math.nan] * len(ratios) for name in costs}
    relative = table / table.min(axis=0)
    return {name: [float((row <= ratio).mean()) for ratio in ratios] for name, row in zip(costs, relative, strict=True)}


def error_split(error: float, tight: float, finest: float) -> dict[str, float]:
    """Where an error comes from, by turning one thing at a time.

    Args:
        error: at the default step and tolerance.
        tight: at the default step, the solver's tolerance out of the way.
        finest: at the finest step, the tolerance out of the way too: what neither takes away remains.
    """
    return {"solver": abs(error - tight), "time stepping": abs(tight - finest), "remains": finest}
