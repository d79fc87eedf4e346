"""What rests, rests: velocities that are nothing but the error which the solver may leave are taken out.

A certificate accepts the impulses of the last step although they leave a velocity of up to a share of the tolerance.
Handed on, it would double in the next step, where it no longer passes; the impulses that are then solved for stop it,
and so are wrong for the step after, in which nothing has to be stopped: they leave the same velocity, reversed. A scene
at rest would factorise every other step for ever. The residual weighs the velocity u of a contact against its impulse
as u / (W r) with W about 1/m_a + 1/m_b, so a body that is slower than the tolerance times all W r upon it has no
velocity that the solver knows of; if it had none at the start either, it stays where it is.
"""

from __future__ import annotations

import math

from ..integrator.momentum import store_momentum
from ..jit import kernel
from ..maths import quat, vec3
from ..model import DYNAMIC


@kernel
def let_rest(
    bodies, starts, tolerance, contacts, order, first, last, loads, island_bodies, first_body, last_body, ends
):  # fmt: skip
    """Stop the bodies of one island that have no more than the error that the solver may leave; ``loads`` is scratch.

    Its speed, and sqrt(w.I w / m) for its spin, are held against ``tolerance`` x the sum of W r over its contacts.
    """
    for index in range(first_body, last_body):
        loads[island_bodies[index]][0] = 0.0
    for index in range(first, last):
        contact = contacts[order[index]]
        a = contact.body_a
        b = contact.body_b
        inverse_mass = bodies[a].inverse_mass + bodies[b].inverse_mass
        change = inverse_mass * vec3.norm(vec3.load(contact.impulse))
        if bodies[a].motion == DYNAMIC:
            loads[a][0] += change
        if bodies[b].motion == DYNAMIC:
            loads[b][0] += change
    for index in range(first_body, last_body):
        handle = island_bodies[index]
        start = starts[handle]
        end = ends[handle]
        body = bodies[handle]
        unknown = tolerance * loads[handle][0]
        spin = quat.rotate_inverse(quat.load(end.orientation), vec3.load(end.angular_velocity))
        energy = vec3.dot(spin, vec3.multiply(vec3.load(body.inertia), spin))
        turning = math.sqrt(energy * body.inverse_mass)
        if vec3.norm(vec3.load(end.velocity)) <= unknown and turning <= unknown:
            vec3.store(end.velocity, vec3.ZERO)
            vec3.store(end.angular_velocity, vec3.ZERO)
            store_momentum(end, vec3.ZERO)
            rested = vec3.norm_squared(vec3.load(start.velocity)) == 0.0
            if rested and vec3.norm_squared(vec3.load(start.angular_velocity)) == 0.0:
                vec3.store(end.center, vec3.load(start.center))
                quat.store(end.orientation, quat.load(start.orientation))
