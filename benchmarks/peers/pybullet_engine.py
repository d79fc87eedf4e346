"""PyBullet: sequential impulses; 200 iterations, no damping, no slop, continuous collision for bullets.

Maximal coordinates lose less where bodies bounce or are stacked, and know continuous collision; reduced ones turn and
slide better (measured). Bullet multiplies friction coefficients; each body gets one of its own so that the products
are the coefficients of the pairs.
"""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Iterator
from functools import partial
from importlib.metadata import version
from typing import Any

import numpy as np

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

ITERATIONS = 200
HEAVY = 1e6  # [kg] of a body that the user moves
MAXIMAL = ("bounces", "stacks", "tunnelling", "cradle", "piles")  # themes that maximal coordinates do better
NATIVE_CHUNK = 50  # steps in one call, as substeps of one longer step


@contextlib.contextmanager
def quiet() -> Iterator[None]:
    """Bullet prints from C while it is imported."""
    sys.stdout.flush()
    kept = os.dup(1)
    with open(os.devnull, "w") as nowhere:
        os.dup2(nowhere.fileno(), 1)
    try:
        yield
    finally:
        os.dup2(kept, 1)
        os.close(kept)


with quiet():
    import pybullet as bullet


def frictions(scene: Scene) -> dict[int, float]:
    """A coefficient for each material (by id), so that products are the larger of each pair (least squares of logs)."""
    materials = list({id(body.material): body.material for body in scene.bodies}.values())
    moving = {id(body.material) for body in scene.bodies if body.motion == "dynamic"}
    rows, wanted = [], []
    for i, a in enumerate(materials):
        for j, b in enumerate(materials[i:], i):
            if not moving & {id(a), id(b)} or (i == j and id(a) not in moving):
                continue
            if max(a.friction, b.friction) > 0.0:
                row = np.zeros(len(materials))
                row[i] += 1.0
                row[j] += 1.0
                rows.append(row)
                wanted.append(np.log(max(a.friction, b.friction)))
    if not rows:
        return {id(material): 0.0 for material in materials}
    logs = np.linalg.lstsq(np.array(rows), np.array(wanted), rcond=None)[0]
    return {id(material): float(np.exp(value)) for material, value in zip(materials, logs, strict=True)}


