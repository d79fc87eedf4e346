"""Whether ground hides a contact with ground: its feature is inside of the union of all pieces, or flat in it.

For a contact with foot q on collider T with outward normal d, and the other colliders S that hold q too:

* **Covered.** d is a normal of the union at q only if q is nearest to q + s d in S as well (the proximal normal of
  Clarke 1983, *Optimization and nonsmooth analysis*, sec. 2.5: normal cones of a union intersect). Else the contact is
  hidden, unless the feature of T goes on in the open: a wall that stands on a floor starts inside of it.
* **Flat.** An edge or vertex of terrain is hidden if the union is flat around q: the points of the body have their
  contacts with the faces.
"""

from __future__ import annotations

import math

import numpy as np

from ..jit import call_stage, kernel
from ..maths import mat3, vec3
from ..memory import bodies_of, colliders_of, header_at, table, workspace_at
from ..model import (
    CAPSULE,
    CYLINDER,
    DYNAMIC,
    HEIGHT_FIELD,
    MESH,
    NUM_SHAPES,
    SMOOTH_FIELD,
    SPHERE,
)
from ..narrow_phase.collide import place
from ..narrow_phase.terrain_candidates import FACE_PLACE, PLACE_NUMBERS
from ..probes.probe import HIT, probe_at
from .ground import ground_collider, ground_lists, other_body

# Surfaces of two colliders this close together, in units of the body's size, are one. Larger: steps of that height
# between two chunks of ground are rolled over as if they were not there.
FLUSH = 1e-9
# ... and what round-off of coordinates far from the origin makes of it, in units of the distance from there.
ROUND_OFF = 1e-15
# How far from the foot the ground is looked at, in units of the body's size. Features smaller than that are not seen.
PROBED = 1e-3
# [rad] Normals that differ by less are the same: on flat shapes, and on curved ones, which bend that much in PROBED.
ALIKE, ALIKE_CURVED = 2e-6, 3e-3
# Directions in which the ground around a foot is looked at.
AROUND = 8


@kernel
def _nearest(header, probe_address, collider, state, point, limit):
    """Whether the collider is within ``limit`` [m] of a point; signed distance, outward normal, nearest point."""
    probe = probe_at(probe_address)
    position, rotation = place(collider, state)
    probe.shape = collider.shape
    probe.data = collider.data
    vec3.store(probe.size, vec3.load(collider.size))
    if collider.shape == SPHERE:
        probe.size[1] = 0.0
    probe.limit = limit
    vec3.store(probe.origin, mat3.apply_transposed(rotation, vec3.sub(point, position)))
    functions = table(header.nearest_functions, NUM_SHAPES, np.int64)
    found = call_stage(functions[collider.shape], probe_address) == HIT
    normal = mat3.apply(rotation, vec3.load(probe.normal))
    return found, probe.distance, normal, vec3.add_scaled(point, -probe.distance, normal)


@kernel
def _alike(shape):
    curved = shape == SPHERE or shape == CAPSULE or shape == CYLINDER or shape == SMOOTH_FIELD
    return ALIKE_CURVED if curved else ALIKE


@kernel
def _is_normal(header, probe_address, collider, state, foot, nearest, d, s):
    """Whether d is a normal of the collider at ``foot``, whose nearest point ``nearest`` is; and the one beside it."""
    _, distance, normal, other = _nearest(header, probe_address, collider, state, vec3.add_scaled(foot, s, d), math.inf)
    moved = vec3.norm(vec3.sub(other, nearest))
    return distance > 0.5 * s and moved <= _alike(collider.shape) * s, normal


@kernel
def _is_covered(header, probe_address, own, own_state, other, other_state, foot, distance, nearest, d, s):
    """Whether the collider ``other`` hides the feature of ``own`` with normal d at ``foot``, which it holds."""
    accepted, out = _is_normal(header, probe_address, other, other_state, foot, nearest, d, s)
    if accepted:
        return False
    # Along the feature out of the other collider.
    t = vec3.add_scaled(out, -vec3.dot(out, d), d)
    length = vec3.norm(t)
    if length <= ALIKE_CURVED:
        return True
    beyond = vec3.add_scaled(foot, (s + max(-distance, 0.0)) / length, t)
    exposed, _ = _is_normal(header, probe_address, own, own_state, beyond, beyond, d, s)
    return not exposed


