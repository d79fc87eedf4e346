"""The pile tier: substeps of Gauss-Seidel sweeps, linear in the number of contacts.

The step h is cut into substeps h_s. In each the bodies gain what flight gives them, take up the impulses of the substep
before, and one sweep solves every contact in turn with all others held; then gaps advance with the velocities (Macklin
et al. 2019, "Small steps in physics simulation": many substeps of one sweep converge better than many sweeps of one
step). Geometry stays that of the start of the step. No velocity is spent on overlap: that is removed by sweeps over
positions, without friction, which add no velocity, though they lift what they part.

A contact is solved in its own frame (normal, t1, t2), W its 3 x 3 response and u its velocity:

    stick   r <- r - W^-1 u                                        if that lies in the cone
    open    r <- 0                                                 if without impulse it would part
    slip    r_n <- max(r_n - u_n / W_nn, 0),   r_t <- the nearest point of |r_t| <= mu r_n to r_t - u_t / w

with w the larger eigenvalue of W_tt.

What stays unchanged under all three obeys the contact law exactly; the slip step is no exact local solution, which a
sweep that is followed by others does not need.

What stops a body does so once. Taken up again in the next substep it throws the body back, and one sweep does not
settle that, nor the blow itself where it goes on to others. Few bodies can afford better: impulses that leapt up are
not taken up again, and a substep with such a blow is swept until there is none. In a crowd there is one in every
substep, and loads that grow look like blows: piles that forget them sink. A crowd is swept again while much of its load
changes, as where a deep heap is caught that has fallen: a sweep hands a load on by one body, more or less.
"""

from __future__ import annotations

import math

from ..jit import kernel
from ..maths import vec3
from .cone import project
from .pile_moments import moment_error, relax_moment, turn_bodies
from .pile_response import contact_velocity, normal_velocity, push_bodies, relative_velocity

# Share of an overlap that a step removes, by so many sweeps. More at a time lifts piles; fewer leave them deeper.
SHARE, POSITION_SWEEPS = 0.3, 3
# Sweeps while an overlap is deeper than what counts of it in a step. Fewer: a box under a heap that is pressed into the
# ground by one edge goes on sinking, to several millimetres.
MOST_POSITION_SWEEPS = 30
# A crowd is not moved for less than this fraction of what counts of an overlap in a step. Larger: it lies deeper. None:
# all of a heap is swept, and stirred, for the sake of the one deep contact in it.
LEFT = 0.05
# An impulse that grows by more than this factor from one substep to the next is a blow. Smaller: loads that settle are
# taken for blows.
LEAP = 2.0
# A crowd is swept again while a sweep changes more than this share of its load. Larger: loads of deep heaps that fall
# do not get to the ground; smaller: heaps that lie are swept more than they need.
UNSETTLED = 0.1


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
def warm_start(rows, moments, nodes, num_contacts, num_bodies):
    """Velocities after the first substep's flight under the impulses of the last step.

    ``moments`` has a record for each row where the scene has rolling or torsional friction, else none; so everywhere.
    """
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
    for i in range(min(num_contacts, moments.shape[0])):
        if moments[i].stiffness > 0.0:
            turn_bodies(rows[i], nodes, vec3.load(moments[i].impulse))


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
def forget_blows(rows, nodes, num_contacts):
    """Take back what go_on repeats of impulses that leapt up in the last substep: something was stopped there, once."""
    for i in range(num_contacts):
        row = rows[i]
        impulse, earlier = vec3.load(row.impulse), vec3.load(row.earlier)
        if impulse[0] > LEAP * earlier[0]:
            push_bodies(row, nodes, vec3.sub(earlier, impulse))
            vec3.store(row.impulse, earlier)
        vec3.store(row.earlier, impulse)


@kernel
def sweep(rows, moments, nodes, num_contacts):
    """Solve every contact in turn with all others held; return whether one of them took a blow, and whether much of the
    load has changed.
    """
    struck = False
    changed = 0.0
    load = 0.0
    for i in range(num_contacts):
        row = rows[i]
        change = relative_velocity(row, nodes)
        u_n = vec3.dot(vec3.load(row.normal), change) + row.prescribed[0] + row.bias
        old = vec3.load(row.impulse)
        if old[0] != 0.0 or u_n < 0.0:
            u_1 = vec3.dot(vec3.load(row.t1), change) + row.prescribed[1]
            u_2 = vec3.dot(vec3.load(row.t2), change) + row.prescribed[2]
            new = relaxed(row, old, u_n, u_1, u_2)
            vec3.store(row.impulse, new)
            push_bodies(row, nodes, vec3.sub(new, old))
            struck = struck or new[0] > LEAP * row.earlier[0]
            changed += abs(new[0] - old[0])
            load += new[0]
        if moments.shape[0] > 0:
            relax_moment(row, moments[i], nodes)
    return struck, changed > UNSETTLED * load


