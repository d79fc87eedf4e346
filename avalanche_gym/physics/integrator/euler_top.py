"""Free rotation of a body with three different moments of inertia, exact for every time step.

Let l be the unit vector of the angular momentum in the principal frame, Lambda its length and d_i = 1 / I_i. Euler's
equations read l' = Lambda l x (d l), that is

    x' = a y z,  y' = b z x,  z' = c x y,    a = Lambda (d3 - d2), b = Lambda (d1 - d3), c = Lambda (d2 - d1).

*The angular momentum in the body.* w1 = b c x^2, w2 = c a y^2 and w3 = a b z^2 have the same derivative, so each is
wp(t + t0) - e_i with one Weierstrass function wp. The addition theorem of sqrt(wp - e_i) carries them over any time h
without a search for t0:

    x(h) = (x p2 p3 + a y z p1) / (p1^2 - w1),    p_i = sqrt(wp(h) - e_i),    and so on in turn,

with the same denominator for all three (the p_i are ns, ds and cs of Jacobi; Whittaker and Watson, sec. 22.2 and
22.351). No amplitude or phase is solved for, so nothing fails where two moments meet, at the separatrix or on an axis.
wp(h) comes from its Laurent series, and everything is evaluated as an increment: small steps lose nothing to
cancellation.

*The orientation.* R(h) = R(0) exp(psi l0) M, where M is the smallest rotation from l(h) to l0: the angular momentum in
the world stays whatever psi is. The angle obeys (compare Celledoni, Fasso, Saefstroem and Zanna 2008, "The exact
computation of the free rigid body motion", sec. 3, where a fixed axis takes the place of l0)

    psi' = Lambda (d l).(l + l0) / (1 + l.l0) = Lambda (d2 + (2 kappa + nu) / (2 + mu)),

kappa = l0.(D l0), nu = l0.D (l - l0), mu = l0.(l - l0), D = d - d2. Hence psi = Lambda h (d2 + kappa) plus the integral
of Lambda (nu - kappa mu) / (2 + mu), which is small and left to Gauss's rule.

*Range.* lambda = sqrt(largest |w_i - w_j|) bounds |l'| by sqrt(2) lambda, and the poles of l are at least
pi / (2 lambda) from the real axis: a bound on lambda h alone bounds every error, for all bodies. Longer steps are cut
into pieces; whole periods are taken at once.
"""

from __future__ import annotations

import math

import numpy as np

from ..jit import kernel
from ..maths import quat, vec3
from .rotation import add_normalized, half_turn

# Largest lambda h of one piece of a step: the series of wp and the five nodes leave less than 1e-17 of l and of psi.
LARGEST_PIECE = 0.25
# Beyond this lambda h it pays to look for whole periods (lambda times the period is at least 2 pi).
WORTH_REDUCING = 20.0
# The longest period in floats, 4 ln(4 / 1e-154) / lambda, has 5700 pieces.
MAX_PIECES = 8192
# The arithmetic-geometric mean of two floats has met the last bit after this many steps, however far apart they are.
MAX_MEANS = 20

NODES, WEIGHTS = (0.5 * array for array in np.polynomial.legendre.leggauss(5))
NODES = NODES + 0.5


@kernel
def invariants(l, abc):
    """w1, w2, w3 [1/s^2] and lambda [1/s]."""
    w1 = abc[1] * abc[2] * l[0] * l[0]
    w2 = abc[2] * abc[0] * l[1] * l[1]
    w3 = abc[0] * abc[1] * l[2] * l[2]
    return (w1, w2, w3), math.sqrt(max(w1, w2, w3) - min(w1, w2, w3))


@kernel
def period(w):
    """Time [s] after which l returns; infinite on the separatrix.

    4 K(k) / lambda = 2 pi / agm(sqrt(w_max - w_min), sqrt(w_mid - w_min)) (Abramowitz and Stegun, 17.6.3).
    """
    low = min(w[0], w[1], w[2])
    x = w[0] - low
    y = w[1] - low
    z = w[2] - low
    a = math.sqrt(max(x, y, z))
    # One of the three is zero.
    g = math.sqrt(max(min(x, y), min(y, z), min(z, x)))
    if g == 0.0:
        return math.inf
    for _ in range(MAX_MEANS):
        a, g = 0.5 * (a + g), math.sqrt(a * g)
    return 2.0 * math.pi / a


@kernel
def laurent_series(w):
    """The e_i and the coefficients c_2 ... c_8 of wp(h) = h^-2 + sum c_k h^(2k - 2) (Abramowitz and Stegun, 18.5.2)."""
    e1 = ((w[1] - w[0]) + (w[2] - w[0])) / 3.0
    e2 = ((w[2] - w[1]) + (w[0] - w[1])) / 3.0
    e3 = ((w[0] - w[2]) + (w[1] - w[2])) / 3.0
    # g2 / 20 and g3 / 28
    c2 = (e1 * e1 + e2 * e2 + e3 * e3) / 10.0
    c3 = e1 * e2 * e3 / 7.0
    c4 = c2 * c2 / 3.0
    c5 = 3.0 * c2 * c3 / 11.0
    c6 = (2.0 * c2 * c2 * c2 + 3.0 * c3 * c3) / 39.0
    c7 = 2.0 * c2 * c2 * c3 / 33.0
    c8 = 5.0 * c2 * (11.0 * c2 * c2 * c2 + 36.0 * c3 * c3) / 7293.0
    return (e1, e2, e3), (c2, c3, c4, c5, c6, c7, c8)


