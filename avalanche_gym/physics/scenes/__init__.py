"""Scenes with known answers, shared by tests, benchmarks, viewer and the adapters of other engines."""

from . import bounces, concave, cradle, flight, friction, invariance, piles, stacks, terrain, tops, tunnelling
from .case import Actuated, Companion, HardCase, Recording, Unbuilt

HARD_CASES: dict[str, HardCase] = {
    case.name: case
    for theme in (
        flight,
        bounces,
        friction,
        cradle,
        stacks,
        terrain,
        concave,
        tunnelling,
        tops,
        piles,
        invariance,
    )
    for case in theme.CASES
}

UNBUILT = (
    Unbuilt(23, "A settled body sleeps", "not a scene to be measured; tests/unit/test_sleeping.py holds it"),
    Unbuilt(24, "A body on a wave that travels along the carpet", "no reference for the motion over a curved wave yet"),
)

__all__ = ["HARD_CASES", "UNBUILT", "Actuated", "Companion", "HardCase", "Recording", "Unbuilt"]
