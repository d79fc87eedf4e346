"""Bowls, troughs, triangulated floors and the carpet: ground given by samples and triangles."""

from __future__ import annotations

import math
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ..scene import Material, Scene, UniformGravity
from ..shapes import Box, Capsule, ConvexHull, HeightField, Plane, Shape, Sphere, TriangleMesh
from .case import EVERY_STEP, GRAVITY, Actuated, Companion, HardCase, Recording, about, angle_between

BOWL_RADIUS, BOWL_WIDTH, BOWL_SAMPLES, BOWL_BALL, RELEASE = 2.0, 2.5, 129, 0.05, math.radians(30.0)
PENDULUM = BOWL_RADIUS - BOWL_BALL


def bowl(surface: str) -> Scene:
    """A sphere without friction in a round bowl of samples, released from the side."""
    line = np.linspace(-0.5 * BOWL_WIDTH, 0.5 * BOWL_WIDTH, BOWL_SAMPLES)
    x, y = np.meshgrid(line, line)
    heights = BOWL_RADIUS - np.sqrt(np.maximum(0.0, BOWL_RADIUS**2 - x**2 - y**2))
    frictionless = Material(friction=0.0)
    scene = Scene()
    scene.add_field(UniformGravity((0.0, 0.0, -GRAVITY)))
    shape = HeightField(heights, (BOWL_WIDTH, BOWL_WIDTH), surface=surface)
    scene.add_body(shape, motion="static", material=frictionless)
    place = (PENDULUM * math.sin(RELEASE), 0.0, BOWL_RADIUS - PENDULUM * math.cos(RELEASE))
    scene.add_body(Sphere(BOWL_BALL), mass=1.0, position=place, material=frictionless)
    return scene


def pendulum_angle(amplitude: float, length: float, times: NDArray[np.float64]) -> NDArray[np.float64]:
    """[rad] of a pendulum released at ``amplitude``: sin(theta / 2) = k sn(K - w t), k = sin(amplitude / 2)."""
    from scipy.special import ellipj, ellipk

    k = math.sin(0.5 * amplitude)
    sn = ellipj(ellipk(k * k) - math.sqrt(GRAVITY / length) * np.asarray(times), k * k)[0]
    return 2.0 * np.arcsin(k * sn)


def measure_bowl(recording: Recording) -> dict[str, float]:
    angle = pendulum_angle(RELEASE, PENDULUM, recording.time)
    truth = np.stack([PENDULUM * np.sin(angle), np.zeros_like(angle), BOWL_RADIUS - PENDULUM * np.cos(angle)], axis=1)
    place, speed = recording.position[:, 1], recording.linear_velocity[:, 1]
    energy = 0.5 * (speed**2).sum(axis=1) + GRAVITY * (place[:, 2] - BOWL_BALL)
    return {
        "position": np.linalg.norm(place - truth, axis=1).max(),
        "energy": np.abs(energy / energy[0] - 1.0).max(),
    }


# A trough of flat facets: heights over x as below, the same along y. A ball crosses each crease at its centre's height
# where the two planes at one radius from the facets meet, and keeps cos(kink) of its speed there (e = 0).
TROUGH_WIDTH, TROUGH_FACETS, TROUGH_BALL, TROUGH_DEPTH = 4.0, 8, 0.1, 1.0


def trough_samples() -> NDArray[np.float64]:
    """Heights [m] at 9 places along x: a parabola."""
    x = np.linspace(-1.0, 1.0, TROUGH_FACETS + 1)
    return TROUGH_DEPTH * x**2


def trough() -> Scene:
    """A sphere without friction that slides down the facets of a trough."""
    frictionless = Material(friction=0.0)
    scene = Scene()
    scene.add_field(UniformGravity((0.0, 0.0, -GRAVITY)))
    heights = np.tile(trough_samples(), (5, 1))
    scene.add_body(HeightField(heights, (TROUGH_WIDTH, 2.0)), motion="static", material=frictionless)
    corners, _ = trough_track()
    start = 0.5 * (corners[0] + corners[1])
    scene.add_body(Sphere(TROUGH_BALL), mass=1.0, position=(start[0], 0.1, start[1]), material=frictionless)
    return scene


def trough_track() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Corners (9, 2) [m] of the path of the ball's centre in x and z, and the slopes (8,) [rad] of its pieces."""
    x = np.linspace(-0.5 * TROUGH_WIDTH, 0.5 * TROUGH_WIDTH, TROUGH_FACETS + 1)
    z = trough_samples()
    slopes = np.arctan2(np.diff(z), np.diff(x))
    corners = []
    for k in range(TROUGH_FACETS + 1):
        left, right = slopes[max(k - 1, 0)], slopes[min(k, TROUGH_FACETS - 1)]
        middle, half = 0.5 * (left + right), 0.5 * (right - left)
        # The offset of a corner goes along the bisector of the normals and is longer by 1 / cos(half the kink).
        offset = TROUGH_BALL / math.cos(half)
        corners.append((x[k] - offset * math.sin(middle), z[k] + offset * math.cos(middle)))
    return np.array(corners), slopes


