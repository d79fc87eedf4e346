"""The smooth step: contacts that last, of order 2.

Bodies whose contacts neither close nor open obey M dv = dt f + G^T dr with the contact law between r and the velocity
u = G v, and G turns with them. Over a step h the impulses act with the geometry of its middle, the law holds with that
of its end, and positions advance by the trapezoid:

    M v' = M v_free + G_mid^T r,       u' = G_end v',       law(r, u'),
    x' = x + h (v + v') / 2,           R' = exp(h I^-1 l / 2) R_free        (l the angular impulse)

with v_free, R_free at the end of the flight. Where the middle and the end are depends on r. They are taken from a
prediction that errs by O(h^2), that bodies go on at the velocity they have, which leaves order 2; one that comes out
too far off is followed by another, made of the solution. To leave the solver one symmetric operator
W = G_mid M^-1 G_mid^T, the contact velocity is written as

    u' = W r + w,       w = Q G_end v'(r0) - W r0,

exact at r = r0, the impulses of the last step, with v' from the angular momentum at the end and Q the small rotation
from the end to the middle, in whose cone r lies. In terms of working velocities v_w = v'(r0) - M^-1 G_mid^T r0,

    w = G_mid v_w + turning,        turning = Q (G_end v'(r0) + s) - (G_mid v'(r0) + s),

s being the velocity of moving heights. Where nothing turns ``turning`` is zero and this is the plain contact problem;
at rest the impulses of the last step solve it.
"""

from __future__ import annotations

from ..contacts.prediction import DRIFT, OVERLAP, bears_load, gap_change, point_displacement, velocity_at
from ..contacts.turning import turn_contact
from ..jit import kernel
from ..maths import quat, vec3
from ..model import BETWEEN, DYNAMIC, ON_A
from .bodies import impulse_on, moment_on, set_velocities, sum_impulses, turn_by, turned

# Share of its gap, and of its creep along the surface while it sticks, that a lasting contact makes good in a step. The
# trapezoid leaves O(h^3) of both where a contact turns; so they stay small, at speeds far below any that matter.
CLOSING = 0.25
# Gaps, overlaps and creep below this fraction of the smaller body are left alone: what rests shall be still.
SETTLED = 3e-7
# A prediction whose contacts end within this fraction of the smaller body of where they were expected is good enough;
# else the solution serves as the next prediction. Larger: order 1 where forces change abruptly.
FORESEEN = 1e-6
MOST_PREDICTIONS = 3


@kernel
def _middle(a, b):
    """Midway between two close orientations."""
    sign = 1.0 if a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3] >= 0.0 else -1.0
    if a[1] == sign * b[1] and a[2] == sign * b[2] and a[3] == sign * b[3]:
        return a
    return quat.normalize((a[0] + sign * b[0], a[1] + sign * b[1], a[2] + sign * b[2], a[3] + sign * b[3]))


@kernel
def place_end(body, start, flown, orientation, row, time_step, out):
    """Center and orientation of ``out``; the moments of ``row`` act on the inertia turned to ``orientation``."""
    impulse = impulse_on(row)
    moment = moment_on(row)
    q = quat.load(flown.orientation)
    center = vec3.load(flown.center)
    if vec3.norm_squared(impulse) > 0.0:
        # The trapezoid of all that acts: what rests stays exactly where it is, whatever the field.
        total = vec3.add(vec3.load(start.velocity), vec3.load(flown.velocity))
        total = vec3.add_scaled(total, body.inverse_mass, impulse)
        center = vec3.add_scaled(vec3.load(start.center), 0.5 * time_step, total)
    vec3.store(out.center, center)
    quat.store(out.orientation, turned(q, vec3.scale(0.5 * time_step, turn_by(body, orientation, moment))))


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
        quat.store(working[handle].orientation, _middle(quat.load(start.orientation), orientation))


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
def _predict_support(start, flown, predicted, working):
    """What is not dynamic moves as it flies."""
    vec3.store(predicted.center, vec3.load(flown.center))
    quat.store(predicted.orientation, quat.load(flown.orientation))
    vec3.store(predicted.velocity, vec3.load(flown.velocity))
    vec3.store(predicted.angular_velocity, vec3.load(flown.angular_velocity))
    vec3.store(working.center, vec3.scale(0.5, vec3.add(vec3.load(start.center), vec3.load(flown.center))))
    quat.store(working.orientation, _middle(quat.load(start.orientation), quat.load(flown.orientation)))
    vec3.store(working.velocity, vec3.load(flown.velocity))
    vec3.store(working.angular_velocity, vec3.load(flown.angular_velocity))


