"""The scene of PushTerrain and how an episode starts: levels, terrain, places of pusher, body and goal."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ... import physics
from ...physics.jit import entry_point, kernel
from ...physics.maths import quat, vec3
from ..base import range_dtype
from ..lane_kernels import sample

EXTENT = 8.0  # [m] of the square terrain along x and y
SAMPLES = 33  # heights along x and y: cells of 0.25 m
MARGIN = 0.4  # [m] pusher and body must stay this far inside the rim
WAVES = 5  # plane waves that make the terrain uneven
PUSHER_RADIUS = 0.15  # [m]
PUSHER_MASS = 1.0  # [kg]
BODY_HALF_EXTENTS = (0.2, 0.2, 0.15)  # [m]
START_CLEARANCE = 0.005  # [m] between terrain and bodies at the start: they drop that far
GROUND_FRICTION = 0.3  # below that of the body, which counts: a pair takes the larger
GLIDING_FRICTION = 0.1  # between pusher and body: the pusher rolls while it pushes

# Uniform numbers that an episode is drawn from: three a wave, then the named ones.
DRAW_CURVATURE = 3 * WAVES
(
    DRAW_ROUGHNESS,
    DRAW_PLACE,
    DRAW_PLACE_ANGLE,
    DRAW_GOAL_ANGLE,
    DRAW_GOAL_DISTANCE,
    DRAW_PUSHER_ANGLE,
    DRAW_PUSHER_DISTANCE,
    DRAW_YAW,
    DRAW_MASS,
    DRAW_FRICTION,
) = range(DRAW_CURVATURE + 1, DRAW_CURVATURE + 11)
DRAWS = DRAW_FRICTION + 1


@dataclass(frozen=True)
class Ranges:
    """(low, high) of what an episode starts with, drawn evenly in between."""

    curvature: tuple[float, float]  # [1/m] of the bowl: height is curvature / 2 times distance squared
    roughness: tuple[float, float]  # [m] amplitude of each wave of the terrain
    wavelength: tuple[float, float]  # [m]
    body_distance: tuple[float, float]  # [m] of the body from the middle
    goal_distance: tuple[float, float]  # [m] from body to goal
    goal_radius: tuple[float, float]  # [m]
    pusher_distance: tuple[float, float]  # [m] from body to pusher
    pusher_angle: tuple[float, float]  # [rad] of the pusher from the point behind the body, as seen from the goal
    yaw: tuple[float, float]  # [rad] of the body from the direction to the goal
    body_mass: tuple[float, float]  # [kg]
    body_friction: tuple[float, float]


LEVELS = {
    "easy": Ranges(
        curvature=(0.01, 0.03),
        roughness=(0.0, 0.01),
        wavelength=(2.0, 4.0),
        body_distance=(0.0, 0.5),
        goal_distance=(0.7, 1.0),
        goal_radius=(0.4, 0.4),
        pusher_distance=(0.45, 0.55),
        pusher_angle=(-0.2, 0.2),
        yaw=(-0.2, 0.2),
        body_mass=(0.5, 0.5),
        body_friction=(0.5, 0.5),
    ),
    "medium": Ranges(
        curvature=(0.02, 0.06),
        roughness=(0.01, 0.03),
        wavelength=(1.5, 4.0),
        body_distance=(0.0, 0.8),
        goal_distance=(0.8, 1.5),
        goal_radius=(0.35, 0.35),
        pusher_distance=(0.5, 0.8),
        pusher_angle=(-1.5, 1.5),
        yaw=(-math.pi, math.pi),
        body_mass=(0.4, 0.7),
        body_friction=(0.4, 0.6),
    ),
    "hard": Ranges(
        curvature=(0.02, 0.10),
        roughness=(0.02, 0.06),
        wavelength=(1.2, 3.0),
        body_distance=(0.0, 1.0),
        goal_distance=(1.0, 2.0),
        goal_radius=(0.3, 0.3),
        pusher_distance=(0.5, 1.0),
        pusher_angle=(-math.pi, math.pi),
        yaw=(-math.pi, math.pi),
        body_mass=(0.3, 1.0),
        body_friction=(0.35, 0.7),
    ),
}
RANGES = range_dtype(Ranges)

LANE = np.dtype(
    [
        ("goal", np.float64, 2),  # [m] x, y of its centre
        ("goal_radius", np.float64),  # [m]
        ("potential", np.float64, 2),  # of progress and approach, after the last step
    ],
    align=True,
)

# What a new episode needs of the world, one row a lane.
START = np.dtype(
    [
        ("pusher_position", np.float64, 3),
        ("body_position", np.float64, 3),
        ("body_orientation", np.float64, 4),
        ("body_mass", np.float64),
        ("body_friction", np.float64),
    ],
    align=True,
)


def build_scene() -> tuple[physics.Scene, int, int, int]:
    """The scene with flat ground, and the handles of ground, pusher and body."""
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity((0.0, 0.0, -9.81)))
    ground_material = physics.Material(friction=GROUND_FRICTION)
    pusher_material = physics.Material(friction=GROUND_FRICTION)
    body_material = physics.Material(friction=0.5)
    scene.set_pair(pusher_material, body_material, friction=GLIDING_FRICTION)
    flat = physics.HeightField(np.zeros((SAMPLES, SAMPLES)), size=(EXTENT, EXTENT))
    ground = scene.add_body(flat, motion="static", material=ground_material, name="ground")
    pusher = scene.add_body(
        physics.Sphere(PUSHER_RADIUS),
        mass=PUSHER_MASS,
        position=(-1.0, 0.0, PUSHER_RADIUS),
        material=pusher_material,
        name="pusher",
    )
    body = scene.add_body(
        physics.Box(BODY_HALF_EXTENTS),
        mass=0.5,
        position=(0.0, 0.0, BODY_HALF_EXTENTS[2]),
        material=body_material,
        name="body",
    )
    return scene, ground, pusher, body


@kernel
def height_at(heights, x, y):
    """[m] of the terrain at x, y: facets whose diagonal joins (row, column) and (row + 1, column + 1)."""
    cell = EXTENT / (SAMPLES - 1)
    u = min(max((x + 0.5 * EXTENT) / cell, 0.0), SAMPLES - 1.000001)
    v = min(max((y + 0.5 * EXTENT) / cell, 0.0), SAMPLES - 1.000001)
    column, row = int(u), int(v)
    u -= column
    v -= row
    low, high = heights[row, column], heights[row + 1, column + 1]
    if u > v:
        side = heights[row, column + 1]
        return low + u * (side - low) + v * (high - side)
    side = heights[row + 1, column]
    return low + v * (side - low) + u * (high - side)


@kernel
def raise_terrain(heights, ranges, draws):
    """Write the heights of one lane: a bowl and plane waves in random directions."""
    curvature = sample(ranges.curvature, draws[DRAW_CURVATURE])
    roughness = sample(ranges.roughness, draws[DRAW_ROUGHNESS])
    cell = EXTENT / (SAMPLES - 1)
    for row in range(SAMPLES):
        y = row * cell - 0.5 * EXTENT
        for column in range(SAMPLES):
            x = column * cell - 0.5 * EXTENT
            heights[row, column] = 0.5 * curvature * (x * x + y * y)
    if roughness == 0.0:
        return
    for wave in range(WAVES):
        heading = 2.0 * math.pi * draws[3 * wave]
        number = 2.0 * math.pi / sample(ranges.wavelength, draws[3 * wave + 1])
        kx, ky = number * math.cos(heading), number * math.sin(heading)
        phase = 2.0 * math.pi * draws[3 * wave + 2]
        for row in range(SAMPLES):
            base = ky * (row * cell - 0.5 * EXTENT) + phase
            for column in range(SAMPLES):
                heights[row, column] += roughness * math.sin(kx * (column * cell - 0.5 * EXTENT) + base)


@kernel
def lift_of_box(heights, x, y, q):
    """[m] height of the centre of the body at x, y that keeps a grid of points of its bottom above the terrain."""
    needed = -math.inf
    for i in range(-2, 3):
        for j in range(-2, 3):
            arm = (0.5 * i * BODY_HALF_EXTENTS[0], 0.5 * j * BODY_HALF_EXTENTS[1], -BODY_HALF_EXTENTS[2])
            point = quat.rotate(q, arm)
            needed = max(needed, height_at(heights, x + point[0], y + point[1]) - point[2])
    return needed + START_CLEARANCE


@kernel
def lift_of_sphere(heights, x, y):
    """[m] height of the centre of the pusher at x, y that keeps it above the terrain under it."""
    needed = height_at(heights, x, y) + PUSHER_RADIUS
    for i in range(-2, 3):
        for j in range(-2, 3):
            dx, dy = 0.3 * i * PUSHER_RADIUS, 0.3 * j * PUSHER_RADIUS
            under = math.sqrt(max(PUSHER_RADIUS * PUSHER_RADIUS - dx * dx - dy * dy, 0.0))
            needed = max(needed, height_at(heights, x + dx, y + dy) + under)
    return needed + START_CLEARANCE


@entry_point
def begin(mask, draws, ranges, lanes, heights, starts):
    """Draw terrain, goal and places of the lanes of the mask."""
    limits = ranges[0]
    for number in range(mask.shape[0]):
        if not mask[number]:
            continue
        lane, start, u, terrain = lanes[number], starts[number], draws[number], heights[number]
        raise_terrain(terrain, limits, u)
        place = sample(limits.body_distance, u[DRAW_PLACE])
        around = 2.0 * math.pi * u[DRAW_PLACE_ANGLE]
        x, y = place * math.cos(around), place * math.sin(around)
        heading = 2.0 * math.pi * u[DRAW_GOAL_ANGLE]
        distance = sample(limits.goal_distance, u[DRAW_GOAL_DISTANCE])
        lane.goal[0] = x + distance * math.cos(heading)
        lane.goal[1] = y + distance * math.sin(heading)
        lane.goal_radius = limits.goal_radius[0]
        half_yaw = 0.5 * (heading + sample(limits.yaw, u[DRAW_YAW]))
        q = (math.cos(half_yaw), 0.0, 0.0, math.sin(half_yaw))
        behind = heading + math.pi + sample(limits.pusher_angle, u[DRAW_PUSHER_ANGLE])
        away = sample(limits.pusher_distance, u[DRAW_PUSHER_DISTANCE])
        px, py = x + away * math.cos(behind), y + away * math.sin(behind)
        quat.store(start.body_orientation, q)
        vec3.store(start.body_position, (x, y, lift_of_box(terrain, x, y, q)))
        vec3.store(start.pusher_position, (px, py, lift_of_sphere(terrain, px, py)))
        start.body_mass = sample(limits.body_mass, u[DRAW_MASS])
        start.body_friction = sample(limits.body_friction, u[DRAW_FRICTION])
