"""The exact tier: certificate, then Newton, then interior point and Newton; the best impulses seen are returned.

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

It reads of a contact: position, normal, impulse (warm start), friction, bias, surface_velocity, body_a, body_b; it
writes ``impulse`` of the contacts and ``velocity`` and ``angular_velocity`` of the island's bodies. If ``method`` is
NEEDS_MEMORY nothing was written: leave the kernels, call ``workspace.grow()``, and repeat with the new arrays.

The three parts of it can also be called apart: ``prepare_nodes`` and ``prepare_rows`` (solver/problem.py),
``solve_rows``, ``write_solution``.

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
from .held_moments import solve_contacts_alone
from .interior_point import interior_point
from .iterate import keep_best, restore_accepted, restore_best
from .local_contact import EXACTLY
from .newton import newton
from .problem import prepare_nodes, prepare_rows
from .residual import evaluate, free_violation

# How an island was solved; the larger, the farther down the chain.
NEEDS_MEMORY, CERTIFICATE, SINGLE, NEWTON, INTERIOR_POINT, SWEEPS = -1, 0, 1, 2, 3, 4

# Share of the tolerance below which the impulses of the last step are good for this one. At the whole of it a scene at
# rest would hand an error of that size to and fro, and solve every other step.
CERTIFIED = 0.1
# Newton from the warm start: the weight makes the first step the solution if no contact changes its status.
WARM_DELTA, WARM_BUDGET = 1e-6, 8
# If the tolerance is loose enough to be reached in that one step, the weight is this share of it.
LOOSE, WARM_SHARE = 1e-7, 0.01
# Islands of so few bodies are swept, which is cheap there, as soon as a step leaps, and given to Newton again before
# the interior point: where a warm start misses a blow, full steps lead from one guess of which contacts bear to the
# next, until the budget is spent. The weight is then the residual: as that of Levenberg and Marquardt it follows the
# error, so that convergence stays quadratic (Fan & Yuan 2005), and no step goes much farther than the error does. A
# fixed 1e-6 threw what the sweeps had nearly solved far off: contacts that are nearly redundant take and give back
# any load. A larger least weight: steps wasted near the end.
SWEPT_BODIES, SWEPT_DELTA, SWEPT_BUDGET = 11, 1e-6, 16
# Interior point: residual at which Newton takes over, in the first round and in the second, and most factorisations of
# each. Handing over earlier saves steps in easy islands and loses jammed ones.
FIRST_GOAL, SECOND_GOAL, INTERIOR_BUDGET = 1e-8, 1e-9, 30
# Residual below which the interior point is not started: it could not improve on that.
GOOD = 1e-10
# Newton from where the interior point ended.
POLISH_DELTA, POLISH_BUDGET = 1e-4, 30
# An impulse below this share of the largest of its island is a trace of round-off, not a load.
TRACE = 1e-15
# Sweeps that unsettle Newton's method, and how well they solve a contact that slips: they are to find out which ones
# bear. Fewer or rougher: more factorisations; to round-off a sweep takes twice as long and finds out nothing else.
UNSETTLING_SWEEPS, ROUGHLY = 5, 0.01
# Above so many 6 x 6 block products a factorisation is not worth its time (0.1 us each); sweeps take over.
MOST_PRODUCTS = 200_000
# Residual above which an island is begun anew, from no impulses.
POOR = 1e-4
# Sweeps for such islands, and how many lie between two looks at the residual.
MOST_SWEEPS, SWEEPS_PER_LOOK = 200, 10


@kernel
def keep_impulses(contacts, order, first, last, rows):
    """Impulses to the contacts order[first:last]. Newton's steps leave traces on open contacts: they become zero."""
    largest = 0.0
    for i in range(last - first):
        largest = max(largest, vec3.norm_squared(vec3.load(rows[i].impulse)))
    for i in range(last - first):
        impulse = vec3.load(rows[i].impulse)
        kept = vec3.norm_squared(impulse) > TRACE * TRACE * largest
        vec3.store(contacts[order[first + i]].impulse, impulse if kept else vec3.ZERO)


