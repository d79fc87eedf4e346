"""Free rotation of a body with three different moments of inertia, exact for every time step.

Let l be the unit vector of the angular momentum in the principal frame, Lambda its length and d_i = 1 / I_i. Euler's
equations read l' = Lambda l x (d l), that is

    x' = a y z,  y' = b z x,  z' = c x y,    a = Lambda (d3 - d2), b = Lambda (d1 - d3), c = Lambda (d2 - d1).

*The angular momentum in the body.* b c x^2, c a y^2 and a b z^2 have the same derivative, so each is wp(t + t0) - e_i with
one Weierstrass function wp. The addition theorem of sqrt(wp - e_i) carries them over any time h without a look for t0:

    x(h) = (x p2 p3 + a y z p1) / (p1^2 - b c x^2),    p_i = sqrt(wp(h) - e_i),  and so on in turn,

the same denominator for all three (Whittaker and Watson, sec. 20.33 and 22.2, where sqrt(wp - e_i) are ns, cs and ds of
Jacobi). No amplitude or phase is solved for, so nothing fails as two moments meet, at the separatrix or on an axis. wp(h)
comes from its Laurent series; everything is evaluated as an increment, so small steps lose nothing to cancellation.

*The orientation.* R(h) = R(0) exp(psi l0) M, where M is the smallest rotation from l(h) to l0: it keeps the angular
momentum in the world whatever psi is. Its angle obeys (compare Celledoni, Fasso, Saefstroem, Zanna 2008, "The exact
computation of the free rigid body motion", sec. 3, where a fixed axis takes the place of l0)

    psi' = Lambda (d l).(l + l0) / (1 + l.l0) = Lambda (d2 + (2 kappa + nu) / (2 + mu)),

kappa = l0.(D l0), nu = l0.D (l - l0), mu = l0.(l - l0), D = d - d2. All but a remainder of third order in h is known,
psi = Lambda h (d2 + kappa) + Lambda int (nu - kappa mu) / (2 + mu) dt, and that is left to Gauss's rule.

*Range.* lambda = sqrt(largest |e_i - e_j|) is the rate of l and sets the distance of all poles (at least pi / lambda from
0, pi / (2 lambda) from the real axis), so a bound on lambda h alone bounds every error, for all bodies. Longer steps are cut;
whole periods are taken at once.
"""

from __future__ import annotations

import math

import numpy as np

from ..jit import kernel
from ..maths import mat3, quat, vec3
from .rotation import add_normalized, turn_increment

# Largest lambda h of one piece of a step: the series of wp is cut below 1e-17 of it, the five nodes of the quadrature leave
# less than 1e-17 rad.
LARGEST_PIECE = 0.25
# Beyond this lambda h it pays to look for whole periods (one is at least 2 pi).
WORTH_REDUCING = 20.0
# A period within the last bits of the separatrix has 4 ln(4 / 1e-162) / LARGEST_PIECE pieces at most.
MAX_PIECES = 8192
# The arithmetic-geometric mean doubles its digits: from any two floats, 15 steps reach the last bit.
MAX_MEANS = 20

NODES, WEIGHTS = (0.5 * array for array in np.polynomial.legendre.leggauss(5))
NODES = NODES + 0.5


@kernel
def laurent_series(g2, g3):
    """Coefficients c_2 ... c_8 of wp(h) = h^-2 + sum c_k h^(2k - 2) (Abramowitz and Stegun, 18.5.2 and 18.5.3)."""
    c2 = g2 / 20.0
    c3 = g3 / 28.0
    c4 = c2 * c2 / 3.0
    c5 = 3.0 * c2 * c3 / 11.0
    c6 = (2.0 * c2 * c2 * c2 + 3.0 * c3 * c3) / 39.0
    c7 = 2.0 * c2 * c2 * c3 / 33.0
    c8 = 5.0 * c2 * (11.0 * c2 * c2 * c2 + 36.0 * c3 * c3) / 7293.0
    return c2, c3, c4, c5, c6, c7, c8


