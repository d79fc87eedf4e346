"""One step of Newton's method: from the present impulses to the next ones, whatever their residual then is.

With more than one body the sparse matrix is assembled pair by pair. For a body alone on its contacts, the commonest
island there is, it is a single block: its contacts are summed up about the centre of mass, where T (assembly.py) has no
arm, as they are linearised, and no table of nodes, order or pattern is asked.
"""

from __future__ import annotations

from ..jit import kernel
from ..maths import mat3, vec3
from .assembly import (
    add_row_stiffness,
    assemble_matrix,
    linearise_row,
    linearise_rows,
    set_right_side,
    set_velocities,
)
from .factorisation import factorise, factorise_diagonal, solve, solve_lower, solve_upper
from .response import add_impulse_alone, relative_velocity, relative_velocity_alone, side_alone
from .workspace import OPEN


@kernel
def advance(rows, row, change):
    """Add dr = A - B du, and what a moment gains with its contact, to the impulse; ``change`` is du."""
    step = vec3.load(row.offset)
    if row.status != OPEN:
        step = vec3.sub(step, mat3.apply(mat3.load(row.stiffness), change))
    if row.of >= 0:
        contact = rows[row.of]
        rise = vec3.dot(vec3.sub(vec3.load(contact.impulse), vec3.load(contact.dx)), vec3.load(contact.normal))
        step = vec3.add_scaled(step, rise, vec3.load(row.coupling))
    else:
        vec3.store(row.dx, vec3.load(row.impulse))
    vec3.store(row.impulse, vec3.add(vec3.load(row.impulse), step))


@kernel
def step_together(rows, nodes, blocks, index, num_contacts, num_bodies, num_handles, slots, delta):
    """A step of an island of any number of bodies."""
    symmetric = linearise_rows(rows, nodes, num_contacts, num_bodies, delta)
    assemble_matrix(rows, nodes, blocks, index, num_contacts, num_bodies, num_handles, slots, symmetric)
    factorise(blocks, index, num_bodies, num_handles, slots, symmetric)
    set_right_side(nodes, num_bodies)
    solve(blocks, index, nodes, num_bodies, num_handles, slots)
    set_velocities(nodes, num_bodies)
    for i in range(num_contacts):
        advance(rows, rows[i], relative_velocity(rows[i], nodes))


@kernel
def _to_scaled(blocks, slot, node):
    """K <- 1 + T^T K T for a body about whose centre of mass K is."""
    axes = mat3.load(node.axes)
    root = node.root
    for r in range(0, 36, 6):
        for c in range(3):
            blocks[slot, r + c] *= root
        turned = mat3.apply_transposed(axes, (blocks[slot, r + 3], blocks[slot, r + 4], blocks[slot, r + 5]))
        blocks[slot, r + 3], blocks[slot, r + 4], blocks[slot, r + 5] = turned
    for c in range(6):
        for r in range(0, 18, 6):
            blocks[slot, r + c] *= root
        turned = mat3.apply_transposed(axes, (blocks[slot, 18 + c], blocks[slot, 24 + c], blocks[slot, 30 + c]))
        blocks[slot, 18 + c], blocks[slot, 24 + c], blocks[slot, 30 + c] = turned
        blocks[slot, 7 * c] += 1.0


@kernel
def step_alone(rows, nodes, blocks, num_contacts, delta):
    """A step of an island of one body."""
    for k in range(36):
        blocks[0, k] = 0.0
    linear = vec3.ZERO
    angular = vec3.ZERO
    for i in range(num_contacts):
        row = rows[i]
        offset, _ = linearise_row(rows, row, delta)
        linear, angular = add_impulse_alone(row, offset, linear, angular)
        if row.status != OPEN:
            _, arm = side_alone(row)
            add_row_stiffness(blocks, 0, rows, row, arm)
    node = nodes[0]
    axes = mat3.load(node.axes)
    _to_scaled(blocks, 0, node)
    factorise_diagonal(blocks, 0)
    y = node.scaled
    y[0], y[1], y[2] = vec3.scale(node.root, linear)
    y[3], y[4], y[5] = mat3.apply_transposed(axes, angular)
    solve_lower(blocks, 0, y)
    solve_upper(blocks, 0, y)
    linear = vec3.scale(node.root, vec3.load(y))
    angular = mat3.apply(axes, (y[3], y[4], y[5]))
    for i in range(num_contacts):
        advance(rows, rows[i], relative_velocity_alone(rows[i], linear, angular))
