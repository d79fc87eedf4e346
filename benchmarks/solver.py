"""The contact solver alone: the problems of a scene, recorded as its steps prepare them, solved again and timed.

    python -m benchmarks.solver [push struck pile push_terrain rolling] [--repeats 5]

``push`` is the small push scene with default options, ``struck`` the same with a step a push, no events and a tolerance
of 1e-4: nearly every problem has a blow in it that its warm start misses. ``pile`` is the steps 30 to 90 of the hard
case ``pile_100`` (its small islands; the pile tier keeps what it steps), ``push_terrain`` the environment, ``rolling``
compounds of three shapes with rolling friction that fall on rough ground. A line each: the problems, CPU time and
factorisations of one, how many miss their tolerance and by how much, and how far down the chain they went. What changes
the solver is compared on the same problems, in turns with the state before it.
"""

from __future__ import annotations

import argparse
import ctypes
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import gymnasium
import numpy as np

import avalanche_gym  # noqa: F401  registers the environments
from avalanche_gym import physics
from avalanche_gym.physics.jit import entry_point
from avalanche_gym.physics.layout import WORKSPACE
from avalanche_gym.physics.report import METHODS
from avalanche_gym.physics.scenes.piles import pile
from avalanche_gym.physics.scenes.push import PUSH_STEP, PUSH_STEPS, PUSHED, push_impulses, push_scene
from avalanche_gym.physics.solver.exact import solve_rows
from avalanche_gym.physics.solver.workspace import NODE, ROW, Workspace

Array = np.ndarray
LANES, PUSHES, ACTIONS = 16, 30, 40  # worlds of the scenes with several, and environment steps that are recorded
FIRST, STEPS = 30, 60  # of the pile
ROLLERS, ROLLING_STEPS = 9, 180  # compounds of a world, fewer than a crowd, and steps in which they land
MOST_BODIES = 1024  # of an island


@dataclass
class Problems:
    """What the solver was given, one after the other."""

    sizes: list[tuple[int, int]] = field(default_factory=list)  # rows, bodies
    limits: list[tuple[float, float]] = field(default_factory=list)  # tolerance, most factorisations
    rows: list[Array] = field(default_factory=list)
    nodes: list[Array] = field(default_factory=list)

    def packed(self) -> tuple[Array, Array, Array, Array, Array, Array]:
        """(problems, 2) sizes and limits; where each begins in the rows and in the nodes; (rows,) and (nodes,)."""
        sizes = np.array(self.sizes, np.int64)
        first_row = np.cumsum(sizes[:, 0]) - sizes[:, 0]
        first_node = np.cumsum(sizes[:, 1] + 1) - sizes[:, 1] - 1
        return (
            sizes, np.array(self.limits), first_row, first_node, np.concatenate(self.rows), np.concatenate(self.nodes),
        )  # fmt: skip


def _array_at(address: int, count: int, kind: np.dtype) -> Array:
    memory: Any = (ctypes.c_char * (count * kind.itemsize)).from_address(address)
    return np.frombuffer(memory, kind)


def record(world: physics.World, step: Callable[[], object]) -> Problems:
    """The problems that ``step`` solves in a world."""
    found = Problems()
    header = world._storage.header[0]
    kind = ctypes.CFUNCTYPE(ctypes.c_int64, *[ctypes.c_int64] * 4)
    address = int(header["solve_problem"])
    original = kind(address)

    def watched(header_address: int, workspace_address: int, num_rows: int, num_bodies: int) -> int:
        workspace = _array_at(workspace_address, 1, WORKSPACE)[0]
        found.sizes.append((num_rows, num_bodies))
        found.limits.append((float(workspace["tolerance"]), float(workspace["budget"])))
        found.rows.append(_array_at(int(workspace["solver_rows"]), num_rows, ROW).copy())
        found.nodes.append(_array_at(int(workspace["solver_nodes"]), num_bodies + 1, NODE).copy())
        return int(original(header_address, workspace_address, num_rows, num_bodies))

    kept = kind(watched)
    header["solve_problem"] = ctypes.cast(kept, ctypes.c_void_p).value
    step()
    header["solve_problem"] = address
    return found


def push(steps_a_push: int = PUSH_STEPS, **options: Any) -> Problems:
    time_step = PUSH_STEP * PUSH_STEPS / steps_a_push
    world = physics.World(push_scene(), LANES, physics.Options(time_step=time_step, sleeping=False, **options))
    pushes = push_impulses(np.random.default_rng(0), PUSHES * LANES).reshape(PUSHES, LANES, 3)

    def steps() -> None:
        for impulses in pushes:
            world.impulse_buffer[:, PUSHED, :3] = impulses
            world.step(steps_a_push)

    return record(world, steps)


