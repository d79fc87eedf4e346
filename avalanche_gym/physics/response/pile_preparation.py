"""What the sweeps of the pile tier are given: bodies and contacts of an island in short records.

Geometry is that of the start of the step. A gap that closes within the step is known with the swing of turning bodies:
gap(h) = gap + h n . u + swing, where swing is what the exact flight has beyond the linear motion.
"""

from __future__ import annotations

import math

from ..contacts.kinematics import surface_shift
from ..contacts.prediction import TOUCH
from ..jit import kernel
from ..maths import quat, vec3
from ..model import DYNAMIC
from ..solver.pile import law_error
from ..solver.pile_moments import allowed, prepare_moment
from ..solver.pile_response import prepare_response, to_local
from ..solver.problem import RESERVED
from .bodies import free_spin
from .creep import CLOSING, SETTLED


@kernel
def place_node(body, state, node):
    """Mass and inertia of a body as it is turned in ``state``; it has not moved from there."""
    m = quat.to_matrix(quat.load(state.orientation))
    x, y, z = body.inverse_inertia[0], body.inverse_inertia[1], body.inverse_inertia[2]
    inertia = node.inverse_inertia
    inertia[0] = m[0] * m[0] * x + m[1] * m[1] * y + m[2] * m[2] * z
    inertia[1] = m[0] * m[3] * x + m[1] * m[4] * y + m[2] * m[5] * z
    inertia[2] = m[0] * m[6] * x + m[1] * m[7] * y + m[2] * m[8] * z
    inertia[3] = m[3] * m[3] * x + m[4] * m[4] * y + m[5] * m[5] * z
    inertia[4] = m[3] * m[6] * x + m[4] * m[7] * y + m[5] * m[8] * z
    inertia[5] = m[6] * m[6] * x + m[7] * m[7] * y + m[8] * m[8] * z
    node.inverse_mass = body.inverse_mass
    node.shoved = 0
    vec3.store(node.moved, vec3.ZERO)
    vec3.store(node.turned, vec3.ZERO)


@kernel
def stand_still(node):
    """The node of all that cannot be moved."""
    node.inverse_mass = 0.0
    node.shoved = -1
    for entry in range(6):
        node.inverse_inertia[entry] = 0.0
    for vector in (node.velocity, node.spin, node.gain, node.before, node.spin_before, node.moved, node.turned):
        vec3.store(vector, vec3.ZERO)


@kernel
def prepare_bodies(bodies, starts, flown, time_step, members, first_body, last_body, substeps, nodes, index):
    """Fill the nodes of the island's bodies at the start of the step, and the table from a body to its node."""
    share = 1.0 / substeps
    for number in range(first_body, last_body):
        handle = members[number]
        index[RESERVED + handle] = number - first_body
        node = nodes[number - first_body]
        body = bodies[handle]
        start = starts[handle]
        flight = flown[handle]
        place_node(body, start, node)
        velocity, spin = vec3.load(start.velocity), vec3.load(start.angular_velocity)
        vec3.store(node.velocity, velocity)
        vec3.store(node.spin, spin)
        vec3.store(node.gain, vec3.scale(share, vec3.sub(vec3.load(flight.velocity), velocity)))
        free = free_spin(body, start, flight, time_step)
        vec3.store(node.spin_gain, vec3.scale(share, vec3.sub(free, spin)))
        vec3.store(node.push, vec3.ZERO)
        vec3.store(node.moment, vec3.ZERO)
    stand_still(nodes[last_body - first_body])


@kernel
def _turn_in_flight(body, start, flight, time_step, arm):
    """[m] that turning within the step moves a point at ``arm``, to first order."""
    spin = vec3.add(vec3.load(start.angular_velocity), free_spin(body, start, flight, time_step))
    return vec3.cross(vec3.scale(0.5 * time_step, spin), arm)


@kernel
def _velocity_in_flight(body, start, flown, arm):
    """Velocity [m/s] of a point at ``arm``: at the end of the flight; of what is driven the mean over it."""
    velocity = vec3.add(vec3.load(flown.velocity), vec3.cross(vec3.load(flown.angular_velocity), arm))
    if body.motion == DYNAMIC:
        return velocity
    before = vec3.add(vec3.load(start.velocity), vec3.cross(vec3.load(start.angular_velocity), arm))
    return vec3.scale(0.5, vec3.add(before, velocity))


