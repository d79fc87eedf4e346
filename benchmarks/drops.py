"""Concave bodies dropped at random: do they come to rest, and how deep do they ever dip into what they meet?

    python -m benchmarks.drops [--shapes rabbit gear ...] [--grounds plane facets ...] [--seeds 4] [--depth]
    python -m benchmarks.drops --heap 8 --seconds 2 --depth

Bodies of 0.1 to 0.2 m, density 300 to 3000 kg/m^3, friction 0.5, rolling friction 0.005 m, fall with a random turn,
velocity and spin; default options, steps of 1/240 s. ``--heap n``: n bodies of mixed shapes one above the other.

Columns: when all of them slept [s], speed and spin of the fastest in the end, what of that friction brakes (nothing of
a spin on a single point), and the deepest overlap after any step:
by the report, and with ``--depth`` by the distance (World.closest_point) of vertices and middles of edges of each mesh,
and of facets of the ground, from all other bodies.
"""

from __future__ import annotations

import argparse
import functools

import numpy as np
from numpy.typing import NDArray

from avalanche_gym import physics
from avalanche_gym.physics.shapes.rabbit import rabbit
from avalanche_gym.physics.shapes.ring_solids import gear, torus
from avalanche_gym.physics.shapes.thread import Thread, bolt, nut

from .concave import ground as rough_ground

RATE = 240  # [1/s]
THREAD = Thread(0.03, 0.012, 0.006)
SHAPES = {
    "rabbit": functools.partial(rabbit, 0.2),
    "torus": functools.partial(torus, 0.1, 0.03),
    "gear": functools.partial(gear, 0.1, 0.05),
    "nut": functools.partial(nut, THREAD, 2, clearance=1e-3),
    "bolt": functools.partial(bolt, THREAD, 10),
}
GROUNDS = ("plane", "box", "facets", "fine", "mesh", "smooth")
# [m] inside a body a point is still known to be inside.
DEEPEST = 0.003


@functools.cache
def solid(name: str) -> physics.TriangleMesh:
    return SHAPES[name]()


@functools.cache
def ground(name: str) -> tuple[physics.Shape, float]:
    """Shape of the ground, and how high [m] it lies."""
    if name == "box":
        return physics.Box((1.0, 1.0, 0.5)), -0.5
    kind, facet = {"facets": ("field", 0.2), "fine": ("field", 0.05), "mesh": ("mesh", 0.2)}.get(name, (name, 0.2))
    return rough_ground(kind, facet), 0.0


def drop(names: list[str], on: str, seed: int) -> physics.World:
    """A world in which these bodies fall, one above the other, on the ground."""
    rng = np.random.default_rng(seed)
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity((0.0, 0.0, -9.81)))
    material = physics.Material(friction=0.5, rolling_friction=0.005)
    shape, height = ground(on)
    scene.add_body(shape, motion="static", position=(0.0, 0.0, height), material=material)
    spread = 0.4 if len(names) == 1 else 0.06
    for number, name in enumerate(names):
        turn = rng.normal(size=4)
        scene.add_body(
            solid(name),
            density=rng.uniform(300.0, 3000.0),
            position=(*rng.uniform(-spread, spread, 2), 0.4 + 0.25 * number),
            orientation=turn / np.linalg.norm(turn),
            linear_velocity=rng.uniform(-0.5, 0.5, 3),
            angular_velocity=rng.uniform(-5.0, 5.0, 3),
            material=material,
        )
    return physics.World(scene)


def points_of(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> NDArray[np.float64]:
    """(n, 3) vertices, and middles of all edges."""
    sides = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    sides = np.unique(np.sort(sides, axis=1), axis=0)
    a, b = vertices[sides[:, 0]], vertices[sides[:, 1]]
    return np.concatenate([vertices, 0.5 * (a + b)])


@functools.cache
def surface_points(shape: physics.Shape) -> NDArray[np.float64]:
    """(n, 3) points of a mesh or of facets, in its frame; none of a plane, a box, or of what is smooth."""
    if isinstance(shape, physics.TriangleMesh):
        return points_of(np.array(shape.vertices), np.array(shape.faces))
    if isinstance(shape, physics.HeightField) and shape.surface == "facets":
        rows, columns = shape.heights.shape
        x = np.linspace(-0.5, 0.5, columns) * shape.size[0]
        y = np.linspace(-0.5, 0.5, rows) * shape.size[1]
        vertices = np.stack([*np.meshgrid(x, y), shape.heights], axis=-1).reshape(-1, 3)
        corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
        across = corner + columns + 1
        faces = [np.stack([corner, corner + 1, across], axis=1), np.stack([corner, across, across - 1], axis=1)]
        return points_of(vertices, np.concatenate(faces))
    return np.zeros((0, 3))


def rotation(q: NDArray[np.float64]) -> NDArray[np.float64]:
    w, v = q[0], q[1:]
    cross = np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])
    return np.eye(3) + 2.0 * (w * cross + cross @ cross)


