"""Impacts at one instant: velocities jump, places stay.

All contacts of one pair of bodies are one impact, resolved at once by Poisson's hypothesis: a compression that ends
where nothing approaches, under the full contact law,

    u_1 = u_0 + W R,    law(R, u_1),

and an expansion that returns a share e of each normal impulse (solver/expansion.py). Pairs follow one another in the
order of their speed of approach, those that approach equally fast together, until nothing approaches that would bounce;
what then still approaches is stopped at once, without bouncing. So a row of balls hands a blow from one to the next,
and a box that falls flat rebounds flat.

Neither part may gain energy. Compression loses by its law. That of the expansion is scaled down if, with friction, it
would give back more than the compression took (Glocker 2013 shows that it can): with s the share of its impulses r,

    E(s) = sum R . (u_0 + u_1) / 2 + s sum r . u_1 + s^2 sum r . (u_2 - u_1) / 2 <= 0.

An endless sequence of ever lower rebounds (Zeno) ends by rule: flights after a rebound with velocity e v under an
acceleration a add up to 2 e v / (a (1 - e)). If what is left of the step holds them all, the body is at rest before its
end, and the impact is taken without rebound: the impulses of all the rebounds and those of lying there are the same
sum.
"""

from __future__ import annotations

import math

import numpy as np

from ..contacts.prediction import OVERLAP, TOUCH, rebounds
from ..integrator.momentum import momentum_of, store_momentum
from ..jit import call_stage, kernel, stage
from ..maths import quat, vec3
from ..memory import bodies_of, header_at, report_of, starts_of, table, traits_of, workspace_at
from ..model import BOUNCED, CONTACT, FLOW_SYMMETRIC, FLOW_TRIAXIAL, LOSSLESS, NO_ROOM, STOPPED, UNTOUCHED
from ..solver.exact import NEEDS_MEMORY
from ..solver.expansion import expand
from ..solver.problem import prepare_moments, prepare_nodes, prepare_rows
from ..solver.response import clear, relative_velocity
from ..solver.workspace import NODE, ROW

# Pairs whose speeds of approach differ by less than this share meet at the same instant.
TIE = 1e-9
# Rounds of impacts at one instant, for each contact of the island; a chain of n balls takes about n^2 / 2.
ROUNDS_PER_CONTACT = 64


@kernel
def _approach(contact, states):
    """Normal velocity [m/s] of a contact, negative if its bodies approach."""
    point = vec3.load(contact.position)
    a = states[contact.body_a]
    b = states[contact.body_b]
    at_a = vec3.cross(vec3.load(a.angular_velocity), vec3.sub(point, vec3.load(a.center)))
    at_b = vec3.cross(vec3.load(b.angular_velocity), vec3.sub(point, vec3.load(b.center)))
    relative = vec3.sub(vec3.add(vec3.load(b.velocity), at_b), vec3.add(vec3.load(a.velocity), at_a))
    return vec3.dot(vec3.load(contact.normal), vec3.add(relative, vec3.load(contact.surface_velocity)))


@kernel
def _share(contact, approach, left, time_step):
    """The coefficient of restitution at work: 0 where no rebound would be seen at the end of the step."""
    if not rebounds(contact, approach, left, time_step):
        return 0.0
    e = contact.restitution
    pressing = (contact.approach - contact.free) / left if left > 0.0 else 0.0
    return 0.0 if -2.0 * e * approach <= pressing * (1.0 - e) * left else e


@kernel
def _choose(contacts, states, order, first, last, left, time_step):
    """Sort the contacts order[first:last] of the next impact to the front; return their number, 0 if none is left.

    ``bias`` of each chosen contact becomes its coefficient of restitution.
    """
    fastest = 0.0
    bounces = False
    start = first
    while start < last:
        # Contacts of a pair of bodies lie together. Each notes the speed of its pair in ``free_gap``.
        end = start
        speed = 0.0
        while end < last and _same_bodies(contacts[order[start]], contacts[order[end]]):
            contact = contacts[order[end]]
            approach = _approach(contact, states)
            if -approach * time_step > OVERLAP * contact.size:
                speed = max(speed, -approach)
                bounces = bounces or _share(contact, approach, left, time_step) > 0.0
            end += 1
        for index in range(start, end):
            contacts[order[index]].free_gap = speed
        fastest = max(fastest, speed)
        start = end
    if not bounces:
        return 0
    chosen = first
    for index in range(first, last):
        number = order[index]
        contact = contacts[number]
        if contact.free_gap >= fastest * (1.0 - TIE):
            contact.bias = _share(contact, -contact.free_gap, left, time_step)
            for place in range(index, chosen, -1):
                order[place] = order[place - 1]
            order[chosen] = number
            chosen += 1
    return chosen - first


