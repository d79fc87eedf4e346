"""Which bodies a group has: a chain of them for each group, in the order of their handles, and how chains join.

All that a group costs is in proportion to its own bodies and to what is near them; only the beginning, once in a step,
looks at all bodies of the world.
"""

from __future__ import annotations

import numpy as np

from ..integrator.flight import copy_state, fly
from ..integrator.way import place_at
from ..jit import kernel
from ..maths import vec3
from ..memory import bodies_of, contacts_of, fields_of, rest_of, states_of, table, world_entry
from ..model import BODY_STATE, CONTACT, CROWD, DYNAMIC, KINEMATIC

# The group of what the pile tier has stepped, and of what is asleep: it is not stopped for those who come near it, and
# what they meet is found in the next step.
APART = -2
# The group of a body that touches nothing.
NONE = -1


@kernel
def states_in(header, address):
    return table(address, header.num_bodies, BODY_STATE)


@kernel
def numbers_in(header, address):
    return table(address, header.num_bodies, np.int64)


@kernel
def label_groups(header, workspace, world):
    """Give every body the label of its group, and link those of each group.

    The label of an island that waits is its number plus DULL or LIVELY times the number of bodies, of another its
    number.
    """
    bodies = bodies_of(header, world)
    states = states_of(header, world)
    rest = rest_of(header, world)
    begins = states_in(header, workspace.begins)
    group = numbers_in(header, workspace.group)
    chain = numbers_in(header, workspace.chain)
    chain_starts = numbers_in(header, workspace.chain_starts)
    movers = numbers_in(header, workspace.movers)
    stray = numbers_in(header, workspace.stray)
    waits = table(workspace.waits, workspace.waits_size, np.int64)
    island = numbers_in(header, workspace.island)
    workspace.num_movers = 0
    workspace.num_strayed = 0
    for number in range(workspace.num_islands):
        chain_starts[number] = -1
    for index in range(header.num_bodies - 1, -1, -1):
        stray[index] = 0
        chain[index] = -1
        group[index] = NONE
        if bodies[index].motion != DYNAMIC:
            copy_state(states[index], begins[index])
            if bodies[index].motion == KINEMATIC:
                movers[workspace.num_movers] = index
                workspace.num_movers += 1
            continue
        own = island[index]
        if rest[index].asleep != 0 or (own >= 0 and waits[own] == CROWD):
            group[index] = APART
        elif own >= 0:
            group[index] = own + waits[own] * header.num_bodies
            chain[index] = chain_starts[own]
            chain_starts[own] = index


@kernel
def link_past(header, workspace, world):
    """Link the contacts of the last step by their bodies, in their order."""
    contacts = contacts_of(header, world)
    starts = numbers_in(header, workspace.past_starts)
    links = table(workspace.past_links, workspace.past_links_size, np.int64)
    for index in range(header.num_bodies):
        starts[index] = -1
    for number in range(world_entry(header.num_contacts, world)[0] - 1, -1, -1):
        links[2 * number] = starts[contacts[number].body_a]
        starts[contacts[number].body_a] = number
        links[2 * number + 1] = starts[contacts[number].body_b]
        starts[contacts[number].body_b] = number


@kernel
def recall(header, workspace, world, label, count):
    """The contacts of the last step that belong to a group, as those of the part before."""
    group = numbers_in(header, workspace.group)
    members = numbers_in(header, workspace.members)
    starts = numbers_in(header, workspace.past_starts)
    links = table(workspace.past_links, workspace.past_links_size, np.int64)
    recent = table(workspace.recent, workspace.recent_size, CONTACT)
    old = contacts_of(header, world)
    workspace.num_recent = 0
    for member in range(count):
        body = members[member]
        number = starts[body]
        while number >= 0:
            own = old[number].body_a == body
            # What two members share is listed by the first of them.
            if own or group[old[number].body_a] != label:
                recent[workspace.num_recent] = old[number]
                vec3.store(recent[workspace.num_recent].blow, vec3.ZERO)
                workspace.num_recent += 1
            number = links[2 * number] if own else links[2 * number + 1]