@kernel
def increment(l, abc, e, mean, series, h):
    """l(h) - l(0) for a piece h [s] of a step; e and mean are the e_i and the mean of b c x^2, c a y^2, a b z^2 [1/s^2]."""
    s = h * h
    c2, c3, c4, c5, c6, c7, c8 = series
    w = s * s * (c2 + s * (c3 + s * (c4 + s * (c5 + s * (c6 + s * (c7 + s * c8))))))
    # h p_i - 1, from h^2 p_i^2 - 1 = w - h^2 e_i.
    q1 = w - s * e[0]
    q2 = w - s * e[1]
    q3 = w - s * e[2]
    r1 = q1 / (1.0 + math.sqrt(1.0 + q1))
    r2 = q2 / (1.0 + math.sqrt(1.0 + q2))
    r3 = q3 / (1.0 + math.sqrt(1.0 + q3))
    # h^2 times the common denominator, less 1.
    d = w - s * mean
    inverse = 1.0 / (1.0 + d)
    x, y, z = l
    return (
        inverse * (x * (r2 + r3 + r2 * r3 - d) + abc[0] * h * y * z * (1.0 + r1)),
        inverse * (y * (r3 + r1 + r3 * r1 - d) + abc[1] * h * z * x * (1.0 + r2)),
        inverse * (z * (r1 + r2 + r1 * r2 - d) + abc[2] * h * x * y * (1.0 + r3)),
    )


@kernel
def invariants(l, abc):
    """The e_i, the mean of b c x^2, c a y^2, a b z^2 [1/s^2], and lambda [1/s]."""
    a, b, c = abc
    w1 = b * c * l[0] * l[0]
    w2 = c * a * l[1] * l[1]
    w3 = a * b * l[2] * l[2]
    # Differences of two: each e_i is one third of two of them, so nothing cancels twice.
    w12 = w1 - w2
    w23 = w2 - w3
    w31 = w3 - w1
    e = ((w31 - w12) / 3.0, (w12 - w23) / 3.0, (w23 - w31) / 3.0)
    return e, (w1 + w2 + w3) / 3.0, math.sqrt(max(abs(w12), abs(w23), abs(w31)))


@kernel
def period(e):
    """Time [s] after which l returns, 2 pi / agm(sqrt(e_max - e_min), sqrt(e_max - e_mid)); infinite on the separatrix."""
    high = max(e[0], e[1], e[2])
    low = min(e[0], e[1], e[2])
    # The middle one by its distance from the largest: the smallest positive distance.
    near = high - low
    first = True
    for i in range(3):
        if e[i] == high and first:
            first = False
        else:
            near = min(near, high - e[i])
    a = math.sqrt(high - low)
    g = math.sqrt(near)
    for _ in range(MAX_MEANS):
        a, g = 0.5 * (a + g), math.sqrt(a * g)
    return 2.0 * math.pi / a if g > 0.0 else math.inf


@kernel
def turn(l0, change, psi):
    """exp(psi l0) M - 1 as a quaternion, M the smallest rotation from l0 + change to l0."""
    # |l0 + l|^2 / 4 = 1 - |change|^2 / 4 is the square of cos(angle / 2).
    quarter = 0.25 * vec3.norm_squared(change)
    m0 = math.sqrt(1.0 - quarter)
    m = vec3.scale(0.5 / m0, vec3.cross(change, l0))
    c, s = turn_increment(0.5 * psi)
    axial = vec3.scale(s, l0)
    v = vec3.add_scaled(vec3.add(vec3.add_scaled(m, c, m), vec3.scale(m0, axial)), 1.0, vec3.cross(axial, m))
    return (c * m0 - quarter / (1.0 + m0), v[0], v[1], v[2])


@kernel
def multiply_increment(q, d):
    """q (d - 1) for d - 1 given."""
    return (
        q[0] * d[0] - q[1] * d[1] - q[2] * d[2] - q[3] * d[3],
        q[0] * d[1] + q[1] * d[0] + q[2] * d[3] - q[3] * d[2],
        q[0] * d[2] - q[1] * d[3] + q[2] * d[0] + q[3] * d[1],
        q[0] * d[3] + q[1] * d[2] - q[2] * d[1] + q[3] * d[0],
    )