@kernel
def _same_bodies(one, other):
    return one.body_a == other.body_a and one.body_b == other.body_b


@kernel
def _add(bodies, states, nodes, members, num_bodies, share):
    """Add the velocities of the nodes to the bodies."""
    for number in range(num_bodies):
        handle = members[number]
        state = states[handle]
        node = nodes[number]
        vec3.store(state.velocity, vec3.add_scaled(vec3.load(state.velocity), share, vec3.load(node.linear)))
        turn = vec3.load(node.angular)
        if vec3.norm_squared(turn) > 0.0:
            spin = vec3.add_scaled(vec3.load(state.angular_velocity), share, turn)
            flow = bodies[handle].flow
            vec3.store(state.angular_velocity, spin)
            if flow == FLOW_SYMMETRIC or flow == FLOW_TRIAXIAL:
                momentum = momentum_of(quat.load(state.orientation), spin, vec3.load(bodies[handle].inertia))
                store_momentum(state, momentum)


@kernel
def _work(rows, nodes, count):
    """(sum r . u, sum r . Gy) of ``count`` rows: u the velocity before their impulses, Gy what these change."""
    before = 0.0
    change = 0.0
    for index in range(count):
        impulse = vec3.load(rows[index].impulse)
        before += vec3.dot(impulse, vec3.load(rows[index].free))
        change += vec3.dot(impulse, relative_velocity(rows[index], nodes))
    return before, change


@kernel
def _note(contacts, order, first, count, rows, share):
    for index in range(count):
        contact = contacts[order[first + index]]
        blow = vec3.add_scaled(vec3.load(contact.blow), share, vec3.load(rows[index].impulse))
        vec3.store(contact.blow, blow)


@kernel
def _impact(address, workspace_address, world, order, first, count, members, num_bodies, poisson):
    """Resolve contacts order[first : first + count] at once; return False if the solver needs more memory."""
    header = header_at(address)
    workspace = workspace_at(workspace_address)
    bodies = bodies_of(header, world)
    states = starts_of(header, workspace)
    contacts = table(workspace.contacts, workspace.contacts_size, CONTACT)
    rows = table(workspace.solver_rows, workspace.solver_rows_size, ROW)
    nodes = table(workspace.solver_nodes, workspace.solver_nodes_size, NODE)
    index = table(workspace.solver_index, workspace.solver_index_size, np.int64)
    for number in range(first, first + count):
        contact = contacts[order[number]]
        if not poisson:
            contact.bias = 0.0
        # What prepare_rows reads and an instant does not have: kept and put back.
        contact.free_gap = contact.bias
        contact.bias = 0.0
        vec3.store(contact.turning, vec3.ZERO)
    prepare_nodes(bodies, states, members, num_bodies, nodes, index)
    prepare_rows(contacts, order[first:], count, bodies, states, num_bodies, rows, nodes, index)
    num_rows = count
    if traits_of(header, world).moments == 1:
        num_rows = prepare_moments(contacts, order[first:], count, states, rows, nodes)
    for number in range(num_rows):
        vec3.store(rows[number].impulse, vec3.ZERO)
    workspace.tolerance = header.tolerance
    method = call_stage(header.solve_problem, address, workspace_address, num_rows, num_bodies)
    if method == NEEDS_MEMORY:
        return False
    report = report_of(header, world)
    report.residual = max(report.residual, workspace.residual)
    report.iterations += workspace.iterations
    report.method = max(report.method, method)
    _add(bodies, states, nodes, members, num_bodies, 1.0)
    _note(contacts, order, first, count, rows, 1.0)
    before, change = _work(rows, nodes, num_rows)
    lost = before + 0.5 * change
    bounces = False
    for number in range(count):
        row = rows[number]
        normal = vec3.load(row.normal)
        vec3.store(row.free, vec3.add(vec3.load(row.free), relative_velocity(row, nodes)))
        e = contacts[order[first + number]].free_gap
        load = max(e * vec3.dot(vec3.load(row.impulse), normal), 0.0)
        bounces = bounces or load > 0.0
        vec3.store(row.impulse, vec3.scale(load, normal))
    if bounces:
        clear(nodes, num_bodies + 1)
        expand(rows, nodes, count)
        before, change = _work(rows, nodes, count)
        share = 1.0
        if lost + before + 0.5 * change > 0.0 and change > 0.0:
            share = (-before + math.sqrt(max(before * before - 2.0 * change * lost, 0.0))) / change
            share = min(max(share, 0.0), 1.0)
        _add(bodies, states, nodes, members, num_bodies, share)
        _note(contacts, order, first, count, rows, share)
    return True


