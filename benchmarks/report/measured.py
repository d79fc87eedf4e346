"""All rows of data, and the questions that the tables and plots ask them."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence

from avalanche_gym.physics.scenes import HARD_CASES, HardCase

from ..peers import Engine
from ..residuals import Residuals
from .analysis import cost_to_reach
from .features import FeatureCost
from .push import PushCost
from .table import OK, Row

THRESHOLDS = (1e-2, 1e-4, 1e-6, 1e-8)


class Measured:
    """All rows, sorted by case and engine."""

    def __init__(
        self,
        rows: Sequence[Row],
        engines: Sequence[Engine],
        features: Sequence[FeatureCost],
        residuals: Sequence[Residuals] = (),
        pushes: Sequence[PushCost] = (),
    ) -> None:
        self.rows, self.engines, self.features = rows, engines, features
        self.residuals, self.pushes = residuals, pushes
        self.by_case: dict[str, list[Row]] = defaultdict(list)
        for row in rows:
            self.by_case[row.case].append(row)
        self.names = [engine.name for engine in engines]
        self.defaults = {engine.name: engine.default_rate for engine in engines}

    def curve(self, case: str, engine: str) -> list[Row]:
        """Points of one line, coarse first."""
        own = [row for row in self.by_case[case] if row.engine == engine and not row.tolerance and row.status == OK]
        return sorted(own, key=lambda row: row.rate)

    def at(self, case: str, engine: str, rate: int, tolerance: str = "") -> Row | None:
        key = (case, engine, rate, tolerance)
        return next((row for row in self.by_case[case] if row.key == key), None)

    def has_curve(self, case: HardCase) -> bool:
        return any(len(self.curve(case.name, name)) > 1 for name in self.names)

    def cases(self) -> list[HardCase]:
        return [case for name, case in HARD_CASES.items() if name in self.by_case]

    def problems(self) -> list[tuple[HardCase, float]]:
        """A case and an error to stay within; as many as some engine reaches with a curve behind it."""
        curves = [case for case in self.cases() if max(len(self.curve(case.name, name)) for name in self.names) > 1]
        return [(case, threshold) for case in curves if not case.chaotic for threshold in THRESHOLDS]

    def costs(self, case: HardCase, threshold: float) -> list[float]:
        return [cost_to_reach([(r.cost, r.error) for r in self.curve(case.name, n)], threshold) for n in self.names]
