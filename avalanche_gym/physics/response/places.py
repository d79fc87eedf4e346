"""Where bodies and contacts of a smooth step are in its middle and at its end: predicted, and whether it came true."""

from __future__ import annotations

from ..contacts.kinematics import gap_change
from ..contacts.prediction import OVERLAP, bears_load, is_touching
from ..contacts.turning import turn_contact
from ..jit import kernel
from ..maths import quat, vec3
from ..model import BETWEEN, DYNAMIC, ON_A
from .bodies import turn_by, turned
from .creep import drifts_away, gap_closing, moved_together

# A prediction whose contacts end within this fraction of the smaller body of where they were expected is good enough;
# else the solution serves as the next prediction. Larger: order 1 where forces change abruptly.
FORESEEN = 1e-6
MOST_PREDICTIONS = 3
# Sweeps in which the first prediction finds what the contacts of a body alone make of its velocity, and the share of
# that fraction at which it is found. More sweeps cost more than the predictions that they save.
EXPECTING_SWEEPS, SHARE_FORESEEN = 8, 0.25


@kernel
def midway(a, b):
    """Midway between two close orientations."""
    sign = 1.0 if a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3] >= 0.0 else -1.0
    if a[1] == sign * b[1] and a[2] == sign * b[2] and a[3] == sign * b[3]:
        return a
    return quat.normalize((a[0] + sign * b[0], a[1] + sign * b[1], a[2] + sign * b[2], a[3] + sign * b[3]))


@kernel
def predict_bodies(starts, ends, island_bodies, first_body, last_body, predicted, working):
    """Places at the predicted end, those of ``ends``, and midway to it."""
    for index in range(first_body, last_body):
        handle = island_bodies[index]
        start = starts[handle]
        center = vec3.load(ends[handle].center)
        orientation = quat.load(ends[handle].orientation)
        vec3.store(predicted[handle].center, center)
        quat.store(predicted[handle].orientation, orientation)
        vec3.store(working[handle].center, vec3.scale(0.5, vec3.add(vec3.load(start.center), center)))
        quat.store(working[handle].orientation, midway(quat.load(start.orientation), orientation))


@kernel
def expect_steady(starts, time_step, contacts, order, first, last, bodies, ends):
    """The first prediction: bodies that bore load in the last step go on at the velocity they have.

    Not at what the impulses of the last step would do to them: those balance one another only to within the small
    motion since, and where a heavy body rests on a light one that is far too much.
    """
    for index in range(first, last):
        contact = contacts[order[index]]
        if bears_load(contact):
            for side in range(2):
                handle = contact.body_a if side == 0 else contact.body_b
                if bodies[handle].motion == DYNAMIC:
                    start = starts[handle]
                    center = vec3.add_scaled(vec3.load(start.center), time_step, vec3.load(start.velocity))
                    vec3.store(ends[handle].center, center)
                    vec3.store(ends[handle].velocity, vec3.load(start.velocity))


@kernel
def expect_on_way(island_bodies, first_body, last_body, bound, predicted, ends):
    """The prediction of a part that has been solved as a longer one: bodies go where its way has been followed to,
    into ``predicted``.
    """
    for index in range(first_body, last_body):
        handle = island_bodies[index]
        if bound[handle] == 1:
            # What else a state has, its forces and its momentum, is not on the way.
            place = predicted[handle]
            vec3.store(ends[handle].center, vec3.load(place.center))
            quat.store(ends[handle].orientation, quat.load(place.orientation))
            vec3.store(ends[handle].velocity, vec3.load(place.velocity))
            vec3.store(ends[handle].angular_velocity, vec3.load(place.angular_velocity))