class Depths:
    """How deep points of each body are inside the others."""

    def __init__(self, world: physics.World, names: list[str], on: str) -> None:
        self.world = world
        shape, _ = ground(on)
        self.points = [surface_points(shape), *(surface_points(solid(name)) for name in names)]
        self.radii = [np.linalg.norm(points, axis=1).max(initial=0.0) for points in self.points]

    def deepest(self) -> tuple[float, int, int]:
        """[m], and the bodies: the one that a point belongs to, the one it is in."""
        worst = (0.0, -1, -1)
        position, orientation = self.world.position[0], self.world.orientation[0]
        for body, own in enumerate(self.points):
            if len(own) == 0:
                continue
            points = own @ rotation(orientation[body]).T + position[body]
            near = np.zeros(len(points), bool)
            for other in range(len(self.points)):
                if other != body and other > 0:
                    near |= np.linalg.norm(points - position[other], axis=1) < self.radii[other]
            near |= body > 0
            points = points[near]
            if len(points) == 0:
                continue
            hits = self.world.closest_point(points, max_distance=DEEPEST, world=0, ignore=body)
            index = int(hits["distance"].argmin())
            if -hits["distance"][index] > worst[0]:
                worst = (-float(hits["distance"][index]), body, int(hits["body"][index]))
        return worst


def braked(world: physics.World) -> float:
    """What friction brakes: the fastest point that bears [m/s], or spin across the normal there [rad/s].

    A body that spins on a single point has neither; rolling friction does not stop that.
    """
    fastest = 0.0
    for contact in world.contacts():
        if not contact["impulse"].any():
            continue
        for body in (contact["body_a"], contact["body_b"]):
            spin = world.angular_velocity[0, body]
            arm = contact["position"] - world.position[0, body]
            slides = np.linalg.norm(world.linear_velocity[0, body] + np.cross(spin, arm))
            rolls = np.linalg.norm(np.cross(spin, contact["normal"]))
            fastest = max(fastest, float(slides), float(rolls))
    return fastest


def run(
    names: list[str], on: str, seed: int, seconds: float, look: bool
) -> tuple[float, float, float, float, float, float]:
    """Time [s] at which all slept, or inf; speed [m/s] and spin [rad/s] in the end, and what of them is braked; deepest
    by report and by points.
    """
    world = drop(names, on, seed)
    depths = Depths(world, names, on) if look else None
    reported, measured = 0.0, 0.0 if look else np.nan
    slept = np.inf
    for step in range(round(seconds * RATE)):
        world.step(1)
        reported = max(reported, float(world.report().penetration[0]))
        if depths is not None:
            measured = max(measured, depths.deepest()[0])
        if world.sleeping[0, 1:].all():
            slept = (step + 1) / RATE
            break
    speed = float(np.linalg.norm(world.linear_velocity[0, 1:], axis=1).max())
    spin = float(np.linalg.norm(world.angular_velocity[0, 1:], axis=1).max())
    return slept, speed, spin, braked(world), reported, measured


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--shapes", nargs="*", choices=SHAPES, default=list(SHAPES))
    parser.add_argument("--grounds", nargs="*", choices=GROUNDS, default=list(GROUNDS))
    parser.add_argument("--seeds", type=int, default=4)
    parser.add_argument("--first", type=int, default=0, help="seed to begin with")
    parser.add_argument("--heap", type=int, default=0, metavar="n", help="n bodies of all the shapes at once")
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--depth", action="store_true")
    arguments = parser.parse_args()
    kinds = {name: [name] for name in arguments.shapes}
    if arguments.heap > 0:
        kinds = {f"heap of {arguments.heap}": [*arguments.shapes * arguments.heap][: arguments.heap]}
    print(f"{'':20s} seed asleep s  speed m/s spin rad/s     braked reported m measured m")
    for name, names in kinds.items():
        for on in arguments.grounds:
            for seed in range(arguments.first, arguments.first + arguments.seeds):
                slept, *rest = run(names, on, seed, arguments.seconds, arguments.depth)
                columns = " ".join(f"{value:10.1e}" for value in rest)
                print(f"{name + ', ' + on:20s} {seed:4d} {slept:8.2f} {columns}", flush=True)


if __name__ == "__main__":
    main()