@kernel
def _foot_of(bodies, contact):
    """Point of the ground, its outward normal, how far [m] to look from there, and what [m] is flush."""
    a_is_ground = bodies[contact.body_a].motion != DYNAMIC
    size = bodies[contact.body_b if a_is_ground else contact.body_a].size
    d = vec3.load(contact.normal) if a_is_ground else vec3.neg(vec3.load(contact.normal))
    foot = vec3.add_scaled(vec3.load(contact.position), -0.5 * contact.gap, d)
    flush = FLUSH * size + ROUND_OFF * (abs(foot[0]) + abs(foot[1]) + abs(foot[2]))
    return foot, d, PROBED * size, flush


@kernel
def _lies_across(contact, collider):
    """Whether a contact belongs to an edge or vertex of terrain."""
    terrain = collider.shape == HEIGHT_FIELD or collider.shape == MESH
    return terrain and contact.feature // PLACE_NUMBERS & 3 != FACE_PLACE


@kernel
def _holds(box, p, reach):
    """Whether a point is within ``reach`` [m] of a box."""
    return (
        box[0] - reach <= p[0] <= box[3] + reach
        and box[1] - reach <= p[1] <= box[4] + reach
        and box[2] - reach <= p[2] <= box[5] + reach
    )


@kernel
def _is_flat(address, workspace_address, world, states, body, foot, d, s, flush):
    """Whether the union of the ground around one body is flat around ``foot``."""
    header = header_at(address)
    workspace = workspace_at(workspace_address)
    bodies = bodies_of(header, world)
    colliders = colliders_of(header)
    pairs, links, firsts = ground_lists(workspace)
    boxes = table(workspace.boxes, (workspace.boxes_size // 6, 6), np.float64)
    axis = 0
    for k in range(1, 3):
        if abs(d[k]) < abs(d[axis]):
            axis = k
    u = vec3.cross(d, vec3.along(axis))
    u = vec3.scale(s / vec3.norm(u), u)
    v = vec3.cross(d, u)
    limit = ALIKE * s + flush
    for direction in range(AROUND):
        angle = 2.0 * math.pi * direction / AROUND
        beside = vec3.add_scaled(vec3.add_scaled(foot, math.cos(angle), u), math.sin(angle), v)
        there = False
        link = firsts[body]
        while link >= 0 and not there:
            ground = bodies[other_body(pairs, link, body)]
            if _holds(boxes[other_body(pairs, link, body)], beside, limit):
                for index in range(ground.first_collider, ground.first_collider + ground.num_colliders):
                    collider = colliders[index]
                    state = states[collider.body]
                    found, distance, _, _ = _nearest(header, workspace.probe, collider, state, beside, limit)
                    there = there or (found and distance >= -limit)
            link = links[link]
        if not there:
            return False
    return True


@kernel
def is_hidden(address, workspace_address, world, states, body, contact):
    """Whether a contact of a body with ground, placed by ``states``, is inside of the ground, or flat in it."""
    header = header_at(address)
    workspace = workspace_at(workspace_address)
    bodies = bodies_of(header, world)
    colliders = colliders_of(header)
    pairs, links, firsts = ground_lists(workspace)
    boxes = table(workspace.boxes, (workspace.boxes_size // 6, 6), np.float64)
    own = ground_collider(bodies, contact, colliders.shape[0])
    own_state = states[colliders[own].body]
    foot, d, s, flush = _foot_of(bodies, contact)
    shared = False
    link = firsts[body]
    while link >= 0:
        other = other_body(pairs, link, body)
        if _holds(boxes[other], foot, flush):
            for index in range(
                bodies[other].first_collider, bodies[other].first_collider + bodies[other].num_colliders
            ):
                collider = colliders[index]
                state = states[other]
                if index == own:
                    continue
                found, distance, _, nearest = _nearest(header, workspace.probe, collider, state, foot, flush)
                if found:
                    shared = True
                    if _is_covered(
                        header,
                        workspace.probe,
                        colliders[own],
                        own_state,
                        collider,
                        state,
                        foot,
                        distance,
                        nearest,
                        d,
                        s,
                    ):
                        return True
        link = links[link]
    return (
        shared
        and _lies_across(contact, colliders[own])
        and _is_flat(address, workspace_address, world, states, body, foot, d, s, flush)
    )
