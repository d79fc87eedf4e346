"""Motion about one centre of gravity: the Kepler arc by universal variables.

With r0 = |x|, eta = x.v, beta = 2 mu / r0 - v^2 and zeta = mu - beta r0, the universal anomaly X, dX = dt / r, solves

    r0 X + eta G2 + zeta G3 = h,                           r = r0 + eta G1 + zeta G2 = dh / dX

where G_n(X) = X^n c_n(beta X^2), c_n(z) = sum_k (-z)^k / (n + 2k)!, and the state follows by

    x' = x - (mu G2 / r0) x + (h - mu G3) v,               v' = v - (mu G1 / (r0 r)) x - (mu G2 / r) v.

One set of formulas holds for ellipse, parabola, hyperbola and the radial fall (which turns round at the centre: the
limit of ever thinner ellipses), and for a repelling centre. Wisdom and Hernandez 2015, "A fast and accurate universal
Kepler solver without Stumpff series", sec. 2; the series below is used where their closed forms would cancel. Written
as increments, the formulas add nothing to the round-off of the last sum while steps are small against the period.
"""

from __future__ import annotations

import math

import numpy as np

from ..jit import kernel
from ..maths import vec3

# Up to this |beta X^2| the series serves; beyond it the closed form loses less than two bits in X - G1.
SERIES_RANGE = 2.0
# 11 terms leave 2^11 / 25! of the first; 5 are enough in short steps (1e-10 / 13! of the first).
TERMS = 11
SHORT_SERIES_RANGE = 0.01
SHORT_TERMS = 5
# The iteration has order 3: a correction below this share of X leaves an error below 1e-17 of it.
CONVERGED = 1e-6
# Where r comes out below this share of its terms it has lost six bits: then the arc is measured from its pericentre.
CANCELLED = 1.0 / 64.0
# 2 to 15 do. Only a passage close to the centre needs more, because its sums cancel: it is taken up from its
# pericentre, where 7 do.
MAX_ITERATIONS = 50


SERIES_2 = np.array([(-1.0) ** k / math.factorial(2 + 2 * k) for k in range(TERMS)])
SERIES_3 = np.array([(-1.0) ** k / math.factorial(3 + 2 * k) for k in range(TERMS)])


@kernel
def universal_functions(beta, x):
    """G1, G2, G3 of the universal anomaly x [s/m]."""
    z = beta * x * x
    if abs(z) <= SERIES_RANGE:
        c2 = 0.0
        c3 = 0.0
        for k in range((SHORT_TERMS if abs(z) <= SHORT_SERIES_RANGE else TERMS) - 1, -1, -1):
            c2 = SERIES_2[k] + z * c2
            c3 = SERIES_3[k] + z * c3
        g3 = x * x * x * c3
        return x - beta * g3, x * x * c2, g3
    root = math.sqrt(abs(beta))
    half = 0.5 * root * x
    if z > 0.0:
        s = math.sin(half)
        c = math.cos(half)
    else:
        s = math.sinh(half)
        c = math.cosh(half)
    g1 = 2.0 * s * c / root
    return g1, 2.0 * (s / root) * (s / root), (x - g1) / beta


@kernel
def universal_anomaly(r0, eta, zeta, beta, duration, guess):
    """X > 0 with r0 X + eta G2 + zeta G3 = duration > 0, by Laguerre's iteration inside a bracket.

    The left side grows with X, its derivative being the distance, so the bracket holds; not finite where none is found.
    """
    if not 0.0 < guess < math.inf:
        return math.nan
    x = guess
    low = 0.0
    high = math.inf
    for _ in range(MAX_ITERATIONS):
        g1, g2, g3 = universal_functions(beta, x)
        error = r0 * x + eta * g2 + zeta * g3 - duration
        r = r0 + eta * g1 + zeta * g2
        # d r / d X = eta G0 + zeta G1
        slope = eta * (1.0 - beta * g2) + zeta * g1
        # Laguerre-Conway with n = 5: order 3, and it converges from almost anywhere.
        change = -5.0 * error / (r + math.sqrt(abs(16.0 * r * r - 20.0 * error * slope)))
        if abs(change) <= CONVERGED * x:
            return x + change
        if error < 0.0:
            low = x
        else:
            # Beyond, or overflowed.
            high = x
        x += change
        if not low < x < high:
            x = 0.5 * (low + high) if high < math.inf else 2.0 * low
            if x == low or x == high:
                # Neighbouring floats.
                return x
    return math.nan


