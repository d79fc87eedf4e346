"""Record a hard case in any engine, and time it."""

from __future__ import annotations

import importlib.util
import math
import time
from dataclasses import dataclass

import numpy as np

from avalanche_gym.physics import Scene
from avalanche_gym.physics.scenes import HardCase, Recording
from avalanche_gym.physics.scenes.recording import steps_between_samples

from .engine import Engine

WARM_STEPS = 20


@dataclass(frozen=True)
class Cost:
    """CPU seconds of this process for the steps of one run, over several repeats."""

    steps: int
    seconds: tuple[float, ...]

    def per_step(self) -> tuple[float, float, float]:
        """Median, smallest and largest [us]."""
        values = np.array(self.seconds) / self.steps * 1e6
        return float(np.median(values)), float(values.min()), float(values.max())


class TooLong(Exception):
    """A motion takes more CPU time than it may; the text says how much."""


def record(
    case: HardCase, engine: Engine, step: float, allowed: float = math.inf
) -> tuple[dict[str, float], dict[str, float], Cost]:
    """Errors of a case at a step [s], what the engine reports of itself, and the cost of the whole motion.

    Raises:
        TooLong: a motion takes more than ``allowed`` [CPU s].
        Unsupported, and the engine's own errors.
    """
    recording, report, cost = record_scene(case, engine, case.scene(), step, 1.0, allowed)
    others = [record_scene(case, engine, other.scene(), step, other.time_unit, allowed)[0] for other in case.companions]
    errors = case.errors(recording, *others)
    if case.name.startswith("pile_") and recording.finite and importlib.util.find_spec("mujoco"):
        from .ruler import overlaps  # here, since our engine is measured without the peers, too

        errors |= overlaps(case, recording)
    return errors, report, cost


def record_scene(
    case: HardCase, engine: Engine, scene: Scene, step: float, time_unit: float, allowed: float
) -> tuple[Recording, dict[str, float], Cost]:
    total, stride = round(case.duration / step), steps_between_samples(case, step)
    simulation = engine.build(case, scene, step * time_unit)
    try:
        samples, times, done, spent = [simulation.state()], [0.0], 0, 0.0
        while done < total:
            count = min(stride, total - done)
            start = time.process_time()
            if case.drive is None:
                simulation.step(count)
            else:
                for number in range(done, done + count):
                    case.drive(simulation, number * step * time_unit, step * time_unit)
                    simulation.step(1)
            spent += time.process_time() - start
            done += count
            if spent > allowed:
                raise TooLong(f"{done} of {total} steps took {spent:.0f} CPU s, allowed are {allowed:g} for all")
            times.append(done * step * time_unit)
            samples.append(simulation.state())
            if not np.isfinite(samples[-1][0]).all():
                break
        place, turn, speed, spin = (np.array([sample[k] for sample in samples]) for k in range(4))
        recording = Recording(np.array(times), place, turn, speed, spin, simulation.contact_force())
        return recording, simulation.report(), Cost(max(done, 1), (spent,))
    finally:
        simulation.close()


def time_steps(
    case: HardCase, engine: Engine, step: float, seconds: float, repeats: int, steps: int | None = None
) -> Cost:
    """CPU time of the whole motion, or of as many steps as fit in about ``seconds``; each repeat from the start.

    Building the scene is not counted. A first, short run warms caches and compiles what is not compiled. ``steps``
    says how many, where that is known. Of what is too slow for that the short run is all there is.
    """
    total = round(case.duration / step)
    warm = warm_up(case, engine, step)
    spent = warm.seconds[0]
    if steps is None:
        if spent > repeats * seconds:
            return warm
        steps = total if spent <= 0.0 else max(warm.steps, min(total, math.ceil(seconds * warm.steps / spent)))
    return Cost(steps, tuple(_run(case, engine, step, steps) for _ in range(repeats)))


def warm_up(case: HardCase, engine: Engine, step: float) -> Cost:
    """A short run."""
    steps = min(round(case.duration / step), WARM_STEPS)
    return Cost(steps, (_run(case, engine, step, steps),))


def _run(case: HardCase, engine: Engine, step: float, steps: int) -> float:
    simulation = engine.build(case, case.scene(), step)
    try:
        start = time.process_time()
        if case.drive is None:
            simulation.step(steps)
        else:
            for number in range(steps):
                case.drive(simulation, number * step, step)
                simulation.step(1)
        return time.process_time() - start
    finally:
        simulation.close()