@kernel
def expect_supported(starts, time_step, whole_step, contacts, order, first, last, bodies, handle, ends):
    """The first prediction of a body alone on its contacts: what it was pushed against holds, so it does not go on.

    The normal velocities u_i of the contacts that bore load become at least what the solver will ask for, u_i', by
    impulses j_i along the normals, found in a few sweeps of projected Gauss-Seidel. The trapezoid makes half a step of
    the velocities that they change:

        u_i' <= u_i + n_i . (dv + dw cross x_i),    dv = sum j_i n_i / m,    dw = I^-1 sum x_i cross j_i n_i,
        j_i >= 0,    j_i = 0 or equality    if there are several,
        x' = x + h (v + dv / 2),    R' = exp(h dw / 2) R_free.

    Of several contacts one that opens may leave the load to the others, as the facet that a body has just slid off:
    there they only push, beyond what keeps the velocity. A single one holds if free flight would close it. Friction
    moves along the surface, which leaves the gaps as they are. The impulses are kept in ``bias``, which is not set yet.
    """
    body = bodies[handle]
    place = quat.load(starts[handle].orientation)
    center = vec3.load(starts[handle].center)
    drifts = drifts_away(bodies, contacts, order, first, last, moved_together(bodies, contacts[order[first]]))
    change = vec3.ZERO
    turn = vec3.ZERO
    several = last - first > 1
    for index in range(first, last):
        contacts[order[index]].bias = 0.0
    for _ in range(EXPECTING_SWEEPS):
        settled = True
        for index in range(first, last):
            contact = contacts[order[index]]
            if contact.persistent == 0 or not bears_load(contact):
                continue
            wanted = -gap_closing(contact, whole_step) if drifts else 0.0
            if contact.free >= wanted:
                continue
            normal = vec3.load(contact.start_normal)
            if contact.body_a == handle:
                normal = vec3.neg(normal)
            lever = vec3.cross(vec3.sub(vec3.load(contact.start_position), center), normal)
            excess = contact.approach - wanted + vec3.dot(normal, change) + vec3.dot(lever, turn)
            opens = several and excess >= 0.0 and contact.bias == 0.0
            if opens or 0.5 * time_step * abs(excess) <= SHARE_FORESEEN * FORESEEN * contact.size:
                continue
            settled = False
            turned_by = turn_by(body, place, lever)
            response = body.inverse_mass + vec3.dot(lever, turned_by)
            if response > 0.0:
                impulse = contact.bias - excess / response
                impulse = max(impulse, 0.0) if several else impulse
                added = impulse - contact.bias
                contact.bias = impulse
                change = vec3.add_scaled(change, added * body.inverse_mass, normal)
                turn = vec3.add_scaled(turn, added, turned_by)
        if settled:
            break
    end = ends[handle]
    vec3.store(end.center, vec3.add_scaled(vec3.load(end.center), 0.5 * time_step, change))
    quat.store(end.orientation, turned(quat.load(end.orientation), vec3.scale(0.5 * time_step, turn)))


@kernel
def _predict_support(start, flown, predicted, working):
    """What is not dynamic moves as it flies."""
    vec3.store(predicted.center, vec3.load(flown.center))
    quat.store(predicted.orientation, quat.load(flown.orientation))
    vec3.store(predicted.velocity, vec3.load(flown.velocity))
    vec3.store(predicted.angular_velocity, vec3.load(flown.angular_velocity))
    vec3.store(working.center, vec3.scale(0.5, vec3.add(vec3.load(start.center), vec3.load(flown.center))))
    quat.store(working.orientation, midway(quat.load(start.orientation), quat.load(flown.orientation)))
    vec3.store(working.velocity, vec3.load(flown.velocity))
    vec3.store(working.angular_velocity, vec3.load(flown.angular_velocity))


@kernel
def back_to_middle(contact, predicted, working, vector):
    """Q: a vector at the end of the step as the middle sees it.

    It turns with the body that carries the normal, spin about the normal included: then the velocities of all contacts
    of a pair turn alike, and contacts that stick at the end can stick in the problem that is solved.
    """
    if contact.frame == BETWEEN or contact.curved == 1:
        normal = vec3.load(contact.end_normal)
        middle = vec3.normalize(vec3.add(vec3.load(contact.start_normal), normal))
        axis = vec3.cross(normal, middle)
        once = vec3.cross(axis, vector)
        # Rodrigues' formula for the smallest rotation from one unit vector to another.
        return vec3.add(
            vec3.add(vector, once), vec3.scale(1.0 / (1.0 + vec3.dot(normal, middle)), vec3.cross(axis, once))
        )
    carrier = contact.body_a if contact.frame == ON_A else contact.body_b
    end = quat.load(predicted[carrier].orientation)
    middle = quat.load(working[carrier].orientation)
    if end[1] == middle[1] and end[2] == middle[2] and end[3] == middle[3]:
        return vector
    return quat.rotate(middle, quat.rotate_inverse(end, vector))


@kernel
def on_to_middle(contact, predicted, working, vector):
    """A vector at the start of the step, that turns with the body that carries the normal, as the middle sees it."""
    carrier = contact.body_a if contact.frame == ON_A else contact.body_b
    end = quat.load(predicted[carrier].orientation)
    middle = quat.load(working[carrier].orientation)
    if end[1] == middle[1] and end[2] == middle[2] and end[3] == middle[3]:
        return vector
    # Both halves of the turn are alike.
    return quat.rotate(end, quat.rotate_inverse(middle, vector))


