"""Interior-point method for the contact law: from a cold start to a residual of 1e-4 in about ten factorisations.

With x = (mu r_n, r_t) and z = (u_n / mu + |u_t|, u_t) the contact law is that x and z lie in the cone |.t| <= .n and
are complementary, x o z = 0 (solver/lorentz.py; De Saxce & Feng 1998). The method follows the path x o z = m e to
m = 0 with Newton steps in the scaling of Nesterov and Todd and with the predictor and corrector of Mehrotra (Andersen,
Roos & Terlaky 2003, sec. 3; for friction Acary, Armand, Nguyen & Shpakovych 2023, who hold |u_t| fixed in an outer
loop; here its derivative is part of the step). z is an unknown of its own; z - z(u) goes to zero along with m.

One step: with Z = dz/du, D = dx/dr and P = W^2 the scaling, x = P z,

    dz = Z du + z(u) - z,        dx = a - P dz,        dr = D^-1 dx = A - B du,   B = D^-1 P Z,

so it has the form of the proximal Newton step and goes through the same assembly and factorisation. a is -x for the
predictor, and s m z^-1 - x - (what the predictor left out) for the corrector.

Unlike Newton on the law itself it needs no guess of which contacts stick, slip or open, and cannot be misled by one.
It cannot profit from a good guess either, and where both x and z vanish it stops at a residual of about the square
root of round-off: it goes before Newton, not in its place.
"""

from __future__ import annotations

import math

import numpy as np

from ..jit import kernel
from ..maths import mat3, vec3
from . import lorentz
from .assembly import assemble_matrix, set_right_side, set_velocities
from .factorisation import factorise, solve
from .iterate import keep_best, restore_best
from .linearisation import add_matrices, outer
from .residual import evaluate
from .response import add_impulse, clear, relative_velocity
from .workspace import OPEN, STICK

# Part of the way to the surface of the cone that a step may go.
FRACTION = 0.99
# Least eigenvalue of a contact's product x o z relative to the mean, below which a step is shortened: no contact may
# run ahead of the others. Smaller: longer steps that get stuck at the surface.
CENTRALITY = 1e-3
# Regularisation of |u_t| at zero, relative to the size of velocities.
SMOOTHING = 1e-12
# A step this short is not taken before another target has been tried.
SHORT = 0.1


@kernel
def start(rows, num_contacts):
    """x and z in the middle of the cone; returns the size of z in units of sqrt(Wd) [J^1/2].

    z is as large as the free velocities, x as large as they call for or as the best impulses so far: under a heavy body
    impulses are far larger than the motion of the light ones suggests, and from below the method would climb slowly.
    """
    motion = 0.0
    load = 0.0
    count = 0
    for i in range(num_contacts):
        row = rows[i]
        if row.scale > 0.0:
            motion += vec3.norm_squared(vec3.load(row.free)) / row.scale
            load += vec3.norm_squared(vec3.load(row.best)) * row.scale
            count += 1
    size = math.sqrt(motion / max(count, 1))
    load = math.sqrt(load / max(count, 1))
    for i in range(num_contacts):
        row = rows[i]
        if row.scale > 0.0:
            normal = vec3.load(row.normal)
            root = math.sqrt(row.scale)
            vec3.store(row.x, vec3.scale(max(size, load) / root, normal))
            vec3.store(row.z, vec3.scale(size * root, normal))
            set_impulse(row)
    return size


@kernel
def set_impulse(row):
    """r = D^-1 x."""
    vec3.store(row.impulse, unscale(row, vec3.load(row.x)))


@kernel
def slack(row, smoothing):
    """(z(u), t): t is the direction of slip, smoothed near zero."""
    normal = vec3.load(row.normal)
    velocity = vec3.load(row.velocity)
    along = vec3.dot(velocity, normal)
    if row.friction == 0.0:
        return vec3.scale(along, normal), vec3.ZERO
    tangential = vec3.add_scaled(velocity, -along, normal)
    slip = math.sqrt(vec3.norm_squared(tangential) + smoothing * smoothing * row.scale)
    return vec3.add_scaled(tangential, along / row.friction + slip, normal), vec3.scale(1.0 / slip, tangential)


