"""Which contacts found on the way are those that hold the bodies all the way: they do not close, they are closed."""

from __future__ import annotations

from ..jit import kernel
from ..maths import vec3
from ..model import DYNAMIC, PLACE_BITS, SLIDING


@kernel
def _bears(contact):
    """Whether a contact holds its bodies on this way: one that is only listed there, open, leaves it free."""
    return contact.located == 0 and (contact.persistent == 1 or vec3.norm_squared(vec3.load(contact.impulse)) > 0.0)


@kernel
def binds_on_way(contacts, first, count, found, slow):
    """Whether a contact found on the way is one of those that bind the bodies all the way.

    The same point of a body on another facet is, if it is ``slow``, as it slides on; else it strikes that facet.
    """
    for index in range(first, count):
        contact = contacts[index]
        if contact.pair != found.pair:
            return False
        if _bears(contact):
            if contact.feature == found.feature:
                return True
            if slow and found.feature >= SLIDING and contact.feature >> PLACE_BITS == found.feature >> PLACE_BITS:
                return True
    return False


@kernel
def _collider_of(contact, body, num_colliders):
    """The collider of one of the two bodies of a contact."""
    first = contact.pair // num_colliders
    return first if contact.body_a == body else contact.pair - first * num_colliders


@kernel
def binds_elsewhere(bodies, contacts, count, found, slow, num_colliders):
    """The same where ground is made of several pieces and the contact, or its point, lies on another one of them."""
    moving = found.body_a if bodies[found.body_a].motion == DYNAMIC else found.body_b
    own = _collider_of(found, moving, num_colliders)
    for index in range(count):
        contact = contacts[index]
        if not _bears(contact) or (contact.body_a != moving and contact.body_b != moving):
            continue
        if contact.pair == found.pair and contact.feature == found.feature:
            return True
        if slow and found.feature >= SLIDING and contact.feature >> PLACE_BITS == found.feature >> PLACE_BITS:
            if _collider_of(contact, moving, num_colliders) == own:
                return True
    return False
