"""What a step costs, beside the others, how much memory a world takes, and how long a cold or a warm start lasts.

    python -m benchmarks.throughput [--repeats 5] [--quick] [--plot docs/figures/batches.svg]

The environments, single and batched; batches of the small push scene beside MuJoCo, PyBullet and Rapier, on one core
and on all (benchmarks/batch.py); memory and starts. ``--quick`` leaves out the last three.

Times are CPU seconds of this process (or of a fresh one, for starts), the median of several repeats. Run it on a quiet
machine, and compare ratios rather than figures of different machines.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import gymnasium
import numpy as np

import avalanche_gym
from avalanche_gym import physics

from . import batch

IDS = ("avalanche/PushTerrain-v0", "avalanche/PlanetLanding-v0")

START = """
import json, sys, time
wall, cpu = time.perf_counter(), time.process_time()
import gymnasium, avalanche_gym
for id in sys.argv[1:]:
    env = gymnasium.make(id)
    env.reset(seed=0)
    env.step(env.action_space.sample())
    print(json.dumps([time.perf_counter() - wall, time.process_time() - cpu]))
"""

MEMORY = """
import resource, sys
import gymnasium, avalanche_gym
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
env = gymnasium.make_vec(sys.argv[1], num_envs=int(sys.argv[2]), vectorization_mode="vector_entry_point")
env.reset(seed=0)
for _ in range(20):
    env.step(env.action_space.sample())
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before)
"""


def cpu_per_call(call: Callable[[], object], count: int, repeats: int) -> tuple[float, float, float]:
    """Smallest, median and largest CPU time [us] of one of ``count`` calls."""
    call()
    times = []
    for _ in range(repeats):
        start = time.process_time()
        for _ in range(count):
            call()
        times.append((time.process_time() - start) / count * 1e6)
    return min(times), float(np.median(times)), max(times)


def show(what: str, triple: tuple[float, float, float], unit: str = "us") -> None:
    low, middle, high = triple
    print(f"{what:58s} {middle:10.2f} {unit}   ({low:.2f} to {high:.2f})", flush=True)


def single_step(env_id: str, repeats: int, count: int) -> None:
    """``env.step`` of one environment, actions drawn beforehand, resets included."""
    env = gymnasium.make(env_id)
    env.reset(seed=0)
    rng = np.random.default_rng(0)
    actions = rng.uniform(-1, 1, (count, *env.action_space.shape)).astype(np.float32)  # type: ignore[misc]
    turn = iter(range(10**12))

    def step() -> None:
        _, _, terminated, truncated, _ = env.step(actions[next(turn) % count])
        if terminated or truncated:
            env.reset()

    show(f"{env_id}: env.step", cpu_per_call(step, count, repeats))
    env.close()


def batched(env_id: str, num_envs: int, repeats: int, count: int) -> None:
    """The vector environment and, alone, its physics."""
    env = gymnasium.make_vec(env_id, num_envs=num_envs, vectorization_mode="vector_entry_point")
    env.reset(seed=0)
    rng = np.random.default_rng(0)
    actions = rng.uniform(-1, 1, (count, *env.action_space.shape)).astype(np.float32)  # type: ignore[misc]
    turn = iter(range(10**12))
    whole = cpu_per_call(lambda: env.step(actions[next(turn) % count]), count, repeats)
    show(f"{env_id}: {num_envs} lanes, vector step per lane", tuple(t / num_envs for t in whole))  # type: ignore[arg-type]
    print(f"{'':58s} {num_envs / whole[1] * 1e6:10.0f} steps per CPU s", flush=True)
    task = env.unwrapped.task  # type: ignore[attr-defined]
    alone = cpu_per_call(lambda: task.world.step(task.num_steps), count, repeats)
    show(f"{env_id}: {num_envs} lanes, physics per world", tuple(t / num_envs for t in alone))  # type: ignore[arg-type]
    env.close()


def python_edge(repeats: int) -> None:
    """One call of World.step on a scene that costs next to nothing."""
    scene = physics.Scene()
    scene.add_body(physics.Sphere(1.0), mass=1.0)
    world = physics.World(scene)
    show("World.step(1), one free sphere", cpu_per_call(lambda: world.step(1), 20000, repeats))


def fresh(code: str, *arguments: str, cache: str | None = None) -> list[str]:
    """Lines that a fresh process prints."""
    environment = dict(os.environ)
    if cache:
        environment["NUMBA_CACHE_DIR"] = cache
    command = [sys.executable, "-c", code, *arguments]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    return done.stdout.splitlines()


def starts() -> None:
    """From ``import`` to the first step: with an empty cache, then with a full one."""
    with tempfile.TemporaryDirectory() as cache:
        cold = [json.loads(line) for line in fresh(START, *IDS, cache=cache)]
        print(f"cold start of {IDS[0]:44s} {cold[0][1]:10.2f} CPU s")
        print(f"then the part of {IDS[1]:41s} {cold[1][1] - cold[0][1]:10.2f} CPU s")
        for env_id in IDS:
            walls = [json.loads(fresh(START, env_id, cache=cache)[0])[0] for _ in range(3)]
            print(f"warm start of {env_id:44s} {np.median(walls):10.2f} s from import to first step")


def memory(env_id: str, num_envs: int) -> None:
    kilobytes = int(fresh(MEMORY, env_id, str(num_envs))[-1])
    print(f"{env_id}: {num_envs} lanes take {kilobytes / 1024:.0f} MB ({kilobytes / num_envs:.1f} kB each)")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--quick", action="store_true", help="leave out the other engines, memory and starts")
    parser.add_argument("--plot", type=Path, help="write a picture of the batches to this file")
    arguments = parser.parse_args()
    print(f"avalanche_gym {avalanche_gym.__version__}, Python {platform.python_version()}, {platform.machine()}")
    python_edge(arguments.repeats)
    for env_id in IDS:
        single_step(env_id, arguments.repeats, 2000)
    for env_id in IDS:
        for num_envs in (256, 1024):
            batched(env_id, num_envs, arguments.repeats, 60)
    if not arguments.quick:
        batch.report(tuple(batch.ENGINES), batch.WORLDS, 0.5, 1, arguments.plot)
        batch.report(tuple(batch.ENGINES), (256,), 0.5, os.cpu_count() or 1, None)
        memory(IDS[0], 4096)
        starts()
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(f"peak memory of this process {peak:.0f} MB")


if __name__ == "__main__":
    main()
