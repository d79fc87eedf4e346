"""What happens at each contact if the bodies fly the whole step as if nothing touched, and what follows from it.

Without impulses the gap of a contact would end at

    gap_end = gap + n . (d_b - d_a) + n . d_s,

d_a and d_b being displacements of the bodies' points (kinematics.py) and d_s that of b's surface against its body.

A contact *lasts* if it touches at the start of the step and does not approach there. An island whose contacts all last,
or stay apart, moves smoothly (response/lasting.py); one in which a contact closes is struck (response/impact.py).
"""

from __future__ import annotations

import math

from ..jit import kernel
from ..maths import quat, vec3
from ..model import FAR_TURN, SLACK
from .kinematics import carried, surface_gain, surface_shift, turn_between, turned_gap_change, velocity_at

# Gap or overlap of less than this fraction of the smaller body is round-off: it counts as touching, and stays.
OVERLAP = 1e-9
# A rebound that rises by less than this fraction of the smaller body is none. Larger: what should bounce on rests too
# early, for an endless sequence is cut off where a step ends by the time sqrt(8 rise / g) e / (1 - e).
REBOUND = 1e-13
# Overlap of more than this fraction of the smaller body is pushed out within the step. Smaller ones, which smooth
# motion leaves behind, part little by little; a smaller limit solves for positions in many more steps.
DRIFT = 1e-6
# A contact that bore load and is now closer than this fraction of the smaller body still touches. Larger: a body that
# has left the ground by less is not seen to fall on it again as an impact. One that separates does not last if half of
# what that does in a step is more: stopped by the end of the step it would be left farther away than what touches, and
# fall anew, for ever (a slender block that rocks).
TOUCH = 1e-4
# A touching contact that approaches still lasts while half of what the approach does in a step is less than this
# fraction of the smaller body: the overlap is pushed out again. Larger approaches are impacts.
CREEP = 1e-3
# A body that comes or swings closer within a step than this many half thicknesses of the thinner one may pass through
# it: two equal bodies have passed each other after four. Smaller: fast piles are stopped at many touches.
THICKNESS = 4.0

# Share of the span in which a contact would bend as far as it may that a step in parts takes.
CALM = 0.9


@kernel
def _far_end(body, start, flown, span):
    """[m] how far the far end of a body moves because it turns; a sphere that spins moves nothing."""
    spin = max(
        vec3.norm_squared(vec3.load(start.angular_velocity)), vec3.norm_squared(vec3.load(flown.angular_velocity))
    )
    return span * math.sqrt(spin) * (body.radius - body.inner) if spin > 0.0 else 0.0


@kernel
def swing(body_a, start_a, flown_a, body_b, start_b, flown_b, span):
    """[m] how far the far ends of two bodies move because they turn."""
    return _far_end(body_a, start_a, flown_a, span) + _far_end(body_b, start_b, flown_b, span)


@kernel
def _turned(body, far):
    """[rad] by which a body turns whose far end moves by ``far``."""
    return far / (body.radius - body.inner) if far > 0.0 else 0.0


@kernel
def _spread(body, place, contact, sign, turned):
    """[m] by which a body that turns may come to reach farther along the normal than it does at a contact.

    It reaches h = n . (point - center) there. No point of it is farther from its centre than its radius r, and none
    moves along the normal by more than the angle times r: r - h or that.
    """
    arm = vec3.sub(vec3.load(contact.position), vec3.load(place.center))
    reach = sign * vec3.dot(vec3.load(contact.normal), arm) - 0.5 * contact.gap
    return min(max(body.radius - reach, 0.0), turned * body.radius)


@kernel
def wander(contact, body_a, start_a, flown_a, body_b, start_b, flown_b, span):
    """[m] by which a gap may end smaller than ``free_gap``, along the normal it has at the start.

    Where bodies turn by an angle and move against each other the normal turns by that angle, and another point of them
    may be the nearest one: angle times way, of second order in the span. Where the angle is not small the point that is
    nearest at the start may be carried far away, and any other may come: all that bodies can reach counts.
    """
    far_a = _far_end(body_a, start_a, flown_a, span)
    far_b = _far_end(body_b, start_b, flown_b, span)
    if far_a + far_b == 0.0:
        return 0.0
    way = vec3.sub(vec3.load(flown_b.center), vec3.load(start_b.center))
    way = vec3.sub(way, vec3.sub(vec3.load(flown_a.center), vec3.load(start_a.center)))
    turned_a = _turned(body_a, far_a)
    turned_b = _turned(body_b, far_b)
    bent = (turned_a + turned_b) * (vec3.norm(way) + far_a + far_b)
    if turned_a + turned_b > FAR_TURN:
        normal = vec3.load(contact.normal)
        least = contact.gap + vec3.dot(normal, way) + span * vec3.dot(normal, vec3.load(contact.surface_velocity))
        if far_a > 0.0:
            least -= _spread(body_a, start_a, contact, 1.0, turned_a)
        if far_b > 0.0:
            least -= _spread(body_b, start_b, contact, -1.0, turned_b)
        bent = max(bent, contact.free_gap - least)
    return bent