@kernel
def unscale(row, v):
    """D^-1 v, without the tangential part where there is no friction."""
    normal = vec3.load(row.normal)
    along = vec3.dot(v, normal)
    if row.friction == 0.0:
        return vec3.scale(along, normal)
    return vec3.add_scaled(v, along / row.friction - along, normal)


@kernel
def linearise_interior(row, smoothing):
    """Store B = D^-1 P Z of a contact, and A of the predictor."""
    normal = vec3.load(row.normal)
    friction = row.friction
    x = vec3.load(row.x)
    z = vec3.load(row.z)
    w, stretch = lorentz.scaling_point(x, z, normal)
    vec3.store(row.scaling, w)
    row.stretch = stretch
    if friction == 0.0:
        stiffness = outer(stretch, normal, normal)
    else:
        _, t = slack(row, smoothing)
        # Z = 1 + n b^T,  P Z = P + (P n) b^T,  D^-1 = 1 + excess n n^T.
        excess = 1.0 / friction - 1.0
        b = vec3.add_scaled(t, excess, normal)
        along = vec3.dot(w, normal)
        p_n = vec3.sub(vec3.scale(2.0 * stretch * along, w), vec3.scale(stretch, normal))
        stiffness = add_matrices(outer(2.0 * stretch, w, w), outer(-2.0 * stretch, normal, normal))
        stiffness = add_matrices(stiffness, (stretch, 0.0, 0.0, 0.0, stretch, 0.0, 0.0, 0.0, stretch))
        stiffness = add_matrices(stiffness, outer(1.0, p_n, b))
        low = vec3.add_scaled(p_n, vec3.dot(p_n, normal), b)
        stiffness = add_matrices(stiffness, outer(excess, normal, low))
    for k in range(9):
        row.stiffness[k] = stiffness[k]
    row.status = STICK
    set_offset(row, vec3.neg(x), w, stretch, smoothing)


@kernel
def set_offset(row, a, w, stretch, smoothing):
    """A = D^-1 (a - P (z(u) - z))."""
    normal = vec3.load(row.normal)
    gap, _ = slack(row, smoothing)
    gap = vec3.sub(gap, vec3.load(row.z))
    pushed = vec3.add_scaled(gap, 2.0 * vec3.dot(w, gap), w)
    pushed = vec3.add_scaled(pushed, -2.0 * vec3.dot(normal, gap), normal)
    vec3.store(row.offset, unscale(row, vec3.add_scaled(a, -stretch, pushed)))


@kernel
def corrector(row, target, weight, smoothing):
    """Store the A that aims at x o z = ``target`` e, less ``weight`` times what the predictor's dx and dz left out."""
    normal = vec3.load(row.normal)
    x = vec3.load(row.x)
    z = vec3.load(row.z)
    w = vec3.load(row.scaling)
    stretch = row.stretch
    dx = lorentz.scale_by(lorentz.reflect(w, normal), normal, vec3.load(row.dx))
    dz = lorentz.scale_by(w, normal, vec3.load(row.dz))
    left_out = lorentz.divide(lorentz.product(dx, dz, normal), lorentz.scale_by(w, normal, z), normal)
    aim = vec3.scale(target / lorentz.determinant(z, normal), lorentz.reflect(z, normal))
    a = vec3.add_scaled(vec3.sub(aim, x), -weight, lorentz.scale_by(w, normal, left_out))
    set_offset(row, a, w, stretch, smoothing)


@kernel
def direction(row, nodes, smoothing):
    """Store dx and dz of a contact for the solution in ``nodes``; the largest step before either leaves the cone."""
    normal = vec3.load(row.normal)
    friction = row.friction
    change = relative_velocity(row, nodes)
    step = vec3.sub(vec3.load(row.offset), mat3.apply(mat3.load(row.stiffness), change))
    step_n = vec3.dot(step, normal)
    change_n = vec3.dot(change, normal)
    gap, t = slack(row, smoothing)
    gap = vec3.sub(gap, vec3.load(row.z))
    if friction == 0.0:
        dx = step
        dz = vec3.add_scaled(gap, change_n, normal)
    else:
        dx = vec3.add_scaled(step, friction * step_n - step_n, normal)
        dz = vec3.add_scaled(vec3.add(gap, change), change_n / friction - change_n + vec3.dot(t, change), normal)
    vec3.store(row.dx, dx)
    vec3.store(row.dz, dz)
    length = lorentz.step_to_surface(vec3.load(row.x), dx, normal)
    return min(length, lorentz.step_to_surface(vec3.load(row.z), dz, normal))


