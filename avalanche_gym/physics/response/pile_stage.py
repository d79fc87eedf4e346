"""The stage of the pile tier, and which islands go there."""

from __future__ import annotations

import numpy as np

from ..contacts.prediction import measure_end
from ..jit import kernel, stage
from ..memory import bodies_of, header_at, report_of, starts_of, table, workspace_at
from ..model import BODY_STATE, CONTACT, TO_IMPACT
from ..solver.pile_memory import CROWD, LEAST_BODIES, PILE_NODE, PILE_ROW
from .pile import step_pile_island

# Name of the tier in the report (report.METHODS).
PILE = 5


@kernel
def _entry(address, number):
    return table(address + 8 * number, 1, np.int64)[0]


@stage
def step_pile(address, workspace_address, world, island):
    """Advance one island by the pile tier, if it is for that; return 1 if so, 0 if the exact tier is to do it."""
    header = header_at(address)
    workspace = workspace_at(workspace_address)
    first_body = _entry(workspace.body_starts, island)
    last_body = _entry(workspace.body_starts, island + 1)
    if last_body - first_body < LEAST_BODIES or header.moments == 1 or workspace.span != header.time_step or workspace.part == TO_IMPACT:
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
    nodes = table(workspace.pile_nodes, workspace.pile_nodes_size, PILE_NODE)
    index = table(workspace.solver_index, workspace.solver_index_size, np.int64)
    residual = step_pile_island(
        bodies, starts, flown, workspace.span, header.substeps, contacts, order, first, last, members, first_body,
        last_body, rows, nodes, index, ends,
    )  # fmt: skip
    worst = measure_end(starts, ends, contacts, order, first, last)
    table(workspace.waits, workspace.waits_size, np.int64)[island] = CROWD
    report = report_of(header, world)
    report.residual = max(report.residual, residual)
    report.iterations += header.substeps
    report.method = max(report.method, PILE)
    report.penetration = max(report.penetration, worst)
    return 1
