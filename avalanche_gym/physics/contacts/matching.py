"""Which of the contacts found now are those of the last step: they keep their impulse, in world space.

A contact is recognised by its pair of colliders and its feature. Where a body slides from one triangle of a terrain to
the next only the part of the feature lasts that names the point of the body; what is left over after that is matched by
place: the unclaimed contact of the same two bodies close by whose normal is most alike.
"""

from __future__ import annotations

from ..jit import kernel
from ..maths import vec3
from ..model import PLACE_BITS, SLIDING

# Contacts of the same pair within this fraction of the smaller body, normals within a third of a right angle, are taken
# for one that moved. A wrong guess costs the solver iterations, not accuracy.
REACH = 0.25
ALIKE = 0.86


# What is compared, in this order: the name of the contact; the point of the body that slides; the place.
EXACT, SAME_POINT, PLACE = 0, 1, 2


@kernel
def _likeness(old, new, stage):
    """Cosine between the normals if the old contact may be the new one, else -1. Only one that bore load may be."""
    if old.body_a != new.body_a or old.body_b != new.body_b or old.island < 0:
        return -1.0
    if stage < PLACE and old.pair != new.pair:
        return -1.0
    if stage == EXACT and old.feature != new.feature:
        return -1.0
    if stage == SAME_POINT and (new.feature < SLIDING or old.feature >> PLACE_BITS != new.feature >> PLACE_BITS):
        return -1.0
    if stage == PLACE:
        apart = vec3.norm(vec3.sub(vec3.load(old.position), vec3.load(new.position)))
        if apart > REACH * new.size:
            return -1.0
    if vec3.dot(vec3.load(old.impulse), vec3.load(old.normal)) <= 0.0:
        return -1.0
    alike = vec3.dot(vec3.load(old.normal), vec3.load(new.normal))
    return alike if stage == EXACT or alike >= ALIKE else -1.0


@kernel
def _inherit(old, new, stage, span):
    """Hand the impulse over, as what it would be for a step of ``span``, and mark the old contact as claimed."""
    impulse = vec3.load(old.impulse)
    moment = vec3.load(old.moment)
    if old.span != span:
        impulse = vec3.scale(span / old.span, impulse)
        moment = vec3.scale(span / old.span, moment)
    vec3.store(new.impulse, impulse)
    vec3.store(new.moment, moment)
    if stage == EXACT:
        vec3.store(new.creep, vec3.load(old.creep))
        new.stuck = old.sticks
    new.persistent = 1 if vec3.dot(impulse, vec3.load(new.normal)) > 0.0 else 0
    new.island = 1
    old.island = -1


@kernel
def _order(one, other):
    """Negative, zero or positive as the pair of bodies of one contact comes before that of the other."""
    return one.body_a - other.body_a if one.body_a != other.body_a else one.body_b - other.body_b


@kernel
def match_contacts(old_contacts, num_old, contacts, num_contacts, span):
    """Give each contact the impulse of the same contact in the last step, or zero, for a step of ``span`` [s].

    The new list is sorted by pair of bodies. If the old one is too, only contacts of the same pair are compared, which
    is linear; else all of them are, with the same result. On return ``contacts.persistent`` says which bore load.
    """
    ascending = True
    for index in range(num_old):
        old_contacts[index].island = 0
        ascending = ascending and (index == 0 or _order(old_contacts[index - 1], old_contacts[index]) <= 0)
    for index in range(num_contacts):
        contacts[index].island = 0
        contacts[index].persistent = 0
        vec3.store(contacts[index].impulse, vec3.ZERO)
        vec3.store(contacts[index].moment, vec3.ZERO)
        vec3.store(contacts[index].creep, vec3.ZERO)
        contacts[index].stuck = 0
        contacts[index].span = span
    if num_old == 0:
        return
    for stage in range(3):
        start = 0
        first = 0
        last = 0 if ascending else num_old
        for index in range(num_contacts):
            new = contacts[index]
            if ascending:
                while first < num_old and _order(old_contacts[first], new) < 0:
                    first += 1
                last = max(first, last)
                while last < num_old and _order(old_contacts[last], new) == 0:
                    last += 1
            if new.island == 1:
                continue
            best = -1.0
            chosen = -1
            candidate = start if first <= start < last else first
            for _ in range(last - first):
                likeness = _likeness(old_contacts[candidate], new, stage)
                if likeness > best:
                    best = likeness
                    chosen = candidate
                    if stage == EXACT:
                        break
                candidate += 1
                if candidate == last:
                    candidate = first
            if chosen >= 0:
                _inherit(old_contacts[chosen], new, stage, span)
                start = chosen
