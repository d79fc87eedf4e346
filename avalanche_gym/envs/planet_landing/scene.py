"""The scene of PlanetLanding and how an episode starts: planet, lander, levels, orbit, site."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ... import physics
from ...physics.jit import entry_point, kernel
from ...physics.maths import quat, vec3
from ...physics.shapes import Shape, TriangleMesh
from ...physics.shapes.planet import bumpy_planet
from ..base import range_dtype
from ..lane_kernels import sample

PLANET_RADIUS = 20.0  # [m]
MU = 400.0  # [m^3/s^2]: 1 m/s^2 at the surface, a circular orbit at 6 m altitude takes 42 s at 3.9 m/s
SUBDIVISIONS = 4  # 5120 facets, edges of 1.3 m
PLANET_SEED = 7  # of the relief: one planet a level, the same for all lanes
RELIEF = {"easy": 0.005, "medium": 0.02, "hard": 0.035}  # largest height of its bumps, in radii

LANDER_MASS = 10.0  # [kg]
HULL = (0.3, 0.3, 0.2)  # [m] half extents
LEG_RADIUS = 0.06  # [m]
HIP = (0.25, 0.25, -0.1)  # [m] upper end of the leg in the first quadrant, frame of the lander
FOOT = (0.5, 0.5, -0.5)  # [m] lower end
QUADRANTS = ((1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0))
FEET = np.array([(sx * FOOT[0], sy * FOOT[1], FOOT[2]) for sx, sy in QUADRANTS])  # (4, 3) [m] centres of the feet
FRICTION = 0.8

# Uniform numbers that an episode is drawn from.
(
    DRAW_LATITUDE,
    DRAW_LONGITUDE,
    DRAW_ALTITUDE,
    DRAW_SPEED,
    DRAW_HEADING,
    DRAW_YAW,
    DRAW_TILT,
    DRAW_TILT_HEADING,
    DRAW_SPIN,
    DRAW_SPIN_LATITUDE,
    DRAW_SPIN_LONGITUDE,
    DRAW_FUEL,
    DRAW_SITE_DISTANCE,
    DRAW_SITE_ANGLE,
) = range(14)
DRAWS = 14


@dataclass(frozen=True)
class Ranges:
    """(low, high) of what an episode starts with, drawn evenly in between."""

    altitude: tuple[float, float]  # [m] above the mean radius
    speed: tuple[float, float]  # horizontal, in units of the circular speed at that altitude
    tilt: tuple[float, float]  # [rad] of the body axis from the vertical
    spin: tuple[float, float]  # [rad/s] about a random axis
    fuel: tuple[float, float]  # [m/s] of speed change that the tank holds
    site_distance: tuple[float, float]  # [m] along the ground from the place below the start, ahead
    site_angle: tuple[float, float]  # [rad] of the site off the heading
    site_radius: tuple[float, float]  # [m] the first number counts; 0: land anywhere


LEVELS = {
    "easy": Ranges(
        altitude=(5.0, 7.0),
        speed=(0.9, 1.0),
        tilt=(0.0, 0.2),
        spin=(0.0, 0.0),
        fuel=(30.0, 30.0),
        site_distance=(0.0, 0.0),
        site_angle=(0.0, 0.0),
        site_radius=(0.0, 0.0),
    ),
    "medium": Ranges(
        altitude=(5.0, 8.0),
        speed=(0.9, 1.05),
        tilt=(0.0, 0.6),
        spin=(0.0, 0.3),
        fuel=(24.0, 24.0),
        site_distance=(8.0, 14.0),
        site_angle=(-0.5, 0.5),
        site_radius=(5.0, 5.0),
    ),
    "hard": Ranges(
        altitude=(5.0, 9.0),
        speed=(0.9, 1.1),
        tilt=(0.0, 1.5),
        spin=(0.2, 0.8),
        fuel=(20.0, 20.0),
        site_distance=(8.0, 20.0),
        site_angle=(-1.0, 1.0),
        site_radius=(2.5, 2.5),
    ),
}
RANGES = range_dtype(Ranges)

LANE = np.dtype(
    [
        ("fuel", np.float64),  # [m/s] left
        ("full", np.float64),  # [m/s] at the start
        ("site", np.float64, 3),  # unit vector from the centre of the planet; zero: none
        ("site_radius", np.float64),  # [m]
        ("feet", np.float64, 4),  # [m] clearance of each foot
        ("altitude", np.float64),  # [m] of the feet's plane above the ground, upright
        ("touchdown", np.float64),  # [m/s] fastest touch so far
        ("speed", np.float64),  # [m/s] after the last physics step
        ("fastest", np.float64),  # [m/s] in this control step
        ("rest", np.int64),  # control steps at rest
        ("touching", np.int64),  # 1: a foot is down
        ("crashed", np.int64),
        ("potential", np.float64),
        ("burnt", np.float64),  # [m/s] in this control step
    ],
    align=True,
)

# What a new episode needs of the world, one row a lane.
START = np.dtype(
    [
        ("position", np.float64, 3),
        ("orientation", np.float64, 4),
        ("linear_velocity", np.float64, 3),
        ("angular_velocity", np.float64, 3),
    ],
    align=True,
)


def planet_of(level: str) -> TriangleMesh:
    """The planet of a level."""
    generator = np.random.default_rng(PLANET_SEED)
    return bumpy_planet(PLANET_RADIUS, generator, subdivisions=SUBDIVISIONS, amplitude=RELIEF[level])


def lander() -> Shape:
    """Hull and four legs."""
    hip, foot = np.array(HIP), np.array(FOOT)
    leg = foot - hip
    length = float(np.linalg.norm(leg))
    capsule = physics.Capsule(LEG_RADIUS, 0.5 * length)
    parts: list[tuple[Shape, object, object]] = [(physics.Box(HULL), (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))]
    for sx, sy in QUADRANTS:
        mirror = np.array([sx, sy, 1.0])
        # The turn that takes z to the direction d of the leg is (1 + d.z, z x d), normalised.
        d = mirror * leg / length
        turn = np.array([1.0 + d[2], -d[1], d[0], 0.0])
        parts.append((capsule, mirror * 0.5 * (hip + foot), turn / np.linalg.norm(turn)))
    return physics.Compound(parts)  # type: ignore[arg-type]


def build_scene(planet: TriangleMesh) -> tuple[physics.Scene, int]:
    """The scene, and the handle of the lander; the planet is body 0."""
    scene = physics.Scene()
    scene.add_field(physics.PointGravity(center=(0.0, 0.0, 0.0), mu=MU))
    material = physics.Material(friction=FRICTION)
    scene.add_body(planet, motion="static", material=material, name="planet")
    handle = scene.add_body(
        lander(), mass=LANDER_MASS, position=(0.0, 0.0, PLANET_RADIUS + 6.0), material=material, name="lander"
    )
    return scene, handle


@kernel
def direction_at(u, v):
    """A unit vector, evenly spread over the sphere for u and v evenly spread in 0 ... 1."""
    z = 2.0 * u - 1.0
    r = math.sqrt(max(1.0 - z * z, 0.0))
    return (r * math.cos(2.0 * math.pi * v), r * math.sin(2.0 * math.pi * v), z)


@kernel
def tangent_at(up, angle):
    """A horizontal unit vector at the place ``up`` of the planet."""
    a, b = vec3.tangents(up)
    return vec3.add_scaled(vec3.scale(math.cos(angle), a), math.sin(angle), b)


@kernel
def turn_from_z(up):
    """The smallest rotation that takes z to the unit vector ``up``."""
    if up[2] < -0.999999:
        return (0.0, 1.0, 0.0, 0.0)
    return quat.normalize((1.0 + up[2], -up[1], up[0], 0.0))


@entry_point
def begin(mask, draws, ranges, lanes, starts):
    """Draw orbit, attitude, fuel and site of the lanes of the mask."""
    limits = ranges[0]
    for number in range(mask.shape[0]):
        if not mask[number]:
            continue
        lane, start, u = lanes[number], starts[number], draws[number]
        up = direction_at(u[DRAW_LATITUDE], u[DRAW_LONGITUDE])
        radius = PLANET_RADIUS + sample(limits.altitude, u[DRAW_ALTITUDE])
        speed = sample(limits.speed, u[DRAW_SPEED]) * math.sqrt(MU / radius)
        heading = 2.0 * math.pi * u[DRAW_HEADING]
        yaw = 2.0 * math.pi * u[DRAW_YAW]
        upright = quat.multiply(turn_from_z(up), (math.cos(0.5 * yaw), 0.0, 0.0, math.sin(0.5 * yaw)))
        axis = tangent_at(up, 2.0 * math.pi * u[DRAW_TILT_HEADING])
        tilt = quat.from_rotation_vector(vec3.scale(sample(limits.tilt, u[DRAW_TILT]), axis))
        spin = direction_at(u[DRAW_SPIN_LATITUDE], u[DRAW_SPIN_LONGITUDE])
        vec3.store(start.position, vec3.scale(radius, up))
        vec3.store(start.linear_velocity, vec3.scale(speed, tangent_at(up, heading)))
        quat.store(start.orientation, quat.normalize(quat.multiply(tilt, upright)))
        vec3.store(start.angular_velocity, vec3.scale(sample(limits.spin, u[DRAW_SPIN]), spin))
        lane.fuel = sample(limits.fuel, u[DRAW_FUEL])
        lane.full = lane.fuel
        lane.site_radius = limits.site_radius[0]
        vec3.store(lane.site, vec3.ZERO)
        if lane.site_radius > 0.0:
            ahead = tangent_at(up, heading + sample(limits.site_angle, u[DRAW_SITE_ANGLE]))
            angle = sample(limits.site_distance, u[DRAW_SITE_DISTANCE]) / PLANET_RADIUS
            vec3.store(lane.site, vec3.add_scaled(vec3.scale(math.cos(angle), up), math.sin(angle), ahead))
