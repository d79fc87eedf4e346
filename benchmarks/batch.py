"""The small push scene in batches beside the others: environment steps and body steps a second, and memory a world.

    python -m benchmarks.batch [--worlds 1 16 256 1024 4096 16384] [--seconds 0.5] [--engines avalanche MuJoCo ...]
                               [--threads 1] [--plot docs/figures/batches.svg]

One environment step is a push (an impulse on the box) and four steps of 5 ms of ``physics.scenes.push``; nothing is
observed. MuJoCo runs its batches in ``mujoco.rollout``, the push held as a force over the four steps; PyBullet and
Rapier have no batches, so their worlds are stepped one after the other, and no more than 64 of them, since a world more
costs as much as the last. Memory is what the process of a batch grows by.

Rates are per second of CPU time on one core, or with ``--threads`` per second of the clock on so many: the batches then
share their worlds among threads, and of the engines without batches so many processes run at once.
"""

from __future__ import annotations

import argparse
import copy
import multiprocessing
import resource
import time
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from avalanche_gym import physics
from avalanche_gym.physics.scenes import HARD_CASES
from avalanche_gym.physics.scenes.push import PUSH_STEP, PUSH_STEPS, PUSHED, push_impulses, push_scene

WORLDS = (1, 16, 256, 1024, 4096, 16384)
ONE_BY_ONE = 64  # worlds at most of engines without batches
EPISODE = 200  # environment steps until the scene starts again
WARM = 10  # environment steps before the timing: the first after a start have no contacts to go on from
BODIES = sum(body is not None and body.motion == "dynamic" for body in push_scene().bodies)
ANY_CASE = HARD_CASES["trough"]  # adapters look at the theme of a case only

ENV_STEP = PUSH_STEP * PUSH_STEPS  # [s]

Stepper = Callable[[np.ndarray], None]  # one environment step; takes (worlds, 3) [N s]


def ours(worlds: int, threads: int, steps: int = PUSH_STEPS, **options: Any) -> tuple[Stepper, Callable[[], None]]:
    chosen = physics.Options(time_step=ENV_STEP / steps, sleeping=False, threads=threads, **options)
    world = physics.World(push_scene(), num_worlds=worlds, options=chosen)

    def step(pushes: np.ndarray) -> None:
        world.impulse_buffer[:, PUSHED, :3] = pushes
        world.step(steps)

    return step, world.reset


def mujoco(worlds: int, threads: int, steps: int = PUSH_STEPS) -> tuple[Stepper, Callable[[], None]]:
    import mujoco as mj
    from mujoco import rollout

    from .peers.mujoco_engine import MuJoCo

    single = MuJoCo(ANY_CASE, push_scene(), ENV_STEP / steps, "IMPLICITFAST")
    model, data = single.model, single.data
    full, force = mj.mjtState.mjSTATE_FULLPHYSICS, mj.mjtState.mjSTATE_XFRC_APPLIED
    first = np.zeros(mj.mj_stateSize(model, full))
    mj.mj_getState(model, data, first, full)
    state = np.tile(first, (worlds, 1))
    forces = np.zeros((worlds, steps, model.nbody, 6))
    body = model.body(f"b{PUSHED}").id
    copies = [copy.copy(data) for _ in range(threads)]
    runner = rollout.Rollout(nthread=threads if threads > 1 else 0)

    def step(pushes: np.ndarray) -> None:
        forces[:, :, body, :3] = pushes[:, None] / ENV_STEP
        found, _ = runner.rollout(
            model, copies, state, forces.reshape(worlds, steps, -1), control_spec=int(force), nstep=steps,
            skip_checks=False,
        )  # fmt: skip
        state[:] = found[:, -1]

    def reset() -> None:
        state[:] = first

    return step, reset


def one_by_one(build: Callable[[], Any], worlds: int, steps: int) -> tuple[Stepper, Callable[[], None]]:
    """Simulations of an engine without batches."""
    simulations = [build() for _ in range(worlds)]

    def step(pushes: np.ndarray) -> None:
        for simulation, push in zip(simulations, pushes, strict=True):
            simulation.apply_impulse(PUSHED, push)
            simulation.step(steps)

    def reset() -> None:
        for simulation in simulations:
            simulation.close()
        simulations[:] = [build() for _ in range(worlds)]

    return step, reset


def pybullet(worlds: int, _threads: int, steps: int = PUSH_STEPS) -> tuple[Stepper, Callable[[], None]]:
    from .peers.pybullet_engine import PyBullet

    return one_by_one(partial(PyBullet, ANY_CASE, push_scene(), ENV_STEP / steps), worlds, steps)


def rapier(worlds: int, _threads: int, steps: int = PUSH_STEPS) -> tuple[Stepper, Callable[[], None]]:
    from .peers.rapier_engine import Rapier

    return one_by_one(partial(Rapier, ANY_CASE, push_scene(), ENV_STEP / steps), worlds, steps)


