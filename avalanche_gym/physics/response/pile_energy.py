"""Sweeps that have not settled give energy; what they give is taken back.

Contacts with ground at rest do no work, but for what friction takes. A sweep settles one contact after the other, and
where a step ends before all agree, impulses are too large: of a blow that is handed on, or under a friction that holds
what presses on it. All impulses of the island are then scaled by one factor s, which keeps both momenta. With v the
velocities that flight alone leads to and d what the contacts add to them, the kinetic energy is

    K(s) = K(0) + s b + s^2 a,    a = d . M d / 2,    b = d . M v,

and s is the largest up to 1 at which no energy is gained, or, where gravity alone has given too much, that of the least
energy. A heap at rest has its least at s = 1.
"""

from __future__ import annotations

import math

from ..jit import kernel
from ..maths import quat, vec3
from .bodies import free_spin
from .energy import potential_gain

# A gain of less than this share of what contacts take and give is round-off.
ROUND_OFF = 1e-12


@kernel
def _spin_product(body, orientation, one, other):
    """one . I other of a body."""
    own, its = quat.rotate_inverse(orientation, one), quat.rotate_inverse(orientation, other)
    return vec3.dot(own, vec3.multiply(vec3.load(body.inertia), its))


@kernel
def _by_contacts(body, start, flight, node, time_step):
    """Velocity [m/s] and spin [rad/s] that flight alone leads to, and what the contacts add to each."""
    free, spin = vec3.load(flight.velocity), free_spin(body, start, flight, time_step)
    return free, spin, vec3.sub(vec3.load(node.velocity), free), vec3.sub(vec3.load(node.spin), spin)


@kernel
def _share(bodies, fields, starts, flown, time_step, members, first_body, last_body, nodes):
    """The share of the impulses that gives no energy."""
    gain = 0.0
    linear = 0.0
    square = 0.0
    for number in range(first_body, last_body):
        handle = members[number]
        body, start, flight = bodies[handle], starts[handle], flown[handle]
        node = nodes[number - first_body]
        orientation = quat.load(start.orientation)
        free, spin, given, turn = _by_contacts(body, start, flight, node, time_step)
        linear += body.mass * vec3.dot(given, free) + _spin_product(body, orientation, turn, spin)
        square += 0.5 * (body.mass * vec3.norm_squared(given) + _spin_product(body, orientation, turn, turn))
        here = vec3.load(start.center)
        # Flight keeps its energy: what counts is where contacts have led instead.
        gain += potential_gain(body, fields, vec3.load(flight.center), vec3.add(here, vec3.load(node.moved)))
    gain += linear + square
    if not gain > ROUND_OFF * (square + abs(linear)):
        return 1.0
    # K(s) = K(1) - gain
    least = -0.5 * linear / square
    root = (1.0 - least) ** 2 - gain / square
    return min(max(least + math.sqrt(max(root, 0.0)), 0.0), 1.0)


@kernel
def give_no_energy(
    bodies, fields, starts, flown, time_step, members, first_body, last_body, rows, moments, nodes, num_contacts
):
    """Scale the impulses of an island's step, and the velocities they gave, so that no energy is gained."""
    share = _share(bodies, fields, starts, flown, time_step, members, first_body, last_body, nodes)
    if share == 1.0:
        return
    for number in range(first_body, last_body):
        handle = members[number]
        node = nodes[number - first_body]
        free, spin, given, turn = _by_contacts(bodies[handle], starts[handle], flown[handle], node, time_step)
        vec3.store(node.velocity, vec3.add_scaled(free, share, given))
        vec3.store(node.spin, vec3.add_scaled(spin, share, turn))
    for index in range(num_contacts):
        vec3.store(rows[index].total, vec3.scale(share, vec3.load(rows[index].total)))
    for index in range(min(num_contacts, moments.shape[0])):
        vec3.store(moments[index].total, vec3.scale(share, vec3.load(moments[index].total)))