class PyBullet(Simulation):
    """A client of its own."""

    def __init__(self, case: HardCase, scene: Scene, step: float) -> None:
        with quiet():
            self.client = bullet.connect(bullet.DIRECT)
        self.scene, self.step_size = scene, step
        self.fast = case.theme == "tunnelling"
        self.maximal = case.theme in MAXIMAL and not any(own_inertia(body) for body in scene.bodies)
        call = {"physicsClientId": self.client}
        bullet.setGravity(*gravity(scene), **call)
        bullet.setPhysicsEngineParameter(
            fixedTimeStep=step, numSubSteps=0, numSolverIterations=ITERATIONS, solverResidualThreshold=0.0,
            contactSlop=0.0, restitutionVelocityThreshold=0.0, **call,
        )  # fmt: skip
        coefficients = frictions(scene)
        self.ids = []
        for body in scene.bodies:
            assert body is not None
            self.ids.append(self._add(body, coefficients[id(body.material)], call))
        self.centers = np.array([body.center_of_mass for body in scene.bodies])
        self.attractors = attractors(scene)
        self.native = not self.attractors

    def _add(self, body: Any, friction: float, call: dict[str, int]) -> int:
        parts = list(body.shape.parts())
        shapes = [collision_shape(shape, call) for shape, _, _ in parts]
        if len(parts) == 1 and not np.any(parts[0][1]) and abs(parts[0][2][0]) == 1.0:
            shape, offset = shapes[0]
        else:
            arrays = compound_arguments(parts)
            shape, offset = bullet.createCollisionShapeArray(**arrays, **call), np.zeros(3)
        if shape < 0:
            raise Unsupported("the shape is refused")
        dynamic = body.motion == "dynamic"
        w, x, y, z = body.orientation
        number = bullet.createMultiBody(
            baseMass=body.mass if dynamic else HEAVY if body.motion == "kinematic" else 0.0,
            baseCollisionShapeIndex=shape,
            basePosition=list(np.asarray(body.position) + offset),
            baseOrientation=(x, y, z, w),
            baseInertialFramePosition=list(body.center_of_mass),
            useMaximalCoordinates=self.maximal,
            **call,
        )
        bullet.changeDynamics(
            number, -1, lateralFriction=friction, restitution=body.material.restitution, linearDamping=0.0,
            angularDamping=0.0, rollingFriction=0.0, spinningFriction=0.0, maxJointVelocity=1e9, **call,
        )  # fmt: skip
        if dynamic:
            if not self.maximal:
                bullet.changeDynamics(number, -1, localInertiaDiagonal=list(principal(body)), **call)
            if self.fast and self.maximal:
                bullet.changeDynamics(number, -1, ccdSweptSphereRadius=0.5 * body.shape.smallest_half_extent, **call)
        if body.motion != "static":
            arm = np.cross(
                body.angular_velocity, -from_center(np.array([body.orientation]), body.center_of_mass[None])[0]
            )
            bullet.resetBaseVelocity(number, list(body.linear_velocity + arm), list(body.angular_velocity), **call)
        return number

    def step(self, count: int) -> None:
        call = {"physicsClientId": self.client}
        if self.native:
            while count > 1:
                chunk = min(count, NATIVE_CHUNK)
                bullet.setPhysicsEngineParameter(fixedTimeStep=chunk * self.step_size, numSubSteps=chunk, **call)
                bullet.stepSimulation(**call)
                count -= chunk
            bullet.setPhysicsEngineParameter(fixedTimeStep=self.step_size, numSubSteps=0, **call)
        for _ in range(count):
            for center in self.attractors:
                for number, body in zip(self.ids, self.scene.bodies, strict=True):
                    if body.motion == "dynamic":
                        place = np.array(bullet.getBasePositionAndOrientation(number, **call)[0])
                        arm = np.asarray(center.center) - place
                        force = body.mass * center.mu / np.linalg.norm(arm) ** 3 * arm
                        bullet.applyExternalForce(number, -1, list(force), list(place), bullet.WORLD_FRAME, **call)
            bullet.stepSimulation(**call)

    def state(self) -> State:
        call = {"physicsClientId": self.client}
        place, turn, speed, spin = (np.zeros((len(self.ids), width)) for width in (3, 4, 3, 3))
        for handle, number in enumerate(self.ids):
            body = self.scene.bodies[handle]
            if body.motion == "static":
                place[handle], turn[handle] = body.position, body.orientation
                continue
            at, (x, y, z, w) = bullet.getBasePositionAndOrientation(number, **call)
            place[handle], turn[handle] = at, (w, x, y, z)
            speed[handle], spin[handle] = bullet.getBaseVelocity(number, **call)
        turn /= np.linalg.norm(turn, axis=1, keepdims=True)
        moving = np.array([body.motion != "static" for body in self.scene.bodies])
        arm = from_center(turn, self.centers) * moving[:, None]
        return place + arm, turn, speed + np.cross(spin, arm), spin

    def apply_force(self, body: int, force: Any) -> None:
        call = {"physicsClientId": self.client}
        place = bullet.getBasePositionAndOrientation(self.ids[body], **call)[0]
        bullet.applyExternalForce(self.ids[body], -1, list(force), list(place), bullet.WORLD_FRAME, **call)

    def apply_impulse(self, body: int, impulse: Any) -> None:
        call = {"physicsClientId": self.client}
        speed, spin = bullet.getBaseVelocity(self.ids[body], **call)
        added = np.asarray(speed) + np.asarray(impulse) / self.scene.bodies[body].mass
        bullet.resetBaseVelocity(self.ids[body], list(added), spin, **call)

    def set_state(self, body: int, *, position: Any = None, linear_velocity: Any = None) -> None:
        call = {"physicsClientId": self.client}
        if position is not None:
            bullet.resetBasePositionAndOrientation(self.ids[body], list(position), (0, 0, 0, 1), **call)
        if linear_velocity is not None:
            bullet.resetBaseVelocity(self.ids[body], list(linear_velocity), (0, 0, 0), **call)

    def close(self) -> None:
        bullet.disconnect(self.client)


