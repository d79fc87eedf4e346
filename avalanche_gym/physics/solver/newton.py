"""Proximal semismooth Newton on the equations of Alart and Curnier, with an adaptive weight.

One step linearises every contact (solver/linearisation.py), dr_i = A_i - B_i du_i, and solves

    (I + G^T B G) dy = G^T A,        du = G dy,        r <- r + dr,        y <- G^T r.

y is computed afresh from r, so the equation of motion always holds exactly and only the contact law is left to the
residual; that is what lets delta go down to 1e-12. Steps are full, without a line search. A step is accepted if the
residual falls below the largest of the last few accepted ones (Grippo, Lampariello & Lucidi 1986), because the
residual of a semismooth method rises before contacts find their status; then delta shrinks. A step that is rejected is
undone and delta grows, as in the method of Levenberg and Marquardt.
"""

from __future__ import annotations


from ..jit import kernel
from ..maths import mat3, vec3
from .assembly import assemble, linearise_rows
from .factorisation import factorise, solve
from .problem import load_matrix
from .residual import evaluate
from .response import relative_velocity

# Residuals of accepted steps that a new one is compared with. 1 (monotone) costs 6 % of the hard problems.
MEMORY = 5
# A step counts as accepted if it falls below this part of the largest of them.
ACCEPT = 0.999
# Factor on delta after an accepted step that at least halved the residual; after any other accepted one; after a rejected one.
SHRINK_FAST, SHRINK, GROW = 0.01, 0.3, 10.0
# delta stays above the first number until the residual is below SWITCH, then above the second: small weights resolve
# mass ratios above 1e3 but only help near the solution.
DELTA_MIN, DELTA_MIN_NEAR, SWITCH = 1e-8, 1e-12, 1e-6
# Steps without an improvement of the best residual by SIGNIFICANT after which the iteration has stalled.
PATIENCE, SIGNIFICANT = 15, 0.9


@kernel
def newton_step(rows, nodes, blocks, index, num_contacts, num_bodies, num_handles, slots, factor, delta):
    """r <- r + dr; keeps the old r in ``accepted``."""
    symmetric = linearise_rows(rows, nodes, num_contacts, num_bodies, factor, delta)
    assemble(rows, nodes, blocks, index, num_contacts, num_bodies, num_handles, slots, symmetric)
    factorise(blocks, index, num_bodies, num_handles, slots, symmetric)
    solve(blocks, index, nodes, num_bodies, num_handles, slots)
    for i in range(num_bodies):
        node = nodes[i]
        y = node.scaled
        vec3.store(node.linear, (node.root * y[0], node.root * y[1], node.root * y[2]))
        vec3.store(node.angular, mat3.apply(load_matrix(node.axes), (y[3], y[4], y[5])))
    vec3.store(nodes[num_bodies].linear, vec3.ZERO)
    vec3.store(nodes[num_bodies].angular, vec3.ZERO)
    for i in range(num_contacts):
        row = rows[i]
        impulse = vec3.load(row.impulse)
        vec3.store(row.accepted, impulse)
        step = vec3.sub(vec3.load(row.offset), mat3.apply(load_matrix(row.stiffness), relative_velocity(row, nodes)))
        vec3.store(row.impulse, vec3.add(impulse, step))


@kernel
def restore_accepted(rows, num_contacts):
    """Undo the step on trial."""
    for i in range(num_contacts):
        vec3.store(rows[i].impulse, vec3.load(rows[i].accepted))


@kernel
def keep_best(rows, num_contacts):
    for i in range(num_contacts):
        vec3.store(rows[i].best, vec3.load(rows[i].impulse))


@kernel
def restore_best(rows, num_contacts):
    for i in range(num_contacts):
        vec3.store(rows[i].impulse, vec3.load(rows[i].best))


@kernel
def newton(
    rows,
    nodes,
    blocks,
    index,
    num_contacts,
    num_bodies,
    num_handles,
    slots,
    violation,
    tolerance,
    residual,
    best,
    factor,
    delta,
    budget,
):
    """Iterate from the present impulses until solved, stalled, or ``budget`` factorisations are spent.

    Args:
        residual: of the present impulses, for which ``evaluate`` was the last thing done.
        best: smallest residual so far; its impulses are in ``rows.best``.
        factor: rho in units of 1 / Wd.
        delta: proximal weight to begin with.

    Returns:
        best residual, factorisations spent. The iterate is left where it stopped; call ``restore_best``.
    """
    # The last accepted residuals, newest first; what is not yet filled does not count.
    h0, h1, h2, h3, h4 = residual, 0.0, 0.0, 0.0, 0.0
    present = residual
    spent = 0
    since_best = 0
    mark = best
    while spent < budget:
        newton_step(rows, nodes, blocks, index, num_contacts, num_bodies, num_handles, slots, factor, delta)
        spent += 1
        trial, noise = evaluate(rows, nodes, num_contacts, num_bodies, violation)
        if trial < best:
            best = trial
            keep_best(rows, num_contacts)
            if best <= max(tolerance, noise):
                break
        since_best += 1
        if best < SIGNIFICANT * mark:
            mark = best
            since_best = 0
        if trial <= ACCEPT * max(h0, h1, h2, h3, h4):
            shrink = SHRINK_FAST if trial < 0.5 * present else SHRINK
            delta = max(shrink * delta, DELTA_MIN_NEAR if trial < SWITCH else DELTA_MIN)
            h0, h1, h2, h3, h4 = trial, h0, h1, h2, h3
            present = trial
            if since_best > PATIENCE:
                break
        else:
            if delta >= 1.0:
                break
            delta = min(GROW * delta, 1.0)
            restore_accepted(rows, num_contacts)
            evaluate(rows, nodes, num_contacts, num_bodies, violation)
    return best, spent