@kernel
def advance_pieces(q, l, reference, abc, duration):
    """q and l after a duration [s] taken in pieces; ``reference`` is Lambda d2 [rad/s].

    Not finite if the pieces run out, which only a fast spin within the last bit of the separatrix can do.
    """
    a, b, c = abc
    remaining = duration
    for _ in range(MAX_PIECES):
        x, y, z = l
        e, mean, rate = invariants(l, abc)
        h = remaining
        # Two of three components zero: a steady turn about a principal axis, in one piece.
        steady = x * y == 0.0 and y * z == 0.0 and z * x == 0.0
        if rate * abs(h) > LARGEST_PIECE and not steady:
            h /= math.ceil(rate * abs(h) / LARGEST_PIECE)
        last = h == remaining
        series = laurent_series(
            2.0 * (e[0] * e[0] + e[1] * e[1] + e[2] * e[2]), 4.0 * e[0] * e[1] * e[2]
        )
        # Lambda D l0, as Lambda (d1 - d2) = -c and Lambda (d3 - d2) = a.
        gx = -c * x
        gz = a * z
        kappa = gx * x + gz * z
        integral = 0.0
        change = vec3.ZERO
        if not steady:
            for k in range(5):
                change = increment(l, abc, e, mean, series, NODES[k] * h)
                mu = vec3.dot(l, change)
                nu = gx * change[0] + gz * change[2]
                integral += WEIGHTS[k] * (nu - kappa * mu) / (2.0 + mu)
            change = increment(l, abc, e, mean, series, h)
        psi = h * (reference + kappa + integral)
        q = add_normalized(q, multiply_increment(q, turn(l, change, psi)))
        l = vec3.normalize(vec3.add(l, change))
        if last:
            return q, l
        remaining -= h
    return (math.nan, math.nan, math.nan, math.nan), l


@kernel
def advance_triaxial(q, angular_velocity, inertia, time_step):
    """Free rotation of any body: orientation and angular velocity [rad/s], world frame, after ``time_step`` [s]."""
    i1, i2, i3 = inertia
    rotation = quat.to_matrix(q)
    momentum = vec3.multiply(inertia, mat3.apply_transposed(rotation, angular_velocity))
    magnitude = vec3.norm(momentum)
    if magnitude == 0.0:
        return q, angular_velocity
    world_momentum = mat3.apply(rotation, momentum)
    l = vec3.scale(1.0 / magnitude, momentum)
    abc = (
        magnitude * ((i2 - i3) / (i2 * i3)),
        magnitude * ((i3 - i1) / (i3 * i1)),
        magnitude * ((i1 - i2) / (i1 * i2)),
    )
    reference = magnitude / i2
    h = time_step
    e, _, rate = invariants(l, abc)
    if rate * abs(h) > WORTH_REDUCING:
        cycle = period(e)
        turns = math.floor(abs(h) / cycle)
        if turns >= 1.0:
            # After a period l is back, and the body has turned about it.
            q_cycle, _ = advance_pieces((1.0, 0.0, 0.0, 0.0), l, reference, abc, cycle)
            half_angle = math.atan2(q_cycle[1] * l[0] + q_cycle[2] * l[1] + q_cycle[3] * l[2], q_cycle[0])
            turns = math.copysign(turns, h)
            c, s = turn_increment(turns * half_angle)
            q = add_normalized(q, multiply_increment(q, (c, s * l[0], s * l[1], s * l[2])))
            h -= turns * cycle
    q, l = advance_pieces(q, l, reference, abc, h)
    rotation = quat.to_matrix(q)
    body_momentum = mat3.apply_transposed(rotation, world_momentum)
    velocity = (body_momentum[0] / i1, body_momentum[1] / i2, body_momentum[2] / i3)
    return q, mat3.apply(rotation, velocity)
