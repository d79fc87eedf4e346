"""Which bodies may have come, within a step, to where its contacts say nothing of: those are looked at where they end.

A body that is struck, or stopped while its neighbours fall on, is pushed into what was out of reach; and a body that
turns by an angle a within the step shows another face, off by

    1/2 a^2 sqrt(radius^2 - inner^2),

for turning moves a surface point p along its normal n by |a x p . n| <= |a| |p x n|; |p| <= radius, p . n >= inner.
And of meshes and facets not all contacts are known: vertices go with the faces that they are over, and slide on to
others.
"""

from __future__ import annotations

import math

from .jit import kernel
from .maths import quat, vec3
from .memory import bodies_of, colliders_of, rest_of, states_of, table
from .model import BODY_STATE, CAPSULE, CONTACT, CYLINDER, DYNAMIC, HEIGHT_FIELD, MESH, SPHERE
from .narrow_phase.terrain_features import TILT

# A body that ends farther from its flight than this fraction of its size is looked at, and one that turns by so much
# that its surface may be off by more than the other. Larger: overlap of that size is not seen.
PUSHED, TURNS = 0.01, 5e-3
# Overlap below this fraction of the smaller body stays: the next step parts what still touches.
# In a crowd the pile tier leaves some each step, and all would be looked at and parted that it is about to part itself.
SHALLOW, CROWD_SHALLOW = 2e-4, 2e-3
# [rad] Up to TILT contacts of a box or hull are listed that its turn will bring to bear; half of that is left to what
# lies on facets already.
LISTED_TILT = 0.5 * TILT


@kernel
def shallow(header):
    """The share of the smaller body below which overlap stays in this world."""
    return CROWD_SHALLOW if header.step_pile != 0 else SHALLOW


@kernel
def mark_strays(header, workspace, world, marks):
    """Mark the bodies that were pushed off their flight or turn far within the step; return whether there are any."""
    bodies = bodies_of(header, world)
    states = states_of(header, world)
    rest = rest_of(header, world)
    flown = table(workspace.flown, header.num_bodies, BODY_STATE)
    ends = table(workspace.ends, header.num_bodies, BODY_STATE)
    found = False
    for index in range(header.num_bodies):
        body = bodies[index]
        marks[index] = 0
        if body.motion != DYNAMIC or rest[index].asleep != 0:
            continue
        start = states[index]
        end = ends[index]
        # What rests is kept from falling, and what falls does not go straight on: neither is pushed by anything new.
        pushed = vec3.sub(vec3.load(end.center), vec3.load(flown[index].center))
        straight = vec3.add_scaled(vec3.load(start.center), header.time_step, vec3.load(start.velocity))
        bent = vec3.sub(vec3.load(end.center), straight)
        strays = min(vec3.norm_squared(pushed), vec3.norm_squared(bent)) > (PUSHED * body.size) ** 2
        if not strays:
            spin = max(_turning(header, body, start), _turning(header, body, end))
            angle_squared = spin * header.time_step * header.time_step
            lever_squared = body.radius * body.radius - body.inner * body.inner
            strays = angle_squared * angle_squared * lever_squared > (2.0 * TURNS * body.size) ** 2
        if strays:
            marks[index] = 1
            found = True
    return found


@kernel
def _is_faceted(shape):
    return shape == MESH or shape == HEIGHT_FIELD


@kernel
def mark_sliders(header, workspace, world, count, marks):
    """Mark the bodies that touch and move where one of a pair is made of facets; return whether there are any.

    Of such pairs twelve contacts are known, each with the face that a vertex is over: what slides across a concave bend
    meets the next face, and what tips over an edge brings another edge down on a vertex. A sphere shows no other part,
    and what turns little in the step none that was not listed.
    """
    bodies = bodies_of(header, world)
    states = states_of(header, world)
    colliders = colliders_of(header)
    ends = table(workspace.ends, header.num_bodies, BODY_STATE)
    contacts = table(workspace.kept if workspace.waiting > 0 else workspace.contacts, workspace.contacts_size, CONTACT)
    found = False
    for index in range(count):
        contact = contacts[index]
        pair = contact.pair
        i = pair // colliders.shape[0]
        j = pair - i * colliders.shape[0]
        if not _is_faceted(colliders[i].shape) and not _is_faceted(colliders[j].shape):
            continue
        meshed = colliders[i].shape == MESH or colliders[j].shape == MESH
        for side in range(2):
            handle = contact.body_a if side == 0 else contact.body_b
            shape = colliders[i].shape if side == 0 else colliders[j].shape
            if bodies[handle].motion != DYNAMIC or marks[handle] == 1 or shape == SPHERE:
                continue
            way = vec3.norm(vec3.sub(vec3.load(ends[handle].center), vec3.load(states[handle].center)))
            turn = max(_turning(header, bodies[handle], states[handle]), _turning(header, bodies[handle], ends[handle]))
            angle = header.time_step * math.sqrt(turn)
            way += bodies[handle].radius * angle
            if (meshed or angle > LISTED_TILT) and way > shallow(header) * contact.size:
                marks[handle] = 1
                found = True
    return found


@kernel
def _turning(header, body, state):
    """Square of the speed [rad/s] at which a body shows other faces; what spins about its own axis shows none."""
    spin = vec3.load(state.angular_velocity)
    squared = vec3.norm_squared(spin)
    if body.num_colliders == 1:
        collider = colliders_of(header)[body.first_collider]
        if collider.shape == CAPSULE or collider.shape == CYLINDER:
            axis = quat.rotate(
                quat.load(state.orientation), quat.rotate(quat.load(collider.orientation), (0.0, 0.0, 1.0))
            )
            squared -= vec3.dot(spin, axis) ** 2
    return squared
