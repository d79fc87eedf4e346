"""The struck step: a contact closes within it, and velocities jump.

Where the jump lies in the step is not known, so impulses and velocities are those of its end and move the bodies all
of it (Moreau 1999, sec. 3; order 1 in this one step):

    M v' = M v_free + G^T r,       x' = x + h v',       law(r, G v' + bias),       bias = gap_end / h - n . u_free,

gap_end being the gap that the free velocities would leave. What is open may close, no more; the gap and the velocity
obey the same inequality, so one solve serves both. A body that falls on the ground ends the step on it, the next one
without velocity into it.

Restitution takes a second solve for the velocities alone, with n . u >= e v for each contact that struck, v its speed
of approach at the instant of touch: v^2 = v_0^2 - 2 a gap, with v_0 at the start of the step and the acceleration a
within it. At gap 0 that speed has the energy of the flight, so no bounce gains any.
"""

from __future__ import annotations

import math

from ..contacts.kinematics import gap_change, surface_gain, surface_shift
from ..contacts.prediction import bears_load
from ..jit import kernel
from ..maths import quat, vec3
from ..model import DYNAMIC
from .bodies import (
    end_orientation,
    free_spin,
    impulse_on,
    moment_on,
    set_velocities,
    sum_impulses,
    turn_by,
    turns_far,
)


@kernel
def _start(body, start, flown, time_step, predicted, working):
    """Places of the start and velocities of the end to work with, and where those velocities lead."""
    velocity = vec3.load(flown.velocity)
    center = vec3.load(start.center)
    vec3.store(working.center, center)
    quat.store(working.orientation, quat.load(start.orientation))
    vec3.store(working.velocity, velocity)
    vec3.store(working.angular_velocity, free_spin(body, start, flown, time_step))
    vec3.store(predicted.center, vec3.add_scaled(center, time_step, velocity))
    quat.store(predicted.orientation, quat.load(flown.orientation))


@kernel
def _spin_change(contact, point, normal, starts, flown, working):
    """[m/s] by which the normal velocity of a contact differs in ``working`` from that of the flight, for its spins."""
    change = 0.0
    for body, sign in ((contact.body_a, -1.0), (contact.body_b, 1.0)):
        spin = vec3.sub(vec3.load(working[body].angular_velocity), vec3.load(flown[body].angular_velocity))
        if vec3.norm_squared(spin) > 0.0:
            arm = vec3.sub(point, vec3.load(starts[body].center))
            change += sign * vec3.dot(normal, vec3.cross(spin, arm))
    return change


@kernel
def prepare_impact(
    bodies,
    starts,
    flown,
    time_step,
    contacts,
    order,
    first,
    last,
    island_bodies,
    first_body,
    last_body,
    predicted,
    working,
):
    """Write the contact problem of one island about the start of the step."""
    for index in range(first_body, last_body):
        handle = island_bodies[index]
        _start(bodies[handle], starts[handle], flown[handle], time_step, predicted[handle], working[handle])
    for index in range(first, last):
        contact = contacts[order[index]]
        a = contact.body_a
        b = contact.body_b
        if bodies[a].motion != DYNAMIC:
            _start(bodies[a], starts[a], flown[a], time_step, predicted[a], working[a])
        if bodies[b].motion != DYNAMIC:
            _start(bodies[b], starts[b], flown[b], time_step, predicted[b], working[b])
        position = vec3.load(contact.start_position)
        normal = vec3.load(contact.start_normal)
        gap = contact.start_gap
        rise = vec3.dot(normal, surface_shift(contact, time_step))
        contact.free += _spin_change(contact, position, normal, starts, flown, working)
        change = gap_change(contact, position, normal, gap, starts[a], predicted[a], starts[b], predicted[b])
        # Overlap that is already there asks for no velocity; the position stage removes it.
        contact.bias = max((max(gap, 0.0) + change + rise) / time_step - contact.free, 0.0)
        contact.end_gap = gap + rise
        vec3.store(contact.position, position)
        vec3.store(contact.normal, normal)
        vec3.store(contact.end_position, position)
        vec3.store(contact.end_normal, normal)
        vec3.store(contact.turning, surface_gain(contact, time_step))
        vec3.store(contact.creep, vec3.ZERO)
        contact.sticks = 0


@kernel
def acts_at_once(contacts, order, first, last):
    """Note of the contacts of a struck island that their impulses are no force times the length of the step."""
    for index in range(first, last):
        contacts[order[index]].span = 0.0


@kernel
def forget_impulses(contacts, order, first, last):
    """Begin anew: what was solved for is no impulse to start from."""
    for index in range(first, last):
        vec3.store(contacts[order[index]].impulse, vec3.ZERO)
        vec3.store(contacts[order[index]].moment, vec3.ZERO)


@kernel
def end_impact(
    bodies, starts, flown, time_step, contacts, order, first, last, sums, island_bodies, first_body, last_body, ends
):
    """Bodies of one island at the end of the step, under the impulses that were solved for."""
    sum_impulses(bodies, starts, contacts, order, first, last, island_bodies, first_body, last_body, sums)
    for index in range(first_body, last_body):
        handle = island_bodies[index]
        body = bodies[handle]
        start = starts[handle]
        end = ends[handle]
        moment = moment_on(sums[handle])
        angle = vec3.scale(time_step, turn_by(body, quat.load(start.orientation), moment))
        velocity = vec3.add_scaled(vec3.load(flown[handle].velocity), body.inverse_mass, impulse_on(sums[handle]))
        vec3.store(end.center, vec3.add_scaled(vec3.load(start.center), time_step, velocity))
        quat.store(end.orientation, end_orientation(body, start, flown[handle], moment, angle, time_step))
        set_velocities(body, flown[handle], sums[handle], end)


@kernel
def strikes(contact):
    """Whether a contact is new, was loaded by the first solve, and is faster than the fields made it in this step."""
    return contact.persistent == 0 and bears_load(contact) and -contact.approach > abs(contact.free - contact.approach)


@kernel
def prepare_rebound(time_step, contacts, order, first, last):
    """Ask of each contact that closed the velocity of its rebound; return whether any contact of the island bounces."""
    bounces = False
    for index in range(first, last):
        contact = contacts[order[index]]
        bounces = bounces or (contact.restitution > 0.0 and strikes(contact))
    if not bounces:
        return False
    for index in range(first, last):
        contact = contacts[order[index]]
        if contact.persistent == 1:
            contact.bias = 0.0
        elif bears_load(contact):
            contact.bias = 0.0
            if strikes(contact):
                gained = contact.free - contact.approach
                square = contact.approach**2 - 2.0 * gained / time_step * max(contact.start_gap, 0.0)
                contact.bias = -contact.restitution * math.sqrt(max(square, 0.0))
    return True


@kernel
def end_rebound(
    bodies, starts, flown, time_step, contacts, order, first, last, sums, island_bodies, first_body, last_body, ends
):
    """Velocities of one island's bodies after the rebound; what turns far turns with them."""
    sum_impulses(bodies, starts, contacts, order, first, last, island_bodies, first_body, last_body, sums)
    for index in range(first_body, last_body):
        handle = island_bodies[index]
        body = bodies[handle]
        start = starts[handle]
        moment = moment_on(sums[handle])
        angle = vec3.scale(time_step, turn_by(body, quat.load(start.orientation), moment))
        if turns_far(body, flown[handle], angle, time_step):
            turn = end_orientation(body, start, flown[handle], moment, angle, time_step)
            quat.store(ends[handle].orientation, turn)
        set_velocities(body, flown[handle], sums[handle], ends[handle])
