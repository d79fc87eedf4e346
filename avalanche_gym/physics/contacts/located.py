"""Which impacts have to be located in time: those whose instant changes the outcome.

* A *rebound*: a contact with restitution that closes. Where it turns round decides how high it goes.
* A *crossing*: within the step a body comes closer than both are thick, or swings its far end that far. Only the way
  there tells whether it passes.
* A body *alone*, in a world of few: no other dynamic body shares the island, so stopping it stops nobody else.

All others close at the end of the step (response/impact.py): a pile is not stopped at every touch.
"""

from __future__ import annotations

from ..jit import kernel
from ..model import DULL, LIVELY
from .prediction import OVERLAP, THICKNESS, swing

# A body alone is stopped for impacts that would leave, taken at the end of the step, more than this share of its size.
WORTH = 1e-4


@kernel
def mark_located(bodies, starts, flown, span, time_step, contacts, order, first, last, alone):
    """Set ``located`` of the contacts of one island, order[first:last]; return the largest: 0, DULL or LIVELY."""
    largest = 0
    for index in range(first, last):
        contact = contacts[order[index]]
        contact.located = 0
        if contact.persistent == 1:
            continue
        a = contact.body_a
        b = contact.body_b
        thick = THICKNESS * contact.size
        # What has come to touch by the end of this part strikes there; in this part it would only be slowed down.
        comes = -contact.approach * time_step > OVERLAP * contact.size
        strikes = contact.free_gap < (OVERLAP if comes else -OVERLAP) * contact.size
        if contact.start_gap <= OVERLAP * contact.size:
            strikes = strikes or comes
        far = swing(bodies[a], starts[a], flown[a], bodies[b], starts[b], flown[b], span)
        lively = contact.restitution > 0.0 or contact.start_gap - contact.free_gap > thick
        if far > thick or (strikes and lively):
            contact.located = LIVELY
        elif strikes and alone and -min(contact.approach, contact.free) * time_step > WORTH * contact.size:
            contact.located = DULL
        largest = max(largest, contact.located)
    return largest


@kernel
def any_lasts(contacts, order, first, last):
    """Whether a contact of one island lasts."""
    lasts = False
    for index in range(first, last):
        lasts = lasts or contacts[order[index]].persistent == 1
    return lasts


@kernel
def located_last(contacts, order, first, last):
    """Sort the contacts of one island so that those to be located come last; return where they begin."""
    end = first
    for index in range(first, last):
        number = order[index]
        if contacts[number].located == 0:
            for place in range(index, end, -1):
                order[place] = order[place - 1]
            order[end] = number
            end += 1
    return end
