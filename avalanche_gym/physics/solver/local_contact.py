"""The contact problem of a single contact, solved exactly: W r + q = u with the contact law between u and r.

In the frame (normal, t1, t2), W symmetric positive definite (Bonnefon & Daviet 2011 solve it by a quartic):

    open   q_n >= 0:  r = 0
    stick  r = -W^-1 q, if that lies in the cone
    slip   u_n = 0 and u_t = -lambda r_t, lambda >= 0, |r_t| = mu r_n. With r_n = -(q_n + W_nt r_t) / W_nn eliminated,
           S = W_tt - W_tn W_nt / W_nn,  b = q_t - W_tn q_n / W_nn:   r_t = -(S + lambda)^-1 b,
           and lambda is the root of f(lambda) = |r_t| - mu r_n. f(0) > 0 since sticking left the cone, and f < 0 for
           large lambda, where r_t -> 0 and r_n -> -q_n / W_nn > 0. A bracketed Newton iteration finds it, on
           mu r_n / |r_t| - 1 = 0 instead: 1 / |r_t| is nearly linear in lambda, |r_t| is not, and takes twice the steps
           (as for trust regions, Hebden 1973; More & Sorensen 1983).
"""

from __future__ import annotations

import math

from ..jit import kernel

# |f| relative to |r_t| at which the slip direction is final for those who want all of it, and the most iterations
# (bisection alone needs 60).
EXACTLY = 1e-15
SLIP_ITERATIONS = 80
# A Newton step that changes lambda by less than this fraction of S + lambda is the last one: the next would change it
# by the square of that.
SHIFT_ACCURACY = 1e-9


@kernel
def slip_impulse(over, w_n1, w_n2, s11, s12, s22, b1, b2, q_n, shift):
    """(r_n, r_1, r_2) for a given lambda = ``shift``, and 1 / det(S + lambda); ``over`` is 1 / W_nn."""
    a11 = s11 + shift
    a22 = s22 + shift
    inverse = 1.0 / (a11 * a22 - s12 * s12)
    r_1 = (s12 * b2 - a22 * b1) * inverse
    r_2 = (s12 * b1 - a11 * b2) * inverse
    return -(q_n + w_n1 * r_1 + w_n2 * r_2) * over, r_1, r_2, inverse


@kernel
def slip_solution(over, w_n1, w_n2, s11, s12, s22, b1, b2, q_n, friction, accuracy, r_n, r_1, r_2, inverse):
    """The impulse of a slipping contact, with |f| <= ``accuracy`` |r_t| before r_t is shortened to fit the cone.

    The last four arguments are ``slip_impulse`` at lambda = 0, where sticking was tried.
    """
    low = 0.0
    high = math.inf
    shift = 0.0
    for _ in range(SLIP_ITERATIONS):
        square = r_1 * r_1 + r_2 * r_2
        length = math.sqrt(square)
        value = length - friction * r_n
        if abs(value) <= accuracy * length:
            break
        if value > 0.0:
            low = shift
        else:
            high = shift
        # d r_t / d lambda = -(S + lambda)^-1 r_t
        a11 = s11 + shift
        a22 = s22 + shift
        d_1 = (s12 * r_2 - a22 * r_1) * inverse
        d_2 = (s12 * r_1 - a11 * r_2) * inverse
        # |r_t|^3 times the slope of mu r_n / |r_t|.
        rise = -(w_n1 * d_1 + w_n2 * d_2) * over
        slope = friction * (rise * square - r_n * (r_1 * d_1 + r_2 * d_2))
        step = shift + value * square / slope
        final = False
        if slope > 0.0 and low < step < high:
            final = abs(step - shift) <= SHIFT_ACCURACY * (step + s11 + s22)
            shift = step
        elif high < math.inf:
            shift = 0.5 * (low + high)
        else:
            shift = 2.0 * shift + (s11 + s22)
        if shift == low or shift == high:
            break
        r_n, r_1, r_2, inverse = slip_impulse(over, w_n1, w_n2, s11, s12, s22, b1, b2, q_n, shift)
        if final:
            break
    # Exactly on the cone and in it, whatever is left of f.
    r_n = max(r_n, 0.0)
    length = math.sqrt(r_1 * r_1 + r_2 * r_2)
    if length > 0.0:
        ratio = friction * r_n / length
        r_1 *= ratio
        r_2 *= ratio
    return r_n, r_1, r_2


@kernel
def solve_contact(w_nn, w_n1, w_n2, w_11, w_12, w_22, q_n, q_1, q_2, friction, accuracy):
    """(r_n, r_1, r_2) of the contact problem above; ``accuracy`` as in ``slip_solution``."""
    if q_n >= 0.0 or w_nn <= 0.0:
        return 0.0, 0.0, 0.0
    over = 1.0 / w_nn
    if friction == 0.0:
        return -q_n * over, 0.0, 0.0
    n1 = w_n1 * over
    n2 = w_n2 * over
    s11 = w_11 - w_n1 * n1
    s12 = w_12 - w_n1 * n2
    s22 = w_22 - w_n2 * n2
    b1 = q_1 - n1 * q_n
    b2 = q_2 - n2 * q_n
    r_n, r_1, r_2, inverse = slip_impulse(over, w_n1, w_n2, s11, s12, s22, b1, b2, q_n, 0.0)
    if inverse > 0.0 and r_1 * r_1 + r_2 * r_2 <= friction * friction * r_n * r_n and r_n >= 0.0:
        return r_n, r_1, r_2
    if b1 == 0.0 and b2 == 0.0:
        return -q_n * over, 0.0, 0.0
    return slip_solution(over, w_n1, w_n2, s11, s12, s22, b1, b2, q_n, friction, accuracy, r_n, r_1, r_2, inverse)
