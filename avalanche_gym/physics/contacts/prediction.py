"""What a contact asks of the velocities at the end of the step.

Let the bodies fly the whole step as if nothing touched. The gap of a contact would then end at

    gap_end = gap + n . (d_b - d_a) + h n . s,

d_a and d_b being exact displacements and s the velocity of b's surface against its body. A corner is displaced with
the material; of a rounded shape it is the point of its core (the centre of a sphere) that tells how the surface
moves, for the surface does not move where a sphere spins. The solver asks for n . u + bias >= 0, u the relative
velocity at the end of the step:

* A contact that lasts (it bore load and still touches) must not approach: bias = 0. Its impulse is spread over the
step,
  so that it moves the body by half of h times the change of velocity: together with the flight, the trapezoid rule.
* A contact that is new may close what is open: h (n . u - n . u_free) >= -gap_end, so bias = gap_end / h - n . u_free.
  Its impulse moves the body by all of h times the change of velocity, which ends the step with gap 0. Overlap that is
  already there asks for no velocity; the position stage removes it.

Contacts that stay open by more than SLACK of the smaller body are dropped.
"""

from __future__ import annotations

import math

from ..jit import kernel
from ..maths import quat, vec3

# A contact whose gap ends larger than this fraction of the smaller body is left out of the problem. It can still come
# into play when a neighbour is pushed by more than that in one step; smaller values then allow overlap for one step.
SLACK = 0.05


@kernel
def point_velocity(state, point):
    """Velocity [m/s] of the body's material at ``point``, lever arm from where its centre is in ``state``."""
    arm = vec3.sub(point, vec3.load(state.center))
    return vec3.add(vec3.load(state.velocity), vec3.cross(vec3.load(state.angular_velocity), arm))


@kernel
def point_displacement(start, end, point):
    """Displacement [m] from ``start`` to ``end`` of the body's material that is at ``point`` [m] in ``start``."""
    turn = quat.multiply(quat.load(end.orientation), quat.conjugate(quat.load(start.orientation)))
    arm = vec3.sub(point, vec3.load(start.center))
    moved = vec3.sub(vec3.load(end.center), vec3.load(start.center))
    return vec3.add(moved, vec3.sub(quat.rotate(turn, arm), arm))


@kernel
def gap_change(contact, start_a, end_a, start_b, end_b, time_step):
    """How much the gap [m] of a contact changes when its bodies move from their start to their end."""
    normal = vec3.load(contact.normal)
    point = vec3.load(contact.position)
    half = 0.5 * contact.start_gap
    moved_a = point_displacement(start_a, end_a, vec3.add_scaled(point, -half - contact.radius_a, normal))
    moved_b = point_displacement(start_b, end_b, vec3.add_scaled(point, half + contact.radius_b, normal))
    drift = vec3.add_scaled(vec3.sub(moved_b, moved_a), time_step, vec3.load(contact.surface_velocity))
    return vec3.dot(normal, drift)


@kernel
def predict_contacts(bodies, starts, ends, moving, time_step, contacts, num_contacts):
    """Set ``bias`` of each contact and drop those that cannot matter; return how many remain.

    ``starts`` and ``ends`` are the states (bodies,) at both ends of the flight, ``moving`` those with the centres of
    the start and the velocities of the end, which the solver works on.
    """
    kept = 0
    for index in range(num_contacts):
        contact = contacts[index]
        a = contact.body_a
        b = contact.body_b
        point = vec3.load(contact.position)
        normal = vec3.load(contact.normal)
        surface = vec3.load(contact.surface_velocity)
        contact.start_gap = contact.gap
        gap_end = contact.gap + gap_change(contact, starts[a], ends[a], starts[b], ends[b], time_step)
        if gap_end > SLACK * min(bodies[a].size, bodies[b].size) and contact.gap > 0.0:
            continue
        free = vec3.add(vec3.sub(point_velocity(moving[b], point), point_velocity(moving[a], point)), surface)
        room = gap_end - min(contact.gap, 0.0)
        contact.free = vec3.dot(normal, free)
        contact.bias = max(room / time_step - contact.free, 0.0)
        if kept < index:
            contacts[kept] = contact
        kept += 1
    return kept


@kernel
def release_lasting(contacts, num_contacts):
    """Contacts that last must not approach: bias = 0."""
    for index in range(num_contacts):
        if contacts[index].persistent == 1:
            contacts[index].bias = 0.0


@kernel
def approach_speed(starts, contact):
    """Normal velocity [m/s] of a contact at the start of the step, negative if it closes."""
    point = vec3.load(contact.position)
    before = vec3.sub(point_velocity(starts[contact.body_b], point), point_velocity(starts[contact.body_a], point))
    return vec3.dot(vec3.load(contact.normal), vec3.add(before, vec3.load(contact.surface_velocity)))


@kernel
def strikes(starts, contact):
    """Whether a contact is new, was loaded by the first solve, and is faster than the fields made it in this step."""
    if contact.persistent == 1 or vec3.dot(vec3.load(contact.impulse), vec3.load(contact.normal)) <= 0.0:
        return False
    approach = approach_speed(starts, contact)
    return -approach > abs(contact.free - approach)


@kernel
def unsettle(starts, ends, time_step, contacts, order, first, last):
    """In an island that is struck, make lasting contacts new ones; return how many there were.

    A new contact moves its bodies by h times the change of velocity. A lasting one that answered the blow would move
    them back by half of that, and be pushed in by the rest. The island is contacts[order[first:last]].
    """
    struck = False
    for index in range(first, last):
        struck = struck or strikes(starts, contacts[order[index]])
    changed = 0
    for index in range(first, last):
        contact = contacts[order[index]]
        if struck and contact.persistent == 1:
            a = contact.body_a
            b = contact.body_b
            change = gap_change(contact, starts[a], ends[a], starts[b], ends[b], time_step)
            contact.persistent = 0
            contact.bias = max((change + max(contact.gap, 0.0)) / time_step - contact.free, 0.0)
            changed += 1
    return changed


@kernel
def prepare_impacts(starts, time_step, contacts, num_contacts):
    """Turn each new contact that closed into an impact; return how many there were.

    The first solve brought it to gap 0. Its velocity must now not approach, or leave with the restitution times the
    speed of approach v at the instant of touch: v^2 = v_0^2 - 2 a gap, with the speed v_0 at the start of the step and
    the acceleration a within it. At gap 0 that speed has the energy of the flight, so that no bounce gains any. A
    contact whose approach is only what the fields gave it in this step rests: it does not bounce.
    """
    count = 0
    for index in range(num_contacts):
        contact = contacts[index]
        if contact.persistent == 1 or vec3.dot(vec3.load(contact.impulse), vec3.load(contact.normal)) <= 0.0:
            continue
        contact.bias = 0.0
        if strikes(starts, contact):
            approach = approach_speed(starts, contact)
            gained = contact.free - approach
            square = approach * approach - 2.0 * gained / time_step * max(contact.start_gap, 0.0)
            contact.bias = -contact.restitution * math.sqrt(max(square, 0.0))
        count += 1
    return count


@kernel
def measure_end(starts, ends, time_step, contacts, num_contacts):
    """Set ``gap`` of each contact to that at the end of the step; return the deepest overlap [m]."""
    worst = 0.0
    for index in range(num_contacts):
        contact = contacts[index]
        a = contact.body_a
        b = contact.body_b
        contact.gap = contact.start_gap + gap_change(contact, starts[a], ends[a], starts[b], ends[b], time_step)
        worst = max(worst, -contact.gap)
    return worst