@kernel
def _prepare_moment(bodies, flown, contact, share, row, moment, nodes):
    """Fill the record of a contact's rolling and torsional friction; its row is filled already."""
    moment.rolling = contact.rolling_friction
    moment.torsion = contact.torsional_friction
    prepare_moment(row, moment, nodes)
    if moment.rolling == 0.0 and moment.torsion == 0.0:
        moment.stiffness = 0.0
        moment.scale = 0.0
    spin = vec3.ZERO
    if bodies[contact.body_a].motion != DYNAMIC:
        spin = vec3.sub(spin, vec3.load(flown[contact.body_a].angular_velocity))
    if bodies[contact.body_b].motion != DYNAMIC:
        spin = vec3.add(spin, vec3.load(flown[contact.body_b].angular_velocity))
    vec3.store(moment.prescribed, to_local(row, spin))
    vec3.store(moment.total, vec3.ZERO)
    turn = vec3.ZERO
    if moment.stiffness > 0.0:
        turn = allowed(moment, row.impulse[0], vec3.scale(share, to_local(row, vec3.load(contact.moment))))
    vec3.store(moment.impulse, turn)


@kernel
def prepare_contacts(
    bodies, starts, flown, time_step, substeps, contacts, order, first, last, num_bodies, rows, moments, nodes, index
):
    """Fill the rows of the island's contacts, and their moments where the scene has any.

    Returns what free motion violates (solver/residual.py).
    """
    violation = 0.0
    share = 1.0 / substeps
    for number in range(first, last):
        contact = contacts[order[number]]
        row = rows[number - first]
        handle_a, handle_b = contact.body_a, contact.body_b
        start_a, start_b = starts[handle_a], starts[handle_b]
        flight_a, flight_b = flown[handle_a], flown[handle_b]
        normal = vec3.load(contact.start_normal)
        point = vec3.load(contact.start_position)
        arm_a = vec3.sub(point, vec3.load(start_a.center))
        arm_b = vec3.sub(point, vec3.load(start_b.center))
        t1, t2 = vec3.tangents(normal)
        row.a = row.b = num_bodies
        prescribed = vec3.scale(1.0 / time_step, surface_shift(contact, time_step))
        velocity_a = _velocity_in_flight(bodies[handle_a], start_a, flight_a, arm_a)
        velocity_b = _velocity_in_flight(bodies[handle_b], start_b, flight_b, arm_b)
        free = vec3.add(prescribed, vec3.sub(velocity_b, velocity_a))
        if bodies[handle_a].motion == DYNAMIC:
            row.a = index[RESERVED + handle_a]
        else:
            prescribed = vec3.sub(prescribed, velocity_a)
        if bodies[handle_b].motion == DYNAMIC:
            row.b = index[RESERVED + handle_b]
        else:
            prescribed = vec3.add(prescribed, velocity_b)
        row.friction = contact.friction
        vec3.store(row.normal, normal)
        vec3.store(row.t1, t1)
        vec3.store(row.t2, t2)
        vec3.store(row.arm_a, arm_a)
        vec3.store(row.arm_b, arm_b)
        vec3.store(row.prescribed, to_local(row, prescribed))
        prepare_response(row, nodes)
        moved = vec3.sub(vec3.load(flight_b.center), vec3.load(start_b.center))
        moved = vec3.sub(moved, vec3.sub(vec3.load(flight_a.center), vec3.load(start_a.center)))
        moved = vec3.add(moved, _turn_in_flight(bodies[handle_b], start_b, flight_b, time_step, arm_b))
        moved = vec3.sub(moved, _turn_in_flight(bodies[handle_a], start_a, flight_a, time_step, arm_a))
        moved = vec3.add(moved, surface_shift(contact, time_step))
        gap = contact.start_gap
        swing = contact.free_gap - gap - vec3.dot(normal, moved)
        row.lasting = 1 if contact.persistent == 1 or abs(gap) <= TOUCH * contact.size else 0
        row.gap = gap
        row.bias = 0.0
        row.open = 0.0
        if row.lasting == 0:
            row.gap = gap + swing if gap > 0.0 else gap
            row.open = row.gap
        elif gap > SETTLED * contact.size:
            row.bias = CLOSING * gap / time_step
        impulse = to_local(row, vec3.load(contact.impulse))
        load = max(impulse[0], 0.0) if row.local[0] > 0.0 else 0.0
        slip = math.sqrt(impulse[1] * impulse[1] + impulse[2] * impulse[2])
        ratio = min(1.0, contact.friction * load / slip) if slip > 0.0 else 0.0
        vec3.store(row.impulse, (share * load, share * ratio * impulse[1], share * ratio * impulse[2]))
        vec3.store(row.earlier, vec3.load(row.impulse))
        vec3.store(row.total, vec3.ZERO)
        if moments.shape[0] > 0:
            _prepare_moment(bodies, flown, contact, share, row, moments[number - first], nodes)
        free = to_local(row, free)
        error, _ = law_error(row, vec3.ZERO, (free[0] + max(row.open, 0.0) / time_step + row.bias, free[1], free[2]))
        violation += error
    return math.sqrt(violation)
