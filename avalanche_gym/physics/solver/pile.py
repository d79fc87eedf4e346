"""The pile tier: substeps of Gauss-Seidel sweeps, linear in the number of contacts.

The step h is cut into substeps h_s. In each the bodies gain what flight gives them, take up the impulses of the substep
before, and one sweep solves every contact in turn with all others held; then gaps advance with the velocities (Macklin
et al. 2019, "Small steps in physics simulation": many substeps of one sweep converge better than many sweeps of one
step). Geometry stays that of the start of the step. No velocity is spent on overlap: that is removed by sweeps over
positions, without friction, which add no energy.

A contact is solved in its own frame (normal, t1, t2), W its 3 x 3 response and u its velocity:

    stick   r <- r - W^-1 u                                        if that lies in the cone
    open    r <- 0                                                 if without impulse it would part
    slip    r_n <- max(r_n - u_n / W_nn, 0),   r_t <- the nearest point of |r_t| <= mu r_n to r_t - u_t / w

with w the larger eigenvalue of W_tt.

What stays unchanged under all three obeys the contact law exactly; the slip step is no exact local solution, which a
sweep that is followed by others does not need.
"""

from __future__ import annotations

import math

from ..jit import kernel
from ..maths import vec3
from .cone import project

# Share of an overlap that a step removes, by so many sweeps. More at a time lifts piles; fewer leave them deeper.
SHARE, POSITION_SWEEPS = 0.3, 3
# Sweeps while an overlap is deeper than what counts of it in a step.
MOST_POSITION_SWEEPS = 12
# Sweeps that take out all of the overlap.
MOST_PARTING_SWEEPS = 40


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
def prepare_response(row, nodes):
    """W of a contact, its inverse, and the length of its sliding steps; return trace(W) / 3."""
    node_a = nodes[row.a]
    node_b = nodes[row.b]
    normal = vec3.load(row.normal)
    t1 = vec3.load(row.t1)
    t2 = vec3.load(row.t2)
    arm_a = vec3.load(row.arm_a)
    arm_b = vec3.load(row.arm_b)
    a_n, a_1, a_2 = vec3.cross(arm_a, normal), vec3.cross(arm_a, t1), vec3.cross(arm_a, t2)
    b_n, b_1, b_2 = vec3.cross(arm_b, normal), vec3.cross(arm_b, t1), vec3.cross(arm_b, t2)
    ia_n, ia_1, ia_2 = respond(node_a, a_n), respond(node_a, a_1), respond(node_a, a_2)
    ib_n, ib_1, ib_2 = respond(node_b, b_n), respond(node_b, b_1), respond(node_b, b_2)
    direct = node_a.inverse_mass + node_b.inverse_mass
    nn = direct + vec3.dot(a_n, ia_n) + vec3.dot(b_n, ib_n)
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


@kernel
def relaxed(row, old, u_n, u_1, u_2):
    """The impulse of a contact that moves at (u_n, u_1, u_2) under ``old``, all others held."""
    m = row.inverse
    r_n = old[0] - (m[0] * u_n + m[1] * u_1 + m[2] * u_2)
    r_1 = old[1] - (m[1] * u_n + m[3] * u_1 + m[4] * u_2)
    r_2 = old[2] - (m[2] * u_n + m[4] * u_1 + m[5] * u_2)
    friction = row.friction
    if r_n >= 0.0 and r_1 * r_1 + r_2 * r_2 <= friction * friction * r_n * r_n:
        return r_n, r_1, r_2
    w = row.local
    if w[0] <= 0.0 or u_n >= w[0] * old[0] + w[1] * old[1] + w[2] * old[2]:
        return 0.0, 0.0, 0.0
    r_n = max(old[0] - u_n / w[0], 0.0)
    step = r_n - old[0]
    r_1 = old[1] - row.slide * (u_1 + w[1] * step)
    r_2 = old[2] - row.slide * (u_2 + w[2] * step)
    length = math.sqrt(r_1 * r_1 + r_2 * r_2)
    if length > friction * r_n:
        ratio = friction * r_n / length
        r_1 *= ratio
        r_2 *= ratio
    return r_n, r_1, r_2


@kernel
def warm_start(rows, nodes, num_contacts, num_bodies):
    """Velocities after the first substep's flight under the impulses of the last step."""
    for i in range(num_bodies):
        node = nodes[i]
        vec3.store(node.before, vec3.load(node.velocity))
        vec3.store(node.spin_before, vec3.load(node.spin))
        vec3.store(node.velocity, vec3.add(vec3.load(node.velocity), vec3.load(node.gain)))
        vec3.store(node.spin, vec3.add(vec3.load(node.spin), vec3.load(node.spin_gain)))
    for i in range(num_contacts):
        row = rows[i]
        if row.impulse[0] != 0.0:
            push_bodies(row, nodes, vec3.load(row.impulse))


@kernel
def go_on(nodes, num_bodies):
    """Velocities after the next substep's flight under the impulses of the last one: they change as they did."""
    for i in range(num_bodies):
        node = nodes[i]
        velocity, spin = vec3.load(node.velocity), vec3.load(node.spin)
        vec3.store(node.velocity, vec3.sub(vec3.scale(2.0, velocity), vec3.load(node.before)))
        vec3.store(node.spin, vec3.sub(vec3.scale(2.0, spin), vec3.load(node.spin_before)))
        vec3.store(node.before, velocity)
        vec3.store(node.spin_before, spin)


