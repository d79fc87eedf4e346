"""Which of the contacts found now are those of the last step: they keep their impulse, in world space.

A contact is recognised by its pair of colliders and its feature. Where a body slides from one triangle of a terrain to
the next only the part of the feature lasts that names the point of the body; what is left over after that is matched by
place: the unclaimed contact close by whose normal is most alike, of the same two bodies, or of the same point of one of
them on another piece of ground.
"""

from __future__ import annotations

import numpy as np

from ..jit import kernel
from ..maths import vec3
from ..model import DYNAMIC, PLACE_BITS, SLIDING

# Contacts of the same pair within this fraction of the smaller body, normals within a third of a right angle, are taken
# for one that moved. A wrong guess costs the solver iterations, not accuracy.
REACH = 0.25
ALIKE = 0.86
# An impulse is handed to a step of another length as the same force, but grows by no more than this factor: what acted
# in a very short part of a step was a jolt. Larger: smooth steps are predicted from forces that never were.
MOST_GROWTH = 4.0


# What is compared, in this order: the name of the contact; the point of the body that slides; the place.
EXACT, SAME_POINT, PLACE = 0, 1, 2


@kernel
def orientation(old, new):
    """1 if both contacts lead from one body to the same other one, or to another piece of ground; -1 if the new one

    leads back; 0 if they have nothing in common.
    """
    if old.body_a == new.body_a and old.body_b == new.body_b:
        return 1.0
    if new.feature < SLIDING or old.feature >> PLACE_BITS != new.feature >> PLACE_BITS:
        return 0.0
    if old.body_a == new.body_a or old.body_b == new.body_b:
        return 1.0
    return -1.0 if old.body_a == new.body_b or old.body_b == new.body_a else 0.0


@kernel
def likeness(old, new, stage):
    """Cosine between the normals if the old contact may be the new one, else -1."""
    if stage < PLACE and old.pair != new.pair:
        return -1.0
    if old.island < 0:
        return -1.0
    sign = orientation(old, new)
    if sign == 0.0:
        return -1.0
    if stage == EXACT and old.feature != new.feature:
        return -1.0
    if stage == SAME_POINT and (new.feature < SLIDING or old.feature >> PLACE_BITS != new.feature >> PLACE_BITS):
        return -1.0
    if stage == PLACE:
        apart = vec3.norm(vec3.sub(vec3.load(old.position), vec3.load(new.position)))
        if apart > REACH * new.size:
            return -1.0
    alike = sign * vec3.dot(vec3.load(old.normal), vec3.load(new.normal))
    return alike if stage == EXACT or alike >= ALIKE else -1.0


@kernel
def _inherit(old, new, stage, span):
    """Hand the impulse over, as what it would be for a step of ``span``, and mark the old contact as claimed.

    That of a blow does not grow with the time after it.
    """
    share = orientation(old, new)
    if old.span > 0.0 and old.span != span:
        share *= min(span / old.span, MOST_GROWTH)
    impulse = vec3.scale(share, vec3.load(old.impulse))
    vec3.store(new.impulse, impulse)
    vec3.store(new.moment, vec3.scale(share, vec3.load(old.moment)))
    if stage == EXACT:
        vec3.store(new.creep, vec3.load(old.creep))
        new.stuck = old.sticks
    new.persistent = 1 if vec3.dot(impulse, vec3.load(new.normal)) > 0.0 else 0
    new.island = 1
    old.island = -1


@kernel
def chain_of(bodies, a, b):
    """Number of the chain of the contacts of two bodies: of both, or of the one that lies on whatever ground."""
    if bodies[a].motion != DYNAMIC:
        return b
    return a + b if bodies[b].motion == DYNAMIC else a


@kernel
def _claim_pair(old_contacts, oldest, following, a, b):
    """Claim what the contacts of a pair of bodies that were recalled as they stood have already."""
    candidate = oldest
    while candidate >= 0:
        old = old_contacts[candidate]
        if old.body_a == a and old.body_b == b:
            old.island = -1
        candidate = following[candidate]


@kernel
def _match_pair(old_contacts, oldest, following, contacts, first, last, span):
    """Match the contacts of one pair of bodies; ``oldest`` leads the chain that holds the old ones."""
    for stage in range(3):
        for index in range(first, last):
            new = contacts[index]
            if new.island == 1:
                continue
            best = -1.0
            chosen = np.int64(-1)
            candidate = oldest
            while candidate >= 0:
                alike = likeness(old_contacts[candidate], new, stage)
                if alike > best:
                    best = alike
                    chosen = candidate
                    if stage == EXACT:
                        break
                candidate = following[candidate]
            if chosen >= 0:
                _inherit(old_contacts[chosen], new, stage, span)


@kernel
def match_contacts(bodies, old_contacts, num_old, contacts, num_contacts, span, chains, following):
    """Give each contact the impulse of the same contact in the last step, or zero, for a step of ``span`` [s].

    Steady ones, all of a pair or none, were recalled with what they have borne (coherence.py) and keep it.
    New contacts of a pair of bodies lie together. The old ones are found through chains: ``chains`` (any number) and
    ``following`` (old contacts,) are scratch. On return ``contacts.persistent`` says which bore load.
    """
    for index in range(num_contacts):
        if contacts[index].steady == 1:
            continue
        contacts[index].island = 0
        contacts[index].persistent = 0
        vec3.store(contacts[index].impulse, vec3.ZERO)
        vec3.store(contacts[index].moment, vec3.ZERO)
        vec3.store(contacts[index].creep, vec3.ZERO)
        contacts[index].stuck = 0
        contacts[index].sticks = 0
        contacts[index].located = 0
        contacts[index].span = span
    num_chains = chains.shape[0]
    for chain in range(num_chains):
        chains[chain] = -1
    # Only what bore load has something to hand over. From the last to the first: each chain then leads on as the list.
    loaded = False
    for index in range(num_old - 1, -1, -1):
        old = old_contacts[index]
        if vec3.dot(vec3.load(old.impulse), vec3.load(old.normal)) > 0.0:
            old.island = 0
            chain = chain_of(bodies, old.body_a, old.body_b) % num_chains
            following[index] = chains[chain]
            chains[chain] = index
            loaded = True
    if not loaded:
        return
    first = np.int64(0)
    while first < num_contacts:
        a = contacts[first].body_a
        b = contacts[first].body_b
        last = first + 1
        while last < num_contacts and contacts[last].body_a == a and contacts[last].body_b == b:
            last += 1
        oldest = chains[chain_of(bodies, a, b) % num_chains]
        if oldest >= 0 and contacts[first].steady == 1:
            _claim_pair(old_contacts, oldest, following, a, b)
        elif oldest >= 0:
            _match_pair(old_contacts, oldest, following, contacts, first, last, span)
        first = last
