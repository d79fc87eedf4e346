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
from .problem import load_matrix
from .residual import load_on
from .response import relative_velocity


@kernel
def lever(node, arm, direction):
    """axes^T (x cross d): the scaled angular velocity that a unit impulse along d makes."""
    return mat3.apply_transposed(load_matrix(node.axes), vec3.cross(arm, direction))


@kernel
def prepare_local(rows, nodes, num_contacts):
    """W_ii of every contact in its own frame (normal, t1, t2)."""
    for i in range(num_contacts):
        row = rows[i]
        if row.of >= 0:
            continue
        node_a = nodes[row.a]
        node_b = nodes[row.b]
        normal = vec3.load(row.normal)
        t1, t2 = vec3.tangents(normal)
        arm_a = vec3.load(row.arm_a)
        arm_b = vec3.load(row.arm_b)
        a_n = lever(node_a, arm_a, normal)
        a_1 = lever(node_a, arm_a, t1)
        a_2 = lever(node_a, arm_a, t2)
        b_n = lever(node_b, arm_b, normal)
        b_1 = lever(node_b, arm_b, t1)
        b_2 = lever(node_b, arm_b, t2)
        direct = node_a.root * node_a.root + node_b.root * node_b.root
        row.local[0] = direct + vec3.dot(a_n, a_n) + vec3.dot(b_n, b_n)
        row.local[1] = vec3.dot(a_n, a_1) + vec3.dot(b_n, b_1)
        row.local[2] = vec3.dot(a_n, a_2) + vec3.dot(b_n, b_2)
        row.local[3] = direct + vec3.dot(a_1, a_1) + vec3.dot(b_1, b_1)
        row.local[4] = vec3.dot(a_1, a_2) + vec3.dot(b_1, b_2)
        row.local[5] = direct + vec3.dot(a_2, a_2) + vec3.dot(b_2, b_2)


@kernel
def push(node, arm, impulse, sign):
    """Add the velocities that an impulse at ``arm`` makes."""
    vec3.store(node.linear, vec3.add_scaled(vec3.load(node.linear), sign * node.root * node.root, impulse))
    turn(node, vec3.cross(arm, impulse), sign)


@kernel
def relax(row, nodes):
    """Solve one contact with all others held; update its impulse and the velocities of its two bodies."""
    node_a = nodes[row.a]
    node_b = nodes[row.b]
    arm_a = vec3.load(row.arm_a)
    arm_b = vec3.load(row.arm_b)
    normal = vec3.load(row.normal)
    t1, t2 = vec3.tangents(normal)
    w = row.local
    old = vec3.load(row.impulse)
    spin_a = vec3.cross(vec3.load(node_a.angular), arm_a)
    spin_b = vec3.cross(vec3.load(node_b.angular), arm_b)
    change = vec3.add(vec3.sub(vec3.load(node_b.linear), vec3.load(node_a.linear)), vec3.sub(spin_b, spin_a))
    velocity = vec3.add(vec3.load(row.free), change)
    r_n = vec3.dot(old, normal)
    r_1 = vec3.dot(old, t1)
    r_2 = vec3.dot(old, t2)
    q_n = vec3.dot(velocity, normal) - (w[0] * r_n + w[1] * r_1 + w[2] * r_2)
    q_1 = vec3.dot(velocity, t1) - (w[1] * r_n + w[3] * r_1 + w[4] * r_2)
    q_2 = vec3.dot(velocity, t2) - (w[2] * r_n + w[4] * r_1 + w[5] * r_2)
    r_n, r_1, r_2 = solve_contact(w[0], w[1], w[2], w[3], w[4], w[5], q_n, q_1, q_2, row.friction)
    new = vec3.add_scaled(vec3.add_scaled(vec3.scale(r_n, normal), r_1, t1), r_2, t2)
    step = vec3.sub(new, old)
    vec3.store(row.impulse, new)
    push(node_a, arm_a, step, -1.0)
    push(node_b, arm_b, step, 1.0)


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
    axes = load_matrix(node.axes)
    turned = mat3.apply(axes, mat3.apply_transposed(axes, moment))
    vec3.store(node.angular, vec3.add_scaled(vec3.load(node.angular), sign, turned))


@kernel
def sweep(rows, nodes, num_contacts):
    """One forward sweep. On entry the velocities of the nodes belong to the present impulses (``evaluate``)."""
    for i in range(num_contacts):
        if rows[i].scale > 0.0:
            if rows[i].of >= 0:
                relax_moment(rows, rows[i], nodes)
            else:
                relax(rows[i], nodes)