@stage
def strike(address, workspace_address, world):
    """Resolve the impacts of all islands at the present places (``starts``).

    Returns NO_ROOM if the solver needs more memory, BOUNCED if anything did, LOSSLESS if all did with a restitution of
    1, STOPPED if what approached was stopped, UNTOUCHED if nothing approached. ``sort_contacts`` has sorted the
    contacts, for a part of the step as long as what is left of it.
    """
    header = header_at(address)
    workspace = workspace_at(workspace_address)
    states = starts_of(header, workspace)
    contacts = table(workspace.contacts, workspace.contacts_size, CONTACT)
    order = table(workspace.order, workspace.order_size, np.int64)
    starts = table(workspace.island_starts, workspace.island_starts_size, np.int64)
    body_starts = table(workspace.body_starts, workspace.body_starts_size, np.int64)
    island_bodies = table(workspace.island_bodies, workspace.island_bodies_size, np.int64)
    left = workspace.span
    time_step = header.time_step
    outcome = UNTOUCHED
    loses = False
    for island in range(workspace.num_islands):
        first = starts[island]
        last = _touching_first(contacts, order, first, starts[island + 1])
        members = island_bodies[body_starts[island] :]
        num_bodies = body_starts[island + 1] - body_starts[island]
        for _ in range(ROUNDS_PER_CONTACT * (last - first)):
            count = _choose(contacts, states, order, first, last, left, time_step)
            if count == 0:
                break
            outcome = BOUNCED
            for index in range(first, first + count):
                loses = loses or contacts[order[index]].bias < 1.0
            if not _impact(address, workspace_address, world, order, first, count, members, num_bodies, True):
                return NO_ROOM
            _by_bodies(contacts, order, first, last)
        approaches = False
        for index in range(first, last):
            contact = contacts[order[index]]
            approaches = approaches or -_approach(contact, states) * time_step > OVERLAP * contact.size
        if approaches:
            outcome = max(outcome, STOPPED)
            loses = True
            if not _impact(address, workspace_address, world, order, first, last - first, members, num_bodies, False):
                return NO_ROOM
    return LOSSLESS if outcome == BOUNCED and not loses else outcome


@kernel
def _touching_first(contacts, order, first, last):
    """Sort the contacts that touch to the front, else in their order; return where they end."""
    end = first
    for index in range(first, last):
        number = order[index]
        contact = contacts[number]
        if contact.gap <= (TOUCH if contact.persistent == 1 else OVERLAP) * contact.size:
            for place in range(index, end, -1):
                order[place] = order[place - 1]
            order[end] = number
            end += 1
    return end


@kernel
def _by_bodies(contacts, order, first, last):
    """Back to the order in which contacts were found, where those of a pair of bodies lie together."""
    for index in range(first + 1, last):
        number = order[index]
        place = index
        while place > first and order[place - 1] > number:
            order[place] = order[place - 1]
            place -= 1
        order[place] = number
