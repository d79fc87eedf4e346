"""What a smooth step gains in energy is taken back.

Contacts with ground at rest do no work, but for what friction takes. The smooth step (lasting.py) obeys that to order 2
only: where a body turns by an angle a within the step it gains or loses about a^3 of its energy, and what it gains
could be gained in every step. The impulse of a contact acts along the step, at ever other places; of all impulses

    R = sum over start, middle, end of r_k w_k,    w = (n, x cross n),  x the arm of the contact,

that leave alone what the law says of the velocity at the end, G v' = 0, the one is added that takes the excess e of
energy with the least change of velocity. In y = M^(1/2) v', where kinetic energy is |y|^2 / 2, those impulses span the
complement B of the rows of G M^(-1/2) in the span of all w_k M^(-1/2); with d the projection of y on B,

    y' = y - k d,    k = 1 - sqrt(1 - 2 e / |d|^2)    or 1 if there is not so much energy in d.

So momentum is what the impulses say it is, a contact without friction still pushes along its normals only, and what
symmetry keeps is kept: no normal force turns a body of revolution about its axis.

Energy that is off by e shows velocities that are off by e / |y| or more, and d is changed by about e / |d|. Where d is
a small part of y that would be a larger error than the one it mends, as of a hoop that slides around a peg and hardly
turns: there the gain stays.
"""

from __future__ import annotations

import math

from ..contacts.prediction import bears_load
from ..integrator.momentum import angular_velocity_of, momentum_of, store_momentum
from ..jit import kernel
from ..maths import quat, vec3
from ..model import KINEMATIC, UNIFORM_GRAVITY

# Energy gained of less than this share of what free flight would end with, kinetic, is round-off.
ROUND_OFF = 1e-14
# A step that gains more than this share of it is not smooth: a contact has jumped. Smaller: bodies that turn far within
# a step are struck, with an error of order 1.
SMOOTH = 1e-2
# Nor is one with an impulse of so many times the momentum, sqrt(2 m E), that free flight would end with: bodies are
# jammed between contacts whose friction holds whatever presses, and cannot have the velocities that the step asks for
# at its end. It is struck, and if that has no solution either a lone body stops. Smaller: bodies that are truly wedged
# in are struck in every step.
JAMMED = 1e4
# An impulse that lies in the span of those before it to within this share of itself adds nothing to that span.
DEPENDENT = 1e-7
# Energy is taken from d only if that holds more than this share of what is kinetic, so no velocity changes by more than
# three times what the gain shows to be wrong. Smaller: slow parts of a motion are bent for the sake of fast ones.
BLAMED = 0.1
# Vectors that may be independent of one another: components of the velocity of a body.
MOST = 6


@kernel
def potential_gain(body, fields, before, after):
    """[J] by which the potential energy of a body grows on its way [m], free of the cancellation of large numbers."""
    way = vec3.sub(after, before)
    gain = 0.0
    for number in range(fields.shape[0]):
        vector = vec3.load(fields[number].vector)
        if fields[number].kind == UNIFORM_GRAVITY:
            gain -= vec3.dot(vector, way)
        else:
            from_here = vec3.sub(before, vector)
            from_there = vec3.sub(after, vector)
            near, far = vec3.norm(from_here), vec3.norm(from_there)
            # 1 / r - 1 / r' = (r'^2 - r^2) / (r r' (r + r'))
            gain += fields[number].mu * vec3.dot(way, vec3.add(from_here, from_there)) / (near * far * (near + far))
    return body.mass * gain


@kernel
def _spin_energy(body, state):
    """[J]"""
    spin = quat.rotate_inverse(quat.load(state.orientation), vec3.load(state.angular_velocity))
    return 0.5 * vec3.dot(spin, vec3.multiply(vec3.load(body.inertia), spin))


@kernel
def _energy_gain(body, fields, start, end):
    """[J] of kinetic and potential energy that a body gains from ``start`` to ``end``."""
    v = vec3.load(start.velocity)
    w = vec3.load(end.velocity)
    gain = 0.5 * body.mass * vec3.dot(vec3.sub(w, v), vec3.add(w, v))
    gain += potential_gain(body, fields, vec3.load(start.center), vec3.load(end.center))
    return gain + _spin_energy(body, end) - _spin_energy(body, start)


