"""The interior point for islands with moments, which it does not know: they are held while it solves the contacts.

The limit of a moment of rolling or torsional friction moves with the normal impulse of its contact, which is no cone.
Held, moments are known loads: their velocities belong to the free ones, w <- w + G M^-1 m, and what is left is a
problem of contacts alone. Then the moments follow, and Newton's method on all of it goes on from there.
"""

from __future__ import annotations

from ..jit import kernel
from ..maths import vec3
from .gauss_seidel import prepare_local, relax_moment, sweep
from .interior_point import interior_point
from .local_contact import EXACTLY
from .residual import evaluate, free_violation

# Steps of the moments towards what the new contact impulses let them be.
STEPS = 5


@kernel
def solve_contacts_alone(
    rows, nodes, blocks, index, num_contacts, num_bodies, num_handles, slots, violation, goal, budget
):  # fmt: skip
    """Solve the contacts with the moments held, then let these follow; return the factorisations spent.

    ``num_contacts`` counts the moments too, and ``violation`` is that of all. On entry ``impulse`` and ``best`` are the
    best impulses seen, on return ``impulse`` is where Newton may go on and ``best`` as it was.
    """
    contacts = 0
    while contacts < num_contacts and rows[contacts].of < 0:
        row = rows[contacts]
        # Kept where the sharing of loads, which is done with, has its basis.
        for axis in range(3):
            row.basis[axis] = row.free[axis]
            row.basis[3 + axis] = row.best[axis]
        vec3.store(row.impulse, vec3.ZERO)
        contacts += 1
    evaluate(rows, nodes, num_contacts, num_bodies, violation)
    for i in range(contacts):
        vec3.store(rows[i].free, vec3.load(rows[i].velocity))
        vec3.store(rows[i].impulse, vec3.load(rows[i].best))
    pressing = free_violation(rows, contacts)
    held, _ = evaluate(rows, nodes, contacts, num_bodies, pressing)
    if contacts == 1:
        prepare_local(rows, nodes, 1)
        sweep(rows, nodes, 1, EXACTLY)
        spent = 1
    else:
        _, spent = interior_point(
            rows, nodes, blocks, index, contacts, num_bodies, num_handles, slots, pressing, goal, held, budget
        )
    for i in range(contacts):
        row = rows[i]
        for axis in range(3):
            row.free[axis] = row.basis[axis]
            row.best[axis] = row.basis[3 + axis]
    evaluate(rows, nodes, num_contacts, num_bodies, violation)
    for _ in range(STEPS):
        for i in range(contacts, num_contacts):
            if rows[i].scale > 0.0:
                relax_moment(rows, rows[i], nodes)
    return spent