@kernel
def keep_moments(contacts, order, first, rows, num_contacts, num_rows):
    """Moments of rows[num_contacts:num_rows] to their contacts."""
    for i in range(num_contacts, num_rows):
        vec3.store(contacts[order[first + rows[i].of]].moment, vec3.load(rows[i].impulse))


@kernel
def write_solution(contacts, order, num_contacts, states, island_bodies, num_bodies, rows, nodes):
    """Impulses to the contacts, changes of velocity to the bodies."""
    keep_impulses(contacts, order, 0, num_contacts, rows)
    for i in range(num_bodies):
        state = states[island_bodies[i]]
        vec3.store(state.velocity, vec3.add(vec3.load(state.velocity), vec3.load(nodes[i].linear)))
        spin = vec3.add(vec3.load(state.angular_velocity), vec3.load(nodes[i].angular))
        vec3.store(state.angular_velocity, spin)


@kernel
def solve_rows(num_contacts, num_bodies, num_handles, tolerance, max_iterations, rows, nodes, blocks, index):
    """Solve the prepared problem.

    What is solved as far as round-off lets it be is reported as at the tolerance: relative to a problem that is itself
    made of round-off, its residual says nothing.

    On return ``rows.impulse`` and the nodes' velocities are those of the best iterate.

    Returns:
        residual, iterations (factorisations and sweeps), method.
    """
    violation = free_violation(rows, num_contacts)
    if violation == 0.0:
        # Nothing presses: no impulses are the solution, whatever the warm start says.
        for i in range(num_contacts):
            vec3.store(rows[i].impulse, vec3.ZERO)
    best, noise = evaluate(rows, nodes, num_contacts, num_bodies, violation)
    if best <= max(CERTIFIED * tolerance, noise):
        return min(best, tolerance), 0, CERTIFICATE
    spent = 0
    if num_contacts == 1:
        # In closed form: exact, and better than the warm start, or round-off keeps both from being.
        prepare_local(rows, nodes, num_contacts)
        keep_best(rows, num_contacts)
        sweep(rows, nodes, num_contacts, EXACTLY)
        residual, noise = evaluate(rows, nodes, num_contacts, num_bodies, violation)
        if residual >= best:
            restore_best(rows, num_contacts)
            residual, noise = evaluate(rows, nodes, num_contacts, num_bodies, violation)
        return residual if residual > max(tolerance, noise) else min(residual, tolerance), 1, SINGLE
    keep_best(rows, num_contacts)
    slots, products = eliminate(rows, num_contacts, num_bodies, num_handles, index)
    index[0] = num_bodies + 2 * slots + SCRATCH_BLOCKS
    if slots < 0 or index[0] > len(blocks):
        return math.inf, 0, NEEDS_MEMORY
    if products > MOST_PRODUCTS:
        method = SWEEPS
        prepare_local(rows, nodes, num_contacts)
        while spent < MOST_SWEEPS:
            sweep(rows, nodes, num_contacts, EXACTLY)
            spent += 1
            if spent % SWEEPS_PER_LOOK == 0:
                residual, noise = evaluate(rows, nodes, num_contacts, num_bodies, violation)
                if residual < best:
                    best = residual
                    keep_best(rows, num_contacts)
                if residual <= max(tolerance, noise):
                    break
    else:
        method = NEWTON
        present = best
        delta = min(WARM_DELTA, WARM_SHARE * tolerance) if tolerance > LOOSE else WARM_DELTA
        budget = WARM_BUDGET
        goal = FIRST_GOAL
        fresh = True
        shares = True
        leaves = num_bodies <= SWEPT_BODIES
        while True:
            best, used, solved = newton(
                rows, nodes, blocks, index, num_contacts, num_bodies, num_handles, slots, violation, tolerance,
                present, best, delta, min(budget, max_iterations - spent), shares, leaves,
            )  # fmt: skip
            spent += used
            if solved:
                return min(best, tolerance), spent, method
            if spent >= max_iterations or goal < SECOND_GOAL or best <= max(GOOD, tolerance):
                break
            swept = fresh and num_bodies <= SWEPT_BODIES
            if swept:
                # The best impulses may be those after a leap, which lead nowhere.
                restore_accepted(rows, num_contacts)
                evaluate(rows, nodes, num_contacts, num_bodies, violation)
                prepare_local(rows, nodes, num_contacts)
                # They are cheap, and leave the factorisations to those who need them.
                for _ in range(UNSETTLING_SWEEPS):
                    sweep(rows, nodes, num_contacts, ROUGHLY)
            elif rows[num_contacts - 1].of >= 0:
                restore_best(rows, num_contacts)
                spent += solve_contacts_alone(
                    rows, nodes, blocks, index, num_contacts, num_bodies, num_handles, slots, violation,
                    max(goal, 0.5 * tolerance), min(INTERIOR_BUDGET, max_iterations - spent),
                )  # fmt: skip
            else:
                best, used = interior_point(
                    rows, nodes, blocks, index, num_contacts, num_bodies, num_handles, slots, violation,
                    max(goal, 0.5 * tolerance), best, min(INTERIOR_BUDGET, max_iterations - spent),
                )  # fmt: skip
                spent += used
            present, _ = evaluate(rows, nodes, num_contacts, num_bodies, violation)
            fresh = False
            leaves = False
            # Where many bodies are jammed sharing stalls what the sweeps set going.
            shares = swept and num_bodies == 1
            if swept:
                delta = max(present, SWEPT_DELTA)
                budget = SWEPT_BUDGET
                continue
            method = INTERIOR_POINT
            if present <= tolerance:
                return present, spent, method
            delta = POLISH_DELTA
            budget = POLISH_BUDGET
            goal = SECOND_GOAL if goal == FIRST_GOAL else 0.0
    restore_best(rows, num_contacts)
    best, noise = evaluate(rows, nodes, num_contacts, num_bodies, violation)
    if best > max(POOR, tolerance) and max_iterations > WARM_BUDGET:
        anew = _sweep_from_nothing(rows, nodes, num_contacts, num_bodies, violation, best)
        if anew < math.inf:
            return anew, spent + MOST_SWEEPS, SWEEPS
    return best, spent, method


