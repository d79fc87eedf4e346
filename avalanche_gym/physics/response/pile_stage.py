"""The stage of the pile tier, and which islands of a crowd go there.

Where contacts close, jam and part, an exact solution costs five to a hundred times what sweeps do, and where they last,
one factorisation. What closes does so at the end of the step for the exact tier and in a substep for this one; both are
of order 1, and what meets at half a metre a second ends as near to where small steps lead (what is much faster, less
near). So an island that is struck comes here at once. For others what it was tells what it will be: the exact tier is
tried on an island that is hardly moving, or whose bodies touch in few rings (a stack or a chain costs it no more than
its length), for as many factorisations as a warm start takes. If that does not solve it the pile tier steps the island,
and the exact tier waits twice as long before it is tried again. A body alone has few contacts and no chain of bodies to
be jammed in: it is solved exactly.
"""

from __future__ import annotations

import math

import numpy as np

from ..contacts.located import any_crosses
from ..contacts.prediction import measure_end
from ..contacts.turning import any_outruns
from ..jit import kernel, stage
from ..maths import vec3
from ..memory import bodies_of, fields_of, header_at, report_of, rest_of, starts_of, table, traits_of, workspace_at
from ..model import BODY_STATE, CONTACT, CROWD, DYNAMIC, LONGEST_PAUSE, MOST_FOLLOWED, TO_IMPACT
from ..solver.exact import CERTIFIED, WARM_BUDGET
from ..solver.pile_memory import PILE_MOMENT, PILE_NODE, PILE_ROW
from .pile import certify_pile_island, step_pile_island
from .stillness import let_rest

# Islands of so many bodies may come here.
LEAST_TOUCHING = 2
# Rings of touching bodies, as a share of their number, above which an island is no chain.
RINGS = 0.25
# Above so many rings a factorisation would be too dear (some 0.1 s).
MOST_RINGS = 600
# A body that moves by less than this fraction of its size in a step hardly moves.
QUIET = 1e-4
# Residual at which the exact tier has done what it can, whatever was asked for.
GOOD = 1e-9
# Name of the tier in the report (report.METHODS).
PILE = 5


@kernel
def _entry(address, number):
    return table(address + 8 * number, 1, np.int64)[0]


@kernel
def _count_rings(bodies, contacts, order, first, last, num_bodies):
    """Independent rings of dynamic bodies that touch; -1 if one of the contacts bounces."""
    edges = 0
    a = np.int64(-1)
    b = np.int64(-1)
    for index in range(first, last):
        contact = contacts[order[index]]
        if contact.restitution > 0.0:
            return -1
        if contact.body_a != a or contact.body_b != b:
            a = contact.body_a
            b = contact.body_b
            if bodies[a].motion == DYNAMIC and bodies[b].motion == DYNAMIC:
                edges += 1
    return edges - num_bodies + 1


@kernel
def _hardly_moves(bodies, starts, time_step, members, first_body, last_body):
    for index in range(first_body, last_body):
        state = starts[members[index]]
        size = bodies[members[index]].size
        speed = math.sqrt(vec3.norm_squared(vec3.load(state.velocity)))
        speed += size * math.sqrt(vec3.norm_squared(vec3.load(state.angular_velocity)))
        if not time_step * speed <= QUIET * size:
            return False
    return True


@kernel
def _any_loaded(contacts, order, first, last):
    """Whether a contact brings an impulse along. Without, what stands there was placed, and may need all it takes."""
    loaded = False
    for index in range(first, last):
        loaded = loaded or vec3.norm_squared(vec3.load(contacts[order[index]].impulse)) > 0.0
    return loaded


@kernel
def _exact_is_due(memory, tolerance):
    """Whether the exact tier is to try an island now; ``memory`` is the REST record of its first body."""
    if memory.tried == 1:
        memory.tried = 0
        memory.pause = 0 if memory.residual <= max(tolerance, GOOD) else min(2 * memory.pause + 1, LONGEST_PAUSE)
        memory.wait = memory.pause
    if memory.wait > 0:
        memory.wait -= 1
        return False
    memory.tried = 1
    return True