@kernel
def through_pericenter(position, velocity, mu, beta, time_step):
    """The same as ``advance``, measured from the pericentre: exact where a passage close to the centre would cancel.

    There eta = 0, r = q + k G2(Y) and t = q Y + k G3(Y) with the distance q, k = q v^2 - mu = |v x L - mu x / r| and
    L = x v: sums of positive terms. With P = (v x L - mu x / r) / k towards the pericentre,

        x = (q - mu G2) P + G1 (L x P),    v = (-mu G1 P + G0 (L x P)) / r.
    """
    momentum = vec3.cross(position, velocity)
    r0 = vec3.norm(position)
    axis = vec3.normalize(vec3.add_scaled(vec3.cross(velocity, momentum), -mu / r0, position))
    momentum_squared = vec3.norm_squared(momentum)
    k = math.sqrt(mu * mu - beta * momentum_squared)
    q = momentum_squared / (k + mu) if mu > 0.0 else (mu - k) / beta
    # k G1(Y0) = x.v and k G0(Y0) = mu - beta r0.
    eta = vec3.dot(position, velocity)
    root = math.sqrt(abs(beta))
    if beta > 0.0:
        y = math.atan2(eta * root, mu - beta * r0) / root
    elif beta < 0.0:
        y = math.asinh(eta * root / k) / root
    else:
        y = eta / k
    _, _, g3 = universal_functions(beta, y)
    time = q * y + k * g3 + time_step
    if beta > 0.0:
        period = 2.0 * math.pi * mu / (beta * root)
        time -= period * math.floor(time / period + 0.5)
    duration = abs(time)
    # Each term of the sum, and the exponential, alone would take longer.
    guess = min(duration / q, (6.0 * duration / k) ** (1.0 / 3.0))
    if guess * root > 1.0 and beta < 0.0:
        guess = (1.0 + math.asinh(duration * root * abs(beta) / k)) / root
    y = math.copysign(universal_anomaly(q, 0.0, k, beta, duration, guess), time) if duration > 0.0 else 0.0
    g1, g2, _ = universal_functions(beta, y)
    r = q + k * g2
    across = vec3.cross(momentum, axis)
    new_position = vec3.add_scaled(vec3.scale(q - mu * g2, axis), g1, across)
    new_velocity = vec3.add_scaled(vec3.scale(-mu * g1 / r, axis), (1.0 - beta * g2) / r, across)
    return new_position, new_velocity


@kernel
def advance(position, velocity, mu, time_step):
    """Position [m] and velocity [m/s] relative to the centre after ``time_step`` [s]; mu [m^3/s^2], a = -mu x / |x|^3.

    At the very centre the motion is not defined and the result not finite.
    """
    r0 = vec3.norm(position)
    eta = vec3.dot(position, velocity)
    beta = 2.0 * mu / r0 - vec3.norm_squared(velocity)
    zeta = mu - beta * r0
    h = time_step
    if beta > 0.0:
        mean_motion = beta * math.sqrt(beta) / mu
        if abs(h) * mean_motion > math.pi:
            period = 2.0 * math.pi / mean_motion
            h -= period * math.floor(h / period + 0.5)
    if h == 0.0:
        return position, velocity
    # A step backward is the step forward of the reversed velocity.
    direction = math.copysign(1.0, h)
    duration = abs(h)
    # The distance as it is, or to first order in h where that is a small change.
    guess = duration / r0
    change = 0.5 * direction * eta * guess / r0
    size = math.sqrt(abs(beta)) * guess
    if abs(change) < 0.5 and size < 1.0:
        guess *= 1.0 - change
    elif size < 1.0:
        pass
    elif beta > 0.0:
        # The mean rate over a revolution.
        guess = duration * beta / mu
    else:
        # Straight past the centre.
        guess *= math.asinh(size) / size
    x = direction * universal_anomaly(r0, direction * eta, zeta, beta, duration, guess)
    g1, g2, g3 = universal_functions(beta, x)
    r = r0 + eta * g1 + zeta * g2
    if not r > CANCELLED * (r0 + abs(eta * g1) + abs(zeta * g2)):
        return through_pericenter(position, velocity, mu, beta, h)
    a = -mu * g2 / r0
    b = h - mu * g3
    new_position = vec3.add(position, vec3.add(vec3.scale(a, position), vec3.scale(b, velocity)))
    c = -mu * g1 / (r0 * r)
    d = -mu * g2 / r
    new_velocity = vec3.add(velocity, vec3.add(vec3.scale(c, position), vec3.scale(d, velocity)))
    return new_position, new_velocity