@kernel
def central(row, step, mean):
    """Whether the contact's product at that step has no eigenvalue far below the mean."""
    normal = vec3.load(row.normal)
    x = vec3.add_scaled(vec3.load(row.x), step, vec3.load(row.dx))
    z = vec3.add_scaled(vec3.load(row.z), step, vec3.load(row.dz))
    inner = vec3.dot(x, z)
    squares = lorentz.determinant(x, normal) * lorentz.determinant(z, normal)
    least = squares / (inner + math.sqrt(max(inner * inner - squares, 0.0)))
    return least >= CENTRALITY * mean


@kernel
def interior_point(
    rows, nodes, blocks, index, num_contacts, num_bodies, num_handles, slots, violation, goal, best, budget
):
    """Iterate from the middle of the cone until the residual is below ``goal``, or ``budget`` factorisations are spent.

    Returns:
        best residual (its impulses in ``rows.best``), factorisations spent. The iterate is left where it stopped.
    """
    smoothing = SMOOTHING * start(rows, num_contacts)
    residual, _ = evaluate(rows, nodes, num_contacts, num_bodies, violation)
    spent = 0
    # Not a literal, for which the assembly and the factorisation would be compiled once more.
    symmetric = np.int64(0)
    while spent < budget and residual > goal:
        spent += 1
        clear(nodes, num_bodies + 1)
        total = 0.0
        count = 0
        for i in range(num_contacts):
            row = rows[i]
            if row.scale > 0.0:
                linearise_interior(row, smoothing)
                add_impulse(row, nodes, vec3.load(row.offset))
                total += vec3.dot(vec3.load(row.x), vec3.load(row.z))
                count += 1
            else:
                row.status = OPEN
        assemble_matrix(rows, nodes, blocks, index, num_contacts, num_bodies, num_handles, slots, symmetric)
        factorise(blocks, index, num_bodies, num_handles, slots, symmetric)
        mean = total / count
        target = 0.0
        weight = 1.0
        step = 0.0
        for phase in range(3):
            if phase > 0:
                clear(nodes, num_bodies + 1)
                for i in range(num_contacts):
                    row = rows[i]
                    if row.scale > 0.0:
                        corrector(row, target, weight, smoothing)
                        add_impulse(row, nodes, vec3.load(row.offset))
            set_right_side(nodes, num_bodies)
            solve(blocks, index, nodes, num_bodies, num_handles, slots)
            set_velocities(nodes, num_bodies)
            step = 1.0
            linear = 0.0
            square = 0.0
            for i in range(num_contacts):
                row = rows[i]
                if row.scale > 0.0:
                    step = min(step, direction(row, nodes, smoothing))
                    dx = vec3.load(row.dx)
                    dz = vec3.load(row.dz)
                    linear += vec3.dot(vec3.load(row.x), dz) + vec3.dot(vec3.load(row.z), dx)
                    square += vec3.dot(dx, dz)
            if phase == 0:
                target = mean * (1.0 - step) ** 3
                continue
            step *= FRACTION
            trials = 0
            i = 0
            while i < num_contacts and trials < 20:
                reached = (total + step * (linear + step * square)) / count
                if rows[i].scale > 0.0 and not central(rows[i], step, reached):
                    step *= 0.8
                    trials += 1
                    i = 0
                else:
                    i += 1
            if step > SHORT:
                break
            # The corrector led astray: aim at the middle of the cone instead, without it.
            target = 0.5 * mean
            weight = 0.0
        for i in range(num_contacts):
            row = rows[i]
            if row.scale > 0.0:
                vec3.store(row.x, vec3.add_scaled(vec3.load(row.x), step, vec3.load(row.dx)))
                vec3.store(row.z, vec3.add_scaled(vec3.load(row.z), step, vec3.load(row.dz)))
                set_impulse(row)
        residual, _ = evaluate(rows, nodes, num_contacts, num_bodies, violation)
        if not math.isfinite(residual):
            restore_best(rows, num_contacts)
            break
        if residual < best:
            best = residual
            keep_best(rows, num_contacts)
    return best, spent