@kernel
def is_alone(bodies, starts, contacts, order, first, last, members, first_body, last_body):
    """Whether only fields give energy to an island: no force acts, and all that it touches besides is at rest."""
    for index in range(first_body, last_body):
        start = starts[members[index]]
        if vec3.norm_squared(vec3.load(start.force)) + vec3.norm_squared(vec3.load(start.torque)) > 0.0:
            return False
    for number in range(first, last):
        contact = contacts[order[number]]
        # That at the end of the step is not asked for: the contacts of crowds have none, and what moves is kinematic.
        moves = vec3.norm_squared(vec3.load(contact.surface_velocity))
        if moves > 0.0 or bodies[contact.body_a].motion == KINEMATIC or bodies[contact.body_b].motion == KINEMATIC:
            return False
    return True


@kernel
def _free_energy(bodies, flown, members, first_body, last_body):
    """(mass [kg], kinetic energy [J] that free flight would end with) of an island."""
    mass = 0.0
    kinetic = 0.0
    for index in range(first_body, last_body):
        handle = members[index]
        mass += bodies[handle].mass
        kinetic += 0.5 * bodies[handle].mass * vec3.norm_squared(vec3.load(flown[handle].velocity))
        kinetic += _spin_energy(bodies[handle], flown[handle])
    return mass, kinetic


@kernel
def is_jammed(bodies, flown, contacts, order, first, last, members, first_body, last_body):
    """Whether contacts of an island bear far more than could be needed to stop it."""
    mass, kinetic = _free_energy(bodies, flown, members, first_body, last_body)
    largest = 0.0
    for number in range(first, last):
        largest = max(largest, vec3.norm_squared(vec3.load(contacts[order[number]].impulse)))
    return largest > JAMMED * JAMMED * 2.0 * mass * kinetic


@kernel
def stop(body, handle, start, flown, end, contacts, order, first, last):
    """A lone body that is jammed stays where it is; what stops it is noted on its first contact."""
    vec3.store(end.center, vec3.load(start.center))
    quat.store(end.orientation, quat.load(start.orientation))
    vec3.store(end.velocity, vec3.ZERO)
    vec3.store(end.angular_velocity, vec3.ZERO)
    store_momentum(end, vec3.ZERO)
    for number in range(first, last):
        vec3.store(contacts[order[number]].impulse, vec3.ZERO)
        vec3.store(contacts[order[number]].moment, vec3.ZERO)
    contact = contacts[order[first]]
    sign = -body.mass if contact.body_b == handle else body.mass
    vec3.store(contact.impulse, vec3.scale(sign, vec3.load(flown.velocity)))


@kernel
def kinetic_and_gain(bodies, fields, starts, flown, ends, members, first_body, last_body):
    """(kinetic energy [J] that free flight would end with, [J] of energy that an island gains in the step)."""
    gain = 0.0
    for index in range(first_body, last_body):
        handle = members[index]
        gain += _energy_gain(bodies[handle], fields, starts[handle], ends[handle])
    _, kinetic = _free_energy(bodies, flown, members, first_body, last_body)
    return kinetic, gain


@kernel
def energy_excess(bodies, fields, starts, flown, ends, contacts, order, first, last, members, first_body, last_body):
    """([J] of energy that an island gains in a smooth step and should not, whether the step can't be smooth for it)."""
    if is_jammed(bodies, flown, contacts, order, first, last, members, first_body, last_body):
        return 0.0, True
    kinetic, gain = kinetic_and_gain(bodies, fields, starts, flown, ends, members, first_body, last_body)
    if gain <= ROUND_OFF * kinetic:
        return 0.0, False
    if not is_alone(bodies, starts, contacts, order, first, last, members, first_body, last_body):
        return 0.0, False
    return gain, gain > SMOOTH * kinetic