@kernel
def gather(header, workspace, label):
    """List the bodies of a group; return their number."""
    members = numbers_in(header, workspace.members)
    chain = numbers_in(header, workspace.chain)
    body = numbers_in(header, workspace.chain_starts)[label % header.num_bodies]
    count = 0
    while body >= 0:
        members[count] = body
        count += 1
        body = chain[body]
    workspace.num_members = count
    return count


@kernel
def meets(header, workspace, world, label, num_contacts):
    """Whether a contact reaches a body of another group; that group and this one become one."""
    bodies = bodies_of(header, world)
    contacts = table(workspace.contacts, workspace.contacts_size, CONTACT)
    group = numbers_in(header, workspace.group)
    met = False
    for index in range(num_contacts):
        for side in range(2):
            body = contacts[index].body_a if side == 0 else contacts[index].body_b
            if bodies[body].motion == DYNAMIC and group[body] != label:
                met = True
                _absorb(header, workspace, label, body)
    return met


@kernel
def _absorb(header, workspace, label, body):
    """Move the whole group of a body into this one; contacts that were kept for it are found anew."""
    group = numbers_in(header, workspace.group)
    chain = numbers_in(header, workspace.chain)
    chain_starts = numbers_in(header, workspace.chain_starts)
    kept = table(workspace.kept, workspace.kept_size, CONTACT)
    other = group[body]
    into = label % header.num_bodies
    if other < 0:
        group[body] = label
        chain[body] = -1
        chain_starts[into] = _join(chain, chain_starts[into], body)
        return
    joined = chain_starts[other % header.num_bodies]
    chain_starts[other % header.num_bodies] = -1
    one = joined
    while one >= 0:
        group[one] = label
        one = chain[one]
    chain_starts[into] = _join(chain, chain_starts[into], joined)
    count = 0
    for index in range(workspace.num_kept):
        if kept[index].island != other:
            if count < index:
                kept[count] = kept[index]
            count += 1
    workspace.num_kept = count


@kernel
def _join(chain, one, other):
    """Merge two chains that are in the order of handles; return the first body."""
    first = np.int64(-1)
    last = np.int64(-1)
    while one >= 0 or other >= 0:
        if other < 0 or (0 <= one < other):
            body = one
            one = chain[one]
        else:
            body = other
            other = chain[other]
        if last < 0:
            first = body
        else:
            chain[last] = body
        last = body
    return first


@kernel
def fly_group(header, workspace, world, count):
    """Fly the group, and what is moved by the user, over ``span`` into ``flown`` and ``ends``."""
    bodies = bodies_of(header, world)
    fields = fields_of(header)
    begins = states_in(header, workspace.begins)
    flown = states_in(header, workspace.flown)
    ends = states_in(header, workspace.ends)
    members = numbers_in(header, workspace.members)
    movers = numbers_in(header, workspace.movers)
    for number in range(count):
        body = members[number]
        fly(begins[body], bodies[body], fields, workspace.span, flown[body])
        copy_state(flown[body], ends[body])
    for number in range(workspace.num_movers):
        body = movers[number]
        fly(begins[body], bodies[body], fields, workspace.span, flown[body])


@kernel
def place_on_way(header, workspace, world, count, instant):
    """Where the group is at an instant [s] of the part that leads to ``ends``: into ``predicted``."""
    bodies = bodies_of(header, world)
    fields = fields_of(header)
    begins = states_in(header, workspace.begins)
    ends = states_in(header, workspace.ends)
    predicted = states_in(header, workspace.predicted)
    members = numbers_in(header, workspace.members)
    bound = numbers_in(header, workspace.bound)
    for number in range(count):
        body = members[number]
        place_at(bodies[body], fields, begins[body], ends[body], bound[body], instant, workspace.span, predicted[body])


@kernel
def move_support(header, workspace, world):
    """What is moved by the user is where the clock of the group says."""
    bodies = bodies_of(header, world)
    states = states_of(header, world)
    begins = states_in(header, workspace.begins)
    movers = numbers_in(header, workspace.movers)
    for number in range(workspace.num_movers):
        body = movers[number]
        if workspace.elapsed == 0.0:
            copy_state(states[body], begins[body])
        else:
            fly(states[body], bodies[body], fields_of(header), workspace.elapsed, begins[body])