ENGINES = {"avalanche": ours, "MuJoCo": mujoco, "PyBullet": pybullet, "Rapier": rapier}
NO_BATCHES = ("PyBullet", "Rapier")


def measure(engine: str, worlds: int, seconds: float, threads: int) -> tuple[float, float, float, float]:
    """Environment steps a second (median, lowest, highest of five) and kB a world. In a process of its own."""
    pushes = push_impulses(np.random.default_rng(0), 64 * worlds).reshape(64, worlds, 3)
    ENGINES[engine](1, 1)[0](pushes[0, :1])  # imports and compiles
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    step, reset = ENGINES[engine](worlds, threads)
    for number in range(WARM):
        step(pushes[number])
    memory = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / worlds
    rates = rates_of(step, reset, pushes, seconds, time.process_time if threads == 1 else time.perf_counter)
    return float(np.median(rates)), min(rates), max(rates), memory


def rates_of(
    step: Stepper, reset: Callable[[], None], pushes: np.ndarray, seconds: float, clock: Callable[[], float]
) -> list[float]:
    """Environment steps a second, five times; the scene has taken WARM steps."""
    rates, age = [], WARM
    for _ in range(5):
        done, start = 0, clock()
        while done == 0 or clock() - start < seconds / 5:
            if age == EPISODE:
                reset()
                age = 0
            step(pushes[age % 64])
            done, age = done + 1, age + 1
        rates.append(done * pushes.shape[1] / (clock() - start))
    return rates


def _answer(pipe: Any, engine: str, worlds: int, seconds: float, threads: int) -> None:
    try:
        pipe.send(measure(engine, worlds, seconds, threads))
    except ImportError as error:
        pipe.send(str(error))


def rows(engines: Sequence[str], counts: Sequence[int], seconds: float, threads: int) -> Iterator[tuple[str, int, Any]]:
    """Engine, worlds, and what ``measure`` found, or why it could not."""
    context = multiprocessing.get_context("spawn")
    for engine in engines:
        for worlds in counts:
            if worlds > ONE_BY_ONE and engine in NO_BATCHES:
                continue
            children = []
            for _ in range(threads if engine in NO_BATCHES else 1):
                mine, theirs = context.Pipe()
                child = context.Process(target=_answer, args=(theirs, engine, worlds, seconds, threads))
                child.start()
                theirs.close()
                children.append((child, mine))
            found: list[Any] = []
            for child, mine in children:
                try:
                    found.append(mine.recv())
                except EOFError:
                    found.append("the process died")
                child.join()
            failed = [one for one in found if isinstance(one, str)]
            # What runs at once adds up; memory is that of one.
            yield engine, worlds, failed[0] if failed else (*map(sum, list(zip(*found, strict=True))[:3]), found[0][3])


def plot(found: dict[str, dict[int, float]], unit: str, path: Path) -> None:
    """Environment steps a second against worlds, a line an engine; engines without batches go on as they are."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(6.4, 3.6), layout="constrained")
    for engine, rates in found.items():
        axes.plot(list(rates), list(rates.values()), "o-", markersize=4, label=engine)
    axes.set(xscale="log", yscale="log", xlabel="worlds", ylabel=f"environment steps per {unit}")
    axes.grid(True, which="both", alpha=0.3)
    axes.legend()
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, metadata={"Date": None} if path.suffix == ".svg" else None)


def report(engines: Sequence[str], counts: Sequence[int], seconds: float, threads: int, picture: Path | None) -> None:
    """Print a table, and draw it."""
    unit = "CPU s" if threads == 1 else f"s on {threads} cores"
    print(
        f"{'engine':12s} {'worlds':>7s} {'env steps per ' + unit:>26s} {'spread':>21s} {'body steps':>12s}"
        f" {'kB a world':>11s}"
    )
    rates: dict[str, dict[int, float]] = {}
    for engine, worlds, found in rows(engines, counts, seconds, threads):
        if isinstance(found, str):
            print(f"{engine:12s} {worlds:7d} {found}")
            continue
        rate, low, high, memory = found
        rates.setdefault(engine, {})[worlds] = rate
        print(
            f"{engine:12s} {worlds:7d} {rate:26,.0f} {low:10,.0f}-{high:10,.0f} {rate * PUSH_STEPS * BODIES:12,.0f}"
            f" {memory:11.1f}",
            flush=True,
        )
    if picture is not None:
        plot(rates, unit, picture)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--worlds", nargs="+", type=int, default=list(WORLDS))
    parser.add_argument("--engines", nargs="+", choices=ENGINES, default=list(ENGINES))
    parser.add_argument("--seconds", type=float, default=0.5, help="time of a measurement, at least one step")
    parser.add_argument("--threads", type=int, default=1, help="so many cores, by the clock")
    parser.add_argument("--plot", type=Path, help="write a picture to this file")
    arguments = parser.parse_args()
    report(arguments.engines, arguments.worlds, arguments.seconds, arguments.threads, arguments.plot)


if __name__ == "__main__":
    main()
