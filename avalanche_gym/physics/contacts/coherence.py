"""Contacts between bodies that stand exactly as they did are those of the last step: nothing is asked again.

The narrow phase is a function of places and of how far the bodies may come. A body that has the places and velocities,
to the last bit, that it had when the last step began, and on which no force is held, is *unmoved*; between two unmoved
bodies that function is given its old arguments, so its old results are the exact ones. What rests is unmoved
(response/stillness.py), and so is ground.

The list of the last step holds where each contact was when that step began. What was left out of it then, because
flight would have opened it, would be left out again.

Where the last step left the whole island as it was, its contacts are *steady* (response/standing.py). All that is said
of such a contact before the solver, where flight would lead it and what it has borne, is a function of the same
arguments too: it stands in the list, and is not worked out again.
"""

from __future__ import annotations

from ..jit import kernel
from ..maths import quat, vec3
from .matching import chain_of


@kernel
def note_place(memory, state):
    """Keep, in the REST record of a body, the state in which a step begins; of one with a force on it, none."""
    seen = memory.seen
    for axis in range(3):
        seen[axis] = state.center[axis]
        seen[7 + axis] = state.velocity[axis]
        seen[10 + axis] = state.angular_velocity[axis]
    for index in range(4):
        seen[3 + index] = state.orientation[index]
    if _is_pushed(state):
        forget_place(memory)


@kernel
def forget_place(memory):
    """No body has the orientation zero."""
    for index in range(4):
        memory.seen[3 + index] = 0.0


@kernel
def _is_pushed(state):
    return vec3.norm_squared(vec3.load(state.force)) + vec3.norm_squared(vec3.load(state.torque)) > 0.0


@kernel
def is_unmoved(memory, state):
    """Whether a body is as it was when the last step began."""
    seen = memory.seen
    for axis in range(3):
        if seen[axis] != state.center[axis] or seen[7 + axis] != state.velocity[axis]:
            return False
        if seen[10 + axis] != state.angular_velocity[axis]:
            return False
    q = quat.load(state.orientation)
    if seen[3] != q[0] or seen[4] != q[1] or seen[5] != q[2] or seen[6] != q[3]:
        return False
    return not _is_pushed(state)


@kernel
def chain_contacts(bodies, old_contacts, num_old, chains, following):
    """Chains of all contacts of the last step, in their order; ``chains`` and ``following`` as in match_contacts."""
    num_chains = chains.shape[0]
    for chain in range(num_chains):
        chains[chain] = -1
    for index in range(num_old - 1, -1, -1):
        chain = chain_of(bodies, old_contacts[index].body_a, old_contacts[index].body_b) % num_chains
        following[index] = chains[chain]
        chains[chain] = index


@kernel
def recall_contacts(bodies, old_contacts, chains, following, a, b, contacts, count):
    """Append the contacts of bodies a < b as the last step found them; return the new count, as ``emit`` does."""
    index = chains[chain_of(bodies, a, b) % chains.shape[0]]
    while index >= 0:
        old = old_contacts[index]
        if old.body_a == a and old.body_b == b:
            if count < contacts.shape[0]:
                contacts[count] = old
                contact = contacts[count]
                # Where it ended, if the step changes nothing (response/standing.py).
                vec3.store(contact.end_position, vec3.load(old.position))
                vec3.store(contact.end_normal, vec3.load(old.normal))
                contact.end_gap = old.gap
                vec3.store(contact.position, vec3.load(old.start_position))
                vec3.store(contact.normal, vec3.load(old.start_normal))
                contact.gap = old.start_gap
                if contact.steady == 1:
                    contact.persistent = 1 if vec3.dot(vec3.load(old.impulse), vec3.load(contact.normal)) > 0.0 else 0
                    contact.stuck = old.sticks
                    contact.sticks = 0
                    contact.located = 0
            count += 1
        index = following[index]
    return count


@kernel
def are_steady(contacts, first, last):
    """Whether all contacts of a pair that were recalled are steady; if some are not, none counts as such."""
    steady = True
    for index in range(first, last):
        steady = steady and contacts[index].steady == 1
    if not steady:
        for index in range(first, last):
            contacts[index].steady = 0
    return steady
