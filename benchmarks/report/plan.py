"""Which points are measured: cases x engines x steps a second, and for our engine tolerances."""

from __future__ import annotations

from dataclasses import dataclass

from avalanche_gym.physics.scenes import HARD_CASES, HardCase

from ..peers import Engine

FULL_RATES = (30, 60, 120, 240, 480, 960, 1920)
COARSE_RATES = (60, 240, 960)  # of the quick report, and of cases whose error does not fall with the step
TOLERANCES = (1e-4, 1e-6, 1e-8, 1e-10)  # of our contact solver, beside the default
TIGHT = 1e-14  # a tolerance at which the solver's part of the error is out of the way
VERDICT_RATE = 240  # [steps/s] at which every engine gets its verdict; our default
FINEST = 1920

# One or two scenes of each theme keep the quick report's curves; the others get their verdict only.
QUICK_CURVES = (
    "throw", "rotation_dzhanibekov", "bounce_e08", "bounce_path", "bounce_e1", "slide", "stick", "slip",
    "slide_to_roll", "roll_down", "stack", "stack_heavy", "bowl_facets", "trough", "cradle", "crossed_beams",
    "euler_disk",
)  # fmt: skip
# Not in the quick report.
LONG = (
    "pile_100",
    "pile_1000",
    "balls_elastic",
    "balls_inelastic",
    "card_house",
    "orbit_e05",
    "orbit_e09",
    "nut_screws_down",
)


@dataclass(frozen=True)
class Budget:
    """CPU seconds that a point may take."""

    run: float  # for the motion that the error is measured on; a point that needs more is left out, and says so
    verdict: float  # the same for the point that the verdict is read from
    timing: float  # for one repeat of the timing
    repeats: int


FULL, QUICK = Budget(15.0, 150.0, 0.1, 5), Budget(2.0, 4.0, 0.02, 3)


@dataclass(frozen=True)
class Point:
    """One measurement; ``tolerance`` is None for the engine's default."""

    case: str
    engine: str
    rate: int
    tolerance: float | None = None

    @property
    def key(self) -> tuple[str, str, int, str]:
        return (self.case, self.engine, self.rate, "" if self.tolerance is None else f"{self.tolerance:g}")

    def allowed(self, budget: Budget) -> float:
        """CPU seconds for its motion."""
        return budget.verdict if self.rate == VERDICT_RATE and self.tolerance is None else budget.run


def points(engines: list[Engine], quick: bool, names: list[str]) -> list[Point]:
    """In the order they are measured: case by case, all engines, coarse steps first."""
    planned = []
    for case in HARD_CASES.values():
        if (names and case.name not in names) or (quick and not names and case.name in LONG):
            continue
        curve = not quick or case.name in QUICK_CURVES or bool(names)
        rates = (FULL_RATES if case.order and not quick else COARSE_RATES) if curve else (VERDICT_RATE,)
        for engine in engines:
            if engine.suits(case):
                own = (VERDICT_RATE,) if case.refusal == "required" else rates
                planned += [Point(case.name, engine.name, rate) for rate in own]
        if curve and wants_split(case):
            ours = engines[0].name
            tolerances = TOLERANCES if not quick else TOLERANCES[1:2]
            planned += [Point(case.name, ours, VERDICT_RATE, tolerance) for tolerance in (*tolerances, TIGHT)]
            planned.append(Point(case.name, ours, FINEST, TIGHT))
    return planned


def wants_split(case: HardCase) -> bool:
    """Whether the error has a part of the solver's: bodies touch, and it is no chaotic motion."""
    return not case.chaotic and case.theme not in ("flight", "invariance") and case.refusal == ""
