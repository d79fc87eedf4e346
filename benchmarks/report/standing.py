"""Where we stand on a scene: our default step against every point of every peer's curve."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from .analysis import ROUND_OFF, cost_to_reach
from .table import Row

TEN = 10.0  # times better is the aim


@dataclass(frozen=True)
class Standing:
    """Two ratios, at equal cost and at equal error; infinite where no peer comes near."""

    default: Row
    rival: Row  # the most exact point of any peer at no more cost, or else the cheapest of all
    affordable: bool  # whether the rival costs no more
    error_ratio: float  # its error over ours; of what is round-off for both, 1
    cost_ratio: float  # of the cheapest peer that stays within our error, over ours

    @property
    def better(self) -> bool:
        """Ten times smaller an error at equal cost, or nothing but round-off on our side."""
        return self.error_ratio >= TEN or self.default.error <= ROUND_OFF

    @property
    def cheaper(self) -> bool:
        return self.cost_ratio >= TEN


def standing(ours: Sequence[Row], rivals: dict[str, Sequence[Row]], default_rate: int) -> Standing | None:
    """Of the rows of one case; None without points to compare.

    Args:
        ours: our curve.
        rivals: each peer's curve, by its name.
        default_rate: the rate of our default step.
    """
    points = [row for curve in rivals.values() for row in curve if math.isfinite(row.error)]
    if not ours or not points:
        return None
    default = next((row for row in ours if row.rate == default_rate), ours[0])
    affordable = [row for row in points if row.cost <= default.cost]
    rival = min(affordable, key=lambda row: row.error) if affordable else min(points, key=lambda row: row.cost)
    floor = max(default.error, ROUND_OFF)
    error_ratio = max(rival.error, ROUND_OFF) / floor
    reached = min(cost_to_reach([(row.cost, row.error) for row in curve], floor) for curve in rivals.values())
    return Standing(default, rival, bool(affordable), error_ratio, reached / default.cost)
