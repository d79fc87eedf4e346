"""Islands that a step leaves as they are: the next step would do the same again, so it is not done.

A step is a function of states, impulses of the last step, and contacts. If the impulses were certified as they were and
every body ended where it began, to the last bit, it has reached a fixed point. As long as none of its arguments changes
(contacts/coherence.py tells) its result is known: places, velocities, impulses and residual stay.
"""

from __future__ import annotations

from ..jit import kernel
from ..maths import quat, vec3


@kernel
def stands_still(contacts, order, first, last):
    """Whether the step is known to leave the island order[first:last] as it is: all its contacts were recalled so."""
    for index in range(first, last):
        if contacts[order[index]].steady == 0:
            return False
    return last > first


@kernel
def keep_standing(starts, contacts, order, first, last, island_bodies, first_body, last_body, ends):
    """The end of a step that changes nothing; returns the deepest overlap [m]."""
    for index in range(first_body, last_body):
        ends[island_bodies[index]] = starts[island_bodies[index]]
    worst = 0.0
    for index in range(first, last):
        contact = contacts[order[index]]
        contact.sticks = contact.stuck
        contact.gap = contact.end_gap
        vec3.store(contact.position, vec3.load(contact.end_position))
        vec3.store(contact.normal, vec3.load(contact.end_normal))
        worst = max(worst, -contact.gap)
    return worst


@kernel
def _is_same(start, end):
    same = True
    for axis in range(3):
        same = same and start.center[axis] == end.center[axis] and start.velocity[axis] == end.velocity[axis]
        same = same and start.angular_velocity[axis] == end.angular_velocity[axis]
    p = quat.load(start.orientation)
    q = quat.load(end.orientation)
    return same and p[0] == q[0] and p[1] == q[1] and p[2] == q[2] and p[3] == q[3]


@kernel
def note_standing(certified, starts, ends, contacts, order, first, last, island_bodies, first_body, last_body):
    """Mark the contacts of an island: 1 if its impulses were ``certified`` and every body ends as it began."""
    steady = certified
    for index in range(first_body, last_body):
        handle = island_bodies[index]
        steady = steady and _is_same(starts[handle], ends[handle])
    for index in range(first, last):
        contacts[order[index]].steady = 1 if steady else 0
