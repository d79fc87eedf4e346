"""Proximal semismooth Newton on the equations of Alart and Curnier, with an adaptive weight.

One step linearises every contact (solver/linearisation.py), dr_i = A_i - B_i du_i, and solves

    (I + G^T B G) dy = G^T A,        du = G dy,        r <- r + dr,        y <- G^T r.

y is computed afresh from r, so the equation of motion always holds exactly and only the contact law is left to the
residual; that is what lets delta go down to 1e-12. Steps are full, without a line search.

A step is accepted if the residual falls below the largest of the last few accepted ones (Grippo, Lampariello & Lucidi
1986); then delta shrinks. Near the solution of a jammed island every full step finds one or two contacts that should
slip or open and pushes them beyond their cones, so that the residual leaps until the last of them is found. So a
number of steps is made on trial before they count as rejected (the watchdog of Chamberlain et al. 1982); only then is
everything undone, and delta grows, as in the method of Levenberg and Marquardt.
"""

from __future__ import annotations

from ..jit import kernel
from .iterate import keep_accepted, keep_best, restore_accepted
from .newton_step import step_alone, step_together
from .residual import evaluate, has_friction
from .sharing import agree_on_shares, part, share_loads

# A step counts as accepted if it falls below this part of the largest of the last five accepted residuals.
ACCEPT = 0.999
# Steps on trial that may follow a step that was not accepted. 0 loses a sixth of the jammed islands; more wastes steps.
WATCH = 6
# Residual above which a step has leapt: most contacts do something else than it took them to do. With friction one such
# step leads to the next, so fewer are made on trial; without it they find out which contacts bear.
LEAP, WATCH_LEAPS = 0.5, 2
# Factor on delta after an accepted step that at least halved the residual, after another accepted one, after rejection.
SHRINK_FAST, SHRINK, GROW = 0.01, 0.3, 10.0
# delta stays above the first number until the residual is below SWITCH, then above the second: small weights resolve
# mass ratios above 1e3 but only help near the solution.
DELTA_MIN, DELTA_MIN_NEAR, SWITCH = 1e-8, 1e-12, 1e-6
# Accepted steps without an improvement of the best residual by the factor SIGNIFICANT, after which it has stalled.
PATIENCE, SIGNIFICANT = 8, 0.9


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
    present,
    best,
    delta,
    budget,
    shares,
    leaves,
):
    """Iterate from the present impulses, just evaluated, until solved, stalled, or ``budget`` factorisations are spent.

    Args:
        violation: res(r = 0), from ``free_violation``.
        present: residual of the present impulses.
        best: smallest residual so far; its impulses are in ``rows.best``.
        delta: proximal weight to begin with.
        shares: whether loads that the law does not divide are shared (solver/sharing.py).
        leaves: whether a step that leaps is the last.

    Returns:
        best residual, factorisations spent, whether it is solved to ``tolerance`` or to round-off. If it is, the last
        iterate is the best; else it is left where it stopped: ``restore_best`` leads back, and ``restore_accepted`` to
        where it leapt from.
    """
    # The last accepted residuals, newest first; what is not yet filled does not count.
    h0, h1, h2, h3, h4 = present, 0.0, 0.0, 0.0, 0.0
    spent = 0
    on_trial = 0
    mark = best
    since_mark = 0
    if present < best:
        best = present
        keep_best(rows, num_contacts)
    friction = has_friction(rows, num_contacts)
    # The caller found the present impulses wanting, be they within the tolerance.
    solved = False
    while spent < budget and not solved:
        if on_trial == 0:
            keep_accepted(rows, num_contacts)
        sharing = shares and agree_on_shares(rows, num_contacts, num_bodies, tolerance)
        if num_bodies == 1:
            step_alone(rows, nodes, blocks, num_contacts, delta)
        else:
            step_together(rows, nodes, blocks, index, num_contacts, num_bodies, num_handles, slots, delta)
        if sharing:
            share_loads(rows, num_contacts)
        trial, noise = evaluate(rows, nodes, num_contacts, num_bodies, violation)
        spent += 1
        since_mark += 1
        if trial < best:
            best = trial
            keep_best(rows, num_contacts)
            solved = best <= max(tolerance, noise)
            if best < SIGNIFICANT * mark:
                mark = best
                since_mark = 0
        elif best <= tolerance:
            break
        leapt = friction and trial > LEAP
        if leaves and leapt:
            break
        if trial <= ACCEPT * max(h0, h1, h2, h3, h4):
            shrink = SHRINK_FAST if trial < 0.5 * present else SHRINK
            delta = max(shrink * delta, DELTA_MIN_NEAR if trial < SWITCH else DELTA_MIN)
            h0, h1, h2, h3, h4 = trial, h0, h1, h2, h3
            present = trial
            on_trial = 0
            if since_mark > PATIENCE:
                break
        elif on_trial < (WATCH_LEAPS if leapt else WATCH):
            on_trial += 1
        else:
            if delta >= 1.0:
                break
            on_trial = 0
            delta = min(GROW * delta, 1.0)
            restore_accepted(rows, num_contacts)
            evaluate(rows, nodes, num_contacts, num_bodies, violation)
    part(rows, num_contacts)
    return best, spent, solved
