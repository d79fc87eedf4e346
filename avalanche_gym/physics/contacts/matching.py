"""Which of the contacts found now are those of the last step: they keep their impulse, in world space.

A contact is recognised by its pair of colliders and its feature. Where a body slides from one triangle of a terrain to
the next the feature changes although the contact lasts; what is left over is therefore matched by place: the nearest
unclaimed contact of the same two bodies whose normal is alike.
"""

from __future__ import annotations

from ..jit import kernel
from ..maths import vec3

# Contacts of the same pair within this fraction of the smaller body, normals within a third of a right angle, are taken
# for one that moved. A wrong guess costs the solver iterations, not accuracy.
REACH = 0.25
ALIKE = 0.86


@kernel
def _matches(old, new, place):
    if old.body_a != new.body_a or old.body_b != new.body_b or old.island < 0:
        return False
    if not place:
        return old.pair == new.pair and old.feature == new.feature
    apart = vec3.norm(vec3.sub(vec3.load(old.position), vec3.load(new.position)))
    return apart <= REACH * new.size and vec3.dot(vec3.load(old.normal), vec3.load(new.normal)) >= ALIKE


@kernel
def _inherit(old, new):
    """Hand the impulse over, and mark the old contact as claimed."""
    impulse = vec3.load(old.impulse)
    vec3.store(new.impulse, impulse)
    vec3.store(new.creep, vec3.load(old.creep))
    new.stuck = old.sticks
    new.persistent = 1 if vec3.dot(impulse, vec3.load(new.normal)) > 0.0 else 0
    new.island = 1
    old.island = -1


@kernel
def match_contacts(old_contacts, num_old, contacts, num_contacts):
    """Give each contact the impulse of the same contact in the last step, or zero.

    Both lists are sorted by pair of bodies, so the search starts where the last one ended and is linear in practice. On
    return ``contacts.persistent`` says which bore load.
    """
    for index in range(num_old):
        old_contacts[index].island = 0
    for index in range(num_contacts):
        contacts[index].island = 0
        contacts[index].persistent = 0
        vec3.store(contacts[index].impulse, vec3.ZERO)
        vec3.store(contacts[index].creep, vec3.ZERO)
        contacts[index].stuck = 0
    if num_old == 0:
        return
    for place in range(2):
        start = 0
        for index in range(num_contacts):
            new = contacts[index]
            if new.island == 1:
                continue
            for step in range(num_old):
                candidate = start + step
                if candidate >= num_old:
                    candidate -= num_old
                if _matches(old_contacts[candidate], new, place == 1):
                    _inherit(old_contacts[candidate], new)
                    start = candidate
                    break
