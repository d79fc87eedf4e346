"""Rapier (Python binding, 32-bit): 8 solver iterations, stiff contacts, hardly any slop, no sleeping, CCD for bullets.

Friction is Rapier's default ("simplified"): with its Coulomb model a sliding box stops 11 % late at every step.
"""

from __future__ import annotations

import math
from functools import partial
from importlib.metadata import version
from typing import Any

import numpy as np
import rapier3d as rapier

from avalanche_gym.physics import (
    Box,
    Capsule,
    ConvexHull,
    Cylinder,
    HeightField,
    Plane,
    Scene,
    Sphere,
    TriangleMesh,
)
from avalanche_gym.physics.scenes import HardCase

from .engine import Engine, Simulation, State, Unsupported, attractors, from_center, gravity, principal

ITERATIONS = 8
FREQUENCY, DAMPING = 100.0, 10.0  # [Hz] of contact springs, ratio; the defaults are 30 and 10. Stiffer topples stacks
SLOP = 1e-4  # [m] overlap that is left alone, of bodies about a metre in size; Rapier's default is 5e-3
UPRIGHT = (math.sqrt(0.5), math.sqrt(0.5), 0.0, 0.0)  # Rapier's y to our z


class Rapier(Simulation):
    """A PhysicsWorld with one thread."""

    def __init__(self, case: HardCase, scene: Scene, step: float) -> None:
        self.world = rapier.PhysicsWorld(gravity=tuple(float(g) for g in gravity(scene)))
        values = self.world.integration_parameters
        values.dt = step
        values.num_solver_iterations = ITERATIONS
        values.normalized_allowed_linear_error = SLOP
        values.normalized_max_linear_velocity = 1e6
        values.static_contact_softness = rapier.SpringCoefficients(2.0 * FREQUENCY, DAMPING)
        values.contact_softness = rapier.SpringCoefficients(FREQUENCY, DAMPING)
        self.world.set_num_threads(1)
        self.scene = scene
        self.fast = case.theme == "tunnelling"
        if self.fast:
            values.max_ccd_substeps = 4
        self.handles = []
        for body in scene.bodies:
            assert body is not None
            self.handles.append(self._add(body))
        self.centers = np.array([body.center_of_mass for body in scene.bodies])
        self.attractors = attractors(scene)

    def _add(self, body: Any) -> Any:
        kinds = {"dynamic": "dynamic", "static": "fixed", "kinematic": "kinematic_velocity_based"}
        builder = getattr(rapier.RigidBody, kinds[body.motion])()
        turn = rapier.Rotation3(*map(float, body.orientation))  # wxyz; a bare tuple would be read as xyzw
        pose = rapier.Isometry3(tuple(map(float, body.position)), turn)
        builder = builder.position(pose).can_sleep(False)
        if body.motion == "dynamic":
            properties = rapier.MassProperties(
                tuple(map(float, body.center_of_mass)), float(body.mass), tuple(map(float, principal(body)))
            )
            builder = builder.additional_mass_properties(properties).gyroscopic_forces(True)
            builder = builder.ccd_enabled(self.fast)
        if body.motion != "static":
            # Rapier's linear velocity is that of the mass centre.
            arm = -from_center(np.array([body.orientation]), body.center_of_mass[None])[0]
            speed = body.linear_velocity + np.cross(body.angular_velocity, arm)
            builder = builder.linvel(tuple(map(float, speed))).angvel(tuple(map(float, body.angular_velocity)))
        colliders = []
        for shape, position, orientation in body.shape.parts():
            geometry, turned = collider_shape(shape)
            turn = rapier.Rotation3(*map(float, orientation))
            if turned:
                turn = turn * rapier.Rotation3(*UPRIGHT)
            collider = rapier.Collider.new(geometry)
            collider = collider.position(rapier.Isometry3(tuple(map(float, position)), turn)).density(0.0)
            collider = collider.friction(float(body.material.friction)).restitution(float(body.material.restitution))
            collider = collider.friction_combine_rule(rapier.CoefficientCombineRule.MAX)
            colliders.append(collider.restitution_combine_rule(rapier.CoefficientCombineRule.MULTIPLY))
        return self.world.add_body(builder, colliders)

    def step(self, count: int) -> None:
        for _ in range(count):
            if self.attractors:
                self._attract()
            self.world.step()

    def _attract(self) -> None:
        for handle, body in zip(self.handles, self.scene.bodies, strict=True):
            if body.motion == "dynamic":
                moving = self.world.rigid_bodies[handle]
                place = np.array(list(moving.translation))
                force = np.zeros(3)
                for center in self.attractors:
                    arm = np.asarray(center.center) - place
                    force += body.mass * center.mu / np.linalg.norm(arm) ** 3 * arm
                moving.reset_forces()
                moving.add_force(tuple(map(float, force)))

    def state(self) -> State:
        place, turn, speed, spin = (np.zeros((len(self.handles), width)) for width in (3, 4, 3, 3))
        for number, handle in enumerate(self.handles):
            body = self.world.rigid_bodies[handle]
            place[number] = list(body.translation)
            x, y, z, w = body.rotation.to_tuple()
            turn[number] = (w, x, y, z)
            speed[number], spin[number] = list(body.linvel), list(body.angvel)
        turn /= np.linalg.norm(turn, axis=1, keepdims=True)
        return place, turn, speed + np.cross(spin, from_center(turn, self.centers)), spin

    def apply_force(self, body: int, force: Any) -> None:
        moving = self.world.rigid_bodies[self.handles[body]]
        moving.reset_forces()
        moving.add_force(tuple(map(float, force)))

    def apply_impulse(self, body: int, impulse: Any) -> None:
        self.world.rigid_bodies[self.handles[body]].apply_impulse(tuple(map(float, impulse)))

    def set_state(self, body: int, *, position: Any = None, linear_velocity: Any = None) -> None:
        moving = self.world.rigid_bodies[self.handles[body]]
        if position is not None:
            moving.translation = tuple(map(float, position))
        if linear_velocity is not None:
            moving.linvel = tuple(map(float, linear_velocity))


def collider_shape(shape: Any) -> tuple[Any, bool]:
    """The shape, and whether its y axis is our z."""
    make = rapier.SharedShape
    if isinstance(shape, Sphere):
        return make.ball(shape.radius), False
    if isinstance(shape, Box):
        return make.cuboid(*map(float, shape.half_extents)), False
    if isinstance(shape, Capsule):
        return make.capsule_z(shape.half_length, shape.radius), False
    if isinstance(shape, Cylinder):
        return make.cylinder(shape.half_length, shape.radius), True
    if isinstance(shape, Plane):
        return make.halfspace((0.0, 0.0, 1.0)), False
    if isinstance(shape, ConvexHull):
        return make.convex_hull(np.asarray(shape.vertices)), False
    if isinstance(shape, TriangleMesh):
        flags = rapier.TriMeshFlags.FIX_INTERNAL_EDGES
        return make.trimesh(np.asarray(shape.vertices), np.asarray(shape.faces), flags), False
    if isinstance(shape, HeightField):
        # Rows run along Rapier's z, which is our -y.
        return make.heightfield(shape.heights[::-1].copy(), (shape.extent[0], 1.0, shape.extent[1])), True
    raise Unsupported(f"no {type(shape).__name__}")


def engines() -> list[Engine]:
    text = f"{ITERATIONS} iterations, contact springs {FREQUENCY:g} Hz, slop {SLOP:g} m, no sleeping, "
    text += "CCD with 4 substeps for bullets, 1 thread"
    return [Engine("Rapier", version("rapier3d"), text, 60, partial(Rapier))]
