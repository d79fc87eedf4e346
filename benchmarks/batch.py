"""The small push scene in batches: environment steps per CPU second on one core, and memory a world, beside the others.

    python -m benchmarks.batch [--worlds 1 16 256 1024 4096 16384] [--seconds 0.5] [--engines avalanche MuJoCo ...]

One environment step is a push (an impulse on the box) and four steps of 5 ms of ``physics.scenes.push``; nothing is
observed. MuJoCo runs its batches in ``mujoco.rollout`` on the calling thread, the push held as a force over the four
steps; PyBullet and Rapier have no batches, so their worlds are stepped one after the other, and no more than 64 of
them, since a world more costs as much as the last. Memory is what the process of a batch grows by.
"""

from __future__ import annotations

import argparse
import multiprocessing
import resource
import time
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import numpy as np

from avalanche_gym import physics
from avalanche_gym.physics.scenes import HARD_CASES
from avalanche_gym.physics.scenes.push import PUSH_STEP, PUSH_STEPS, PUSHED, push_impulses, push_scene

WORLDS = (1, 16, 256, 1024, 4096, 16384)
ONE_BY_ONE = 64  # worlds at most of engines without batches
EPISODE = 200  # environment steps until the scene starts again
WARM = 10  # environment steps before the timing: the first after a start have no contacts to go on from
ANY_CASE = HARD_CASES["trough"]  # adapters look at the theme of a case only

Stepper = Callable[[np.ndarray], None]  # one environment step; takes (worlds, 3) [N s]


def ours(worlds: int) -> tuple[Stepper, Callable[[], None]]:
    world = physics.World(push_scene(), num_worlds=worlds, options=physics.Options(time_step=PUSH_STEP, sleeping=False))

    def step(pushes: np.ndarray) -> None:
        world.impulse_buffer[:, PUSHED, :3] = pushes
        world.step(PUSH_STEPS)

    return step, world.reset


def mujoco(worlds: int) -> tuple[Stepper, Callable[[], None]]:
    import mujoco as mj
    from mujoco import rollout

    from .peers.mujoco_engine import MuJoCo

    single = MuJoCo(ANY_CASE, push_scene(), PUSH_STEP, "IMPLICITFAST")
    model, data = single.model, single.data
    full, force = mj.mjtState.mjSTATE_FULLPHYSICS, mj.mjtState.mjSTATE_XFRC_APPLIED
    first = np.zeros(mj.mj_stateSize(model, full))
    mj.mj_getState(model, data, first, full)
    state = np.tile(first, (worlds, 1))
    forces = np.zeros((worlds, PUSH_STEPS, model.nbody, 6))
    body = model.body(f"b{PUSHED}").id
    runner = rollout.Rollout(nthread=0)

    def step(pushes: np.ndarray) -> None:
        forces[:, :, body, :3] = pushes[:, None] / (PUSH_STEP * PUSH_STEPS)
        found, _ = runner.rollout(
            model, data, state, forces.reshape(worlds, PUSH_STEPS, -1), control_spec=int(force), nstep=PUSH_STEPS,
            skip_checks=False,
        )  # fmt: skip
        state[:] = found[:, -1]

    def reset() -> None:
        state[:] = first

    return step, reset


def one_by_one(build: Callable[[], Any], worlds: int) -> tuple[Stepper, Callable[[], None]]:
    """Simulations of an engine without batches."""
    simulations = [build() for _ in range(worlds)]

    def step(pushes: np.ndarray) -> None:
        for simulation, push in zip(simulations, pushes, strict=True):
            simulation.apply_impulse(PUSHED, push)
            simulation.step(PUSH_STEPS)

    def reset() -> None:
        for simulation in simulations:
            simulation.close()
        simulations[:] = [build() for _ in range(worlds)]

    return step, reset


def pybullet(worlds: int) -> tuple[Stepper, Callable[[], None]]:
    from .peers.pybullet_engine import PyBullet

    return one_by_one(partial(PyBullet, ANY_CASE, push_scene(), PUSH_STEP), worlds)


def rapier(worlds: int) -> tuple[Stepper, Callable[[], None]]:
    from .peers.rapier_engine import Rapier

    return one_by_one(partial(Rapier, ANY_CASE, push_scene(), PUSH_STEP), worlds)


ENGINES = {"avalanche": ours, "MuJoCo": mujoco, "PyBullet": pybullet, "Rapier": rapier}


def measure(engine: str, worlds: int, seconds: float) -> tuple[float, float, float, float]:
    """Environment steps per CPU second (median, lowest, highest of five) and kB a world. In a process of its own."""
    pushes = push_impulses(np.random.default_rng(0), 64 * worlds).reshape(64, worlds, 3)
    ENGINES[engine](1)[0](pushes[0, :1])  # imports and compiles
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    step, reset = ENGINES[engine](worlds)
    for number in range(WARM):
        step(pushes[number])
    memory = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / worlds
    rates, age = [], WARM
    for _ in range(5):
        done, start = 0, time.process_time()
        while done == 0 or time.process_time() - start < seconds / 5:
            if age == EPISODE:
                reset()
                age = 0
            step(pushes[age % 64])
            done, age = done + 1, age + 1
        rates.append(done * worlds / (time.process_time() - start))
    return float(np.median(rates)), min(rates), max(rates), memory


def _answer(pipe: Any, engine: str, worlds: int, seconds: float) -> None:
    try:
        pipe.send(measure(engine, worlds, seconds))
    except ImportError as error:
        pipe.send(str(error))


def rows(engines: list[str], counts: list[int], seconds: float) -> Iterator[tuple[str, int, Any]]:
    """Engine, worlds, and what ``measure`` found, or why it could not."""
    context = multiprocessing.get_context("spawn")
    for engine in engines:
        for worlds in counts:
            if worlds > ONE_BY_ONE and engine in ("PyBullet", "Rapier"):
                continue
            mine, theirs = context.Pipe()
            child = context.Process(target=_answer, args=(theirs, engine, worlds, seconds))
            child.start()
            theirs.close()
            try:
                yield engine, worlds, mine.recv()
            except EOFError:
                yield engine, worlds, "the process died"
            child.join()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--worlds", nargs="+", type=int, default=list(WORLDS))
    parser.add_argument("--engines", nargs="+", choices=ENGINES, default=list(ENGINES))
    parser.add_argument("--seconds", type=float, default=0.5, help="CPU time of a measurement, at least one step")
    arguments = parser.parse_args()
    print(f"{'engine':12s} {'worlds':>7s} {'env steps per CPU s':>20s} {'spread':>21s} {'kB a world':>11s}")
    for engine, worlds, found in rows(arguments.engines, arguments.worlds, arguments.seconds):
        if isinstance(found, str):
            print(f"{engine:12s} {worlds:7d} {found}")
            continue
        rate, low, high, memory = found
        print(f"{engine:12s} {worlds:7d} {rate:20,.0f} {low:10,.0f}-{high:10,.0f} {memory:11.1f}", flush=True)


if __name__ == "__main__":
    main()
