"""What the size of the terrain costs: a step on fields and meshes of growing size, and loading a large mesh.

    python -m benchmarks.terrain [--sizes 33 129 1025] [--triangles 1000000]

A sphere and a box are pushed about the middle of the terrain, cells of 0.25 m, in four steps of 5 ms a push. The field
of every size has the same heights there, so that all do the same work; the sizes take turns, and the CPU time is the
median of their turns. A mesh is prepared in a process of its own, whose peak of memory is that of loading.

What four steps cost depends on what the bodies do more than on all else: at rest, pushed about so that they slide and
strike facets all the time, and thrown up tumbling, on these hills and on rough ones.
"""

from __future__ import annotations

import argparse
import multiprocessing
import resource
import time

import numpy as np
from numpy.typing import NDArray

from avalanche_gym import physics

CELL, TURNS, PUSHES, STEPS = 0.25, 15, 60, 4


def heights_of(samples: int) -> NDArray[np.float64]:
    """The same hills whatever the size: a function of the place."""
    line = CELL * (np.arange(samples) - samples // 2)
    x, y = np.meshgrid(line, line)
    heights: NDArray[np.float64] = 0.15 * np.sin(1.3 * x) * np.cos(1.1 * y) + 0.05 * np.sin(3.1 * x + 2.3 * y)
    return heights


def mesh_of(samples: int) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Vertices and faces of those hills."""
    heights = heights_of(samples)
    line = CELL * (np.arange(samples) - samples // 2)
    x, y = np.meshgrid(line, line)
    i, j = (index.ravel() for index in np.mgrid[: samples - 1, : samples - 1])
    a = i * samples + j
    faces = np.concatenate([np.stack([a, a + 1, a + samples + 1], 1), np.stack([a, a + samples + 1, a + samples], 1)])
    return np.stack([x, y, heights], axis=2).reshape(-1, 3), faces


def world_on(ground: physics.shapes.Shape) -> physics.World:
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity((0.0, 0.0, -9.81)))
    scene.add_body(ground, motion="static")
    scene.add_body(physics.Sphere(0.15), mass=1.0, position=(0.3, 0.0, 0.6))
    scene.add_body(physics.Box((0.2, 0.2, 0.2)), mass=2.0, position=(-0.4, 0.3, 0.7))
    return physics.World(scene, options=physics.Options(time_step=0.005, sleeping=False))


def turn(world: physics.World) -> float:
    """[us] of CPU time of four steps, the same motion every time."""
    world.reset()
    world.step(100)
    pushes = np.random.default_rng(0).normal(size=(PUSHES, 2, 2)) * (0.2, 0.4)
    start = time.process_time()
    for x, y in pushes:
        world.apply_impulse(1, (*x, 0.0))
        world.apply_impulse(2, (*y, 0.0))
        world.step(STEPS)
    return (time.process_time() - start) / PUSHES * 1e6


def motion(world: physics.World, kind: str) -> tuple[float, float, float]:
    """[us] of CPU time, located impacts and iterations of the solver in four steps, the mean of three seeds."""
    used = events = iterations = 0.0
    seeds, number = 3, 100
    for seed in range(seeds):
        rng = np.random.default_rng(seed)
        world.reset()
        world.step(400 if kind == "at rest" else 100)
        for index in range(number):
            if kind == "pushed":
                for body, impulse in ((1, 0.2), (2, 0.8)):
                    world.apply_impulse(body, (*rng.normal(scale=impulse, size=2), 0.0))
            elif kind == "thrown" and index % 20 == 0:
                for body in (1, 2):
                    up = (*rng.normal(scale=1.5, size=2), 1.0)
                    world.set_state(body, linear_velocity=up, angular_velocity=rng.normal(scale=8.0, size=3))
            start = time.process_time()
            world.step(STEPS)
            used += time.process_time() - start
            report = world.report()
            events += float(report.events[0])
            iterations += float(report.iterations[0])
    return 1e6 * used / seeds / number, events / seeds / number, iterations / seeds / number


def compare_motions(samples: int) -> None:
    extent = CELL * (samples - 1)
    rough = heights_of(samples) + np.random.default_rng(0).normal(scale=0.02, size=(samples, samples))
    print(f"a sphere and a box on {samples} x {samples} samples, four steps: CPU time [us], impacts, iterations")
    for ground, heights in (("hills", heights_of(samples)), ("rough", rough)):
        world = world_on(physics.HeightField(heights, (extent, extent)))
        for kind in ("at rest", "pushed", "thrown"):
            used, events, iterations = motion(world, kind)
            print(f"  {ground}, {kind:8s} {used:8.1f} {events:8.2f} {iterations:8.1f}", flush=True)


def compare(kind: str, worlds: dict[int, physics.World]) -> None:
    costs: dict[int, list[float]] = {size: [] for size in worlds}
    for _ in range(TURNS):
        for size, world in worlds.items():
            costs[size].append(turn(world))
    print(f"{kind}: CPU time of a push and four steps, median (least) [us], and as a ratio to the smallest")
    smallest = float(np.median(next(iter(costs.values()))))
    for size, found in costs.items():
        middle = float(np.median(found))
        print(f"  {size:5d} x {size:<5d} {middle:8.1f} ({min(found):.1f})   {middle / smallest:5.2f}", flush=True)


def load(samples: int) -> tuple[int, float, float, float]:
    """Triangles; CPU and wall time of preparing them [s]; peak of memory of the process [MB]."""
    vertices, faces = mesh_of(samples)
    start, wall = time.process_time(), time.perf_counter()
    world_on(physics.TriangleMesh(vertices, faces))
    used = time.process_time() - start
    return len(faces), used, time.perf_counter() - wall, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sizes", nargs="+", type=int, default=[33, 65, 129, 257, 513, 1025])
    parser.add_argument("--mesh-sizes", nargs="+", type=int, default=[33, 129, 513])
    parser.add_argument("--triangles", type=int, default=1_000_000)
    arguments = parser.parse_args()

    def field(size: int) -> physics.World:
        extent = CELL * (size - 1)
        return world_on(physics.HeightField(heights_of(size), (extent, extent)))

    compare_motions(129)
    compare("height field", {size: field(size) for size in arguments.sizes})
    compare("mesh", {size: world_on(physics.TriangleMesh(*mesh_of(size))) for size in arguments.mesh_sizes})
    if arguments.triangles > 0:
        samples = round(np.sqrt(arguments.triangles / 2)) + 1
        with multiprocessing.get_context("spawn").Pool(1) as pool:
            triangles, used, wall, memory = pool.apply(load, (samples,))
        print(
            f"{triangles} triangles: {used:.1f} s of CPU time, {wall:.1f} s of wall time, {memory:.0f} MB at the peak"
        )


if __name__ == "__main__":
    main()
