"""The step of an island that is too large for the exact tier while it moves (solver/pile.py); order 1.

Geometry is that of the start of the step. A gap that closes within the step is known with the swing of turning bodies:
gap(h) = gap + h n . u + swing, where swing is what the exact flight has beyond the linear motion.
"""

from __future__ import annotations

import math

from ..contacts.prediction import TOUCH, bears_load, surface_shift
from ..jit import kernel
from ..maths import quat, vec3
from ..model import DYNAMIC, LEAST_BODIES, SLACK
from ..solver.pile import SHARE, forget_blows, go_on, law_error, pile_residual, remove_overlap, substep, warm_start
from ..solver.pile_moments import allowed, prepare_moment
from ..solver.pile_response import prepare_response, to_local, to_world
from ..solver.problem import RESERVED
from .bodies import end_orientation, free_spin, set_velocities, turned
from .creep import CLOSING, SETTLED

# Most sweeps of a substep with a blow in an island that is no crowd itself. Fewer: what falls on others is not stopped
# in that substep, and sinks in.
FEW_BODIES_SWEEPS = 12


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


@kernel
def _end_moment(contact, row, moments, number, nodes):
    """The moment of the whole step to the contact and to the sums of its bodies."""
    turn = vec3.ZERO
    if moments.shape[0] > 0:
        turn = to_world(row, vec3.load(moments[number].total))
        node_a, node_b = nodes[row.a], nodes[row.b]
        vec3.store(node_a.moment, vec3.sub(vec3.load(node_a.moment), turn))
        vec3.store(node_b.moment, vec3.add(vec3.load(node_b.moment), turn))
    vec3.store(contact.moment, turn)


@kernel
def end_pile(
    bodies,
    starts,
    flown,
    time_step,
    substeps,
    contacts,
    order,
    first,
    last,
    members,
    first_body,
    last_body,
    rows,
    moments,
    nodes,
    ends,
):
    """Impulses to the contacts, and the island's bodies to the end of the step."""
    for number in range(first, last):
        contact = contacts[order[number]]
        row = rows[number - first]
        impulse = to_world(row, vec3.load(row.total))
        node_a, node_b = nodes[row.a], nodes[row.b]
        vec3.store(node_a.push, vec3.sub(vec3.load(node_a.push), impulse))
        vec3.store(node_b.push, vec3.add(vec3.load(node_b.push), impulse))
        vec3.store(node_a.moment, vec3.sub(vec3.load(node_a.moment), vec3.cross(vec3.load(row.arm_a), impulse)))
        vec3.store(node_b.moment, vec3.add(vec3.load(node_b.moment), vec3.cross(vec3.load(row.arm_b), impulse)))
        vec3.store(contact.impulse, impulse)
        _end_moment(contact, row, moments, number - first, nodes)
        vec3.store(contact.turning, vec3.ZERO)
        vec3.store(contact.creep, vec3.ZERO)
        contact.sticks = 0
        # Where it is at the end follows from the geometry of the start (prediction.measure_end).
        vec3.store(contact.end_position, vec3.load(contact.start_position))
        vec3.store(contact.end_normal, vec3.load(contact.start_normal))
        contact.end_gap = contact.start_gap + vec3.dot(
            vec3.load(contact.start_normal), surface_shift(contact, time_step)
        )
    for number in range(first_body, last_body):
        handle = members[number]
        node = nodes[number - first_body]
        end = ends[handle]
        flight = flown[handle]
        start = starts[handle]
        body = bodies[handle]
        spin = vec3.add_scaled(vec3.load(start.angular_velocity), 0.5 * (substeps + 1), vec3.load(node.spin_gain))
        turn = vec3.sub(vec3.load(node.turned), vec3.scale(time_step, spin))
        p, l = node.push, node.moment
        quat.store(end.orientation, end_orientation(body, start, flight, vec3.load(l), turn, time_step))
        vec3.store(end.center, vec3.add(vec3.load(start.center), vec3.load(node.moved)))
        set_velocities(body, flight, (p[0], p[1], p[2], l[0], l[1], l[2]), end)


@kernel
def _rests(contacts, order, first, last):
    """Whether all contacts that bear load touch, and none has a gap or a creep to make good."""
    for number in range(first, last):
        contact = contacts[order[number]]
        if contact.persistent == 1:
            squares = contact.start_gap**2 + vec3.norm_squared(vec3.load(contact.creep))
            if squares > (SETTLED * contact.size) ** 2:
                return False
        elif bears_load(contact):
            return False
    return True


