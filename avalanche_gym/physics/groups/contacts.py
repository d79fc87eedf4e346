"""What is handed on from part to part of a step: the contacts, what they have borne, and whom they bind."""

from __future__ import annotations

import numpy as np

from ..contacts.matching import PLACE, likeness, orientation
from ..contacts.prediction import bears_load
from ..contacts.turning import turn_contact
from ..jit import kernel
from ..maths import vec3
from ..memory import bodies_of, report_of, table
from ..model import CONTACT, CROWD, DYNAMIC
from .members import numbers_in, states_in


@kernel
def keep_finished(workspace, waits):
    """Contacts of the islands that do not wait."""
    contacts = table(workspace.contacts, workspace.contacts_size, CONTACT)
    kept = table(workspace.kept, workspace.kept_size, CONTACT)
    starts = table(workspace.island_starts, workspace.island_starts_size, np.int64)
    count = 0
    for index in range(starts[workspace.num_islands]):
        contact = contacts[index]
        if waits[contact.island] == 0 or waits[contact.island] == CROWD:
            kept[count] = contact
            count += 1
    workspace.num_kept = count


@kernel
def note_bound(header, workspace, num_contacts, count):
    """Note which bodies of the group are not in free flight; return whether there is any contact but the located."""
    contacts = table(workspace.contacts, workspace.contacts_size, CONTACT)
    bound = numbers_in(header, workspace.bound)
    members = numbers_in(header, workspace.members)
    for number in range(count):
        bound[members[number]] = 0
    # What the group rests on is no member of it.
    for index in range(num_contacts):
        bound[contacts[index].body_a] = 0
        bound[contacts[index].body_b] = 0
    found = False
    for index in range(num_contacts):
        contact = contacts[index]
        if contact.located == 0:
            found = True
            if vec3.norm_squared(vec3.load(contact.impulse)) > 0.0:
                bound[contact.body_a] = 1
                bound[contact.body_b] = 1
    return found


@kernel
def remember(workspace, contacts, num_contacts, acted):
    """Keep the contacts of a part for the next one; if their impulses have ``acted`` they count as given."""
    recent = table(workspace.recent, workspace.recent_size, CONTACT)
    for index in range(num_contacts):
        recent[index] = contacts[index]
        if acted:
            if contacts[index].located == 0:
                total = vec3.add(vec3.load(contacts[index].blow), vec3.load(contacts[index].impulse))
                vec3.store(recent[index].blow, total)
            else:
                vec3.store(recent[index].impulse, vec3.ZERO)
    workspace.num_recent = num_contacts


@kernel
def hand_back(workspace, num_contacts):
    """Let the same part, made shorter, begin with what its contacts have borne in the longer one; return False, and do
    nothing, if that was struck: what its impulses would be in a shorter part they do not tell.

    What bore nothing there keeps what it came with: by that it is known to last. Which contact came with what is
    told as it was when they were found (contacts/matching.py).
    """
    contacts = table(workspace.contacts, workspace.contacts_size, CONTACT)
    recent = table(workspace.recent, workspace.recent_size, CONTACT)
    for index in range(num_contacts):
        contact = contacts[index]
        if contact.located == 0 and contact.persistent == 0 and bears_load(contact):
            return False
    for number in range(workspace.num_recent):
        recent[number].island = 0 if bears_load(recent[number]) else -1
    for stage in range(PLACE + 1):
        for index in range(num_contacts):
            contact = contacts[index]
            # They are found anew after this: the island of one that has been handed back is not asked for any more.
            if contact.persistent == 1 and contact.island >= 0:
                chosen = _most_alike(recent, workspace.num_recent, contact, stage)
                if chosen >= 0:
                    recent[chosen].island = -1
                    contact.island = -1
                    if contact.located == 0 and bears_load(contact):
                        _give_back(contact, recent[chosen])
    return True


@kernel
def _most_alike(recent, num_recent, contact, stage):
    """The contact of the part before that this one may be, else -1."""
    best = -1.0
    chosen = -1
    for number in range(num_recent):
        alike = likeness(recent[number], contact, stage)
        if alike > best:
            best = alike
            chosen = number
    return chosen


@kernel
def _give_back(contact, old):
    sign = orientation(old, contact)
    vec3.store(old.impulse, vec3.scale(sign, vec3.load(contact.impulse)))
    vec3.store(old.moment, vec3.scale(sign, vec3.load(contact.moment)))
    vec3.store(old.normal, vec3.scale(sign, vec3.load(contact.normal)))
    old.span = contact.span


@kernel
def forget_impulses(contacts, num_contacts):
    """Of a part that is not stepped only the blows count, not what its impulses would begin with."""
    for index in range(num_contacts):
        vec3.store(contacts[index].impulse, vec3.ZERO)
        vec3.store(contacts[index].moment, vec3.ZERO)