def own_inertia(body: Any) -> bool:
    """Whether it is not the one Bullet computes, which a body in maximal coordinates must keep (another gives NaN)."""
    if body.motion != "dynamic":
        return False
    kinds = tuple(type(shape) for shape, _, _ in body.shape.parts())
    if len(kinds) != 1 or kinds[0] not in (Sphere, Box, Capsule, Cylinder):
        return True
    shape = body.shape.mass_properties()
    return not np.allclose(body.inertia, shape.inertia * (body.mass / shape.volume), rtol=1e-9)


def shape_arguments(shape: Any) -> dict[str, Any]:
    """Of createCollisionShape."""
    if isinstance(shape, Sphere):
        return {"shapeType": bullet.GEOM_SPHERE, "radius": shape.radius}
    if isinstance(shape, Box):
        return {"shapeType": bullet.GEOM_BOX, "halfExtents": list(shape.half_extents)}
    if isinstance(shape, Capsule):
        return {"shapeType": bullet.GEOM_CAPSULE, "radius": shape.radius, "height": 2.0 * shape.half_length}
    if isinstance(shape, Cylinder):
        return {"shapeType": bullet.GEOM_CYLINDER, "radius": shape.radius, "height": 2.0 * shape.half_length}
    if isinstance(shape, Plane):
        return {"shapeType": bullet.GEOM_PLANE, "planeNormal": (0, 0, 1)}
    if isinstance(shape, ConvexHull):
        return {"shapeType": bullet.GEOM_MESH, "vertices": [list(v) for v in shape.vertices]}
    if isinstance(shape, TriangleMesh):
        return {
            "shapeType": bullet.GEOM_MESH,
            "vertices": [list(v) for v in shape.vertices],
            "indices": [int(i) for i in shape.faces.ravel()],
            "flags": bullet.GEOM_FORCE_CONCAVE_TRIMESH | bullet.GEOM_CONCAVE_INTERNAL_EDGE,
        }
    if isinstance(shape, HeightField):
        rows, columns = shape.heights.shape
        return {
            "shapeType": bullet.GEOM_HEIGHTFIELD,
            "flags": bullet.GEOM_CONCAVE_INTERNAL_EDGE,
            "meshScale": [shape.extent[0] / (columns - 1), shape.extent[1] / (rows - 1), 1.0],
            "heightfieldData": [float(h) for h in shape.heights.ravel()],
            "numHeightfieldRows": columns,
            "numHeightfieldColumns": rows,
        }
    raise Unsupported(f"no {type(shape).__name__}")


def collision_shape(shape: Any, call: dict[str, int]) -> tuple[int, np.ndarray]:
    """Its number, and the offset [m] that Bullet's centring of heights makes necessary."""
    offset = np.zeros(3)
    if isinstance(shape, HeightField):
        offset[2] = 0.5 * float(shape.heights.min() + shape.heights.max())
    with quiet():
        return bullet.createCollisionShape(**shape_arguments(shape), **call), offset


def compound_arguments(parts: list[Any]) -> dict[str, Any]:
    """Of createCollisionShapeArray, for boxes, spheres and capsules."""
    arguments: dict[str, list[Any]] = {
        "shapeTypes": [], "radii": [], "halfExtents": [], "lengths": [], "collisionFramePositions": [],
        "collisionFrameOrientations": [],
    }  # fmt: skip
    for shape, position, (w, x, y, z) in parts:
        values = shape_arguments(shape)
        arguments["shapeTypes"].append(values["shapeType"])
        arguments["radii"].append(values.get("radius", 0.0))
        arguments["halfExtents"].append(values.get("halfExtents", [0.0, 0.0, 0.0]))
        arguments["lengths"].append(values.get("height", 0.0))
        arguments["collisionFramePositions"].append(list(position))
        arguments["collisionFrameOrientations"].append([x, y, z, w])
    return arguments


def engines() -> list[Engine]:
    text = f"{ITERATIONS} iterations, residual threshold 0, contact slop 0, restitution threshold 0, no damping, "
    text += f"internal edges, maximal coordinates for {', '.join(MAXIMAL)}, continuous collision for bullets, "
    text += "native substeps"
    return [Engine("PyBullet", version("pybullet"), text, 240, partial(PyBullet))]
