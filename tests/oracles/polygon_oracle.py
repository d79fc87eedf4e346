"""A ring with a hole that is a regular polygon, hung on a round peg without friction: an independent integration.

Seen in the plane of the ring, with its centre c against that of the peg and its angle theta, side k of the hole is off
the peg by

    g_k = l + c . u_k,   u_k = (sin a_k, cos a_k),   a_k = theta + phi_k,   l = apothem - radius of the peg,

so c moves as a point in a polygon of apothem l that turns with the ring. On one side, with t_k = du_k / da and the
coordinate s = c . t_k along it, Lagrange's equations of

    L = m/2 ((s' - l a')^2 + (s a')^2) + I/2 a'^2 + m g (l cos a + s sin a)

hold until s reaches the end of the side, where the next one stops it without rebound: with the gradient G = (u, s) of a
gap in (c, theta), and W = |u|^2 / m + s^2 / I, the impulse is -g' / W along it. It takes g'^2 / (2 W) of the energy; of
a point that does not turn, of speed v, that is m/2 (v sin kink)^2: the speed is multiplied by cos kink.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.integrate import solve_ivp


def hang(apothem, peg, segments, mass, inertia, gravity, start, seconds, samples):
    """Centre (samples + 1, 2) [m] and energy [J] against time, and the energy [J] that each crease took.

    Args:
        start: [rad] of the centre about the peg, at rest; a corner of the hole is at the top of the ring.
    """
    kink = 2.0 * math.pi / segments
    reach = apothem - peg
    half = reach * math.tan(0.5 * kink)

    def accelerations(_, y):
        s, a, ds, da = y
        # d/dt of the two momenta, m (s'' - l a'') and m (-l (s'' - l a'') + s^2 a'' + 2 s s' a') + I a''.
        along = mass * s * da * da + mass * gravity * math.sin(a)
        about = mass * gravity * (s * math.cos(a) - reach * math.sin(a)) - 2.0 * mass * s * ds * da
        matrix = np.array([[mass, -mass * reach], [-mass * reach, mass * (reach * reach + s * s) + inertia]])
        dds, dda = np.linalg.solve(matrix, (along, about))
        return ds, da, dds, dda

    def leaves(_, y):
        return half - abs(y[0])

    leaves.terminal = True
    leaves.direction = -1.0

    def place(y):
        """Centre and velocity of (s, a, s', a')."""
        s, a, ds, da = y
        u, t = np.array((math.sin(a), math.cos(a))), np.array((math.cos(a), -math.sin(a)))
        return s * t - reach * u, (ds - reach * da) * t - s * da * u

    def side(centre, velocity, angle, spin):
        u, t = np.array((math.sin(angle), math.cos(angle))), np.array((math.cos(angle), -math.sin(angle)))
        s = centre @ t
        return np.array((s, angle, velocity @ t + reach * spin, spin)), u

    times = np.linspace(0.0, seconds, samples + 1)
    # The side that looks from the centre up to the peg, against the swing.
    angle = (math.floor(-start / kink) + 0.5) * kink
    centre = reach / math.cos(angle + start) * np.array((math.sin(start), -math.cos(start)))
    y, _ = side(centre, np.zeros(2), angle, 0.0)
    path, energies, losses = np.zeros((samples + 1, 2)), np.zeros(samples + 1), []
    now, done = 0.0, 0
    while done <= samples:
        solution = solve_ivp(
            accelerations, (now, seconds + 1e-9), y, "DOP853", events=leaves, rtol=1e-11, atol=1e-13, dense_output=True
        )
        end = solution.t[-1]
        while done <= samples and times[done] <= end:
            state = solution.sol(times[done])
            path[done], velocity = place(state)
            energies[done] = (
                0.5 * mass * velocity @ velocity + 0.5 * inertia * state[3] ** 2 + mass * gravity * path[done][1]
            )
            done += 1
        if not solution.t_events[0].size:
            break
        now, y = end, solution.y[:, -1]
        sense = math.copysign(1.0, y[0])
        centre, velocity = place(y)
        # The centre leaves the side along +t: the next one is turned against it.
        following, u = side(centre, velocity, y[1] - sense * kink, y[3])
        s = following[0]
        closing = velocity @ u + s * y[3]
        response = 1.0 / mass + s * s / inertia
        impulse = max(-closing, 0.0) / response
        losses.append(0.5 * max(-closing, 0.0) ** 2 / response)
        y, _ = side(centre, velocity + impulse / mass * u, following[1], y[3] + impulse * s / inertia)
        y[0] = -sense * half * (1.0 - 1e-12)
    return times, path, energies, np.array(losses)
