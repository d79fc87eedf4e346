"""How a pair function hands over its contacts."""

from __future__ import annotations

from ..jit import kernel
from ..maths import vec3


@kernel
def emit(contacts, count, position, normal, gap, feature):
    """Append one contact and return the new count.

    ``contacts`` is an array of model.CONTACT. A full array is not written to, but the count goes on, so that the caller
    learns how many contacts there were and can grow it.
    """
    if count < contacts.shape[0]:
        contact = contacts[count]
        vec3.store(contact.position, position)
        vec3.store(contact.normal, normal)
        contact.gap = gap
        contact.feature = feature
    return count + 1
