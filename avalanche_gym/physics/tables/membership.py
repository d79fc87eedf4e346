"""Bodies that come and go in a running world: one row of its tables changes, the others stay where they are.

Tables that have a row a body keep room for more, and double when it is used up. What a new body brings along that other
tables have to hold (heights, a new mesh or hull), or what changes which stages a world runs, is left to building all
tables anew: the functions here then return False and have changed nothing.
"""

from __future__ import annotations

import math

import numpy as np

from .. import frames
from ..contacts.sleeping import wake
from ..model import COLLIDER, DYNAMIC, NUM_SHAPES, REMOVED
from ..scene import Body, Scene
from ..shapes import HeightField
from ..stages import pair_stage, watch_seams
from .construction import Tables, rows_of, rules_of
from .storage import Storage

EVERY_WORLD = np.ones(1, np.bool_)


def insert_body(storage: Storage, tables: Tables, scene: Scene, handle: int) -> bool:
    """Put the body of the scene with this handle into the tables; False if they have to be built anew.

    Raises:
        ValueError: there is no collision test for its shape and that of a body it could meet.
    """
    body = scene.bodies[handle]
    assert body is not None
    shapes = [shape for shape, _, _ in body.shape.parts()]
    header, arrays = storage.header[0], storage.arrays
    # Ground may have seams with what is there (seams): those stages are chosen when all tables are built.
    if not header["collisions"] or body.motion != "dynamic" or not all(tables.shapes.knows(shape) for shape in shapes):
        return False
    functions = _functions_of(storage, body)
    wake(storage.address, EVERY_WORLD, -1)
    row, parts = rows_of(body)
    if body.material not in tables.materials:
        tables.materials.append(body.material)
        arrays["pair_rules"] = rules_of(scene, tables.materials)
        header["num_materials"] = len(tables.materials)
    old_colliders = arrays["colliders"]
    added = np.array(parts, COLLIDER)
    added["body"] = handle
    for collider, shape in zip(added, shapes, strict=True):
        tables.shapes.add(handle, shape, collider)
    _set_colliders(storage, np.concatenate([old_colliders, added]), 0, len(old_colliders))
    storage.show_bodies(max(storage.num_bodies, handle + 1))
    bodies = arrays["bodies"]
    bodies[0, handle] = row
    bodies["material"][0, handle] = tables.materials.index(body.material)
    bodies["first_collider"][0, handle] = len(old_colliders)
    for name in arrays["proportions"].dtype.names or ():
        arrays["proportions"][name][0, handle] = bodies[name][0, handle]
    for name in ("position", "orientation", "linear_velocity", "angular_velocity"):
        arrays[name][0, handle] = storage.initial[name][0, handle] = getattr(body, name)
    arrays["states"][0, handle] = np.zeros((), arrays["states"].dtype)
    arrays["impulses"][0, handle] = 0.0
    arrays["rest"][0, handle] = np.zeros((), arrays["rest"].dtype)
    arrays["rest"]["barred"][0, handle] = not body.allow_sleep
    for place, address in functions.items():
        arrays["pair_functions"][place] = address
    storage.link_tables(("colliders", "pair_rules"))
    storage.choose_tiers()
    storage.note_features()
    frames.adopt(storage.address, EVERY_WORLD, handle)
    storage.initial["states"][0, handle] = arrays["states"][0, handle]
    return True


def take_body(storage: Storage, handle: int, body: Body) -> bool:
    """Take a body out of the tables; False if they have to be built anew."""
    header, arrays = storage.header[0], storage.arrays
    bodies = arrays["bodies"][0]
    others = np.flatnonzero((bodies["num_colliders"] > 0) & (np.arange(len(bodies)) != handle))
    if any(isinstance(shape, HeightField) for shape, _, _ in body.shape.parts()):
        return False
    if len(others) < 2 or not (bodies["motion"][others] == DYNAMIC).any():
        return False
    wake(storage.address, EVERY_WORLD, -1)
    count = int(arrays["num_contacts"][0])
    contacts = arrays["contacts"][0, :count]
    gone = (contacts["body_a"] == handle) | (contacts["body_b"] == handle)
    if gone.any():
        kept = contacts[~gone]
        contacts[: len(kept)] = kept
        arrays["num_contacts"][0] = len(kept)
    first, parts = int(bodies["first_collider"][handle]), int(bodies["num_colliders"][handle])
    left = np.delete(arrays["colliders"], slice(first, first + parts))
    _set_colliders(storage, left, parts, first)
    bodies["first_collider"][bodies["first_collider"] > first] -= parts
    bodies[handle] = np.zeros((), bodies.dtype)
    bodies["motion"][handle] = REMOVED
    bodies["principal"][handle, 0] = 1.0
    arrays["states"][0, handle] = storage.initial["states"][0, handle] = np.zeros((), arrays["states"].dtype)
    arrays["proportions"][0, handle] = np.zeros((), arrays["proportions"].dtype)
    arrays["impulses"][0, handle] = 0.0
    arrays["rest"]["seen"] = 0.0  # what bore it, or rested on it, stands where it did
    for name in ("position", "orientation", "linear_velocity", "angular_velocity"):
        arrays[name][0, handle] = storage.initial[name][0, handle] = math.nan
    storage.link_tables(("colliders",))
    storage.choose_tiers()
    # What it alone asked for is left out from now on, as in a world that never had it: snapshots outlive the tables.
    watch_seams(header, arrays)
    storage.note_features()
    return True


def _functions_of(storage: Storage, body: Body) -> dict[int, int]:
    """Addresses of the functions that a new body needs to meet the others, by their place in ``pair_functions``."""
    colliders, bodies = storage.arrays["colliders"], storage.arrays["bodies"][0]
    shapes = colliders["shape"]
    if body.motion != "dynamic":
        shapes = shapes[bodies["motion"][colliders["body"]] == DYNAMIC]
    functions = {}
    own = {shape.code for shape, _, _ in body.shape.parts()}
    for other in np.unique(shapes).tolist():
        for code in own:
            pair = (min(code, other), max(code, other))
            functions[pair[0] * NUM_SHAPES + pair[1]] = pair_stage(pair).address
    return functions


def _set_colliders(storage: Storage, colliders: np.ndarray, removed: int, first: int) -> None:
    """Replace the table of colliders, of which ``removed`` from ``first`` on are gone; contacts keep their pairs."""
    arrays = storage.arrays
    rows = arrays["contacts"][0, : int(arrays["num_contacts"][0])]
    a, b = np.divmod(rows["pair"], max(len(arrays["colliders"]), 1))
    if removed:
        a, b = a - removed * (a > first), b - removed * (b > first)
    rows["pair"] = a * len(colliders) + b
    arrays["colliders"] = colliders