@kernel
def predict_contacts(bodies, starts, ends, time_step, whole_step, lands, contacts, num_contacts):
    """Note where each contact is, how fast it approaches and how it ends without impulses; return how many remain.

    ``starts`` and ``ends`` are the states (bodies,) at both ends of the flight. Contacts that stay open by more than
    SLACK of the smaller body are dropped, unless a body turns so far that another part of it may be the one that hits.
    How far is asked of the ``whole_step``: one made of short parts is not looked over less closely.
    ``lands``: impacts without rebound are located as well. Steady ones were recalled with all of this (coherence.py).
    """
    kept = 0
    # Contacts come pair by pair.
    last_a = -1
    last_b = -1
    turn_a = quat.IDENTITY
    turn_b = quat.IDENTITY
    for index in range(num_contacts):
        contact = contacts[index]
        if contact.steady == 1:
            if kept < index:
                contacts[kept] = contact
            kept += 1
            continue
        a = contact.body_a
        b = contact.body_b
        if a != last_a:
            turn_a = turn_between(starts[a], ends[a])
            last_a = a
        if b != last_b:
            turn_b = turn_between(starts[b], ends[b])
            last_b = b
        point = vec3.load(contact.position)
        normal = vec3.load(contact.normal)
        rise = vec3.dot(normal, vec3.load(contact.surface_velocity))
        contact.size = min(bodies[a].size, bodies[b].size)
        change = turned_gap_change(
            contact, point, normal, contact.gap, starts[a], ends[a], turn_a, starts[b], ends[b], turn_b
        )
        contact.free_gap = contact.gap + change + vec3.dot(normal, surface_shift(contact, time_step))
        struck = contact.blow[0] != 0.0 or contact.blow[1] != 0.0 or contact.blow[2] != 0.0
        before = vec3.sub(velocity_at(starts[b], starts[b], point), velocity_at(starts[a], starts[a], point))
        contact.approach = vec3.dot(normal, before) + rise
        # A corner that comes to touch strikes, even if the turn has taken it away again by the end.
        apart = contact.gap > OVERLAP * contact.size or (contact.gap > 0.0 and contact.approach >= 0.0)
        if contact.free_gap > SLACK * contact.size and apart and not struck:
            far = swing(bodies[a], starts[a], ends[a], bodies[b], starts[b], ends[b], whole_step)
            if far <= THICKNESS * contact.size:
                if contact.restitution == 0.0 and not lands:
                    continue
                # What is located has to be looked at on its way, where that may bend enough.
                bent = wander(contact, bodies[a], starts[a], ends[a], bodies[b], starts[b], ends[b], time_step)
                if contact.free_gap - bent > SLACK * contact.size:
                    continue
        after = vec3.sub(velocity_at(starts[b], ends[b], point), velocity_at(starts[a], ends[a], point))
        contact.free = vec3.dot(normal, vec3.add(after, surface_gain(contact, time_step))) + rise
        contact.start_gap = contact.gap
        vec3.store(contact.start_position, point)
        vec3.store(contact.start_normal, normal)
        if kept < index:
            contacts[kept] = contact
        kept += 1
    return kept


@kernel
def rebounds(contact, approach, span, time_step):
    """Whether a contact with this normal velocity [m/s], negative if approaching, is one that bounces.

    One whose rebound rises by less than REBOUND of the smaller body does not; what presses the bodies together is told
    by the flight: a = (free - approach) / span.
    """
    if contact.restitution <= 0.0 or -approach * time_step <= OVERLAP * contact.size:
        return False
    pressing = (contact.approach - contact.free) / span if span > 0.0 else 0.0
    return approach * approach > 2.0 * pressing * REBOUND * contact.size


