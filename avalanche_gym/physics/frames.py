"""From the user's frame of a body to its principal frame and back, and impulses that act at once."""

from __future__ import annotations

import math

from .jit import entry_point, kernel
from .maths import quat, vec3
from .memory import bodies_of, header_at, states_of, vectors_of
from .model import DYNAMIC, REMOVED


@kernel
def publish_body(header, world, index, body, state):
    """Write the public arrays of one body from its state: the origin and axes of the frame its shape was given in."""
    position = vectors_of(header.position, header, world, 3)[index]
    orientation = vectors_of(header.orientation, header, world, 4)[index]
    linear_velocity = vectors_of(header.linear_velocity, header, world, 3)[index]
    angular_velocity = vectors_of(header.angular_velocity, header, world, 3)[index]
    if body.motion == REMOVED:
        for axis in range(3):
            position[axis] = orientation[axis] = linear_velocity[axis] = angular_velocity[axis] = math.nan
        orientation[3] = math.nan
        return
    q = quat.load(state.orientation)
    spin = vec3.load(state.angular_velocity)
    arm = quat.rotate(q, vec3.load(body.origin))
    vec3.store(position, vec3.add(vec3.load(state.center), arm))
    quat.store(orientation, quat.multiply(q, quat.load(body.principal)))
    vec3.store(linear_velocity, vec3.add(vec3.load(state.velocity), vec3.cross(spin, arm)))
    vec3.store(angular_velocity, spin)


@kernel
def adopt_body(header, world, index, body, state):
    """Write the state of one body from the public arrays."""
    orientation = quat.load(vectors_of(header.orientation, header, world, 4)[index])
    q = quat.multiply(orientation, quat.conjugate(quat.load(body.principal)))
    spin = vec3.load(vectors_of(header.angular_velocity, header, world, 3)[index])
    arm = quat.rotate(q, vec3.load(body.origin))
    vec3.store(state.center, vec3.sub(vec3.load(vectors_of(header.position, header, world, 3)[index]), arm))
    quat.store(state.orientation, q)
    velocity = vec3.load(vectors_of(header.linear_velocity, header, world, 3)[index])
    vec3.store(state.velocity, vec3.sub(velocity, vec3.cross(spin, arm)))
    vec3.store(state.angular_velocity, spin)


@kernel
def kick(body, state, impulse, turn):
    """Change velocities by an impulse [N s] at the centre of mass and an angular impulse [N m s], world frame.

    Returns False, and changes nothing, if the body would be too fast for its kinetic energy to be a number.
    """
    velocity = vec3.add_scaled(vec3.load(state.velocity), body.inverse_mass, impulse)
    q = quat.load(state.orientation)
    change = quat.rotate(q, vec3.multiply(vec3.load(body.inverse_inertia), quat.rotate_inverse(q, turn)))
    spin = vec3.add(vec3.load(state.angular_velocity), change)
    if not math.isfinite(vec3.norm_squared(velocity) + vec3.norm_squared(spin)):
        return False
    vec3.store(state.velocity, velocity)
    vec3.store(state.angular_velocity, spin)
    return True


@entry_point
def publish(address, world_mask, index):
    """Public arrays from states: of one body, or of all if ``index`` is negative, in the worlds of the mask."""
    header = header_at(address)
    for world in range(header.num_worlds):
        if world_mask[world]:
            bodies = bodies_of(header, world)
            states = states_of(header, world)
            for body in range(header.num_bodies):
                if index < 0 or body == index:
                    publish_body(header, world, body, bodies[body], states[body])


@entry_point
def adopt(address, world_mask, index):
    """States from public arrays: of one body, or of all if ``index`` is negative, in the worlds of the mask."""
    header = header_at(address)
    for world in range(header.num_worlds):
        if world_mask[world]:
            bodies = bodies_of(header, world)
            states = states_of(header, world)
            for body in range(header.num_bodies):
                if index < 0 or body == index:
                    adopt_body(header, world, body, bodies[body], states[body])


@entry_point
def apply_impulses(address, world_mask, index, impulses, points, hold):
    """Impulses (worlds, 3) on one body at points (worlds, 3) [m], NaN for the centre of mass.

    With ``hold`` they are forces [N], added to what acts until the end of the next call.
    """
    header = header_at(address)
    for world in range(header.num_worlds):
        if not world_mask[world]:
            continue
        body = bodies_of(header, world)[index]
        state = states_of(header, world)[index]
        if body.motion != DYNAMIC:
            continue
        impulse = vec3.load(impulses[world])
        turn = vec3.ZERO
        if not math.isnan(points[world, 0]):
            turn = vec3.cross(vec3.sub(vec3.load(points[world]), vec3.load(state.center)), impulse)
        if hold:
            vec3.store(state.force, vec3.add(vec3.load(state.force), impulse))
            vec3.store(state.torque, vec3.add(vec3.load(state.torque), turn))
        else:
            if kick(body, state, impulse, turn):
                publish_body(header, world, index, body, state)
            else:
                # Left to the next step, which refuses it and says so: until then the state stays a good one.
                waiting = vectors_of(header.impulses, header, world, 6)[index]
                for axis in range(3):
                    waiting[axis] += impulse[axis]
                    waiting[3 + axis] += turn[axis]