def trough_motion(times: NDArray[np.float64]) -> NDArray[np.float64]:
    """Places (n, 2) [m] of the ball's centre: constant acceleration on each piece, cos(kink) at each corner."""
    corners, slopes = trough_track()
    piece, place, speed, begin = 0, 0.5 * (corners[0] + corners[1]), 0.0, 0.0
    found = []
    for time in times:
        while True:
            along = np.array([math.cos(slopes[piece]), math.sin(slopes[piece])])
            acceleration = -GRAVITY * math.sin(slopes[piece])
            ends = [(side, float((corners[piece + side] - place) @ along)) for side in (0, 1)]
            leave = [(_first_time(distance, speed, acceleration), side) for side, distance in ends]
            wait, side = min(leave)
            if time <= begin + wait:
                t = time - begin
                found.append(place + along * (speed * t + 0.5 * acceleration * t * t))
                break
            begin, place = begin + wait, corners[piece + side]
            speed += acceleration * wait
            other = piece + (1 if side else -1)
            speed *= math.cos(slopes[other] - slopes[piece])
            piece = other
    return np.array(found)


def _first_time(distance: float, speed: float, acceleration: float) -> float:
    """Smallest t > 0 with speed t + acceleration t^2 / 2 = distance; infinite if there is none."""
    if abs(distance) < 1e-14:  # [m] it stands on this end: it comes back to it, if at all, when its speed is reversed
        back = -2.0 * speed / acceleration
        return back if back > 0.0 else math.inf
    root = speed * speed + 2.0 * acceleration * distance
    if root < 0.0:
        return math.inf
    # Both roots without cancellation.
    half = -(speed + math.copysign(math.sqrt(root), speed))
    times = [t for t in (half / acceleration, -2.0 * distance / half if half else math.inf) if t > 0.0]
    return min(times, default=math.inf)


def measure_trough(recording: Recording) -> dict[str, float]:
    truth = trough_motion(recording.time)
    place = recording.position[:, 1]
    return {
        "position": np.linalg.norm(place[:, [0, 2]] - truth, axis=1).max(),
        "sideways": np.abs(place[:, 1] - 0.1).max(),
    }


# Internal edges: a floor cut at random, in two meshes, one with T-junctions inside.
FLOOR_SPEED, FLOOR_FRICTION = (3.0, 0.7), 0.3


