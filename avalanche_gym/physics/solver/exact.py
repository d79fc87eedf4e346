"""The exact tier: certificate, then Newton, then Newton with sweeps between; the best impulses seen are returned.

How to call it, once an island and step, after every body has its free velocity:

    workspace = Workspace(max_contacts, max_bodies)          # one a thread; solver/workspace.py
    rows, nodes, blocks, index = workspace.arrays

    residual, iterations, method = solve_island(
        contacts,          # (capacity,) model.CONTACT of one world
        order,             # int64; order[:num_contacts] are the indices of this island's contacts
        num_contacts,
        bodies,            # (bodies,) model.BODY of that world
        states,            # (bodies,) model.BODY_STATE of that world
        island_bodies,     # int64; island_bodies[:num_bodies] are the handles of this island's dynamic bodies
        num_bodies,
        tolerance,         # relative residual to reach, e.g. 1e-12
        max_iterations,    # most factorisations, e.g. 60
        rows, nodes, blocks, index,
    )

It reads of a contact: position, normal, impulse (warm start), friction, bias, surface_velocity, body_a, body_b; it writes
``impulse`` of the contacts and ``velocity`` and ``angular_velocity`` of the island's bodies. If ``method`` is NEEDS_MEMORY
nothing was written: leave the kernels, call ``workspace.grow()``, and repeat the call with the new arrays.

Every dynamic body of the island's contacts must be among ``island_bodies``. A contact between two bodies that are not
dynamic gets a zero impulse. An island without contacts may be passed.
"""

from __future__ import annotations

import math

from ..jit import kernel
from ..maths import vec3
from .assembly import SCRATCH_BLOCKS
from .elimination import eliminate
from .gauss_seidel import prepare_local, sweep
from .newton import keep_best, newton, restore_best
from .problem import prepare_nodes, prepare_rows
from .residual import evaluate, free_violation

# How an island was solved; the larger, the farther down the chain.
NEEDS_MEMORY, CERTIFICATE, SINGLE, NEWTON, NEWTON_SWEEPS, SWEEPS = -1, 0, 1, 2, 3, 4

# Stage 1, from the warm start: the weight makes the first step the solution if no contact changes its status.
WARM_DELTA, WARM_BUDGET = 1e-6, 12
# Stage 2, from the best so far: heavily damped, and up to ROUNDS restarts after sweeps, with rho varied.
DAMPED_DELTA, ROUNDS, SWEEPS_PER_ROUND = 0.1, 3, 5
# Above so many 6 x 6 block products a factorisation is not worth its time (0.1 us each); sweeps take over.
MOST_PRODUCTS = 200_000
# Sweeps for such islands.
MOST_SWEEPS = 200


@kernel
def write_solution(contacts, order, num_contacts, states, island_bodies, num_bodies, rows, nodes):
    """Impulses to the contacts, changes of velocity to the bodies."""
    for i in range(num_contacts):
        vec3.store(contacts[order[i]].impulse, vec3.load(rows[i].impulse))
    for i in range(num_bodies):
        state = states[island_bodies[i]]
        vec3.store(state.velocity, vec3.add(vec3.load(state.velocity), vec3.load(nodes[i].linear)))
        spin = vec3.add(vec3.load(state.angular_velocity), vec3.load(nodes[i].angular))
        vec3.store(state.angular_velocity, spin)


@kernel
def solve_rows(num_contacts, num_bodies, num_handles, tolerance, max_iterations, rows, nodes, blocks, index):
    """Solve the prepared problem. On return ``rows.impulse`` and the nodes' velocities are those of the best iterate.

    Returns:
        residual, iterations (factorisations and sweeps), method.
    """
    violation = free_violation(rows, num_contacts)
    if violation == 0.0:
        for i in range(num_contacts):
            vec3.store(rows[i].impulse, vec3.ZERO)
    residual, noise = evaluate(rows, nodes, num_contacts, num_bodies, violation)
    if residual <= max(tolerance, noise):
        return residual, 0, CERTIFICATE
    keep_best(rows, num_contacts)
    best = residual
    spent = 0
    method = NEWTON
    if num_contacts == 1:
        prepare_local(rows, nodes, num_contacts)
        sweep(rows, nodes, num_contacts)
        residual, noise = evaluate(rows, nodes, num_contacts, num_bodies, violation)
        return residual, 1, SINGLE
    slots, products = eliminate(rows, num_contacts, num_bodies, num_handles, index)
    index[0] = num_bodies + 2 * max(slots, 0) + SCRATCH_BLOCKS
    if slots < 0 or index[0] > len(blocks):
        return math.inf, 0, NEEDS_MEMORY
    if products > MOST_PRODUCTS:
        prepare_local(rows, nodes, num_contacts)
        for k in range(MOST_SWEEPS):
            sweep(rows, nodes, num_contacts)
            spent += 1
            if k % 10 == 9:
                residual, noise = evaluate(rows, nodes, num_contacts, num_bodies, violation)
                if residual < best:
                    best = residual
                    keep_best(rows, num_contacts)
                if residual <= max(tolerance, noise):
                    break
        method = SWEEPS
    else:
        best, used = newton(
            rows, nodes, blocks, index, num_contacts, num_bodies, num_handles, slots, violation, tolerance,
            residual, best, 1.0, WARM_DELTA, min(WARM_BUDGET, max_iterations),
        )
        spent += used
        factor = 1.0
        for k in range(ROUNDS + 1):
            restore_best(rows, num_contacts)
            residual, noise = evaluate(rows, nodes, num_contacts, num_bodies, violation)
            if residual <= max(tolerance, noise) or spent >= max_iterations:
                break
            method = NEWTON_SWEEPS
            if k > 0:
                prepare_local(rows, nodes, num_contacts)
                for _ in range(SWEEPS_PER_ROUND * k):
                    sweep(rows, nodes, num_contacts)
                residual, noise = evaluate(rows, nodes, num_contacts, num_bodies, violation)
                if residual < best:
                    best = residual
                    keep_best(rows, num_contacts)
                factor = 3.0 if k == 1 else (1.0 / 3.0 if k == 2 else 1.0)
            best, used = newton(
                rows, nodes, blocks, index, num_contacts, num_bodies, num_handles, slots, violation, tolerance,
                residual, best, factor, DAMPED_DELTA, max_iterations - spent,
            )
            spent += used
    restore_best(rows, num_contacts)
    residual, noise = evaluate(rows, nodes, num_contacts, num_bodies, violation)
    return residual, spent, method


@kernel
def solve_island(
    contacts,
    order,
    num_contacts,
    bodies,
    states,
    island_bodies,
    num_bodies,
    tolerance,
    max_iterations,
    rows,
    nodes,
    blocks,
    index,
):
    """Contact impulses and velocities of one island; arguments and results are described at the top of this file."""
    prepare_nodes(bodies, states, island_bodies, num_bodies, nodes, index)
    prepare_rows(contacts, order, num_contacts, bodies, states, num_bodies, rows, nodes, index)
    residual, iterations, method = solve_rows(
        num_contacts, num_bodies, len(bodies), tolerance, max_iterations, rows, nodes, blocks, index
    )
    if method != NEEDS_MEMORY:
        write_solution(contacts, order, num_contacts, states, island_bodies, num_bodies, rows, nodes)
    return residual, iterations, method
