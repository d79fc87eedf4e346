"""The step of an island that is too large for the exact tier while it moves (solver/pile.py); order 1."""

from __future__ import annotations

import math

from ..contacts.kinematics import surface_shift
from ..contacts.prediction import bears_load
from ..jit import kernel
from ..maths import quat, vec3
from ..model import LEAST_BODIES, SLACK
from ..solver.pile import SHARE, forget_blows, go_on, pile_residual, remove_overlap, substep, warm_start
from ..solver.pile_response import to_world
from .bodies import end_orientation, set_velocities, turned
from .creep import SETTLED
from .energy import is_alone
from .pile_energy import give_no_energy
from .pile_preparation import prepare_bodies, prepare_contacts

# Most sweeps of a substep with a blow in an island that is no crowd itself. Fewer: what falls on others is not stopped
# in that substep, and sinks in.
FEW_BODIES_SWEEPS = 12
# A crowd of n bodies is taken for a heap of so many times n^(1/3) layers, and a sweep may carry loads on by no more
# than one of them. Fewer sweeps than layers in a step: deep heaps that fall are never caught, and sink as fast as they
# are pushed apart.
LAYERS = 1.5


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
def _most_sweeps(num_bodies, substeps):
    """Sweeps that a substep may take."""
    if num_bodies < LEAST_BODIES:
        return FEW_BODIES_SWEEPS
    return 1 + int(LAYERS * num_bodies ** (1.0 / 3.0) / substeps)


@kernel
def step_pile_island(
    bodies, fields, starts, flown, time_step, substeps, contacts, order, first, last, members, first_body, last_body,
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
    most_sweeps = _most_sweeps(num_bodies, substeps)
    for number in range(substeps):
        if number > 0:
            go_on(nodes, num_bodies)
            if few:
                forget_blows(rows, nodes, num_contacts)
        substep(rows, moments, nodes, num_contacts, num_bodies, time_step / substeps, most_sweeps, few)
    size = math.inf
    for number in range(first, last):
        size = min(size, contacts[order[number]].size)
    if is_alone(bodies, starts, contacts, order, first, last, members, first_body, last_body):
        give_no_energy(
            bodies, fields, starts, flown, time_step, members, first_body, last_body, rows, moments, nodes, num_contacts
        )
    residual = pile_residual(rows, moments, nodes, num_contacts, violation)
    remove_overlap(rows, nodes, num_contacts, time_step, SLACK * size, 1.0 if few else SHARE)
    end_pile(
        bodies, starts, flown, time_step, substeps, contacts, order, first, last, members, first_body, last_body,
        rows, moments, nodes, ends,
    )  # fmt: skip
    return residual
