"""Nonsmooth Gauss-Seidel: sweeps of exact single-contact solves (Jean 1999; Jourdan, Alart & Jean 1998).

Robust where Newton stalls, linear in the number of contacts, slow to converge: it unsettles a stalled Newton iteration,
and carries islands whose factorisation would be too dear. Between sweeps the iterate can be extrapolated along the
conjugate direction of Fletcher and Reeves (Silcowitz, Niebe & Erleben 2010, "A nonsmooth nonlinear conjugate gradient
method for interactive contact force problems").
"""

from __future__ import annotations

from ..jit import kernel
from ..maths import mat3, vec3
from .cone import limit
from .local_contact import solve_contact
from .residual import load_on
from .response import relative_velocity


@kernel
def moves(node):
    """Whether a node stands for something that can move."""
    return node.root > 0.0 or node.trace > 0.0


@kernel
def lever(axes, arm, direction):
    """axes^T (x cross d): the scaled angular velocity that a unit impulse along d makes."""
    return mat3.apply_transposed(axes, vec3.cross(arm, direction))


@kernel
def add_local(local, node, arm, normal, t1, t2):
    """Add what one of the two bodies gives to W_ii."""
    axes = mat3.load(node.axes)
    direct = node.root * node.root
    n = lever(axes, arm, normal)
    a = lever(axes, arm, t1)
    b = lever(axes, arm, t2)
    local[0] += direct + vec3.dot(n, n)
    local[1] += vec3.dot(n, a)
    local[2] += vec3.dot(n, b)
    local[3] += direct + vec3.dot(a, a)
    local[4] += vec3.dot(a, b)
    local[5] += direct + vec3.dot(b, b)


@kernel
def prepare_local(rows, nodes, num_contacts):
    """W_ii of every contact in its own frame (normal, t1, t2)."""
    for i in range(num_contacts):
        row = rows[i]
        if row.of >= 0:
            continue
        normal = vec3.load(row.normal)
        t1, t2 = vec3.tangents(normal)
        for k in range(6):
            row.local[k] = 0.0
        if moves(nodes[row.a]):
            add_local(row.local, nodes[row.a], vec3.load(row.arm_a), normal, t1, t2)
        if moves(nodes[row.b]):
            add_local(row.local, nodes[row.b], vec3.load(row.arm_b), normal, t1, t2)


@kernel
def push(node, arm, impulse, sign):
    """Add the velocities that an impulse at ``arm`` makes."""
    if moves(node):
        linear = vec3.add_scaled(vec3.load(node.linear), sign * node.root * node.root, impulse)
        vec3.store(node.linear, linear)
        turn(node, vec3.cross(arm, impulse), sign)


@kernel
def relax(row, nodes, accuracy):
    """Solve one contact with all others held; update its impulse and the velocities of its two bodies."""
    normal = vec3.load(row.normal)
    old = vec3.load(row.impulse)
    velocity = vec3.add(vec3.load(row.free), relative_velocity(row, nodes))
    u_n = vec3.dot(velocity, normal)
    if u_n >= 0.0 and old[0] == 0.0 and old[1] == 0.0 and old[2] == 0.0:
        return
    t1, t2 = vec3.tangents(normal)
    w = row.local
    r_n = vec3.dot(old, normal)
    r_1 = vec3.dot(old, t1)
    r_2 = vec3.dot(old, t2)
    q_n = u_n - (w[0] * r_n + w[1] * r_1 + w[2] * r_2)
    q_1 = vec3.dot(velocity, t1) - (w[1] * r_n + w[3] * r_1 + w[4] * r_2)
    q_2 = vec3.dot(velocity, t2) - (w[2] * r_n + w[4] * r_1 + w[5] * r_2)
    r_n, r_1, r_2 = solve_contact(w[0], w[1], w[2], w[3], w[4], w[5], q_n, q_1, q_2, row.friction, accuracy)
    new = vec3.add_scaled(vec3.add_scaled(vec3.scale(r_n, normal), r_1, t1), r_2, t2)
    step = vec3.sub(new, old)
    vec3.store(row.impulse, new)
    push(nodes[row.a], vec3.load(row.arm_a), step, -1.0)
    push(nodes[row.b], vec3.load(row.arm_b), step, 1.0)


@kernel
def relax_moment(rows, row, nodes):
    """A projected step of a moment with all others held; 3 Wd is a bound of its response in every direction."""
    old = vec3.load(row.impulse)
    velocity = vec3.add(vec3.load(row.free), relative_velocity(row, nodes))
    load = load_on(rows, row)
    aim = vec3.add_scaled(old, -1.0 / (3.0 * row.scale), velocity)
    new = limit(aim, vec3.load(row.normal), row.friction * load, row.torsion * load)
    vec3.store(row.impulse, new)
    step = vec3.sub(new, old)
    turn(nodes[row.a], step, -1.0)
    turn(nodes[row.b], step, 1.0)


@kernel
def turn(node, moment, sign):
    """Add the angular velocity that a moment makes."""
    axes = mat3.load(node.axes)
    turned = mat3.apply(axes, mat3.apply_transposed(axes, moment))
    vec3.store(node.angular, vec3.add_scaled(vec3.load(node.angular), sign, turned))


@kernel
def sweep(rows, nodes, num_contacts, accuracy):
    """One forward sweep. On entry the velocities of the nodes belong to the present impulses (``evaluate``).

    ``accuracy``: of the direction in which a contact slips (solver/local_contact.py).
    """
    for i in range(num_contacts):
        if rows[i].scale > 0.0:
            if rows[i].of >= 0:
                relax_moment(rows, rows[i], nodes)
            else:
                relax(rows[i], nodes, accuracy)
