"""From the impulses of an island's contacts to the motion of its bodies.

Impulses r_i on body b (and -r_i on a) at arms x_i, and the moments m_i of rolling and torsional friction, add up, body
by body, to an impulse p and an angular impulse l,

    p = sum r_i,    l = sum x_i cross r_i + m_i,    v = v_free + p / m,    L = L_free + l,    omega = R I^-1 R^T L,

with v_free, L_free what the flight leaves at the end of the step and R the orientation there.

In a step of order 1 the impulses act on the inertia as it is turned at the start. Where the body turns far within the
step that is the inertia of no other time: the angular velocity of the end, or an orientation that is put together from
the turn of the flight and that of the impulses, would make energy of the difference, as much as the moments of inertia
differ (a thin rod has a thousand times more about one axis than about another). There the impulses act at the start,
and what follows is free rotation, which keeps momentum and energy:

    omega_free = omega + h R_0 I^-1 R_0^T torque,    L = L_free + l,    R = the free rotation of R_0 under L.
"""

from __future__ import annotations

from ..contacts.turning import QUIET_TURN
from ..integrator.flight import turn_freely
from ..integrator.momentum import angular_velocity_of, momentum_of, store_momentum
from ..jit import kernel
from ..maths import quat, vec3
from ..model import DYNAMIC, FLOW_SPHERE, FLOW_SYMMETRIC, FLOW_TRIAXIAL


@kernel
def _accumulate(row, center, point, push, turn):
    moment = vec3.add(vec3.cross(vec3.sub(point, center), push), turn)
    for axis in range(3):
        row[axis] += push[axis]
        row[3 + axis] += moment[axis]


@kernel
def sum_impulses(bodies, places, contacts, order, first, last, island_bodies, first_body, last_body, sums):
    """Fill ``sums`` (bodies, 6) for the bodies of one island, arms from their centres in ``places``."""
    for index in range(first_body, last_body):
        row = sums[island_bodies[index]]
        for axis in range(6):
            row[axis] = 0.0
    for index in range(first, last):
        contact = contacts[order[index]]
        push = vec3.load(contact.impulse)
        turn = vec3.load(contact.moment)
        point = vec3.load(contact.position)
        a = contact.body_a
        b = contact.body_b
        if bodies[a].motion == DYNAMIC:
            _accumulate(sums[a], vec3.load(places[a].center), point, vec3.neg(push), vec3.neg(turn))
        if bodies[b].motion == DYNAMIC:
            _accumulate(sums[b], vec3.load(places[b].center), point, push, turn)


@kernel
def impulse_on(row):
    return (row[0], row[1], row[2])


@kernel
def moment_on(row):
    return (row[3], row[4], row[5])


@kernel
def turn_by(body, orientation, moment):
    """Change of angular velocity [rad/s] that an angular impulse [N m s] makes, inertia turned to ``orientation``."""
    local = vec3.multiply(vec3.load(body.inverse_inertia), quat.rotate_inverse(orientation, moment))
    return quat.rotate(orientation, local)


@kernel
def turned(orientation, angle):
    """An orientation after a small rotation vector [rad], world frame."""
    if angle[0] == 0.0 and angle[1] == 0.0 and angle[2] == 0.0:
        return orientation
    return quat.normalize(quat.multiply(quat.from_rotation_vector(angle), orientation))


@kernel
def _has_axes(body):
    """Whether the moments of inertia of a body differ."""
    return body.flow == FLOW_SYMMETRIC or body.flow == FLOW_TRIAXIAL


@kernel
def turns_far(body, flown, angle, time_step):
    """Whether a body turns far in a step, by its flight and by ``angle`` [rad], which impulses add."""
    return _has_axes(body) and (
        time_step * vec3.norm(vec3.load(flown.angular_velocity)) + vec3.norm(angle) > QUIET_TURN
    )


@kernel
def free_spin(body, start, flown, time_step):
    """Angular velocity [rad/s] that goes with the inertia at the start of a step, without impulses of contacts."""
    if not turns_far(body, flown, vec3.ZERO, time_step):
        return vec3.load(flown.angular_velocity)
    change = turn_by(body, quat.load(start.orientation), vec3.scale(time_step, vec3.load(start.torque)))
    return vec3.add(vec3.load(start.angular_velocity), change)


@kernel
def end_orientation(body, start, flown, moment, angle, time_step):
    """Where a body has turned to by the end of a step of order 1.

    ``moment`` [N m s] is the angular impulse of its contacts, ``angle`` [rad] the small rotation that it adds to that
    of the flight.
    """
    if not turns_far(body, flown, angle, time_step):
        return turned(quat.load(flown.orientation), angle)
    momentum = vec3.add(vec3.load(flown.angular_momentum), moment)
    momentum = vec3.add_scaled(momentum, -0.5 * time_step, vec3.load(start.torque))
    return turn_freely(quat.load(start.orientation), momentum, vec3.load(body.inertia), body.flow, time_step)


@kernel
def set_velocities(body, flown, row, out):
    """Velocities of ``out`` after the impulses of ``row``; its orientation is that of the end of the step."""
    impulse = impulse_on(row)
    moment = moment_on(row)
    vec3.store(out.velocity, vec3.add_scaled(vec3.load(flown.velocity), body.inverse_mass, impulse))
    spin = vec3.load(flown.angular_velocity)
    if body.flow == FLOW_SPHERE:
        spin = vec3.add_scaled(spin, body.inverse_inertia[0], moment)
    elif _has_axes(body):
        momentum = vec3.add(vec3.load(flown.angular_momentum), moment)
        spin = angular_velocity_of(quat.load(out.orientation), momentum, vec3.load(body.inertia))
        store_momentum(out, momentum)
    vec3.store(out.angular_velocity, spin)


@kernel
def shift(body, state, translation, rotation):
    """Move a state without changing its velocities."""
    vec3.store(state.center, vec3.add(vec3.load(state.center), translation))
    before = quat.load(state.orientation)
    after = turned(before, rotation)
    quat.store(state.orientation, after)
    if _has_axes(body):
        # The momentum follows from the velocity that is kept.
        store_momentum(state, momentum_of(after, vec3.load(state.angular_velocity), vec3.load(body.inertia)))