@kernel
def _back_to_middle(contact, predicted, working, vector):
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
def predict_places(
    bodies, starts, flown, ends, time_step, contacts, order, first, last, island_bodies, first_body, last_body,
    predicted, working,
):  # fmt: skip
    """Bodies at the end that ``ends`` has so far, and midway to it; the contacts' fields ``end_*`` there."""
    predict_bodies(starts, ends, island_bodies, first_body, last_body, predicted, working)
    for index in range(first, last):
        contact = contacts[order[index]]
        a = contact.body_a
        b = contact.body_b
        if bodies[a].motion != DYNAMIC:
            _predict_support(starts[a], flown[a], predicted[a], working[a])
        if bodies[b].motion != DYNAMIC:
            _predict_support(starts[b], flown[b], predicted[b], working[b])
        contact.warm = 1 if bears_load(contact) else 0
        turn_contact(contact, starts[a], predicted[a], starts[b], predicted[b], time_step)


@kernel
def asks(contacts, order, first, last):
    """Whether the narrow phase has to say where a contact of the island is in the end."""
    for index in range(first, last):
        contact = contacts[order[index]]
        if (contact.curved == 1) if contact.persistent == 1 else (contact.end_gap < 0.0):
            return True
    return False


@kernel
def closes(contacts, order, first, last):
    """Whether a contact of the island that does not last would close on the way."""
    for index in range(first, last):
        if contacts[order[index]].persistent == 0 and contacts[order[index]].end_gap < 0.0:
            return True
    return False


@kernel
def take_middle(predicted, working, contacts, order, first, last):
    """Make ``position`` and ``normal`` of each contact those of the middle."""
    for index in range(first, last):
        contact = contacts[order[index]]
        position = vec3.add(vec3.load(contact.start_position), vec3.load(contact.end_position))
        vec3.store(contact.position, vec3.scale(0.5, position))
        vec3.store(contact.normal, _back_to_middle(contact, predicted, working, vec3.load(contact.end_normal)))


@kernel
def predict_velocities(bodies, flown, sums, island_bodies, first_body, last_body, predicted, working):
    """v'(r0) into ``predicted`` and v_w into ``working``; ``sums`` has the arms of the middle."""
    for index in range(first_body, last_body):
        handle = island_bodies[index]
        body = bodies[handle]
        row = sums[handle]
        set_velocities(body, flown[handle], row, predicted[handle])
        # v'(r0) - M^-1 p is the free velocity, and rounding it twice would move what rests.
        vec3.store(working[handle].velocity, vec3.load(flown[handle].velocity))
        change = turn_by(body, quat.load(working[handle].orientation), moment_on(row))
        vec3.store(working[handle].angular_velocity, vec3.sub(vec3.load(predicted[handle].angular_velocity), change))


@kernel
def _drifts(contacts, order, first, last):
    """Whether a lasting contact of the island has a gap, an overlap or a creep worth making good.

    One answer for all: what each contact asks for on its own, no motion of rigid bodies may be able to give.
    """
    for index in range(first, last):
        contact = contacts[order[index]]
        if contact.persistent == 1:
            squares = contact.start_gap**2 + vec3.norm_squared(vec3.load(contact.creep))
            if squares > (SETTLED * contact.size) ** 2:
                return True
    return False


@kernel
def set_turning(bodies, predicted, working, ends, time_step, contacts, order, first, last):
    """``turning`` and ``bias`` of each contact.

    The velocity at the end is that of the relative motion (V, Omega) of the pair at arm x' from the centre of one of
    them, Q (V + Omega cross x'). The solver knows the arm x of the middle. Q x' - x is not alike for all contacts of a
    pair, and the difference it makes is left out where it is round-off: velocities that no rigid motion could bring to
    zero would make contacts slip that stick.
    """
    drifts = _drifts(contacts, order, first, last)
    for index in range(first, last):
        contact = contacts[order[index]]
        a = contact.body_a
        b = contact.body_b
        middle = vec3.load(contact.position)
        at_middle = vec3.sub(
            velocity_at(working[b], predicted[b], middle), velocity_at(working[a], predicted[a], middle)
        )
        own = b if bodies[b].motion == DYNAMIC else a
        other = a if own == b else b
        sign = 1.0 if own == b else -1.0
        center = vec3.load(predicted[own].center)
        relative = vec3.sub(vec3.load(predicted[own].velocity), velocity_at(predicted[other], predicted[other], center))
        spin = vec3.sub(vec3.load(predicted[own].angular_velocity), vec3.load(predicted[other].angular_velocity))
        relative = vec3.scale(sign, _back_to_middle(contact, predicted, working, relative))
        spin = vec3.scale(sign, _back_to_middle(contact, predicted, working, spin))
        arm = vec3.sub(vec3.load(contact.end_position), center)
        arm = _back_to_middle(contact, predicted, working, arm)
        arm_middle = vec3.sub(middle, vec3.load(working[own].center))
        at_end = vec3.add(relative, vec3.cross(spin, arm_middle))
        change = vec3.cross(spin, vec3.sub(arm, arm_middle))
        if time_step * vec3.norm(change) > OVERLAP * contact.size:
            at_end = vec3.add(at_end, change)
        turning = vec3.sub(at_end, at_middle)
        contact.bias = 0.0
        if contact.persistent == 0:
            # Its gap would end at end_gap + h n . (u - u') / 2, u' being the velocity that led to that gap; it comes
            # into play where that is zero.
            point = vec3.load(contact.end_position)
            expected = vec3.sub(velocity_at(predicted[b], ends[b], point), velocity_at(predicted[a], ends[a], point))
            expected = vec3.add(expected, vec3.load(contact.surface_velocity))
            contact.bias = 2.0 * contact.end_gap / time_step - vec3.dot(vec3.load(contact.normal), expected)
        elif drifts:
            # What is deeper is left to the position stage.
            if contact.start_gap >= -DRIFT * contact.size:
                contact.bias = CLOSING * contact.start_gap / time_step
            turning = vec3.add_scaled(turning, CLOSING / time_step, vec3.load(contact.creep))
        vec3.store(contact.turning, turning)


