"""Run a hard case on our own engine and record it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from ..errors import PhysicsError
from ..options import Options
from ..report import StepReport
from ..scene import Scene
from ..world import World
from .case import Companion, HardCase, Recording


def record(case: HardCase, options: Options) -> tuple[Recording, list[Recording], StepReport]:
    """The motion of a case and of its companions, and the report over all its steps.

    Raises:
        ValueError: the engine refuses the scene.
        PhysicsError: a step failed.
    """
    recording, report = record_scene(case, case.scene(), options)
    others = [record_companion(case, companion, options) for companion in case.companions]
    return recording, others, report


def record_companion(case: HardCase, companion: Companion, options: Options) -> Recording:
    """A companion's steps are shorter or longer by its unit of time; as many as the case's."""
    return record_scene(case, companion.scene(), options, companion.time_unit)[0]


def record_scene(
    case: HardCase, scene: Scene, options: Options, time_unit: float = 1.0
) -> tuple[Recording, StepReport]:
    step = options.time_step * time_unit
    world = World(scene, options=replace(options, time_step=step))
    total = round(case.duration / options.time_step)
    stride = steps_between_samples(case, options.time_step)
    times, samples = [0.0], [_state(world)]
    reports: list[StepReport] = []
    done = 0
    while done < total:
        count = min(stride, total - done)
        for _ in range(count if case.drive else 1):
            if case.drive:
                case.drive(world, done * step, step)
            world.step(1 if case.drive else count)
            reports.append(world.report())
            done += 1 if case.drive else count
        times.append(done * step)
        samples.append(_state(world))
    place, turn, speed, spin = (np.array([sample[k] for sample in samples]) for k in range(4))
    recording = Recording(np.array(times), place, turn, speed, spin, contact_forces(world))
    return recording, joined(reports)


def steps_between_samples(case: HardCase, step: float) -> int:
    """1 for every step, and never more than the whole motion has."""
    total = round(case.duration / step)
    return total if math.isinf(case.sampling) else max(1, min(total, round(case.sampling / step)))


def _state(world: World) -> tuple[np.ndarray, ...]:
    arrays = (world.position, world.orientation, world.linear_velocity, world.angular_velocity)
    return tuple(array[0].copy() for array in arrays)


def contact_forces(world: World) -> np.ndarray:
    """(bodies, 3) [N] over the last step."""
    forces = np.zeros((world.num_bodies, 3))
    contacts = world.contacts()
    np.add.at(forces, contacts["body_b"], contacts["impulse"])
    np.subtract.at(forces, contacts["body_a"], contacts["impulse"])
    return forces / world.options.time_step


def joined(reports: list[StepReport]) -> StepReport:
    """One report over several calls of step of one world."""
    worst = {name: max(getattr(r, name) for r in reports) for name in ("residual", "penetration", "contacts")}
    added = {
        name: sum(getattr(r, name) for r in reports)
        for name in ("iterations", "events", "event_limit", "energy_change", "steps")
    }
    return replace(reports[-1], **worst, **added)


__all__ = ["PhysicsError", "contact_forces", "joined", "record", "record_scene", "steps_between_samples"]