@kernel
def _add_independent(basis, count, body, orientation, push, arm):
    """Append the impulse ``push`` at ``arm``, in y, to the orthonormal rows of ``basis``; return how many there are."""
    if count == MOST:
        return count
    row = basis[count]
    moment = quat.rotate_inverse(orientation, vec3.cross(arm, push))
    inverse = vec3.load(body.inverse_inertia)
    root = math.sqrt(body.inverse_mass)
    square = 0.0
    for axis in range(3):
        row[axis] = root * push[axis]
        row[3 + axis] = math.sqrt(inverse[axis]) * moment[axis]
    for axis in range(MOST):
        square += row[axis] * row[axis]
    for _ in range(2):  # once more for what round-off leaves of those that are nearly dependent
        for number in range(count):
            known = basis[number]
            share = 0.0
            for axis in range(MOST):
                share += known[axis] * row[axis]
            for axis in range(MOST):
                row[axis] -= share * known[axis]
    left = 0.0
    for axis in range(MOST):
        left += row[axis] * row[axis]
    if left <= DEPENDENT * DEPENDENT * square:
        return count
    for axis in range(MOST):
        row[axis] /= math.sqrt(left)
    return count + 1


@kernel
def _add_contact(basis, count, body, orientation, contact, point, normal, center):
    """Append what a contact may give where it is at ``point``: along its normal, and in all directions if it sticks."""
    arm = vec3.sub(point, center)
    count = _add_independent(basis, count, body, orientation, normal, arm)
    if contact.sticks == 1 and contact.friction > 0.0:
        t1, t2 = vec3.tangents(normal)
        count = _add_independent(basis, count, body, orientation, t1, arm)
        count = _add_independent(basis, count, body, orientation, t2, arm)
    return count


@kernel
def take_back(excess, body, handle, start, working, end, contacts, order, first, last, basis):
    """Take ``excess`` [J] from the velocities of a lone body at the end of its smooth step, and note the impulse.

    ``working`` is its place in the middle of the step, ``basis`` (6 or more, 6 or more) is scratch.
    """
    loaded = -1
    for number in range(first, last):
        if bears_load(contacts[order[number]]):
            loaded = order[number]
    if loaded < 0:
        return
    orientation = quat.load(end.orientation)
    held = 0
    for number in range(first, last):
        contact = contacts[order[number]]
        if bears_load(contact):
            point, normal = vec3.load(contact.end_position), vec3.load(contact.end_normal)
            held = _add_contact(basis, held, body, orientation, contact, point, normal, vec3.load(end.center))
    count = held
    for number in range(first, last):
        contact = contacts[order[number]]
        if bears_load(contact):
            point, normal = vec3.load(contact.start_position), vec3.load(contact.start_normal)
            count = _add_contact(basis, count, body, orientation, contact, point, normal, vec3.load(start.center))
            point, normal = vec3.load(contact.position), vec3.load(contact.normal)
            center = vec3.load(working.center)
            count = _add_contact(basis, count, body, orientation, contact, point, normal, center)
    inertia = vec3.load(body.inertia)
    root = math.sqrt(body.mass)
    spin = quat.rotate_inverse(orientation, vec3.load(end.angular_velocity))
    push = vec3.ZERO
    turn = vec3.ZERO
    square = 0.0
    for number in range(held, count):
        row = basis[number]
        along = root * vec3.dot(vec3.load(end.velocity), vec3.load(row))
        for axis in range(3):
            along += math.sqrt(inertia[axis]) * spin[axis] * row[3 + axis]
        square += along * along
        push = vec3.add_scaled(push, along, vec3.load(row))
        turn = vec3.add_scaled(turn, along, vec3.load(row[3:]))
    whole = body.mass * vec3.norm_squared(vec3.load(end.velocity)) + vec3.dot(spin, vec3.multiply(inertia, spin))
    if square <= BLAMED * whole:
        return
    share = 1.0 - math.sqrt(max(1.0 - 2.0 * excess / square, 0.0))
    impulse = vec3.scale(-share * root, push)
    vec3.store(end.velocity, vec3.add_scaled(vec3.load(end.velocity), body.inverse_mass, impulse))
    roots = (math.sqrt(inertia[0]), math.sqrt(inertia[1]), math.sqrt(inertia[2]))
    moment = quat.rotate(orientation, vec3.scale(-share, vec3.multiply(roots, turn)))
    momentum = vec3.add(momentum_of(orientation, vec3.load(end.angular_velocity), inertia), moment)
    vec3.store(end.angular_velocity, angular_velocity_of(orientation, momentum, inertia))
    store_momentum(end, momentum)
    contact = contacts[loaded]
    sign = 1.0 if contact.body_b == handle else -1.0
    vec3.store(contact.impulse, vec3.add_scaled(vec3.load(contact.impulse), sign, impulse))
