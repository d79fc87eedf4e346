"""Removal of overlap: the nearest admissible positions in the metric of the masses.

Among all small displacements q of the bodies (translations and rotation vectors) that leave no overlap to first order,
gap_i + n_i . J_i q >= 0, take the one with the least q^T M q. Its optimality conditions are the contact problem without
friction, with displacements for velocities and w_i = gap_i n_i:

    q = M^-1 J^T r,     0 <= gap_i + n_i . J_i q   orthogonal to   r_i >= 0.

So the solver of velocities does it. No velocity is added, hence no energy; a stack in which every box overlaps the next
by 10 mm comes apart in one call (Moreau 1999, sec. 5.4; Acary 2013 combine it with the velocity law in the same way).

    residual, iterations, method = project_island(
        contacts, order, num_contacts, bodies, states, island_bodies, num_bodies,   # as for ``solve_island``
        most_overlap,      # [m] deeper overlaps are treated as this deep, so that they part at a bounded speed
        tolerance,         # relative residual, e.g. 1e-6: what is left of the overlap is about this part of it
        max_iterations, rows, nodes, blocks, index,
    )

Nothing but the workspace is written: afterwards ``nodes[k].linear`` is the translation [m] of the body
``island_bodies[k]`` and ``nodes[k].angular`` its rotation vector [rad], world frame. The caller moves the bodies.
``gap`` of the contacts is read; ``impulse`` only helps to guess which contacts bear load. NEEDS_MEMORY as there.
"""

from __future__ import annotations

import math

from ..jit import kernel
from ..maths import vec3
from .exact import solve_rows
from .problem import prepare_nodes, prepare_rows


@kernel
def prepare_gaps(contacts, order, num_contacts, most_overlap, rows):
    """Replace velocities by gaps, drop friction, and guess the multipliers.

    The guess is proportional to the contact impulses, in the size that the overlaps call for. It only matters for which
    contacts are taken to be active.
    """
    overlaps = 0.0
    impulses = 0.0
    for i in range(num_contacts):
        row = rows[i]
        if row.scale > 0.0:
            overlap = max(min(contacts[order[i]].gap, 0.0), -most_overlap)
            overlaps += overlap * overlap / row.scale
            load = max(vec3.dot(vec3.load(row.impulse), vec3.load(row.normal)), 0.0)
            impulses += load * load * row.scale
    factor = math.sqrt(overlaps / impulses) if impulses > 0.0 else 0.0
    for i in range(num_contacts):
        row = rows[i]
        normal = vec3.load(row.normal)
        load = factor * max(vec3.dot(vec3.load(row.impulse), normal), 0.0)
        row.friction = 0.0
        row.speed = 0.0
        vec3.store(row.impulse, vec3.scale(load, normal))
        vec3.store(row.free, vec3.scale(max(contacts[order[i]].gap, -most_overlap), normal))


@kernel
def project_island(
    contacts,
    order,
    num_contacts,
    bodies,
    states,
    island_bodies,
    num_bodies,
    most_overlap,
    tolerance,
    max_iterations,
    rows,
    nodes,
    blocks,
    index,
):
    """Displacements that remove the overlaps of one island; arguments and results: see the top of this file."""
    prepare_nodes(bodies, states, island_bodies, num_bodies, nodes, index)
    prepare_rows(contacts, order, num_contacts, bodies, states, num_bodies, rows, nodes, index)
    prepare_gaps(contacts, order, num_contacts, most_overlap, rows)
    return solve_rows(num_contacts, num_bodies, len(bodies), tolerance, max_iterations, rows, nodes, blocks, index)