@kernel
def increment(l, abc, mean, e, series, h):
    """l(h) - l(0) for a piece h [s] of a step; ``mean`` is that of w1, w2, w3."""
    s = h * h
    p = series[6]
    for k in range(5, -1, -1):
        p = series[k] + s * p
    p *= s * s
    # h p_i - 1, from h^2 p_i^2 - 1 = p - h^2 e_i.
    q1 = p - s * e[0]
    q2 = p - s * e[1]
    q3 = p - s * e[2]
    r1 = q1 / (1.0 + math.sqrt(1.0 + q1))
    r2 = q2 / (1.0 + math.sqrt(1.0 + q2))
    r3 = q3 / (1.0 + math.sqrt(1.0 + q3))
    # h^2 times the denominator, less 1; e_i + w_i is the mean of the w.
    d = p - s * mean
    inverse = 1.0 / (1.0 + d)
    x, y, z = l
    return (
        inverse * (x * (r2 + r3 + r2 * r3 - d) + abc[0] * h * y * z * (1.0 + r1)),
        inverse * (y * (r3 + r1 + r3 * r1 - d) + abc[1] * h * z * x * (1.0 + r2)),
        inverse * (z * (r1 + r2 + r1 * r2 - d) + abc[2] * h * x * y * (1.0 + r3)),
    )


@kernel
def turn_about(q, l0, change, psi):
    """q exp(psi l0) M, where M is the smallest rotation from l0 + change to l0."""
    # |l0 + l|^2 / 4 = 1 - |change|^2 / 4 is the square of the cosine of half the angle.
    quarter = 0.25 * vec3.norm_squared(change)
    m0 = math.sqrt(1.0 - quarter)
    m = vec3.scale(0.5 / m0, vec3.cross(change, l0))
    c, s = half_turn(0.5 * psi)
    axial = vec3.scale(s, l0)
    v = vec3.add(vec3.scale(1.0 + c, m), vec3.add(vec3.scale(m0, axial), vec3.cross(axial, m)))
    return add_normalized(q, quat.multiply(q, (c * m0 - quarter / (1.0 + m0), v[0], v[1], v[2])))


@kernel
def advance_pieces(q, l, abc, reference, duration):
    """q and l after a duration [s], cut into pieces; ``reference`` is Lambda d2 [rad/s].

    Not finite if the pieces run out: only at the separatrix, within the smallest float, and a long time.
    """
    remaining = duration
    for _ in range(MAX_PIECES):
        w, rate = invariants(l, abc)
        # Lambda D l0, as Lambda (d1 - d2) = -c and Lambda (d3 - d2) = a; kappa and the integrand with that factor too.
        gx = -abc[2] * l[0]
        gz = abc[0] * l[2]
        kappa = gx * l[0] + gz * l[2]
        # Turning about a principal axis, all of the time at once.
        if (w[0] == 0.0) + (w[1] == 0.0) + (w[2] == 0.0) >= 2:
            return turn_about(q, l, vec3.ZERO, remaining * (reference + kappa)), l
        h = remaining
        if rate * abs(h) > LARGEST_PIECE:
            h /= math.ceil(rate * abs(h) / LARGEST_PIECE)
        mean = (w[0] + w[1] + w[2]) / 3.0
        e, series = laurent_series(w)
        integral = 0.0
        for k in range(5):
            change = increment(l, abc, mean, e, series, NODES[k] * h)
            mu = vec3.dot(l, change)
            integral += WEIGHTS[k] * (gx * change[0] + gz * change[2] - kappa * mu) / (2.0 + mu)
        change = increment(l, abc, mean, e, series, h)
        q = turn_about(q, l, change, h * (reference + kappa + integral))
        l = vec3.normalize(vec3.add(l, change))
        if h == remaining:
            return q, l
        remaining -= h
    return (math.nan, math.nan, math.nan, math.nan), l


@kernel
def advance_triaxial(q, momentum, inertia, time_step):
    """Orientation of any free body with the angular momentum [kg m^2/s] in the world frame, after ``time_step`` [s]."""
    i1, i2, i3 = inertia
    magnitude = vec3.norm(momentum)
    if magnitude == 0.0:
        return q
    l = vec3.normalize(quat.rotate_inverse(q, momentum))
    abc = (
        magnitude * ((i2 - i3) / (i2 * i3)),
        magnitude * ((i3 - i1) / (i3 * i1)),
        magnitude * ((i1 - i2) / (i1 * i2)),
    )
    reference = magnitude / i2
    remaining = time_step
    w, rate = invariants(l, abc)
    # All pieces of a remainder, after those of one whole period (if there is one).
    cycle = period(w) if rate * abs(remaining) > WORTH_REDUCING else math.inf
    if abs(remaining) > cycle:
        # After a period l is back, and the body has turned about it.
        q_cycle, _ = advance_pieces(quat.IDENTITY, l, abc, reference, cycle)
        half_angle = math.atan2(q_cycle[1] * l[0] + q_cycle[2] * l[1] + q_cycle[3] * l[2], q_cycle[0])
        turns = math.copysign(math.floor(abs(remaining) / cycle), remaining)
        q = turn_about(q, l, vec3.ZERO, 2.0 * turns * half_angle)
        remaining -= turns * cycle
    q, _ = advance_pieces(q, l, abc, reference, remaining)
    return q
