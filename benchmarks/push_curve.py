"""The small push scene, speed against error: every engine at several steps, and how far it is from the limit.

    python -m benchmarks.push_curve [--worlds 48] [--plot docs/figures/push_curve.svg]

Boxes are pushed every 20 ms, each in its own way, from the same start. Errors are those of the places of box and ball
(the larger one) after 20, 100 and 400 ms, against our steps of 20/128 ms: medians over the worlds. How far 20/64 ms is
from those says the last line. The pushes are impulses there for every engine. Rates are environment steps a second
of CPU time as in ``benchmarks.batch``, in batches of 256 where the engine has them; MuJoCo's rollout takes the push as
a force over the 20 ms there.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from avalanche_gym import physics
from avalanche_gym.physics.scenes.push import PUSHED, push_impulses, push_scene

from . import batch

Places = np.ndarray  # (environment steps, worlds, 2, 3) [m] of ball and box
SECONDS, ROUNDS = 0.5, 5  # of a measurement, and how many of each
FINE = 128  # steps of an environment step in the reference
AFTER = (1, 5, 20)  # environment steps at which errors are printed
WORLDS = 256  # of a batch whose rate is measured
LEARNING: dict[str, Any] = {"events": False, "tolerance": 1e-4}  # as PushTerrain ships
STEPS = (1, 2, 4, 8)  # of an environment step


@dataclass(frozen=True)
class Candidate:
    """An engine at one step."""

    name: str
    steps: int  # of an environment step
    build: Callable[[int, int], tuple[batch.Stepper, Callable[[], None]]]  # worlds, threads: as in benchmarks.batch
    worlds: int  # of the batch whose rate is measured
    places: Callable[[], Places]


def rates(candidates: Sequence[Candidate]) -> list[float]:
    """Environment steps a second of CPU time: of each in turn, several times; a busy machine slows all alike."""
    running = []
    for candidate in candidates:
        pushes = push_impulses(np.random.default_rng(0), 64 * candidate.worlds).reshape(64, candidate.worlds, 3)
        step, reset = candidate.build(candidate.worlds, 1)
        for number in range(batch.WARM):
            step(pushes[number])
        running.append((step, reset, pushes))
    found = [[batch.rates_of(*one, SECONDS, time.process_time) for one in running] for _ in range(ROUNDS)]
    return np.median(np.concatenate(found, axis=1), axis=1).tolist()


def our_places(steps: int, pushes: np.ndarray, **options: Any) -> Places:
    chosen = physics.Options(time_step=batch.ENV_STEP / steps, sleeping=False, **options)
    world = physics.World(push_scene(), num_worlds=pushes.shape[1], options=chosen)
    found = []
    for impulses in pushes:
        world.impulse_buffer[:, PUSHED, :3] = impulses
        world.step(steps)
        found.append(world.position[:, 1:].copy())
    return np.array(found)


def places_of(build: Callable[[], Any], steps: int, pushes: np.ndarray) -> Places:
    """Of an engine of the report, one world after the other."""
    found = np.empty((*pushes.shape[:2], 2, 3))
    for world in range(pushes.shape[1]):
        simulation = build()
        for number, push in enumerate(pushes[:, world]):
            simulation.apply_impulse(PUSHED, push)
            simulation.step(steps)
            found[number, world] = simulation.state()[0][1:]
        simulation.close()
    return found


def peers() -> dict[str, Callable[[float], Any]]:
    """By name, what builds the scene with this step [s]; those that are installed."""
    found: dict[str, Callable[[float], Any]] = {}
    for name, *chosen in (("MuJoCo", "IMPLICITFAST"), ("PyBullet",), ("Rapier",)):
        try:
            module = import_module(f"{__package__}.peers.{name.lower()}_engine")
        except ImportError:
            continue
        found[name] = partial(_pushed, getattr(module, name), chosen)
    return found


def _pushed(engine: Callable[..., Any], chosen: Sequence[str], step: float) -> Any:
    """The scene in an engine of the report, with this step [s]; ``chosen``: what else that is given."""
    return engine(batch.ANY_CASE, push_scene(), step, *chosen)


def candidates(pushes: np.ndarray) -> Iterator[Candidate]:
    for name, options in (("avalanche", {}), ("avalanche, learning", LEARNING)):
        for steps in STEPS:
            places = partial(our_places, steps, pushes, **options)
            yield Candidate(name, steps, partial(batch.ours, steps=steps, **options), WORLDS, places)
    for name, build in peers().items():
        for steps in STEPS:
            worlds = batch.ONE_BY_ONE if name in batch.NO_BATCHES else WORLDS
            places = partial(places_of, partial(build, batch.ENV_STEP / steps), steps, pushes)
            yield Candidate(name, steps, partial(batch.ENGINES[name], steps=steps), worlds, places)


def plot(points: dict[str, list[tuple[float, float]]], path: Path) -> None:
    """Error against rate, a line an engine."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(6.4, 4.0), layout="constrained")
    for name, found in points.items():
        axes.plot(*zip(*found, strict=True), "o-", markersize=4, label=name)
    axes.set(xscale="log", yscale="log", xlabel="environment steps per CPU s", ylabel="error after 0.4 s [m], median")
    axes.grid(True, which="both", alpha=0.3)
    axes.legend()
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, metadata={"Date": None} if path.suffix == ".svg" else None)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--worlds", type=int, default=48, help="of which the errors are medians")
    parser.add_argument("--plot", type=Path, help="write a picture to this file")
    arguments = parser.parse_args()
    count = max(AFTER)
    pushes = push_impulses(np.random.default_rng(5), count * arguments.worlds).reshape(count, arguments.worlds, 3)
    reference = our_places(FINE, pushes)

    def errors(places: Places) -> list[float]:
        """[m] at AFTER; the farther one of ball and box counts."""
        off = np.linalg.norm(places - reference, axis=3).max(axis=2)
        return [float(np.median(off[number - 1])) for number in AFTER]

    print(f"{'engine':20s} {'step':>8s} {'env steps per CPU s':>20s}   error after 20, 100, 400 ms [m]")
    points: dict[str, list[tuple[float, float]]] = {}
    several = list(candidates(pushes))
    for one, rate in zip(several, rates(several), strict=True):
        found = errors(one.places())
        points.setdefault(one.name, []).append((rate, found[-1]))
        print(
            f"{one.name:20s} {batch.ENV_STEP / one.steps * 1e3:5.2f} ms {rate:20,.0f}   "
            + "  ".join(f"{e:.1e}" for e in found),
            flush=True,
        )
    found = errors(our_places(FINE // 2, pushes))
    print(f"{'(20/64 ms)':20s} {'':8s} {'':20s}   " + "  ".join(f"{e:.1e}" for e in found))
    if arguments.plot is not None:
        plot(points, arguments.plot)


if __name__ == "__main__":
    main()