@kernel
def note_sticking(time_step, contacts, order, first, last, rows):
    """Set ``sticks`` of each contact from the solved problem, whose rows are still there.

    A contact sticks if it bears load and has no velocity, also if its friction happens to be at its limit.
    """
    for index in range(first, last):
        contact = contacts[order[index]]
        velocity = vec3.load(rows[index - first].velocity)
        normal = vec3.load(contact.normal)
        slip = time_step * vec3.norm(vec3.add_scaled(velocity, -vec3.dot(velocity, normal), normal))
        sticks = contact.persistent == 1 and bears_load(contact) and slip <= OVERLAP * contact.size
        contact.sticks = 1 if sticks else 0


@kernel
def add_creep(starts, ends, contacts, order, first, last):
    """Add up how far each contact that sticks has crept along its tangents, which a true one would not.

    It counts from the end of the step in which the contact came to rest, and turns with the ground. Only corners: where
    round shapes roll, the material at the contact is always another.
    """
    for index in range(first, last):
        contact = contacts[order[index]]
        creep = vec3.ZERO
        corner = contact.radius_a == 0.0 and contact.radius_b == 0.0 and contact.curved == 0
        if corner and contact.stuck == 1 and contact.sticks == 1:
            a = contact.body_a
            b = contact.body_b
            carrier = a if contact.frame == ON_A else b
            creep = quat.rotate_inverse(quat.load(starts[carrier].orientation), vec3.load(contact.creep))
            creep = quat.rotate(quat.load(ends[carrier].orientation), creep)
            point = vec3.load(contact.start_position)
            creep = vec3.add(creep, point_displacement(starts[b], ends[b], point))
            creep = vec3.sub(creep, point_displacement(starts[a], ends[a], point))
            normal = vec3.load(contact.end_normal)
            creep = vec3.add_scaled(creep, -vec3.dot(creep, normal), normal)
        vec3.store(contact.creep, creep)


@kernel
def prepare_lasting(
    bodies, flown, time_step, contacts, order, first, last, sums, island_bodies, first_body, last_body,
    predicted, working, ends,
):  # fmt: skip
    """Write the contact problem of one island about the middle of the way to ``predicted``: contacts, and ``working``
    bodies.
    """
    take_middle(predicted, working, contacts, order, first, last)
    sum_impulses(bodies, working, contacts, order, first, last, island_bodies, first_body, last_body, sums)
    predict_velocities(bodies, flown, sums, island_bodies, first_body, last_body, predicted, working)
    set_turning(bodies, predicted, working, ends, time_step, contacts, order, first, last)


@kernel
def end_lasting(
    bodies, starts, flown, time_step, contacts, order, first, last, sums, island_bodies, first_body, last_body,
    working, ends,
):  # fmt: skip
    """Bodies of one island at the end of the step, under the impulses that were solved for."""
    sum_impulses(bodies, working, contacts, order, first, last, island_bodies, first_body, last_body, sums)
    for index in range(first_body, last_body):
        handle = island_bodies[index]
        body = bodies[handle]
        middle = quat.load(working[handle].orientation)
        place_end(body, starts[handle], flown[handle], middle, sums[handle], time_step, ends[handle])
        set_velocities(body, flown[handle], sums[handle], ends[handle])


@kernel
def came_true(predicted, ends, contacts, order, first, last):
    """Whether all contacts of an island that last end where they were predicted to.

    One that bore no load before, as in a first step, had no prediction.
    """
    for index in range(first, last):
        contact = contacts[order[index]]
        if contact.persistent == 1:
            a = contact.body_a
            b = contact.body_b
            position = vec3.load(contact.end_position)
            normal = vec3.load(contact.end_normal)
            gap = contact.end_gap
            miss = gap_change(contact, position, normal, gap, predicted[a], ends[a], predicted[b], ends[b])
            if abs(miss) > (FORESEEN if contact.warm == 1 else OVERLAP) * contact.size:
                return False
    return True
