"""Scenes with known answers, shared by tests, benchmarks, viewer and the adapters of other engines."""

from . import (
    bounces,
    concave,
    cradle,
    flight,
    friction,
    invariance,
    piles,
    stacks,
    swinging_plate,
    terrain,
    tops,
    travelling_wave,
    tunnelling,
)
from .case import Actuated, Companion, HardCase, Recording, Unbuilt

HARD_CASES: dict[str, HardCase] = {
    case.name: case
    for theme in (
        flight,
        bounces,
        friction,
        swinging_plate,
        cradle,
        stacks,
        terrain,
        travelling_wave,
        concave,
        tunnelling,
        tops,
        piles,
        invariance,
    )
    for case in theme.CASES
}

UNBUILT = (Unbuilt(23, "A settled body sleeps", "not a scene to be measured; tests/unit/test_sleeping.py holds it"),)

__all__ = ["HARD_CASES", "UNBUILT", "Actuated", "Companion", "HardCase", "Recording", "Unbuilt"]
