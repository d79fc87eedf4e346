"""Solving what one island has prepared: a stage, and how its answer is kept."""

from __future__ import annotations

import numpy as np

from ..jit import call_stage, kernel, stage
from ..memory import bodies_of, header_at, report_of, rest_of, table, traits_of, workspace_at
from ..model import BODY_STATE, CONTACT
from ..solver.exact import NEEDS_MEMORY, keep_impulses, keep_moments, solve_rows
from ..solver.problem import prepare_moments, prepare_nodes, prepare_rows
from ..solver.workspace import NODE, ROW
from .pile_stage import GOOD

# What became of an island in the exact tier.
FULL, SOLVED, GAVE_UP, STRIKES = 0, 1, 2, 3


@kernel
def solver_memory(workspace):
    """The four arrays of solver/workspace.py."""
    return (
        table(workspace.solver_rows, workspace.solver_rows_size, ROW),
        table(workspace.solver_nodes, workspace.solver_nodes_size, NODE),
        table(workspace.solver_blocks, (workspace.solver_blocks_size // 36, 36), np.float64),
        table(workspace.solver_index, workspace.solver_index_size, np.int64),
    )


@stage
def solve_problem(address, workspace_address, num_contacts, num_bodies):
    """Solve the contact problem that lies prepared in the workspace, to its ``tolerance``; return the method.

    A stage, because it is large and serves velocities and positions.
    """
    header = header_at(address)
    workspace = workspace_at(workspace_address)
    rows, nodes, blocks, index = solver_memory(workspace)
    residual, iterations, method = solve_rows(
        num_contacts,
        num_bodies,
        header.num_bodies,
        workspace.tolerance,
        workspace.budget,
        rows,
        nodes,
        blocks,
        index,
    )
    workspace.residual = residual
    workspace.iterations = iterations
    return method


@kernel
def solve_velocities(address, workspace_address, world, listed, own, first_body, last_body):
    """Solve the velocities of one island about ``working``; SOLVED, FULL or GAVE_UP, as in _step_exactly.

    ``own`` contacts have a part in it, their numbers are at the address ``listed``.
    """
    header = header_at(address)
    workspace = workspace_at(workspace_address)
    rows, nodes, _, index = solver_memory(workspace)
    bodies = bodies_of(header, world)
    working = table(workspace.working, header.num_bodies, BODY_STATE)
    contacts = table(workspace.contacts, workspace.contacts_size, CONTACT)
    num_bodies = last_body - first_body
    # Tables of the island's own part: a slice of an array would count references to it.
    order = table(listed, own, np.int64)
    members = table(workspace.island_bodies + 8 * first_body, num_bodies, np.int64)
    prepare_nodes(bodies, working, members, num_bodies, nodes, index)
    prepare_rows(contacts, order, own, bodies, working, num_bodies, rows, nodes, index)
    num_rows = own
    if traits_of(header, world).moments == 1:
        num_rows = prepare_moments(contacts, order, own, working, rows, nodes)
    workspace.tolerance = header.tolerance
    method = call_stage(header.solve_problem, address, workspace_address, num_rows, num_bodies)
    if method == NEEDS_MEMORY:
        return FULL
    report = report_of(header, world)
    report.iterations += workspace.iterations
    rest_of(header, world)[members[0]].residual = workspace.residual
    if workspace.budget < header.max_iterations and workspace.residual > max(header.tolerance, GOOD):
        return GAVE_UP
    keep_impulses(contacts, order, 0, own, rows)
    keep_moments(contacts, order, 0, rows, own, num_rows)
    report.residual = max(report.residual, workspace.residual)
    report.method = max(report.method, method)
    return SOLVED