@kernel
def substep(rows, moments, nodes, num_contacts, num_bodies, time_step, most_sweeps, few):
    """One sweep, or up to ``most_sweeps`` while loads change, those of ``few`` bodies by blows; then gaps and bodies
    advance by a substep [s].
    """
    for i in range(num_contacts):
        row = rows[i]
        if row.lasting == 0:
            row.bias = max(row.open, 0.0) / time_step
    for _ in range(most_sweeps):
        struck, unsettled = sweep(rows, moments, nodes, num_contacts)
        if not (struck if few else unsettled):
            break
    for i in range(num_contacts):
        row = rows[i]
        vec3.store(row.total, vec3.add(vec3.load(row.total), vec3.load(row.impulse)))
        if row.lasting == 0:
            row.open += time_step * normal_velocity(row, nodes)
    for i in range(min(num_contacts, moments.shape[0])):
        vec3.store(moments[i].total, vec3.add(vec3.load(moments[i].total), vec3.load(moments[i].impulse)))
    for i in range(num_bodies):
        node = nodes[i]
        vec3.store(node.moved, vec3.add_scaled(vec3.load(node.moved), time_step, vec3.load(node.velocity)))
        vec3.store(node.turned, vec3.add_scaled(vec3.load(node.turned), time_step, vec3.load(node.spin)))


@kernel
def gap_after(row, nodes):
    """Gap [m] of a contact with the bodies moved as far as they are."""
    node_a = nodes[row.a]
    node_b = nodes[row.b]
    moved = vec3.dot(vec3.load(row.normal), vec3.sub(vec3.load(node_b.moved), vec3.load(node_a.moved)))
    turned = vec3.dot(vec3.load(row.lever_b), vec3.load(node_b.turned))
    turned -= vec3.dot(vec3.load(row.lever_a), vec3.load(node_a.turned))
    return row.gap + (moved + turned)


@kernel
def remove_overlap(rows, nodes, num_contacts, time_step, most, share):
    """Sweeps that move the bodies until this share of each overlap is gone; at most ``most`` [m] of it counts.

    The gaps of the rows then contain what prescribed motion does to them within ``time_step`` [s].
    """
    deepest = 0.0
    for i in range(num_contacts):
        row = rows[i]
        row.gap += time_step * row.prescribed[0]
        gap = gap_after(row, nodes)
        row.push = 0.0
        row.floor = gap + share * min(-gap, most) if gap < 0.0 else 0.0
        deepest = max(deepest, -gap)
    if deepest == 0.0:
        return
    crowd = share < 1.0
    sweeps = POSITION_SWEEPS if deepest < most and crowd else MOST_POSITION_SWEEPS
    sweep_positions(rows, nodes, num_contacts, 1, sweeps, LEFT * most if crowd else 0.0)


@kernel
def sweep_positions(rows, nodes, num_contacts, first, last, enough):
    """Move the bodies, by the sweeps first <= number <= last, until no gap is below its floor by more than ``enough``
    [m].

    A contact that is as near to its floor as that is left, and one whose bodies have not moved since it was looked at
    is passed over: work goes where something moves. Returns whether all gaps are as they should be.
    """
    for number in range(first, last + 1):
        still = True
        for i in range(num_contacts):
            row = rows[i]
            if max(nodes[row.a].shoved, nodes[row.b].shoved) < number - 1:
                continue
            lack = row.floor - gap_after(row, nodes)
            if row.local[0] > 0.0 and (lack > enough or row.push > 0.0):
                push = max(row.push + lack / row.local[0], 0.0)
                if abs(push - row.push) * row.local[0] > enough:
                    shove(row, nodes, push - row.push, number)
                    row.push = push
                    still = False
        if still:
            return True
    return False


@kernel
def _shift(node, multiplier, normal, answer, number):
    vec3.store(node.moved, vec3.add_scaled(vec3.load(node.moved), node.inverse_mass * multiplier, normal))
    vec3.store(node.turned, vec3.add_scaled(vec3.load(node.turned), multiplier, answer))
    if node.shoved >= 0:
        node.shoved = number


@kernel
def shove(row, nodes, multiplier, number):
    """Move the bodies of a contact apart along its normal, in the sweep of this number."""
    normal = vec3.load(row.normal)
    _shift(nodes[row.a], -multiplier, normal, vec3.load(row.answer_a), number)
    _shift(nodes[row.b], multiplier, normal, vec3.load(row.answer_b), number)


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
def pile_residual(rows, moments, nodes, num_contacts, violation):
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
        if moments.shape[0] > 0:
            error, size = moment_error(row, moments[i], nodes)
            squares += error
            impulses += size
    size = max(violation, math.sqrt(impulses))
    return math.sqrt(squares) / size if size > 0.0 else 0.0
