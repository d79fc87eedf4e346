"""Groups of dynamic bodies that touch each other, found by union-find; each is a contact problem of its own.

Static and kinematic bodies transmit no impulse and join nothing.
"""

from __future__ import annotations

from ..jit import kernel
from ..model import DYNAMIC


@kernel
def root_of(parent, body):
    """The body that stands for the set of ``body``; what leads there is shortened on the way."""
    while parent[body] != body:
        parent[body] = parent[parent[body]]
        body = parent[body]
    return body


@kernel
def find_islands(bodies, contacts, num_contacts, members, num_members, parent, starts, order, body_starts, body_order):
    """Number the islands; sort the contacts, and the bodies members[:num_members], by island.

    Fills ``contacts.island``, ``order`` (contacts, island by island) and ``starts`` (first entry of each island in
    ``order``, and one past the last), ``body_order`` and ``body_starts`` likewise with the dynamic bodies;
    ``parent`` (bodies,) is overwritten by the number of each member's island, or -1. Islands are numbered by their
    first contact: the order does not depend on how the search went. Returns their number.
    """
    for number in range(num_members):
        parent[members[number]] = members[number]
        starts[members[number]] = -1
    # Others, which are no members, may be touched.
    for index in range(num_contacts):
        parent[contacts[index].body_a] = contacts[index].body_a
        parent[contacts[index].body_b] = contacts[index].body_b
        starts[contacts[index].body_a] = -1
        starts[contacts[index].body_b] = -1
    for index in range(num_contacts):
        contact = contacts[index]
        if bodies[contact.body_a].motion == DYNAMIC and bodies[contact.body_b].motion == DYNAMIC:
            root_a = root_of(parent, contact.body_a)
            root_b = root_of(parent, contact.body_b)
            parent[max(root_a, root_b)] = min(root_a, root_b)
    # starts[root] holds the number of a root's island while they are counted.
    count = 0
    for index in range(num_contacts):
        contact = contacts[index]
        body = contact.body_a if bodies[contact.body_a].motion == DYNAMIC else contact.body_b
        root = root_of(parent, body)
        if starts[root] < 0:
            starts[root] = count
            count += 1
        contact.island = starts[root]
    for number in range(num_members):
        parent[members[number]] = root_of(parent, members[number])
    for number in range(num_members):
        parent[members[number]] = starts[parent[members[number]]]
    # Counting sorts: stable, so contacts and bodies keep their order within an island.
    for island in range(count + 1):
        starts[island] = 0
        body_starts[island] = 0
    for index in range(num_contacts):
        starts[contacts[index].island + 1] += 1
    for number in range(num_members):
        island = parent[members[number]]
        if island >= 0:
            body_starts[island + 1] += 1
    for island in range(count):
        starts[island + 1] += starts[island]
        body_starts[island + 1] += body_starts[island]
    for index in range(num_contacts):
        island = contacts[index].island
        order[starts[island]] = index
        starts[island] += 1
    for number in range(num_members):
        island = parent[members[number]]
        if island >= 0:
            body_order[body_starts[island]] = members[number]
            body_starts[island] += 1
    for island in range(count, 0, -1):
        starts[island] = starts[island - 1]
        body_starts[island] = body_starts[island - 1]
    starts[0] = 0
    body_starts[0] = 0
    return count
