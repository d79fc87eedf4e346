"""Where a contact is, and how its normal has turned, after its bodies have moved a little.

A contact is between features that move with their bodies. Which of them carries the normal is CONTACT.frame:

    ON_A, ON_B   a flat side of that body; the other one touches it with a point of its core (a corner, the centre of a
                 sphere), thickened by a radius. The side turns with its body, and the core moves with the other:
                     n' = R n,    gap' = n' . (core' - side') - radius
    BETWEEN      two rounded points (spheres): the normal lies along the line between them:
                     n' = (core_b' - core_a') / |...|,    gap' = |core_b' - core_a'| - radius_a - radius_b

Edges that cross and shapes that roll on their rims are taken as ON_A or ON_B too: right to first order in the motion.
"""

from __future__ import annotations

import math

from ..jit import kernel
from ..maths import quat, vec3
from ..model import BETWEEN, ON_A
from .kinematics import gap_change, point_displacement, surface_gain, surface_shift
from .prediction import THICKNESS

# [rad] Of a part of a step in which contacts hold bodies that turn: what contacts do not know of is off by half its
# square in the size of the bodies, what a smooth part makes of their energy by about its cube.
QUIET_TURN = 0.1
# A step is made of no more such parts than these; what whirls faster is not followed so. Larger: it costs ever more.
MOST_QUIET = 32
# [rad] A body that turns by more within a step shows other parts than its contacts know of.
WHIRL = 1.0


@kernel
def turning_speed(body, state):
    """[rad/s] at which a body shows other faces: a sphere shows none."""
    return vec3.norm(vec3.load(state.angular_velocity)) if body.radius > body.inner else 0.0


@kernel
def whirls(body, state, span):
    """Whether a body turns so far within ``span`` [s] that contacts known at its start do not hold it."""
    return turning_speed(body, state) * span > WHIRL


@kernel
def known_span(fastest):
    """[s] in which no body whirls, the fastest one turning at ``fastest`` [rad/s].

    Over a longer way a search takes as many looks as there are turns, and a point that has swung away and come back by
    the end seems to have stayed.
    """
    return WHIRL / fastest if fastest > 0.0 else math.inf


@kernel
def any_outruns(bodies, states, members, first_body, last_body, span):
    """Whether one of bodies members[first_body:last_body] gets within ``span`` [s] where no contact of its start is."""
    found = False
    for index in range(first_body, last_body):
        body = bodies[members[index]]
        state = states[members[index]]
        far = span * vec3.norm(vec3.load(state.velocity)) > THICKNESS * body.size
        found = found or far or whirls(body, state, span)
    return found


@kernel
def quiet_part(fastest):
    """[s] in which no body turns far, the fastest one at ``fastest`` [rad/s]."""
    return QUIET_TURN / fastest if fastest > 0.0 else math.inf


@kernel
def quiet_span(fastest, time_step):
    """The same for a step that is made of such parts; inf if they were too many."""
    return quiet_part(fastest) if fastest * time_step <= MOST_QUIET * QUIET_TURN else math.inf


@kernel
def _carry(start, end, point):
    """Where material at ``point`` in ``start`` is in ``end``."""
    return vec3.add(point, point_displacement(start, end, point))


@kernel
def _turn(start, end, direction):
    turn = quat.multiply(quat.load(end.orientation), quat.conjugate(quat.load(start.orientation)))
    return quat.rotate(turn, direction)


@kernel
def turn_contact(contact, start_a, end_a, start_b, end_b, time_step):
    """Fill the fields ``end_*`` for the bodies at ``end``, from ``start_*``, where they are at ``start``."""
    normal = vec3.load(contact.start_normal)
    position = vec3.load(contact.start_position)
    half = 0.5 * contact.start_gap
    radius_a = contact.radius_a
    radius_b = contact.radius_b
    drift = surface_shift(contact, time_step)
    velocity = vec3.add(vec3.load(contact.surface_velocity), surface_gain(contact, time_step))
    vec3.store(contact.end_surface_velocity, velocity)
    if contact.persistent == 0:
        # What is still apart may pass by altogether: it is measured along the normal it started with.
        gap = contact.start_gap + vec3.dot(normal, drift)
        gap += gap_change(contact, position, normal, contact.start_gap, start_a, end_a, start_b, end_b)
    elif contact.frame == BETWEEN:
        core_a = _carry(start_a, end_a, vec3.add_scaled(position, -half - radius_a, normal))
        core_b = vec3.add(_carry(start_b, end_b, vec3.add_scaled(position, half + radius_b, normal)), drift)
        apart = vec3.sub(core_b, core_a)
        distance = vec3.norm(apart)
        if distance > 0.0 and vec3.dot(apart, normal) > 0.0:
            normal = vec3.scale(1.0 / distance, apart)
        gap = vec3.dot(normal, apart) - radius_a - radius_b
        position = vec3.add_scaled(core_a, radius_a + 0.5 * gap, normal)
    elif contact.frame == ON_A:
        side = _carry(start_a, end_a, vec3.add_scaled(position, -half, normal))
        core = vec3.add(_carry(start_b, end_b, vec3.add_scaled(position, half + radius_b, normal)), drift)
        normal = _turn(start_a, end_a, normal)
        gap = vec3.dot(normal, vec3.sub(core, side)) - radius_b
        position = vec3.add_scaled(core, -radius_b - 0.5 * gap, normal)
    else:
        side = vec3.add(_carry(start_b, end_b, vec3.add_scaled(position, half, normal)), drift)
        core = _carry(start_a, end_a, vec3.add_scaled(position, -half - radius_a, normal))
        normal = _turn(start_b, end_b, normal)
        gap = vec3.dot(normal, vec3.sub(side, core)) - radius_a
        position = vec3.add_scaled(core, radius_a + 0.5 * gap, normal)
    vec3.store(contact.end_position, position)
    vec3.store(contact.end_normal, normal)
    contact.end_gap = gap