@kernel
def _sweep_from_nothing(rows, nodes, num_contacts, num_bodies, violation, best):
    """Sweeps from no impulses at all; return their residual, or infinity where the best so far is the better one.

    The residual is relative to the impulses, so huge ones in a vain balance may have the smaller one; which of the two
    is nearer to a solution is told by the velocities that are wrong, in full.
    """
    wrong = best * max(violation, _load(rows, num_contacts))
    for i in range(num_contacts):
        vec3.store(rows[i].impulse, vec3.ZERO)
    evaluate(rows, nodes, num_contacts, num_bodies, violation)
    prepare_local(rows, nodes, num_contacts)
    for _ in range(MOST_SWEEPS):
        sweep(rows, nodes, num_contacts, EXACTLY)
    anew, _ = evaluate(rows, nodes, num_contacts, num_bodies, violation)
    if anew * max(violation, _load(rows, num_contacts)) < wrong:
        return anew
    restore_best(rows, num_contacts)
    evaluate(rows, nodes, num_contacts, num_bodies, violation)
    return math.inf


@kernel
def _load(rows, num_contacts):
    """The size of all impulses, as the residual weighs them."""
    total = 0.0
    for i in range(num_contacts):
        total += rows[i].scale * vec3.norm_squared(vec3.load(rows[i].impulse))
    return math.sqrt(total)


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
