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

    w = G_mid v_w + s + turning,        turning = Q (G_end v'(r0) + s') - (G_mid v'(r0) + s),

s and s' being the velocities of moving heights at the start and the end. Where nothing turns ``turning`` is zero and
this is the plain contact problem; at rest the impulses of the last step solve it.

Contacts that are open by more than what bears may become have no part in it: they bear nothing as long as they stay
open, and of those near a moving body that is most. Whether one is closed at the end that comes out, or one that does
not last bears load, tells whether the step was smooth at all.
"""

from __future__ import annotations

from ..contacts.kinematics import turn_between, velocity_at
from ..contacts.prediction import OVERLAP
from ..jit import kernel
from ..maths import quat, vec3
from ..model import DYNAMIC, ON_A, ON_B, STATIC
from .bodies import impulse_on, moment_on, set_velocities, sum_impulses, turn_by, turned
from .creep import CLOSING, drifts_away, gap_closing, moved_together
from .places import back_to_middle, on_to_middle, take_middle


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
def set_turning(bodies, predicted, working, ends, time_step, whole_step, contacts, touching, num_touching):
    """``turning`` and ``bias`` of each contact.

    The velocity at the end is that of the relative motion (V, Omega) of the pair at arm x' from the centre of one of
    them, Q (V + Omega cross x'). The solver knows the arm x of the middle. Q x' - x is not alike for all contacts of a
    pair, and the difference it makes is left out where it is round-off: velocities that no rigid motion could bring to
    zero would make contacts slip that stick.
    """
    drifts = False
    known = (-2, -2)
    for index in range(num_touching):
        contact = contacts[touching[index]]
        a = contact.body_a
        b = contact.body_b
        movers = moved_together(bodies, contact)
        if movers != known:
            known = movers
            drifts = drifts_away(bodies, contacts, touching, 0, num_touching, movers)
        middle = vec3.load(contact.position)
        own = b if bodies[b].motion == DYNAMIC else a
        other = a if own == b else b
        sign = 1.0 if own == b else -1.0
        center = vec3.load(predicted[own].center)
        arm = vec3.sub(vec3.load(contact.end_position), center)
        arm_middle = vec3.sub(middle, vec3.load(working[own].center))
        turning = vec3.ZERO
        if bodies[other].motion == STATIC and contact.curved == 0 and contact.frame == (ON_B if other == b else ON_A):
            # Q is the identity and V + Omega cross x the velocity at the middle: all that can differ is the arm.
            spin = vec3.scale(sign, vec3.load(predicted[own].angular_velocity))
        else:
            at_middle = vec3.sub(
                velocity_at(working[b], predicted[b], middle), velocity_at(working[a], predicted[a], middle)
            )
            relative = velocity_at(predicted[other], predicted[other], center)
            relative = vec3.sub(vec3.load(predicted[own].velocity), relative)
            spin = vec3.sub(vec3.load(predicted[own].angular_velocity), vec3.load(predicted[other].angular_velocity))
            relative = vec3.scale(sign, back_to_middle(contact, predicted, working, relative))
            spin = vec3.scale(sign, back_to_middle(contact, predicted, working, spin))
            surface = back_to_middle(contact, predicted, working, vec3.load(contact.end_surface_velocity))
            arm = back_to_middle(contact, predicted, working, arm)
            turning = vec3.sub(vec3.add(relative, vec3.cross(spin, arm_middle)), at_middle)
            turning = vec3.add(turning, vec3.sub(surface, vec3.load(contact.surface_velocity)))
        change = vec3.cross(spin, vec3.sub(arm, arm_middle))
        if time_step * vec3.norm(change) > OVERLAP * contact.size:
            turning = vec3.add(turning, change)
        contact.bias = 0.0
        if contact.persistent == 0:
            # Its gap would end at end_gap + h n . (u - u') / 2, u' being the velocity that led to that gap; it comes
            # into play where that is zero.
            point = vec3.load(contact.end_position)
            expected = vec3.sub(velocity_at(predicted[b], ends[b], point), velocity_at(predicted[a], ends[a], point))
            expected = vec3.add(expected, vec3.load(contact.end_surface_velocity))
            contact.bias = 2.0 * contact.end_gap / time_step - vec3.dot(vec3.load(contact.normal), expected)
        elif drifts:
            contact.bias = gap_closing(contact, whole_step)
            # A rigid motion makes it good only where it has turned on as its arm has.
            creep = on_to_middle(contact, predicted, working, vec3.load(contact.creep))
            turning = vec3.add_scaled(turning, CLOSING / whole_step, creep)
        vec3.store(contact.turning, turning)


@kernel
def prepare_lasting(
    bodies, flown, time_step, whole_step, contacts, touching, num_touching, sums, island_bodies, first_body, last_body,
    predicted, working, ends,
):  # fmt: skip
    """Write the contact problem of one island about the middle of the way to ``predicted``: contacts that touch, and
    ``working`` bodies. What has drifted is made good at the pace of a ``whole_step``, however short this part of it is.
    """
    take_middle(predicted, working, contacts, touching, num_touching)
    sum_impulses(bodies, working, contacts, touching, 0, num_touching, island_bodies, first_body, last_body, sums)
    predict_velocities(bodies, flown, sums, island_bodies, first_body, last_body, predicted, working)
    set_turning(bodies, predicted, working, ends, time_step, whole_step, contacts, touching, num_touching)


@kernel
def end_lasting(
    bodies, starts, flown, time_step, contacts, touching, num_touching, sums, island_bodies, first_body, last_body,
    working, ends,
):  # fmt: skip
    """Bodies of one island at the end of the step, under the impulses that were solved for."""
    sum_impulses(bodies, working, contacts, touching, 0, num_touching, island_bodies, first_body, last_body, sums)
    for index in range(first_body, last_body):
        handle = island_bodies[index]
        body = bodies[handle]
        middle = quat.load(working[handle].orientation)
        place_end(body, starts[handle], flown[handle], middle, sums[handle], time_step, ends[handle])
        set_velocities(body, flown[handle], sums[handle], ends[handle])


@kernel
def settle_where_foreseen(bodies, almost, flown, sums, island_bodies, first_body, last_body, predicted, ends):
    """Put the bodies of one island to the places that were predicted, with the velocities there, if all of them came
    true to ``almost`` of their size.
    """
    for index in range(first_body, last_body):
        handle = island_bodies[index]
        body = bodies[handle]
        missed = vec3.norm(vec3.sub(vec3.load(ends[handle].center), vec3.load(predicted[handle].center)))
        turn = turn_between(predicted[handle], ends[handle])
        missed += 2.0 * body.radius * vec3.norm((turn[1], turn[2], turn[3]))
        if missed > almost * body.size:
            return
    for index in range(first_body, last_body):
        handle = island_bodies[index]
        end = ends[handle]
        vec3.store(end.center, vec3.load(predicted[handle].center))
        quat.store(end.orientation, quat.load(predicted[handle].orientation))
        set_velocities(bodies[handle], flown[handle], sums[handle], end)