@kernel
def sort_out(time_step, contacts, order, first, last, bounce_step, crowd):
    """Set ``persistent`` of the contacts of one island, order[first:last]; return whether one strikes at once, and the
    span [s] in which those that rest turn little enough to last.

    On entry ``persistent`` says which bore load in the last step. Spread evenly over the step, an impulse that stops
    an approach lets the gap close by half of what the approach does in a step; if that is more than CREEP allows,
    the contact does not last: it is an impact at the start of the step. Nor does one whose point swings away from its
    tangent within the step: the smooth step is for small turns. Nor one that leaves so fast that it would end too far
    away to touch, or that bounces or has just done so, if ``bounce_step`` [s], the whole step, is not zero.
    ``crowd``: whether the pile tier may step the island. Its bodies tremble, and what bears load opens now and then by
    more than TOUCH. There a contact lasts up to SLACK: a heap that forgets such loads sinks and is pushed apart again,
    which opens others, for ever, the deeper it is the more.
    """
    struck = False
    calm = time_step
    parting = SLACK if crowd else TOUCH
    for index in range(first, last):
        contact = contacts[order[index]]
        touches = contact.gap <= (parting if contact.persistent == 1 else OVERLAP) * contact.size
        kept = max(contact.gap, 0.0) + 0.5 * time_step * contact.approach >= -CREEP * contact.size
        linear = contact.gap + 0.5 * time_step * (contact.approach + contact.free)
        kept = kept and not rebounds(contact, contact.approach, time_step, bounce_step)
        bend = abs(contact.free_gap - linear)
        rests = kept
        kept = kept and bend <= SLACK * contact.size
        leaves = 0.5 * time_step * contact.approach > parting * contact.size
        leaves = leaves or rebounds(contact, -contact.approach, time_step, bounce_step)
        if leaves or not touches:
            # What it bore ended with the last step; begun with that, the solver would leave a trace of it.
            vec3.store(contact.impulse, vec3.ZERO)
            vec3.store(contact.moment, vec3.ZERO)
        contact.persistent = 1 if touches and kept and not leaves else 0
        struck = struck or (touches and not kept and not leaves)
        if touches and rests and not kept and not leaves:
            # The bend grows with the square of the span, at least.
            calm = min(calm, CALM * time_step * math.sqrt(SLACK * contact.size / bend))
    return struck, calm


@kernel
def bears_load(contact):
    return vec3.dot(vec3.load(contact.impulse), vec3.load(contact.normal)) > 0.0


@kernel
def is_touching(contact):
    """Whether a contact lasts, or is open by no more than one that bears may become."""
    return contact.persistent == 1 or contact.start_gap <= TOUCH * contact.size


@kernel
def list_touching(contacts, order, first, last, touching):
    """List the contacts of the island order[first:last] that touch in ``touching``; return how many there are."""
    count = 0
    for index in range(first, last):
        contact = contacts[order[index]]
        if is_touching(contact):
            touching[count] = order[index]
            count += 1
    return count


@kernel
def newly_loaded(contacts, touching, num_touching):
    """Whether one of the contacts touching[:num_touching] that did not last bears load."""
    for index in range(num_touching):
        contact = contacts[touching[index]]
        if contact.persistent == 0 and bears_load(contact):
            return True
    return False


@kernel
def measure_end(places, ends, contacts, order, first, last):
    """Move each contact of an island to the end of the step; return the deepest overlap [m].

    The fields ``end_*`` hold its geometry with the bodies at ``places``; they are now at ``ends``.
    """
    worst = 0.0
    last_a = -1
    last_b = -1
    turn_a = quat.IDENTITY
    turn_b = quat.IDENTITY
    for index in range(first, last):
        contact = contacts[order[index]]
        a = contact.body_a
        b = contact.body_b
        if a != last_a:
            turn_a = turn_between(places[a], ends[a])
            last_a = a
        if b != last_b:
            turn_b = turn_between(places[b], ends[b])
            last_b = b
        position = vec3.load(contact.end_position)
        normal = vec3.load(contact.end_normal)
        change = turned_gap_change(
            contact, position, normal, contact.end_gap, places[a], ends[a], turn_a, places[b], ends[b], turn_b
        )
        contact.gap = contact.end_gap + change
        moved = vec3.add(carried(places[a], ends[a], turn_a, position), carried(places[b], ends[b], turn_b, position))
        vec3.store(contact.position, vec3.add_scaled(position, 0.5, moved))
        vec3.store(contact.normal, normal)
        worst = max(worst, -contact.gap)
    return worst