def cut_floor(
    generator: np.random.Generator, low: tuple[float, float], high: tuple[float, float], count: int
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Vertices (n, 3) and faces (m, 3) of a flat rectangle cut at random points; its border has points of its own."""
    from scipy.spatial import Delaunay

    low_, high_ = np.array(low), np.array(high)
    inside = generator.uniform(0.02, 0.98, (count, 2))
    ends = np.array([0.0, 1.0])
    border = [np.stack(np.meshgrid(ends, ends), axis=-1).reshape(-1, 2)]
    for axis in (0, 1):
        for side in ends:
            points = np.full((6, 2), side)
            points[:, axis] = generator.uniform(0.05, 0.95, 6)
            border.append(points)
    points = low_ + (high_ - low_) * np.concatenate([inside, *border])
    faces = Delaunay(points).simplices.astype(np.int64)
    a, b, c = (points[faces[:, k]] for k in range(3))
    area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    faces = faces[np.abs(area) > 1e-9]
    area = area[np.abs(area) > 1e-9]
    faces[area < 0.0] = faces[area < 0.0][:, ::-1]
    return np.column_stack([points, np.zeros(len(points))]), faces


def floor_meshes() -> list[TriangleMesh]:
    """Two meshes that meet at x = 2.2 without shared points; the first is two patches that meet at T-junctions."""
    generator = np.random.default_rng(7)
    first = cut_floor(generator, (-1.0, -2.0), (0.8, 3.0), 60)
    second = cut_floor(generator, (0.8, -2.0), (2.2, 3.0), 60)
    joined = np.concatenate([first[0], second[0]]), np.concatenate([first[1], second[1] + len(first[0])])
    third = cut_floor(generator, (2.2, -2.0), (6.0, 3.0), 90)
    return [TriangleMesh(*joined), TriangleMesh(*third)]


SLIDERS: dict[str, tuple[Shape, float, tuple[float, float, float, float]]] = {
    # shape, height of its origin above the floor, orientation
    "sphere": (Sphere(0.1), 0.1, (1.0, 0.0, 0.0, 0.0)),
    "capsule": (Capsule(0.1, 0.2), 0.1, about((1.0, 0.0, 0.0), 0.5 * math.pi)),
    "box": (Box((0.2, 0.15, 0.1)), 0.1, about((0.0, 0.0, 1.0), 0.3)),
    "hull": (
        ConvexHull([(x, y, z) for z, s in ((-0.1, 0.2), (0.1, 0.1)) for x in (-s, s) for y in (-s, s)]),
        0.1,
        about((0.0, 0.0, 1.0), 0.5),
    ),
}


def floor_scene(kind: str, cut: bool) -> Scene:
    """A shape that slides over the floor: the cut one, or the plane."""
    shape, height, turn = SLIDERS[kind]
    material = Material(friction=FLOOR_FRICTION)
    scene = Scene()
    scene.add_field(UniformGravity((0.0, 0.0, -GRAVITY)))
    scene.add_body(
        shape, mass=1.0, position=(0.0, 0.0, height), orientation=turn, linear_velocity=(*FLOOR_SPEED, 0.0),
        material=material,
    )  # fmt: skip
    for mesh in floor_meshes() if cut else [Plane()]:
        scene.add_body(mesh, motion="static", material=material)
    return scene


def measure_floor(cut: Recording, plane: Recording) -> dict[str, float]:
    return {
        "position": np.abs(cut.position[:, 0] - plane.position[:, 0]).max(),
        "velocity": np.abs(cut.linear_velocity[:, 0] - plane.linear_velocity[:, 0]).max(),
        "angle": angle_between(cut.orientation[:, 0], plane.orientation[:, 0]).max(),
    }


# The carpet: a wave that travels along x under a body. A flat field that rises and falls as one is its simplest case,
# and has a closed form: the body is lifted with the surface as long as that falls slower than g.
CARPET_AMPLITUDE, CARPET_RATE, CARPET_SIZE, CARPET_CELLS = 0.05, 2.0 * math.pi, 4.0, 8


def carpet() -> Scene:
    """A box on a field whose samples rise and fall together."""
    scene = Scene()
    scene.add_field(UniformGravity((0.0, 0.0, -GRAVITY)))
    flat = np.zeros((CARPET_CELLS + 1, CARPET_CELLS + 1))
    scene.add_body(HeightField(flat, (CARPET_SIZE, CARPET_SIZE)), motion="kinematic")
    rise = CARPET_AMPLITUDE * CARPET_RATE
    scene.add_body(Box((0.2, 0.2, 0.1)), mass=1.0, position=(0.1, 0.15, 0.1), linear_velocity=(0, 0, rise))
    return scene


def wave(simulation: Actuated, time: float, step: float) -> None:
    """Heights at the start of the step, with the mean rate until its end."""
    here, there = (CARPET_AMPLITUDE * math.sin(CARPET_RATE * t) for t in (time, time + step))
    shape = (CARPET_CELLS + 1, CARPET_CELLS + 1)
    simulation.set_heights(0, np.full(shape, here), np.full(shape, (there - here) / step))


def measure_carpet(recording: Recording) -> dict[str, float]:
    surface = CARPET_AMPLITUDE * np.sin(CARPET_RATE * recording.time)
    place = recording.position[:, 1]
    return {
        "height": np.abs(place[:, 2] - 0.1 - surface).max() / CARPET_AMPLITUDE,
        "drift": np.abs(place[:, :2] - place[0, :2]).max(),
    }


CASES = (
    *(
        HardCase(
            f"bowl_{surface}", 11, f"A sphere without friction in a bowl of 129 x 129 samples, {surface}",
            "pendulum of length 1.95 m on the smooth surface, by elliptic functions", partial(bowl, surface), 10.0,
            measure_bowl, "position", "m", 3e-3, goal={240: 3e-3}, sampling=0.1, order=surface == "smooth",
        )
        for surface in ("smooth", "facets")
    ),
    HardCase(
        "trough", 11, "A sphere without friction down a trough of facets, e = 0",
        "constant acceleration on each facet, cos(kink) of the speed at each crease", trough, 5.0, measure_trough,
        "position", "m", 1e-3, goal={60: 1e-6, 240: 1e-6, 960: 1e-6}, sampling=0.1, order=False,
    ),
    *(
        HardCase(
            f"internal_edges_{kind}", 12, f"A {kind} slides over a floor cut at random, with T-junctions and a seam",
            "the motion on the analytic plane with the same step", partial(floor_scene, kind, True), 1.0,
            measure_floor, "position", "m", 1e-9, goal={60: 1e-9, 240: 1e-9, 960: 1e-9}, sampling=1.0 / 30.0,
            companions=(Companion(partial(floor_scene, kind, False)),), order=False,
        )
        for kind in SLIDERS
    ),
    HardCase(
        "carpet", 24, "A box on ground that rises and falls, 1 Hz, 5 cm", "stays on the surface", carpet, 3.0,
        measure_carpet, "height", "amplitudes", 1e-3, goal={240: 1e-4}, sampling=EVERY_STEP, drive=wave,
    ),
)  # fmt: skip
