"""The small scene of learning in every engine: a push, four steps of 5 ms, and again."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from avalanche_gym.physics.scenes import HardCase
from avalanche_gym.physics.scenes.push import PUSH_STEP, PUSH_STEPS, PUSHED, push_impulses, push_scene

from ..peers import Engine, Simulation, Unsupported

CASE = HardCase("push", 0, "A box and a ball, pushed", "none", push_scene, 2.0, lambda recording: {}, "", "", 0.0)
PUSHES = 100  # in one motion, which is 2 s


@dataclass(frozen=True)
class PushCost:
    """Environment steps per CPU second: median, smallest and largest of the repeats."""

    engine: str
    per_second: float
    low: float
    high: float


def measure_pushes(engines: Sequence[Engine], repeats: int = 9) -> list[PushCost]:
    """All engines in turns, so that a machine that slows down slows all."""
    impulses = push_impulses(np.random.default_rng(0), PUSHES)
    times: dict[str, list[float]] = {}
    for _ in range(repeats + 1):
        for engine in engines:
            if not engine.suits(CASE):
                continue
            try:
                simulation = engine.build(CASE, push_scene(), PUSH_STEP)
            except Unsupported:
                continue
            times.setdefault(engine.name, []).append(_seconds(simulation, impulses))
            simulation.close()
    found = []
    for name, seconds in times.items():
        rates = PUSHES / np.array(seconds[1:])  # the first warms up
        found.append(PushCost(name, float(np.median(rates)), float(rates.min()), float(rates.max())))
    return found


def _seconds(simulation: Simulation, impulses: np.ndarray) -> float:
    start = time.process_time()
    for impulse in impulses:
        simulation.apply_impulse(PUSHED, impulse)
        simulation.step(PUSH_STEPS)
    return time.process_time() - start