@kernel
def _same(contacts, num_contacts, pair, feature):
    """The contact of a pair with this feature, else the first of that pair, else -1."""
    chosen = -1
    for index in range(num_contacts):
        if contacts[index].pair == pair:
            if contacts[index].feature == feature:
                return index
            if chosen < 0:
                chosen = index
    return chosen


@kernel
def carry_blows(workspace, num_contacts):
    """Hand what contacts have borne earlier in the step to the same contacts of this part, or to those of the pair."""
    contacts = table(workspace.contacts, workspace.contacts_size, CONTACT)
    recent = table(workspace.recent, workspace.recent_size, CONTACT)
    for number in range(workspace.num_recent):
        blow = vec3.load(recent[number].blow)
        if vec3.norm_squared(blow) == 0.0:
            continue
        chosen = _same(contacts, num_contacts, recent[number].pair, recent[number].feature)
        if chosen >= 0:
            vec3.store(contacts[chosen].blow, vec3.add(vec3.load(contacts[chosen].blow), blow))


@kernel
def part_with(workspace, num_contacts):
    """Move what ``recent`` has and the contacts of this part have not to ``gone``: the blow belongs to the step.

    Return whether there was room.
    """
    contacts = table(workspace.contacts, workspace.contacts_size, CONTACT)
    recent = table(workspace.recent, workspace.recent_size, CONTACT)
    gone = table(workspace.gone, workspace.gone_size, CONTACT)
    for number in range(workspace.num_recent):
        old = recent[number]
        blow = vec3.load(old.blow)
        if vec3.norm_squared(blow) == 0.0 or _same(contacts, num_contacts, old.pair, old.feature) >= 0:
            continue
        known = _same(gone, workspace.num_gone, old.pair, old.feature)
        if known >= 0:
            blow = vec3.add(blow, vec3.load(gone[known].blow))
        else:
            known = workspace.num_gone
            if known == gone.shape[0]:
                return False
            workspace.num_gone += 1
        gone[known] = old
        vec3.store(gone[known].blow, blow)
        vec3.store(gone[known].impulse, vec3.ZERO)
        vec3.store(gone[known].moment, vec3.ZERO)
        gone[known].persistent = 1
    return True


@kernel
def pass_by(header, workspace, world, num_contacts):
    """Put the contacts that were looked for and did not close to the end of the step: they bear nothing, and are open.

    Along the normal with which one began it may seem to close; at the end another feature is the nearest one.
    """
    bodies = bodies_of(header, world)
    contacts = table(workspace.contacts, workspace.contacts_size, CONTACT)
    begins = states_in(header, workspace.begins)
    ends = states_in(header, workspace.ends)
    flown = states_in(header, workspace.flown)
    report = report_of(header, world)
    for index in range(num_contacts):
        contact = contacts[index]
        if contact.located > 0:
            vec3.store(contact.impulse, vec3.ZERO)
            vec3.store(contact.moment, vec3.ZERO)
            contact.persistent = 0
            _follow(bodies, begins, flown, ends, contact, workspace.span)
            contact.gap = max(contact.gap, 0.0)
        report.penetration = max(report.penetration, -contact.gap)


@kernel
def _follow(bodies, begins, flown, ends, contact, span):
    """Move a contact from where its bodies are in ``begins`` to the end of the part."""
    a = contact.body_a
    b = contact.body_b
    end_a = ends[a] if bodies[a].motion == DYNAMIC else flown[a]
    end_b = ends[b] if bodies[b].motion == DYNAMIC else flown[b]
    turn_contact(contact, begins[a], end_a, begins[b], end_b, span)
    vec3.store(contact.position, vec3.load(contact.end_position))
    vec3.store(contact.normal, vec3.load(contact.end_normal))
    contact.gap = contact.end_gap


@kernel
def _go_with(header, workspace, world, contact):
    """Move a contact on from where it is."""
    vec3.store(contact.start_position, vec3.load(contact.position))
    vec3.store(contact.start_normal, vec3.load(contact.normal))
    contact.start_gap = contact.gap
    begins = states_in(header, workspace.begins)
    ends = states_in(header, workspace.ends)
    flown = states_in(header, workspace.flown)
    _follow(bodies_of(header, world), begins, flown, ends, contact, workspace.span)


@kernel
def follow_gone(header, workspace, world):
    """Contacts that are out of reach go with their bodies from ``begins`` to ``ends``."""
    gone = table(workspace.gone, workspace.gone_size, CONTACT)
    for number in range(workspace.num_gone):
        _go_with(header, workspace, world, gone[number])


@kernel
def follow_struck(header, workspace, world):
    """So do those that have just been struck, on a part that no contact has a share in."""
    recent = table(workspace.recent, workspace.recent_size, CONTACT)
    for number in range(workspace.num_recent):
        contact = recent[number]
        if vec3.norm_squared(vec3.load(contact.blow)) > 0.0:
            persistent = contact.persistent
            contact.persistent = 1
            _go_with(header, workspace, world, contact)
            contact.persistent = persistent
