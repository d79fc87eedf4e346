"""A smooth part of a step is left at an instant of its way, where an impact has been found on it.

The forces of a smooth part are constant, so the part up to that instant need not be solved again: the bodies are where
the way leads (integrator/way.py), and the contacts have given as much of their impulses as of its time has gone by. And
they are, to the last bit, where the search has found them to touch.

The law holds at the end of the part. Velocities go straight from one end to the other, so up to any instant t of the
span h an impulse r has done the work

    r . (u t / h + (u' - u) t^2 / (2 h^2)),    r . u' <= 0,

u and u' the velocities of the contact at both ends: none is gained if r . u <= 0 as well. A contact that pushes what
leaves it at the start, for it holds that at the end, may have given energy by then; that part is stepped again.
"""

from __future__ import annotations

from ..contacts.prediction import OVERLAP, point_displacement, velocity_at
from ..integrator.flight import copy_state
from ..integrator.way import state_at
from ..jit import kernel
from ..maths import vec3
from ..memory import bodies_of, fields_of, table
from ..model import CONTACT, DYNAMIC
from .contacts import follow, remember
from .members import fly_group, numbers_in, states_in


@kernel
def may_break_off(header, workspace, num_contacts):
    """Whether the part that has been stepped is smooth, and its contacts give no energy on the way."""
    if workspace.smooth == 0:
        return False
    contacts = table(workspace.contacts, workspace.contacts_size, CONTACT)
    begins = states_in(header, workspace.begins)
    for index in range(num_contacts):
        contact = contacts[index]
        impulse = vec3.load(contact.impulse)
        if contact.located == 0 and vec3.norm_squared(impulse) > 0.0:
            a = contact.body_a
            b = contact.body_b
            point = vec3.load(contact.start_position)
            velocity = vec3.sub(velocity_at(begins[b], begins[b], point), velocity_at(begins[a], begins[a], point))
            velocity = vec3.add(velocity, vec3.load(contact.surface_velocity))
            way = workspace.span * vec3.dot(impulse, velocity)
            if way > OVERLAP * contact.size * vec3.norm(impulse):
                return False
    return True


@kernel
def break_off(header, workspace, world, count, num_contacts, instant):
    """Bodies of the group to ``ends``, its contacts to ``recent``, as they are at an ``instant`` [s] of the part."""
    bodies = bodies_of(header, world)
    fields = fields_of(header)
    contacts = table(workspace.contacts, workspace.contacts_size, CONTACT)
    members = numbers_in(header, workspace.members)
    bound = numbers_in(header, workspace.bound)
    begins = states_in(header, workspace.begins)
    flown = states_in(header, workspace.flown)
    ends = states_in(header, workspace.ends)
    there = states_in(header, workspace.working)
    span = workspace.span
    for index in range(num_contacts):
        _creep_less(bodies, begins, flown, ends, contacts[index], 1.0 - instant / span)
    for number in range(count):
        body = members[number]
        state_at(bodies[body], fields, begins[body], flown[body], ends[body], bound[body], instant, span, there[body])
    workspace.span = instant
    fly_group(header, workspace, world, count)
    for number in range(count):
        copy_state(there[members[number]], ends[members[number]])
    for index in range(num_contacts):
        follow(bodies, begins, flown, ends, contacts[index], instant)
    remember(workspace, contacts, num_contacts, instant / span)


@kernel
def _creep_less(bodies, begins, flown, ends, contact, share):
    """Take from the creep of a contact what it has not crept in the last ``share`` of the part."""
    if contact.stuck == 0 or contact.sticks == 0 or vec3.norm_squared(vec3.load(contact.creep)) == 0.0:
        return
    a = contact.body_a
    b = contact.body_b
    end_a = ends[a] if bodies[a].motion == DYNAMIC else flown[a]
    end_b = ends[b] if bodies[b].motion == DYNAMIC else flown[b]
    point = vec3.load(contact.start_position)
    normal = vec3.load(contact.end_normal)
    crept = vec3.sub(point_displacement(begins[b], end_b, point), point_displacement(begins[a], end_a, point))
    crept = vec3.add_scaled(crept, -vec3.dot(crept, normal), normal)
    vec3.store(contact.creep, vec3.add_scaled(vec3.load(contact.creep), -share, crept))