@kernel
def certify_pile_island(
    bodies, starts, flown, time_step, contacts, order, first, last, members, first_body, last_body, rows, moments,
    nodes, index, ends, tolerance,
):  # fmt: skip
    """Where the impulses of the last step solve this one and nothing moves: the island's bodies to the end of the step.

    Returns the residual, or -1 if that is more than ``tolerance`` and nothing was changed.
    """
    if not _rests(contacts, order, first, last):
        return -1.0
    num_contacts = last - first
    num_bodies = last_body - first_body
    prepare_bodies(bodies, starts, flown, time_step, members, first_body, last_body, 1, nodes, index)
    violation = prepare_contacts(
        bodies, starts, flown, time_step, 1, contacts, order, first, last, num_bodies, rows, moments, nodes, index
    )
    warm_start(rows, moments, nodes, num_contacts, num_bodies)
    for number in range(num_contacts):
        row = rows[number]
        row.bias = max(row.open, 0.0) / time_step
        vec3.store(row.total, vec3.load(row.impulse))
        if moments.shape[0] > 0:
            vec3.store(moments[number].total, vec3.load(moments[number].impulse))
    residual = pile_residual(rows, moments, nodes, num_contacts, violation)
    if not residual <= tolerance:
        return -1.0
    for number in range(first_body, last_body):
        handle = members[number]
        node = nodes[number - first_body]
        start, end, flight = starts[handle], ends[handle], flown[handle]
        # The trapezoid of velocities that are zero but for round-off, as in lasting.py.
        velocity = vec3.scale(0.5, vec3.add(vec3.load(start.velocity), vec3.load(node.velocity)))
        spin = vec3.scale(0.5, vec3.add(vec3.load(start.angular_velocity), vec3.load(node.spin)))
        vec3.store(end.center, vec3.add_scaled(vec3.load(start.center), time_step, velocity))
        quat.store(end.orientation, turned(quat.load(start.orientation), vec3.scale(time_step, spin)))
        vec3.store(end.velocity, vec3.load(node.velocity))
        vec3.store(end.angular_velocity, vec3.load(node.spin))
        vec3.store(end.angular_momentum, vec3.load(flight.angular_momentum))
    for number in range(first, last):
        contact = contacts[order[number]]
        vec3.store(contact.impulse, to_world(rows[number - first], vec3.load(rows[number - first].total)))
        if moments.shape[0] > 0:
            vec3.store(contact.moment, to_world(rows[number - first], vec3.load(moments[number - first].total)))
        vec3.store(contact.turning, vec3.ZERO)
        contact.sticks = contact.stuck
        # ``position``, ``normal`` and ``gap`` are those of the start, and nothing has moved.
    return residual


@kernel
def step_pile_island(
    bodies, starts, flown, time_step, substeps, contacts, order, first, last, members, first_body, last_body,
    rows, moments, nodes, index, ends,
):  # fmt: skip
    """Advance the bodies of one island to the end of the step; return the residual of their contacts."""
    num_contacts = last - first
    num_bodies = last_body - first_body
    prepare_bodies(bodies, starts, flown, time_step, members, first_body, last_body, substeps, nodes, index)
    violation = prepare_contacts(
        bodies, starts, flown, time_step, substeps, contacts, order, first, last, num_bodies, rows, moments, nodes,
        index,
    )  # fmt: skip
    warm_start(rows, moments, nodes, num_contacts, num_bodies)
    few = num_bodies < LEAST_BODIES
    most_sweeps = FEW_BODIES_SWEEPS if few else 1
    for number in range(substeps):
        if number > 0:
            go_on(nodes, num_bodies)
            if few:
                forget_blows(rows, nodes, num_contacts)
        substep(rows, moments, nodes, num_contacts, num_bodies, time_step / substeps, most_sweeps)
    size = math.inf
    for number in range(first, last):
        size = min(size, contacts[order[number]].size)
    residual = pile_residual(rows, moments, nodes, num_contacts, violation)
    remove_overlap(rows, nodes, num_contacts, time_step, SLACK * size, 1.0 if few else SHARE)
    end_pile(
        bodies, starts, flown, time_step, substeps, contacts, order, first, last, members, first_body, last_body,
        rows, moments, nodes, ends,
    )  # fmt: skip
    return residual
