"""MuJoCo: soft contacts, made as hard as the step allows.

Settings and why: elliptic cones and impratio 100 against slip, Newton's method to 1e-12, a contact time constant of two
steps (the shortest that is stable; ``solref``) and near-rigid impedance (``solimp``). Restitution is a damper that acts
within one step: with solref = (-k, -(1 + e) / step) the approach speed v becomes -e v. RK4 where nothing touches. It
does not begin anew where a state goes to pieces (``autoreset``), or a pile that exploded would look settled.

Tuned theme by theme, over impedances 0.9 to 0.9999 and impratio 1 to 100 at 1/60 and 1/240 s: stacks stand better the
harder they are, piles explode unless they are soft, and a ball keeps its energy in a bowl on springs without damping.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import mujoco
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
from avalanche_gym.physics.scenes.case import rotation_matrices

from .engine import Engine, Simulation, State, Unsupported, attractors, gravity

# Its warnings of states that are not finite would fill the screen, and a file; the errors tell as much.
mujoco.set_mju_user_warning(lambda text: None)

HARD, SOFT = (0.99, 0.999), (0.9, 0.95)  # impedances; the latter is MuJoCo's default
HARDEST = (0.9999, 0.9999)
SPRING = 0.25  # [1/step^2] stiffness without damping, for what should swing on and on
HEAVY = 1e6  # [kg] of a body that the user moves
SOFTEST = 1e-8  # stiffness beside the damper of restitution [1/s^2]; zero means another format


class MuJoCo(Simulation):
    """A model compiled from the scene."""

    def __init__(self, case: HardCase, scene: Scene, step: float, integrator: str) -> None:
        mujoco.set_mjcb_passive(None)
        spec = mujoco.MjSpec()
        option = spec.option
        option.timestep = step
        option.gravity = gravity(scene)
        option.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{integrator}")
        option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
        option.impratio = 100.0
        option.tolerance = 1e-12
        option.iterations = 100
        option.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
        if case.theme == "piles":
            option.solver, option.tolerance, option.impratio = mujoco.mjtSolver.mjSOL_CG, 1e-8, 10.0
        hard = HARDEST if case.theme in ("stacks", "tunnelling") else SOFT if case.theme == "piles" else HARD
        springs = case.name.startswith("bowl")
        self.contact = ((-SPRING / step**2, 0.0), HARD) if springs else ((2.0 * step, 1.0), hard)
        spec.compiler.balanceinertia = False
        self.moved: list[int] = []
        self.joints: dict[int, tuple[int, int]] = {}
        for handle, body in enumerate(scene.bodies):
            assert body is not None
            self._add(spec, handle, body, step)
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)
        self.scene = scene
        self._place(scene)
        centers = attractors(scene)
        if centers:
            mujoco.set_mjcb_passive(partial(attract, centers))
        mujoco.mj_forward(self.model, self.data)

    def _add(self, spec: Any, handle: int, body: Any, step: float) -> None:
        frame = spec.worldbody.add_body(name=f"b{handle}", pos=body.position, quat=body.orientation)
        if body.motion != "static":
            frame.add_freejoint(name=f"j{handle}")
            frame.explicitinertial = True
            frame.mass = body.mass if body.motion == "dynamic" else HEAVY
            frame.ipos = body.center_of_mass
            inertia = body.inertia if body.motion == "dynamic" else HEAVY * np.eye(3)
            frame.fullinertia = inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
            if body.motion == "kinematic":
                frame.gravcomp = 1.0
                self.moved.append(handle)
        for number, (shape, position, orientation) in enumerate(body.shape.parts()):
            values = geometry(spec, f"b{handle}_{number}", shape, body.motion)
            place = np.asarray(position, float) + np.asarray(values.pop("offset", np.zeros(3)))
            restitution = body.material.restitution
            damped = restitution > 0.0 and body.motion == "dynamic"
            frame.add_geom(
                pos=place,
                quat=orientation,
                friction=(body.material.friction, body.material.torsional_friction, body.material.rolling_friction),
                condim=1 if body.material.friction == 0.0 else 3,
                solref=(-SOFTEST, -(1.0 + restitution) / step) if damped else self.contact[0],
                solimp=(*(HARDEST if damped else self.contact[1]), 0.001, 0.5, 2.0),
                priority=1 if damped else 0,
                **values,
            )

    def _place(self, scene: Scene) -> None:
        turns = rotation_matrices(np.array([body.orientation for body in scene.bodies]))
        for handle, body in enumerate(scene.bodies):
            if body.motion == "static":
                continue
            joint = self.model.joint(f"j{handle}")
            at, speed = int(joint.qposadr[0]), int(joint.dofadr[0])
            self.joints[handle] = (at, speed)
            self.data.qvel[speed : speed + 3] = body.linear_velocity
            self.data.qvel[speed + 3 : speed + 6] = turns[handle].T @ body.angular_velocity

    def step(self, count: int) -> None:
        mujoco.mj_step(self.model, self.data, count)

    def state(self) -> State:
        bodies = self.scene.bodies
        place = np.array([body.position for body in bodies])
        turn = np.array([body.orientation for body in bodies])
        speed, spin = np.zeros((len(bodies), 3)), np.zeros((len(bodies), 3))
        for handle, (at, dof) in self.joints.items():
            place[handle] = self.data.qpos[at : at + 3]
            turn[handle] = self.data.qpos[at + 3 : at + 7]
            speed[handle] = self.data.qvel[dof : dof + 3]
            spin[handle] = self.data.qvel[dof + 3 : dof + 6]
        turn /= np.linalg.norm(turn, axis=1, keepdims=True)
        return place, turn, speed, np.einsum("bij,bj->bi", rotation_matrices(turn), spin)

    def apply_force(self, body: int, force: Any) -> None:
        self.data.body(f"b{body}").xfrc_applied[:3] = force

    def apply_impulse(self, body: int, impulse: Any) -> None:
        dof = self.joints[body][1]
        self.data.qvel[dof : dof + 3] += np.asarray(impulse) / self.scene.bodies[body].mass

    def set_state(self, body: int, *, position: Any = None, linear_velocity: Any = None) -> None:
        at, dof = self.joints[body]
        if position is not None:
            self.data.qpos[at : at + 3] = position
            self.data.qpos[at + 3 : at + 7] = (1.0, 0.0, 0.0, 0.0)
        if linear_velocity is not None:
            self.data.qvel[dof : dof + 6] = (*linear_velocity, 0.0, 0.0, 0.0)

    def close(self) -> None:
        mujoco.set_mjcb_passive(None)


def attract(centers: list[Any], model: Any, data: Any) -> None:
    """Point gravity on every free body, as a passive force."""
    for number in range(model.njnt):
        at, dof = model.jnt_qposadr[number], model.jnt_dofadr[number]
        mass = model.body_mass[model.jnt_bodyid[number]]
        for center in centers:
            arm = np.asarray(center.center) - data.qpos[at : at + 3]
            data.qfrc_passive[dof : dof + 3] += mass * center.mu / np.linalg.norm(arm) ** 3 * arm


def geometry(spec: Any, name: str, shape: Any, motion: str) -> dict[str, Any]:
    """Arguments of a geom."""
    kinds = mujoco.mjtGeom
    if isinstance(shape, Sphere):
        return {"type": kinds.mjGEOM_SPHERE, "size": (shape.radius, 0, 0)}
    if isinstance(shape, Box):
        return {"type": kinds.mjGEOM_BOX, "size": shape.half_extents}
    if isinstance(shape, Capsule):
        return {"type": kinds.mjGEOM_CAPSULE, "size": (shape.radius, shape.half_length, 0)}
    if isinstance(shape, Cylinder):
        return {"type": kinds.mjGEOM_CYLINDER, "size": (shape.radius, shape.half_length, 0)}
    if isinstance(shape, Plane):
        return {"type": kinds.mjGEOM_PLANE, "size": (0, 0, 1)}
    if isinstance(shape, ConvexHull):
        spec.add_mesh(name=name, uservert=np.asarray(shape.vertices).ravel())
        return {"type": kinds.mjGEOM_MESH, "meshname": name}
    if isinstance(shape, HeightField):
        if motion != "static":
            raise Unsupported("height fields are static")
        low, high = float(shape.heights.min()), float(shape.heights.max())
        span = max(high - low, 1e-3)
        spec.add_hfield(
            name=name,
            size=(0.5 * shape.extent[0], 0.5 * shape.extent[1], span, 1.0),
            nrow=shape.heights.shape[0],
            ncol=shape.heights.shape[1],
            userdata=((shape.heights - low) / span).ravel(),
        )
        return {"type": kinds.mjGEOM_HFIELD, "hfieldname": name, "offset": (0.0, 0.0, low)}
    if isinstance(shape, TriangleMesh):
        raise Unsupported("meshes collide as their convex hulls")
    raise Unsupported(f"no {type(shape).__name__}")


def contact_free(case: HardCase) -> bool:
    return case.theme == "flight" and "touchdown" not in case.name


def engines() -> list[Engine]:
    text = (
        "cone elliptic, impratio 100, Newton 1e-12, solref 2 steps, solimp 0.99 0.999 (stacks and tunnelling 0.9999; "
        "piles 0.9 0.95, impratio 10, CG 1e-8; bowls springs without damping), restitution by a one-step damper"
    )
    return [
        Engine("MuJoCo", mujoco.__version__, f"implicitfast, {text}", 480, partial(MuJoCo, integrator="IMPLICITFAST")),
        Engine("MuJoCo RK4", mujoco.__version__, f"RK4, {text}", 480, partial(MuJoCo, integrator="RK4"), contact_free),
    ]