@kernel
def predict_places(
    bodies, starts, flown, ends, time_step, contacts, order, first, last, island_bodies, first_body, last_body,
    predicted, working,
):  # fmt: skip
    """Bodies at the end that ``ends`` has so far, and midway to it; the contacts' fields ``end_*`` there."""
    predict_bodies(starts, ends, island_bodies, first_body, last_body, predicted, working)
    support = -1
    for index in range(first, last):
        contact = contacts[order[index]]
        a = contact.body_a
        b = contact.body_b
        # Contacts with the same support follow one another.
        if bodies[a].motion != DYNAMIC and a != support:
            _predict_support(starts[a], flown[a], predicted[a], working[a])
            support = a
        if bodies[b].motion != DYNAMIC and b != support:
            _predict_support(starts[b], flown[b], predicted[b], working[b])
            support = b
        contact.warm = 1 if bears_load(contact) else 0
        turn_contact(contact, starts[a], predicted[a], starts[b], predicted[b], time_step)
        if contact.persistent == 0 and contact.restitution > 0.0 and contact.end_gap < 0.0:
            # What bounces and only just touches at the end of the step does so in the next one.
            if contact.end_gap >= -OVERLAP * contact.size:
                contact.end_gap = OVERLAP * contact.size


@kernel
def asks(contacts, order, first, last):
    """Whether the narrow phase has to say where a contact of the island is in the end."""
    for index in range(first, last):
        contact = contacts[order[index]]
        if (contact.curved == 1) if contact.persistent == 1 else (contact.end_gap < 0.0):
            return True
    return False


@kernel
def closes(contacts, order, first, last, time_step, predictions):
    """Whether a contact of the island that does not last would close on the way.

    The first prediction knows nothing of what the fields do within the step: what closes by no more than that may not
    close, and is left to the solution, and to the prediction that is made of it.
    """
    for index in range(first, last):
        contact = contacts[order[index]]
        if contact.persistent == 0 and contact.end_gap < 0.0:
            unknown = abs(contact.free - contact.approach) * time_step if predictions == 0 else 0.0
            if contact.end_gap < -unknown:
                return True
    return False


@kernel
def _missed(contact, predicted, ends):
    """[m] by which the gap of a contact ends larger than it was predicted to."""
    a = contact.body_a
    b = contact.body_b
    position = vec3.load(contact.end_position)
    normal = vec3.load(contact.end_normal)
    return gap_change(contact, position, normal, contact.end_gap, predicted[a], ends[a], predicted[b], ends[b])


@kernel
def closes_by_end(predicted, ends, contacts, order, first, last):
    """Whether a contact of the island that had no part in the solution is closed at the end that this leads to."""
    for index in range(first, last):
        contact = contacts[order[index]]
        if not is_touching(contact) and contact.end_gap + _missed(contact, predicted, ends) < 0.0:
            return True
    return False


@kernel
def take_middle(predicted, working, contacts, touching, num_touching):
    """Make ``position`` and ``normal`` of each contact that touches those of the middle."""
    for index in range(num_touching):
        contact = contacts[touching[index]]
        position = vec3.add(vec3.load(contact.start_position), vec3.load(contact.end_position))
        vec3.store(contact.position, vec3.scale(0.5, position))
        vec3.store(contact.normal, back_to_middle(contact, predicted, working, vec3.load(contact.end_normal)))


@kernel
def came_true(predicted, ends, time_step, contacts, touching, num_touching):
    """Whether all contacts of touching[:num_touching] that last end where they were predicted to.

    One that bore no load before, as in a first step, had no prediction. Where the ground turns it matters along the
    surface as well: at a place that was missed by d the surface goes otherwise by omega cross d, and makes half of that
    in a step.
    """
    for index in range(num_touching):
        contact = contacts[touching[index]]
        if contact.persistent == 1:
            a = contact.body_a
            b = contact.body_b
            miss = abs(_missed(contact, predicted, ends))
            carrier, body = (a, b) if contact.frame == ON_A else (b, a)
            spin = vec3.load(predicted[carrier].angular_velocity)
            if vec3.norm_squared(spin) > 0.0:
                place = vec3.sub(vec3.load(ends[body].center), vec3.load(predicted[body].center))
                place = vec3.sub(place, vec3.sub(vec3.load(ends[carrier].center), vec3.load(predicted[carrier].center)))
                miss = max(miss, 0.5 * time_step * vec3.norm(vec3.cross(spin, place)))
            if miss > (FORESEEN if contact.warm == 1 else OVERLAP) * contact.size:
                return False
    return True