def struck() -> Problems:
    return push(1, events=False, tolerance=1e-4)


def falling_pile() -> Problems:
    world = physics.World(pile(100), options=physics.Options(time_step=1.0 / 60.0, sleeping=False))
    world.step(FIRST)
    return record(world, lambda: world.step(STEPS))


def push_terrain() -> Problems:
    env: Any = gymnasium.make_vec(
        "avalanche/PushTerrain-v0", num_envs=4 * LANES, vectorization_mode="vector_entry_point"
    )
    env.reset(seed=0)
    env.action_space.seed(0)
    return record(env.unwrapped.task.world, lambda: [env.step(env.action_space.sample()) for _ in range(ACTIONS)])


def rolling() -> Problems:
    generator = np.random.default_rng(0)
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity((0.0, 0.0, -9.81)))
    stuff = physics.Material(friction=0.7, rolling_friction=0.005)
    heights = generator.normal(scale=0.05, size=(33, 33))
    scene.add_body(physics.HeightField(heights, (8.0, 8.0)), motion="static", material=stuff)
    shapes = (physics.Capsule(0.04, 0.12), physics.Cylinder(0.06, 0.05), physics.Box((0.08, 0.05, 0.03)))
    for place in range(ROLLERS):
        turns = generator.normal(size=(len(shapes), 4))
        turns /= np.linalg.norm(turns, axis=1, keepdims=True)
        parts = [(shape, generator.normal(scale=0.08, size=3), turn) for shape, turn in zip(shapes, turns, strict=True)]
        at = (1.8 * (place % 3 - 1), 1.8 * (place // 3 - 1), 0.5)
        scene.add_body(physics.Compound(parts), density=500.0, position=at, material=stuff)
    world = physics.World(scene, LANES, physics.Options(time_step=1.0 / 120.0, sleeping=False))
    for body in range(1, ROLLERS + 1):
        world.set_state(body, angular_velocity=generator.normal(scale=3.0, size=(LANES, 3)))
    return record(world, lambda: world.step(ROLLING_STEPS))


SOURCES: dict[str, Callable[[], Problems]] = {
    "push": push, "struck": struck, "pile": falling_pile, "push_terrain": push_terrain, "rolling": rolling,
}  # fmt: skip


@entry_point
def solve_all(sizes, limits, first_row, first_node, all_rows, all_nodes, rows, nodes, blocks, index, found, solves):
    """Copy every problem to the arrays of a Workspace and, if ``solves`` is 1, solve it."""
    for number in range(sizes.shape[0]):
        num_rows = sizes[number, 0]
        num_bodies = sizes[number, 1]
        for i in range(num_rows):
            rows[i] = all_rows[first_row[number] + i]
        for i in range(num_bodies + 1):
            nodes[i] = all_nodes[first_node[number] + i]
        if solves == 1:
            tolerance = limits[number, 0]
            budget = np.int64(limits[number, 1])
            residual, iterations, method = solve_rows(
                num_rows, num_bodies, np.int64(nodes.shape[0]), tolerance, budget, rows, nodes, blocks, index
            )
            found[number, 0] = residual
            found[number, 1] = iterations
            found[number, 2] = method


def report(name: str, repeats: int) -> None:
    packed = SOURCES[name]().packed()
    sizes, limits = packed[0], packed[1]
    count = len(sizes)
    arrays = Workspace(int(sizes[:, 0].max()), MOST_BODIES).arrays
    found = np.zeros((count, 3))
    solve_all(*packed, *arrays, found, 1)
    spent = []
    for _ in range(repeats):
        start = time.process_time()
        solve_all(*packed, *arrays, found, 1)
        middle = time.process_time()
        solve_all(*packed, *arrays, found, 0)
        spent.append(2.0 * middle - start - time.process_time())
    residual = found[:, 0]
    missed = residual > limits[:, 0]
    wide = missed & (residual > 1e-10)
    methods = Counter(METHODS[int(method)] for method in found[:, 2])
    print(
        f"{name:12s} {count:6d} problems, {sizes[:, 0].mean():4.1f} rows: {min(spent) / count * 1e6:6.2f} us,"
        f" {found[:, 1].mean():5.2f} iterations; missed {missed.sum()}, above 1e-10 {wide.sum()},"
        f" worst {residual.max():.0e}; " + ", ".join(f"{method} {number}" for method, number in methods.most_common()),
        flush=True,
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", default=list(SOURCES), help=", ".join(SOURCES))
    parser.add_argument("--repeats", type=int, default=5)
    arguments = parser.parse_args()
    for name in arguments.names:
        report(name, arguments.repeats)


if __name__ == "__main__":
    main()