@kernel
def substep(rows, nodes, num_contacts, num_bodies, time_step):
    """One sweep; then gaps and bodies advance by a substep [s]."""
    for i in range(num_contacts):
        row = rows[i]
        change = relative_velocity(row, nodes)
        if row.lasting == 0:
            row.bias = max(row.open, 0.0) / time_step
        u_n = vec3.dot(vec3.load(row.normal), change) + row.prescribed[0] + row.bias
        old = vec3.load(row.impulse)
        if old[0] != 0.0 or u_n < 0.0:
            u_1 = vec3.dot(vec3.load(row.t1), change) + row.prescribed[1]
            u_2 = vec3.dot(vec3.load(row.t2), change) + row.prescribed[2]
            new = relaxed(row, old, u_n, u_1, u_2)
            vec3.store(row.impulse, new)
            vec3.store(row.total, vec3.add(vec3.load(row.total), new))
            push_bodies(row, nodes, vec3.sub(new, old))
    for i in range(num_contacts):
        row = rows[i]
        if row.lasting == 0:
            row.open += time_step * normal_velocity(row, nodes)
    for i in range(num_bodies):
        node = nodes[i]
        vec3.store(node.moved, vec3.add_scaled(vec3.load(node.moved), time_step, vec3.load(node.velocity)))
        vec3.store(node.turned, vec3.add_scaled(vec3.load(node.turned), time_step, vec3.load(node.spin)))


@kernel
def gap_after(row, nodes, time_step):
    """Gap [m] of a contact with the bodies moved as far as they are, after ``time_step`` [s]."""
    node_a = nodes[row.a]
    node_b = nodes[row.b]
    change = vec3.sub(vec3.load(node_b.moved), vec3.load(node_a.moved))
    change = vec3.add(change, vec3.cross(vec3.load(node_b.turned), vec3.load(row.arm_b)))
    change = vec3.sub(change, vec3.cross(vec3.load(node_a.turned), vec3.load(row.arm_a)))
    return row.gap + vec3.dot(vec3.load(row.normal), change) + time_step * row.prescribed[0]


@kernel
def remove_overlap(rows, nodes, num_contacts, time_step, most):
    """Sweeps that move the bodies until a share of each overlap is gone; at most ``most`` [m] of it counts."""
    deepest = 0.0
    for i in range(num_contacts):
        row = rows[i]
        gap = gap_after(row, nodes, time_step)
        row.push = 0.0
        row.floor = gap + SHARE * min(-gap, most) if gap < 0.0 else 0.0
        deepest = max(deepest, -gap)
    if deepest == 0.0:
        return
    for _ in range(POSITION_SWEEPS if deepest < most else MOST_POSITION_SWEEPS):
        for i in range(num_contacts):
            row = rows[i]
            lack = row.floor - gap_after(row, nodes, time_step)
            if row.local[0] > 0.0 and (lack > 0.0 or row.push > 0.0):
                push = max(row.push + lack / row.local[0], 0.0)
                shove(row, nodes, push - row.push)
                row.push = push


@kernel
def part(rows, nodes, num_contacts, enough):
    """Sweeps that move the bodies until no gap is below its floor by more than ``enough`` [m]."""
    for _ in range(MOST_PARTING_SWEEPS):
        deepest = 0.0
        for i in range(num_contacts):
            row = rows[i]
            lack = row.floor - gap_after(row, nodes, 0.0)
            if row.local[0] > 0.0 and (lack > 0.0 or row.push > 0.0):
                push = max(row.push + lack / row.local[0], 0.0)
                shove(row, nodes, push - row.push)
                row.push = push
                deepest = max(deepest, lack)
        if deepest <= enough:
            return


@kernel
def shove(row, nodes, multiplier):
    """Move the bodies of a contact apart along its normal."""
    node_a = nodes[row.a]
    node_b = nodes[row.b]
    push = vec3.scale(multiplier, vec3.load(row.normal))
    turn = respond(node_a, vec3.cross(vec3.load(row.arm_a), push))
    vec3.store(node_a.moved, vec3.add_scaled(vec3.load(node_a.moved), -node_a.inverse_mass, push))
    vec3.store(node_a.turned, vec3.sub(vec3.load(node_a.turned), turn))
    turn = respond(node_b, vec3.cross(vec3.load(row.arm_b), push))
    vec3.store(node_b.moved, vec3.add_scaled(vec3.load(node_b.moved), node_b.inverse_mass, push))
    vec3.store(node_b.turned, vec3.add(vec3.load(node_b.turned), turn))


@kernel
def law_error(row, impulse, velocity):
    """Wd |F|^2 of a contact (solver/residual.py), and Wd; vectors in the frame of the contact."""
    scale = (row.local[0] + row.local[3] + row.local[5]) / 3.0
    if scale <= 0.0:
        return 0.0, 0.0
    slip = math.sqrt(velocity[1] * velocity[1] + velocity[2] * velocity[2])
    corrected = (velocity[0] + row.friction * slip, velocity[1], velocity[2])
    aim = vec3.add_scaled(impulse, -1.0 / scale, corrected)
    error = vec3.sub(impulse, project(aim, (1.0, 0.0, 0.0), row.friction))
    return scale * vec3.norm_squared(error), scale


@kernel
def pile_residual(rows, nodes, num_contacts, violation):
    """Relative residual of the impulses ``total`` with the velocities of the nodes; ``violation``: that of flight."""
    squares = 0.0
    impulses = 0.0
    for i in range(num_contacts):
        row = rows[i]
        velocity = contact_velocity(row, nodes)
        total = vec3.load(row.total)
        error, scale = law_error(row, total, (velocity[0] + row.bias, velocity[1], velocity[2]))
        squares += error
        impulses += scale * vec3.norm_squared(total)
    size = max(violation, math.sqrt(impulses))
    return math.sqrt(squares) / size if size > 0.0 else 0.0