@stage
def step_pile(address, workspace_address, world, island, struck):
    """Advance one island by the pile tier, if it is for that; return 1 if so, 0 if the exact tier is to do it.

    ``struck``: 1 if a contact closes at the start of the step.
    """
    header = header_at(address)
    workspace = workspace_at(workspace_address)
    first_body = _entry(workspace.body_starts, island)
    last_body = _entry(workspace.body_starts, island + 1)
    if last_body - first_body < LEAST_TOUCHING:
        return 0
    if workspace.part == TO_IMPACT or workspace.span != header.time_step:
        return 0
    first = _entry(workspace.island_starts, island)
    last = _entry(workspace.island_starts, island + 1)
    bodies = bodies_of(header, world)
    starts = starts_of(header, workspace)
    flown = table(workspace.flown, header.num_bodies, BODY_STATE)
    ends = table(workspace.ends, header.num_bodies, BODY_STATE)
    contacts = table(workspace.contacts, workspace.contacts_size, CONTACT)
    order = table(workspace.order, workspace.order_size, np.int64)
    members = table(workspace.island_bodies, workspace.island_bodies_size, np.int64)
    rows = table(workspace.pile_rows, workspace.pile_rows_size, PILE_ROW)
    num_moments = workspace.pile_moments_size if traits_of(header, world).moments == 1 else 0
    moments = table(workspace.pile_moments, num_moments, PILE_MOMENT)
    nodes = table(workspace.pile_nodes, workspace.pile_nodes_size, PILE_NODE)
    index = table(workspace.solver_index, workspace.solver_index_size, np.int64)
    num_bodies = last_body - first_body
    if num_bodies <= MOST_FOLLOWED and (
        any_crosses(contacts, order, first, last)
        or any_outruns(bodies, starts, members, first_body, last_body, workspace.span)
    ):
        return 0
    rings = _count_rings(bodies, contacts, order, first, last, num_bodies)
    if rings < 0:
        return 0
    report = report_of(header, world)
    memory = rest_of(header, world)[members[first_body]]
    quiet = rings <= MOST_RINGS and _hardly_moves(bodies, starts, workspace.span, members, first_body, last_body)
    if quiet:
        residual = certify_pile_island(
            bodies, starts, flown, workspace.span, contacts, order, first, last, members, first_body, last_body, rows,
            moments, nodes, index, ends, CERTIFIED * header.tolerance,
        )  # fmt: skip
        if residual >= 0.0:
            sums = table(workspace.sums, (header.num_bodies, 6), np.float64)
            let_rest(
                bodies, starts, header.tolerance, contacts, order, first, last, sums, members, first_body, last_body,
                ends,
            )  # fmt: skip
            table(workspace.waits, workspace.waits_size, np.int64)[island] = CROWD
            report.residual = max(report.residual, residual)
            return 1
    if struck == 0 and (quiet or rings < RINGS * num_bodies) and _exact_is_due(memory, header.tolerance):
        workspace.budget = header.max_iterations
        if not quiet or _any_loaded(contacts, order, first, last):
            workspace.budget = min(WARM_BUDGET, header.max_iterations)
        return 0
    residual = step_pile_island(
        bodies, fields_of(header), starts, flown, workspace.span, header.substeps, contacts, order, first, last,
        members, first_body, last_body, rows, moments, nodes, index, ends,
    )  # fmt: skip
    worst = measure_end(starts, ends, contacts, order, first, last)
    table(workspace.waits, workspace.waits_size, np.int64)[island] = CROWD
    report.residual = max(report.residual, residual)
    report.iterations += header.substeps
    report.method = max(report.method, PILE)
    report.penetration = max(report.penetration, worst)
    return 1
