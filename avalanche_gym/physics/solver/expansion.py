"""The second half of an impact by Poisson's hypothesis: normal impulses that are given, friction that they limit.

With r_n = e R_n for each contact, R_n being its impulse of compression, the tangential impulses are those of Coulomb
friction under a known load (Tresca): they minimise the kinetic energy,

    |t_i| <= mu_i r_ni,      u_ti = 0   or   t_i = -mu_i r_ni u_ti / |u_ti|,

a convex problem; sweeps over the contacts, each solved exactly, lead to it (Glocker & Pfeiffer 1995 state it as a
linear complementarity problem). For one contact, with W the part of its response in the tangent plane and q the slip
that is left without t,

    t = -(W + lambda)^-1 q,    lambda = 0 if that is short enough, else the root of |t| = mu r_n.
"""

from __future__ import annotations

import math

from ..jit import kernel
from ..maths import vec3
from .gauss_seidel import prepare_local, push
from .response import relative_velocity

# Sweeps at most, and the change of an impulse relative to the largest below which they end.
MOST_SWEEPS = 400
SETTLED = 1e-15
LIMIT_ITERATIONS = 60


@kernel
def limited_slip(w_11, w_12, w_22, q_1, q_2, limit):
    """(t_1, t_2): the impulse that stops a slip, or slows it with length ``limit``."""
    shift = 0.0
    low = 0.0
    high = math.inf
    t_1 = 0.0
    t_2 = 0.0
    for _ in range(LIMIT_ITERATIONS):
        a = w_11 + shift
        b = w_22 + shift
        determinant = a * b - w_12 * w_12
        if determinant <= 0.0:
            return 0.0, 0.0
        t_1 = (w_12 * q_2 - b * q_1) / determinant
        t_2 = (w_12 * q_1 - a * q_2) / determinant
        length = math.sqrt(t_1 * t_1 + t_2 * t_2)
        if length <= limit and shift == 0.0:
            return t_1, t_2
        if abs(length - limit) <= SETTLED * limit:
            break
        if length > limit:
            low = shift
        else:
            high = shift
        # Newton on 1 / |t| - 1 / limit, nearly linear in lambda: d|t|/dlambda = -t . (W + lambda)^-1 t / |t|.
        d_1 = (b * t_1 - w_12 * t_2) / determinant
        d_2 = (a * t_2 - w_12 * t_1) / determinant
        slope = (t_1 * d_1 + t_2 * d_2) / (length * length)
        step = shift + (length / limit - 1.0) / slope
        shift = step if low < step < high else (0.5 * (low + high) if high < math.inf else 2.0 * shift + w_11 + w_22)
        if shift == low or shift == high:
            break
    length = math.sqrt(t_1 * t_1 + t_2 * t_2)
    ratio = limit / length if length > 0.0 else 0.0
    return t_1 * ratio, t_2 * ratio


@kernel
def expand(rows, nodes, count):
    """Impulses of expansion of ``count`` rows whose ``impulse`` holds e R_n n, and ``free`` the velocity before it.

    The nodes' velocities are zero on entry and on return what the impulses change.
    """
    prepare_local(rows, nodes, count)
    largest = 0.0
    for index in range(count):
        row = rows[index]
        impulse = vec3.load(row.impulse)
        largest = max(largest, vec3.norm(impulse))
        # ``x`` keeps the normal impulse, while ``impulse`` comes to hold the whole.
        row.x[0] = vec3.norm(impulse)
        push(nodes[row.a], vec3.load(row.arm_a), impulse, -1.0)
        push(nodes[row.b], vec3.load(row.arm_b), impulse, 1.0)
    for _ in range(MOST_SWEEPS):
        moved = 0.0
        for index in range(count):
            row = rows[index]
            limit = row.friction * row.x[0]
            if limit <= 0.0:
                continue
            normal = vec3.load(row.normal)
            t1, t2 = vec3.tangents(normal)
            old = vec3.load(row.impulse)
            velocity = vec3.add(vec3.load(row.free), relative_velocity(row, nodes))
            r_1 = vec3.dot(old, t1)
            r_2 = vec3.dot(old, t2)
            w = row.local
            q_1 = vec3.dot(velocity, t1) - (w[3] * r_1 + w[4] * r_2)
            q_2 = vec3.dot(velocity, t2) - (w[4] * r_1 + w[5] * r_2)
            s_1, s_2 = limited_slip(w[3], w[4], w[5], q_1, q_2, limit)
            change = vec3.add(vec3.scale(s_1 - r_1, t1), vec3.scale(s_2 - r_2, t2))
            vec3.store(row.impulse, vec3.add(old, change))
            push(nodes[row.a], vec3.load(row.arm_a), change, -1.0)
            push(nodes[row.b], vec3.load(row.arm_b), change, 1.0)
            moved = max(moved, abs(s_1 - r_1) + abs(s_2 - r_2))
        if moved <= SETTLED * largest:
            break
