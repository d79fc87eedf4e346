"""Which impacts have to be located in time: those whose instant changes the outcome.

* A *rebound*: a contact with restitution that closes. Where it turns round decides how high it goes.
* A *crossing*: within the step a body comes closer than both are thick, or swings its far end that far. Only the way
  there tells whether it passes.
* A *landing*, without rebound: the normal and the arm of its blow are those of the instant. It is worth the cost where
  the step has few bodies to stop for it; which, the caller says.

All others close at the end of the step (response/impact.py): a pile is not stopped at every touch.
"""

from __future__ import annotations

from ..jit import kernel
from ..model import BETWEEN, DULL, DYNAMIC, LIVELY
from .prediction import OVERLAP, REBOUND, THICKNESS, swing, wander

# Landings of an island that are located: none, those whose normal turns as the bodies pass each other, those of bodies
# that nothing bears, all.
NONE, ROUND, FLYING, ALL = 0, 1, 2, 3
# Plain time stepping: only what swings its far end past the thinner body, since what flies straight at it is met along
# its normal before it is through.
SWINGING = -1
# A landing is located if, taken at the end of the step, it would leave more than this share of the body's size.
WORTH = 1e-4


@kernel
def _note_flying(bodies, contacts, order, first, last, bound):
    """Set ``bound`` of each body of an island: 0 if it is dynamic and no contact of it lasts."""
    for index in range(first, last):
        contact = contacts[order[index]]
        bound[contact.body_a] = 0 if bodies[contact.body_a].motion == DYNAMIC else 1
        bound[contact.body_b] = 0 if bodies[contact.body_b].motion == DYNAMIC else 1
    for index in range(first, last):
        contact = contacts[order[index]]
        if contact.persistent == 1:
            bound[contact.body_a] = 1
            bound[contact.body_b] = 1


@kernel
def _touch(contacts, order, first, last, a, b):
    """Whether a contact of these two bodies lasts."""
    for index in range(first, last):
        contact = contacts[order[index]]
        if contact.persistent == 1 and contact.body_a == a and contact.body_b == b:
            return True
    return False


@kernel
def _is_worth(contact, time_step):
    """A point that turns may have closed by the end though it approaches neither there nor at the start."""
    closed = max(-min(contact.approach, contact.free) * time_step, max(contact.start_gap, 0.0) - contact.free_gap)
    return closed > WORTH * contact.size


@kernel
def mark_located(bodies, starts, flown, span, time_step, contacts, order, first, last, landings, bound):
    """Set ``located`` of the contacts of one island, order[first:last]; return the largest: 0, DULL or LIVELY.

    ``landings`` says which of those are located; ``bound`` (bodies,) is scratch.
    """
    largest = 0
    if landings >= FLYING:
        _note_flying(bodies, contacts, order, first, last, bound)
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
        # What has just rebounded comes back, however little it rises.
        deep = REBOUND if contact.restitution > 0.0 else OVERLAP
        strikes = contact.free_gap < (OVERLAP if comes else -deep) * contact.size
        if contact.start_gap <= OVERLAP * contact.size:
            strikes = strikes or comes
        far = swing(bodies[a], starts[a], flown[a], bodies[b], starts[b], flown[b], time_step)
        bounces = contact.restitution > 0.0 and landings != SWINGING
        swings = False
        # What rests on something is led by that, and does not swing freely.
        flies = landings == ALL and (bound[a] == 0 or bound[b] == 0)
        # Where this point hardly closes another one may.
        passes = not strikes or not (bounces or _is_worth(contact, time_step))
        if (bounces or flies) and passes and not _touch(contacts, order, first, last, a, b):
            bent = wander(contact, bodies[a], starts[a], flown[a], bodies[b], starts[b], flown[b], span)
            swings = contact.free_gap < bent
            strikes = swings
        lively = bounces or (landings != SWINGING and _crosses(contact))
        if far > thick or (strikes and lively):
            contact.located = LIVELY
        elif swings or (strikes and landings > NONE and _is_worth(contact, time_step)):
            if landings == ROUND:
                worth = contact.frame == BETWEEN or contact.curved == 1
            else:
                worth = landings == ALL or bound[a] == 0 or bound[b] == 0
            if worth:
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
def leave_open(contacts, order, first, last):
    """Set ``located`` of the contacts of one island that do not last; return the largest.

    So on a way that has been found to be free: what is open there is open.
    """
    largest = 0
    for index in range(first, last):
        contact = contacts[order[index]]
        contact.located = 0 if contact.persistent == 1 else LIVELY
        largest = max(largest, contact.located)
    return largest


@kernel
def _crosses(contact):
    """Whether free flight would bring the bodies of a contact closer than both are thick."""
    return contact.start_gap - contact.free_gap > THICKNESS * contact.size


@kernel
def any_crosses(contacts, order, first, last):
    """Whether a contact of one island that does not last is a crossing."""
    crosses = False
    for index in range(first, last):
        contact = contacts[order[index]]
        crosses = crosses or (contact.persistent == 0 and _crosses(contact))
    return crosses


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
