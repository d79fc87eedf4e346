"""How the bodies of a pile answer to impulses: response, velocities and frames of a contact's short record."""

from __future__ import annotations

import math

from ..jit import kernel
from ..maths import vec3


@kernel
def respond(node, moment):
    """I^-1 times a moment, world frame."""
    m = node.inverse_inertia
    return (
        m[0] * moment[0] + m[1] * moment[1] + m[2] * moment[2],
        m[1] * moment[0] + m[3] * moment[1] + m[4] * moment[2],
        m[2] * moment[0] + m[4] * moment[1] + m[5] * moment[2],
    )


@kernel
def prepare_normal(row, nodes):
    """How the bodies of a contact answer to its normal; returns W_nn [1/kg]."""
    node_a = nodes[row.a]
    node_b = nodes[row.b]
    normal = vec3.load(row.normal)
    a_n, b_n = vec3.cross(vec3.load(row.arm_a), normal), vec3.cross(vec3.load(row.arm_b), normal)
    ia_n, ib_n = respond(node_a, a_n), respond(node_b, b_n)
    vec3.store(row.lever_a, a_n)
    vec3.store(row.lever_b, b_n)
    vec3.store(row.answer_a, ia_n)
    vec3.store(row.answer_b, ib_n)
    return node_a.inverse_mass + node_b.inverse_mass + vec3.dot(a_n, ia_n) + vec3.dot(b_n, ib_n)


@kernel
def prepare_response(row, nodes):
    """W of a contact, its inverse, the length of its sliding steps, and how its bodies answer to its normal.

    Returns trace(W) / 3.
    """
    nn = prepare_normal(row, nodes)
    node_a = nodes[row.a]
    node_b = nodes[row.b]
    t1 = vec3.load(row.t1)
    t2 = vec3.load(row.t2)
    arm_a = vec3.load(row.arm_a)
    arm_b = vec3.load(row.arm_b)
    a_1, a_2 = vec3.cross(arm_a, t1), vec3.cross(arm_a, t2)
    b_1, b_2 = vec3.cross(arm_b, t1), vec3.cross(arm_b, t2)
    ia_n, ia_1, ia_2 = vec3.load(row.answer_a), respond(node_a, a_1), respond(node_a, a_2)
    ib_n, ib_1, ib_2 = vec3.load(row.answer_b), respond(node_b, b_1), respond(node_b, b_2)
    direct = node_a.inverse_mass + node_b.inverse_mass
    n1 = vec3.dot(a_1, ia_n) + vec3.dot(b_1, ib_n)
    n2 = vec3.dot(a_2, ia_n) + vec3.dot(b_2, ib_n)
    w11 = direct + vec3.dot(a_1, ia_1) + vec3.dot(b_1, ib_1)
    w12 = vec3.dot(a_2, ia_1) + vec3.dot(b_2, ib_1)
    w22 = direct + vec3.dot(a_2, ia_2) + vec3.dot(b_2, ib_2)
    local = row.local
    local[0], local[1], local[2], local[3], local[4], local[5] = nn, n1, n2, w11, w12, w22
    c0 = w11 * w22 - w12 * w12
    c1 = n2 * w12 - n1 * w22
    c2 = n1 * w12 - n2 * w11
    determinant = nn * c0 + n1 * c1 + n2 * c2
    # Where nothing can move no impulse changes anything: such a contact carries none.
    factor = 1.0 / determinant if determinant > 0.0 else 0.0
    inverse = row.inverse
    inverse[0], inverse[1], inverse[2] = factor * c0, factor * c1, factor * c2
    inverse[3] = factor * (nn * w22 - n2 * n2)
    inverse[4] = factor * (n1 * n2 - nn * w12)
    inverse[5] = factor * (nn * w11 - n1 * n1)
    largest = 0.5 * (w11 + w22) + math.sqrt(0.25 * (w11 - w22) ** 2 + w12 * w12)
    row.slide = 1.0 / largest if largest > 0.0 else 0.0
    return (nn + w11 + w22) / 3.0


@kernel
def to_world(row, vector):
    """From the frame of a contact to the world."""
    normal = row.normal
    t1 = row.t1
    t2 = row.t2
    return (
        vector[0] * normal[0] + vector[1] * t1[0] + vector[2] * t2[0],
        vector[0] * normal[1] + vector[1] * t1[1] + vector[2] * t2[1],
        vector[0] * normal[2] + vector[1] * t1[2] + vector[2] * t2[2],
    )


@kernel
def to_local(row, vector):
    """From the world to the frame of a contact."""
    return (
        vec3.dot(vec3.load(row.normal), vector),
        vec3.dot(vec3.load(row.t1), vector),
        vec3.dot(vec3.load(row.t2), vector),
    )


@kernel
def relative_velocity(row, nodes):
    """Velocity of b against a at a contact, world frame, without what is prescribed."""
    node_a = nodes[row.a]
    node_b = nodes[row.b]
    change = vec3.sub(vec3.load(node_b.velocity), vec3.load(node_a.velocity))
    change = vec3.add(change, vec3.cross(vec3.load(node_b.spin), vec3.load(row.arm_b)))
    return vec3.sub(change, vec3.cross(vec3.load(node_a.spin), vec3.load(row.arm_a)))


@kernel
def contact_velocity(row, nodes):
    """u of a contact in its own frame, without bias."""
    return vec3.add(to_local(row, relative_velocity(row, nodes)), vec3.load(row.prescribed))


@kernel
def normal_velocity(row, nodes):
    """u_n of a contact, without bias."""
    return vec3.dot(vec3.load(row.normal), relative_velocity(row, nodes)) + row.prescribed[0]


@kernel
def push_bodies(row, nodes, change):
    """Add the velocities that an impulse [N s], frame of the contact, makes."""
    impulse = to_world(row, change)
    node_a = nodes[row.a]
    node_b = nodes[row.b]
    turn = respond(node_a, vec3.cross(vec3.load(row.arm_a), impulse))
    vec3.store(node_a.velocity, vec3.add_scaled(vec3.load(node_a.velocity), -node_a.inverse_mass, impulse))
    vec3.store(node_a.spin, vec3.sub(vec3.load(node_a.spin), turn))
    turn = respond(node_b, vec3.cross(vec3.load(row.arm_b), impulse))
    vec3.store(node_b.velocity, vec3.add_scaled(vec3.load(node_b.velocity), node_b.inverse_mass, impulse))
    vec3.store(node_b.spin, vec3.add(vec3.load(node_b.spin), turn))
