"""Which impacts have to be located in time: those whose instant changes the outcome.

* A *rebound*: a contact with restitution that closes. Where it turns round decides how high it goes.
* A *crossing*: within the step a body comes closer than both are thick, or swings its far end that far. Only the way
  there tells whether it passes.
* A body *alone*: no other dynamic body shares the island, so stopping it stops nobody else.

All others close at the end of the step (response/impact.py): a pile is not stopped at every touch.
"""

from __future__ import annotations

from ..jit import kernel
from .prediction import OVERLAP

# A body that comes or swings closer within a step than this many times its size may pass through another one.
THICKNESS = 2.0


@kernel
def _swing(body, start, flown, span):
    """[m] how far the far end of a body moves because it turns; a sphere that spins moves nothing."""
    square = 0.0
    for axis in range(3):
        square += max(abs(start.angular_velocity[axis]), abs(flown.angular_velocity[axis])) ** 2
    return span * square**0.5 * (body.radius - body.size) if square > 0.0 else 0.0


@kernel
def mark_located(bodies, starts, flown, span, time_step, contacts, order, first, last, alone):
    """Set ``located`` of the contacts of one island, order[first:last]; return whether any is."""
    any_located = False
    for index in range(first, last):
        contact = contacts[order[index]]
        contact.located = 0
        if contact.persistent == 1:
            continue
        a = contact.body_a
        b = contact.body_b
        thick = THICKNESS * contact.size
        strikes = contact.free_gap < -OVERLAP * contact.size
        if contact.start_gap <= OVERLAP * contact.size:
            strikes = strikes or -contact.approach * time_step > OVERLAP * contact.size
        located = strikes and (contact.restitution > 0.0 or alone or contact.start_gap - contact.free_gap > thick)
        if not located:
            swing = _swing(bodies[a], starts[a], flown[a], span) + _swing(bodies[b], starts[b], flown[b], span)
            located = swing > thick
        if located:
            contact.located = 1
            any_located = True
    return any_located


@kernel
def lasting_first(contacts, order, first, last):
    """Sort the contacts of one island so that those that last lead, else in their order; return where they end."""
    end = first
    for index in range(first, last):
        number = order[index]
        if contacts[number].persistent == 1:
            for place in range(index, end, -1):
                order[place] = order[place - 1]
            order[end] = number
            end += 1
    return end
