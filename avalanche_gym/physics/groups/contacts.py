"""What is handed on from part to part of a step: the contacts, what they have borne, and whom they bind."""

from __future__ import annotations

import numpy as np

from ..jit import kernel
from ..maths import vec3
from ..memory import contacts_of, table, world_entry
from ..model import CONTACT, CROWD
from .members import numbers_in


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
def recall(header, workspace, world, label):
    """The contacts of the last step that belong to a group, as those of the part before."""
    group = numbers_in(header, workspace.group)
    recent = table(workspace.recent, workspace.recent_size, CONTACT)
    old = contacts_of(header, world)
    workspace.num_recent = 0
    for number in range(world_entry(header.num_contacts, world)[0]):
        contact = old[number]
        if group[contact.body_a] == label or group[contact.body_b] == label:
            recent[workspace.num_recent] = contact
            vec3.store(recent[workspace.num_recent].blow, vec3.ZERO)
            workspace.num_recent += 1


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
def carry_blows(workspace, num_contacts):
    """Hand what contacts have borne earlier in the step to the same contacts of this part, or to those of the pair."""
    contacts = table(workspace.contacts, workspace.contacts_size, CONTACT)
    recent = table(workspace.recent, workspace.recent_size, CONTACT)
    for number in range(workspace.num_recent):
        blow = vec3.load(recent[number].blow)
        if vec3.norm_squared(blow) == 0.0:
            continue
        chosen = -1
        for index in range(num_contacts):
            if contacts[index].pair == recent[number].pair:
                if chosen < 0 or contacts[index].feature == recent[number].feature:
                    chosen = index
                if contacts[index].feature == recent[number].feature:
                    break
        if chosen >= 0:
            vec3.store(contacts[chosen].blow, vec3.add(vec3.load(contacts[chosen].blow), blow))
