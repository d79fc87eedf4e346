"""What the options of PushTerrain leave: errors after one environment step against a tight tolerance, and the cost.

    python -m benchmarks.push_options [--lanes 128] [--states 20]

Lanes in which the pusher mostly pushes are stepped by the reference; every fourth state each of the options starts from
the same. Differences of places and velocities of pusher and body at the end of the 0.02 s, and the CPU time of the
physics as a share of the reference's.
"""

from __future__ import annotations

import argparse
import time
from typing import Any

import gymnasium
import numpy as np

import avalanche_gym  # noqa: F401  registers the environments
from avalanche_gym import physics
from avalanche_gym.envs.push_terrain.env import push

STEP = 0.005  # [s]
REFERENCE: dict[str, Any] = {"time_step": STEP, "tolerance": 1e-12, "events": False}
OPTIONS: dict[str, dict[str, Any]] = {
    "tolerance=1e-2": {"tolerance": 1e-2},
    "tolerance=1e-3": {"tolerance": 1e-3},
    "tolerance=1e-4": {"tolerance": 1e-4},
    "tolerance=1e-6": {"tolerance": 1e-6},
    "tolerance=1e-8": {"tolerance": 1e-8},
    "events=True": {"events": True},
    "half the step": {"time_step": STEP / 2},
    "an eighth of the step, events=True": {"time_step": STEP / 8, "events": True},
}
EVERY = 4  # environment steps from one compared state to the next


def make(lanes: int, changes: dict[str, Any]) -> Any:
    """The task of a vector environment with the reference's options and these changes."""
    options = physics.Options(sleeping=False, **(REFERENCE | changes))
    env: Any = gymnasium.make_vec(
        "avalanche/PushTerrain-v0", num_envs=lanes, vectorization_mode="vector_entry_point", options=options
    )
    env.reset(seed=0)
    return env.unwrapped.task


def step(task: Any, action: np.ndarray) -> float:
    """One environment step; its CPU seconds."""
    push(action, task.pusher, task.world.impulse_buffer)
    start = time.process_time()
    task.world.step(task.num_steps)
    return time.process_time() - start


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--lanes", type=int, default=128)
    parser.add_argument("--states", type=int, default=20)
    arguments = parser.parse_args()
    reference = make(arguments.lanes, {})
    tasks = {name: make(arguments.lanes, changes) for name, changes in OPTIONS.items()}
    generator = np.random.default_rng(0)
    errors: dict[str, list[np.ndarray]] = {name: [] for name in tasks}
    seconds = dict.fromkeys([*tasks, "reference"], 0.0)
    for number in range(EVERY * arguments.states):
        world = reference.world
        way = world.position[:, reference.body, :2] - world.position[:, reference.pusher, :2]
        way /= np.linalg.norm(way, axis=1, keepdims=True) + 1e-9
        action = np.clip(0.6 * way + generator.normal(0.0, 0.5, way.shape), -1.0, 1.0)
        compared = number % EVERY == EVERY - 1
        if compared:
            states = dict(enumerate(reference.get_states()))
            for name, task in tasks.items():
                task.set_states(states)
                seconds[name] += step(task, action)
        spent = step(reference, action)
        if compared:
            seconds["reference"] += spent
            for name, task in tasks.items():
                errors[name].append(
                    np.stack(
                        [
                            np.linalg.norm(getattr(task.world, what) - getattr(world, what), axis=2)[:, 1:].max(axis=1)
                            for what in ("position", "linear_velocity")
                        ]
                    )
                )
    print(f"{'options':36s} position [m]      velocity [m/s]    cost    (median, 99th percentile)")
    for name, found in errors.items():
        middle, high = np.quantile(np.concatenate(found, axis=1), (0.5, 0.99), axis=1)
        share = seconds[name] / seconds["reference"]
        print(f"{name:36s} {middle[0]:7.0e} {high[0]:7.0e}   {middle[1]:7.0e} {high[1]:7.0e}   {share:5.2f}")


if __name__ == "__main__":
    main()
