"""From a Scene to the tables of a World."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from ..integrator.flight import flow_class
from ..mass_properties import principal_frame, rotation_matrix
from ..model import (
    BODY,
    BODY_STATE,
    COLLIDER,
    DYNAMIC,
    FIELD,
    FLOW_NONE,
    KINEMATIC,
    NUM_SHAPES,
    PAIR_RULE,
    POINT_GRAVITY,
    REMOVED,
    STATIC,
    UNIFORM_GRAVITY,
)
from ..scene import Body, Material, PointGravity, Scene, UniformGravity
from ..shapes import TriangleMesh
from .shape_tables import ShapeTables

MOTION = {"dynamic": DYNAMIC, "kinematic": KINEMATIC, "static": STATIC}


@dataclass
class Tables:
    """Everything a scene says, as arrays for one world; ``arrays`` by the names of layout.py."""

    arrays: dict[str, NDArray[Any]]
    public: dict[str, NDArray[np.float64]]  # (bodies, 3 | 4) the initial public arrays
    materials: list[Material]
    shapes: ShapeTables
    choices: dict[int, NDArray[Any]]  # by handle, (1 + alternatives,) of BODY: the body with each of its shapes


def multiply(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """Quaternion product a b."""
    w = a[0] * b[0] - a[1:] @ b[1:]
    return np.concatenate([[w], a[0] * b[1:] + b[0] * a[1:] + np.cross(a[1:], b[1:])])


def build_tables(scene: Scene) -> Tables:
    """Turn descriptions into tables; a body of the scene that is ``None`` was removed."""
    bodies = scene.bodies
    rows = np.zeros(len(bodies), BODY)
    rows["motion"] = REMOVED
    rows["principal"][:, 0] = 1.0
    public = {
        "position": np.full((len(bodies), 3), np.nan),
        "orientation": np.full((len(bodies), 4), np.nan),
        "linear_velocity": np.full((len(bodies), 3), np.nan),
        "angular_velocity": np.full((len(bodies), 3), np.nan),
    }
    materials: list[Material] = []
    colliders: list[NDArray[Any]] = []
    shapes = ShapeTables()
    choices: dict[int, NDArray[Any]] = {}
    for handle, body in enumerate(bodies):
        if body is None:
            continue
        if body.material not in materials:
            materials.append(body.material)
        worn = np.zeros(1 + len(body.alternatives), BODY)
        for number, choice in enumerate((body, *body.alternatives)):
            own, parts = rows_of(choice)
            worn[number] = own
            worn["material"][number] = materials.index(body.material)
            worn["first_collider"][number] = len(colliders)
            for part, (shape, _, _) in zip(parts, choice.shape.parts(), strict=True):
                collider = part.copy()
                collider["body"] = handle
                shapes.add(handle, shape, collider)
                colliders.append(collider)
        rows[handle] = worn[0]
        if body.alternatives:
            choices[handle] = worn
        for name in public:
            public[name][handle] = getattr(body, name)
    arrays = {
        "bodies": rows,
        "states": np.zeros(len(bodies), BODY_STATE),
        "colliders": np.array(colliders, COLLIDER).reshape(-1),
        "fields": _field_rows([field for field in scene.fields if not _is_nothing(field)]),
        "pair_rules": rules_of(scene, materials),
        "pair_functions": np.zeros(NUM_SHAPES * NUM_SHAPES, np.int64),
        "nearest_functions": np.zeros(NUM_SHAPES, np.int64),
        **shapes.arrays(),
    }
    return Tables(arrays, public, materials, shapes, choices)


def rules_of(scene: Scene, materials: list[Material]) -> NDArray[Any]:
    """(materials * materials,) what ``set_pair`` fixed, NaN for the rest."""
    rules = np.zeros((len(materials), len(materials)), PAIR_RULE)
    rules["friction"] = rules["restitution"] = math.nan
    for (a, b), (friction, restitution) in scene.pair_rules.items():
        if a in materials and b in materials:
            for i, j in ((materials.index(a), materials.index(b)), (materials.index(b), materials.index(a))):
                rules[i, j] = (
                    math.nan if friction is None else friction,
                    math.nan if restitution is None else restitution,
                )
    return rules.reshape(-1)


_ROWS: WeakKeyDictionary[Body, tuple[NDArray[Any], list[NDArray[Any]]]] = WeakKeyDictionary()


def rows_of(body: Body) -> tuple[NDArray[Any], list[NDArray[Any]]]:
    """What a body alone decides of its row () and of those of its colliders, each ().

    Made once: a running world is built anew whenever a body comes or goes, and the others are the same as before.
    """
    if body not in _ROWS:
        row = np.zeros((), BODY)
        row["principal"][0] = 1.0
        _fill_body(row, body)
        rotation = rotation_matrix(row["principal"])
        parts: list[NDArray[Any]] = []
        for shape, position, orientation in body.shape.parts():
            collider = np.zeros((), COLLIDER)
            collider["shape"] = shape.code
            collider["size"] = shape.size
            collider["position"] = rotation @ (position - body.center_of_mass)
            collider["orientation"] = multiply(row["principal"], orientation)
            collider["radius"] = shape.bounding_radius
            parts.append(collider)
        row["num_colliders"] = len(parts)
        row["radius"] = max(float(np.linalg.norm(part["position"])) + float(part["radius"]) for part in parts)
        row["inner"] = row["size"]
        if body.motion == "dynamic" and isinstance(body.shape, TriangleMesh):
            lever = body.shape.lever_about(body.center_of_mass)
            row["inner"] = math.sqrt(max(0.0, float(row["radius"]) ** 2 - lever**2))
        _ROWS[body] = (row, parts)
    return _ROWS[body]


def _fill_body(row: Any, body: Body) -> None:
    """Mass, principal frame, flow and coefficients of one body."""
    row["motion"] = MOTION[body.motion]
    row["flow"] = FLOW_NONE
    row["size"] = body.shape.smallest_half_extent if body.motion == "dynamic" else math.inf
    for name in ("friction", "restitution", "rolling_friction", "torsional_friction"):
        row[name] = getattr(body.material, name)
    if body.motion == "dynamic":
        moments, principal = principal_frame(body.inertia)
        row["mass"] = body.mass
        row["inverse_mass"] = 1.0 / body.mass
        row["inertia"] = moments
        row["inverse_inertia"] = 1.0 / moments
        row["principal"] = principal
        row["origin"] = -rotation_matrix(principal) @ body.center_of_mass
        row["flow"] = flow_class(moments.tolist())


def _is_nothing(field: Any) -> bool:
    """Whether it pulls nowhere. At its centre, where there is a pole otherwise, such a field has no value."""
    return isinstance(field, PointGravity) and field.mu == 0.0


def _field_rows(fields: list[Any]) -> NDArray[Any]:
    rows = np.zeros(len(fields), FIELD)
    for row, field in zip(rows, fields, strict=True):
        if isinstance(field, UniformGravity):
            row["kind"], row["vector"] = UNIFORM_GRAVITY, field.acceleration
        elif isinstance(field, PointGravity):
            row["kind"], row["vector"], row["mu"] = POINT_GRAVITY, field.center, field.mu
    return rows
