"""What a scene makes the engine model: read from the tables that the kernels run on."""

from __future__ import annotations

import numpy as np

from .model import (
    DYNAMIC,
    FLOW_SPHERE,
    FLOW_SYMMETRIC,
    FLOW_TRANSLATE,
    FLOW_TRIAXIAL,
    HEIGHT_FIELD,
    KINEMATIC,
    MESH,
    POINT_GRAVITY,
    SMOOTH_FIELD,
    UNIFORM_GRAVITY,
)
from .report import Features
from .scene import Scene
from .tables.storage import Storage

FLOWS = {
    FLOW_TRANSLATE: "translation",
    FLOW_SPHERE: "translation and constant spin",
    FLOW_SYMMETRIC: "translation and symmetric top",
    FLOW_TRIAXIAL: "translation and triaxial top",
}


def describe_features(scene: Scene, storage: Storage) -> Features:
    """Sort every feature of the engine into modelled and left out."""
    arrays, header = storage.arrays, storage.header[0]
    bodies = arrays["bodies"]
    motion = bodies["motion"][0]
    shapes = arrays["colliders"]["shape"]
    kinds = arrays["fields"]["kind"]
    collisions = bool(header["collisions"])
    rules = arrays["pair_rules"]
    used = {
        "uniform gravity": bool((kinds == UNIFORM_GRAVITY).any()),
        "point gravity": bool((kinds == POINT_GRAVITY).any()),
        "kinematic bodies": bool((motion == KINEMATIC).any()),
        "collisions": collisions,
        "hash grid": storage.grid,
        "friction": collisions and bool(bodies["friction"].any() or np.nan_to_num(rules["friction"]).any()),
        "restitution": collisions and bool(arrays["traits"]["restitution"].any()),
        "located impacts": collisions and bool(header["events"]),
        "rolling friction": collisions and bool(bodies["rolling_friction"].any()),
        "torsional friction": collisions and bool(bodies["torsional_friction"].any()),
        "height fields": bool((shapes == HEIGHT_FIELD).any()),
        "smooth height fields": bool((shapes == SMOOTH_FIELD).any()),
        "triangle meshes": bool((shapes == MESH).any()),
        "moving heights": bool(arrays["traits"]["moving_heights"].any()),
        "heights per world": bool(header["height_worlds"] > 1),
        "pile tier": bool(header["step_pile"]),
        "sleeping": collisions and bool(header["sleeping"]),
    }
    flows = {}
    for index, body in enumerate(scene.bodies):
        if body is not None and motion[index] in (DYNAMIC, KINEMATIC):
            flow = FLOWS.get(int(bodies["flow"][0, index]), "constant velocities")
            flows[body.name] = "constant velocities" if motion[index] == KINEMATIC else flow
    return Features(
        modelled=tuple(name for name, present in used.items() if present),
        left_out=tuple(name for name, present in used.items() if not present),
        flows=flows,
    )
