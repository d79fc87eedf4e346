"""The rebound of a struck step: the contacts that closed part again, with no more energy than came in.

Each contact asks for the velocity of its rebound, e times that of its approach (Newton), and all are solved at once,
with friction. Where several bodies, or friction, act together such velocities can hold more energy than there was: a
crowd of elastic bodies would heat up without bound. Then the island is solved again with smaller rebounds. Above what
the step gains without any, g_0 < 0, the gain grows about as the square of what is asked for,

    g(s) = g_0 + (g(1) - g_0) s^2,

which gives the share s of the rebounds to ask for; after some trials that is none.
"""

from __future__ import annotations

import math

from ..jit import kernel
from ..memory import bodies_of, fields_of, header_at, workspace_at
from .energy import is_alone, kinetic_and_gain
from .impact import end_rebound, prepare_rebound
from .solving import SOLVED, solve_velocities

# A gain of less than this share of the kinetic energy that free flight would end with is let be. Smaller: what bounces
# alone is solved anew for round-off.
LET_BE = 1e-6
# Solutions for one rebound, of which the last asks for none. Fewer: more energy is lost where too much was asked for.
TRIALS = 4
# Of the share that the law above gives, which is none of the solver's.
CAUTION = 0.98


@kernel
def _ask_for_less(share, contacts, order, first, last):
    for index in range(first, last):
        contact = contacts[order[index]]
        if contact.bias < 0.0:
            contact.bias *= share


@kernel
def rebound(
    address, workspace_address, world, time_step, contacts, order, first, last, starts, flown, sums, members,
    first_body, last_body, ends,
):  # fmt: skip
    """Let what closed rebound; ``ends`` are where the step without rebound led. Returns an outcome of solving.py."""
    header = header_at(address)
    bodies = bodies_of(header, world)
    if not prepare_rebound(time_step, contacts, order, first, last):
        return SOLVED
    fields = fields_of(header)
    alone = is_alone(bodies, starts, contacts, order, first, last, members, first_body, last_body)
    _, lowest = kinetic_and_gain(bodies, fields, starts, flown, ends, members, first_body, last_body)
    listed = workspace_at(workspace_address).order + 8 * first
    for trial in range(TRIALS):
        outcome = solve_velocities(address, workspace_address, world, listed, last - first, first_body, last_body)
        if outcome != SOLVED:
            return outcome
        end_rebound(
            bodies, starts, flown, time_step, contacts, order, first, last, sums, members, first_body, last_body, ends
        )
        kinetic, gain = kinetic_and_gain(bodies, fields, starts, flown, ends, members, first_body, last_body)
        if not alone or gain <= LET_BE * kinetic:
            break
        share = 0.0
        if trial < TRIALS - 2 and lowest < 0.0:
            share = CAUTION * math.sqrt(-lowest / (gain - lowest))
        _ask_for_less(share, contacts, order, first, last)
    return SOLVED
