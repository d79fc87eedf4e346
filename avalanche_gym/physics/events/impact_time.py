"""The instant at which two bodies meet, on the way that they take.

Conservative advancement (Mirtich 1996, sec. 2.3): at an instant s the narrow phase gives the gaps g of a pair of
colliders; no feature can close before s + ds; repeat there. Two steps ds compete:

    first order    0 = g - (|n . v| + omega R) ds - max(-n . a, 0) ds^2 / 2,   n . v and n . a of the centres, omega R
                   what turning can add: safe, linear near the impact, and no step at all where bodies touch
    second order   0 = g + u ds - A ds^2 / 2,   u the normal velocity of the feature, A the acceleration that closes it:
                   exact for a sphere over a plane in uniform gravity, quadratic near any impact, blind for features
                   that are not listed

The first one is safe everywhere; where it is shorter than half the thickness of the thinner body the second may go as
far as that. From an overlap that such a step runs into Newton's method goes back, s + g / |u|, and where it leaves the
bracket between the last two instants their middle is next; so it is where a feature overlaps that leaves already, and
has come by unseen. What the second step alone would pass is looked at where the way ends.

Between a side with normal n that turns at omega and a point of a core of radius r, with velocity v against the side,

    g'' = n . (a_b - a_a) + 2 (omega x n) . v - |omega x n|^2 (g + r),    a = a_0 + alpha x x + omega x (omega x x);

where two rounded or crossing features meet, bounds of these terms take their place.

The way is that of integrator/way.py.
"""

from __future__ import annotations

import math

import numpy as np

from ..integrator.way import gain_on_way, place_at
from ..jit import call_stage, kernel, stage
from ..maths import vec3
from ..memory import bodies_of, colliders_of, fields_of, header_at, starts_of, table, traits_of, workspace_at
from ..model import (
    BETWEEN,
    BODY_STATE,
    CONTACT,
    FAR_TURN,
    MEETS,
    MESH,
    ON_A,
    PASSES,
    SLACK,
    UNDECIDED,
)
from ..narrow_phase.answers import FORESIGHT, ON_WAY, UNKNOWN, keeps_answers, note_answers, recall_answers
from ..narrow_phase.collide import collide_pair
from ..narrow_phase.height_field_grid import spacing_of
from ..narrow_phase.moving_heights import place_ground
from ..narrow_phase.pair_query import aim, query_at
from .approach import follow
from .binding import binds_elsewhere, binds_on_way
from .closing import no_sooner, point_velocity, swing_of, turning_acceleration
from .outlook import look_ahead, turning_between

# Bodies have met when their gap is below this fraction of the smaller one; what is below TOUCHING and neither comes
# nor goes rests.
MET = 1e-12
TOUCHING = 1e-9
RESTING = 1e-4
# What closes by less than this fraction of the smaller body in a step slides on.
SLOW = 1e-5
# Two meshes may touch at hundreds of places, of which the narrow phase names twelve. It is asked for what is that near,
# as a share of the smaller body: so these span the whole, and are not others at each instant. Larger: more triangles
# to look at; smaller: more instants.
SPANNING = 0.1
# Instants looked at for one pair in one part of a step. A pair that needs more slides along itself, and is left to the
# next look, or turns many times within the step, and is stopped there.
MOST_INSTANTS = 256
# So many of them may overlap and be left by Newton's method; from then on the bracket is halved.
MOST_NEWTON = 8
# Spacing of floats relative to their value: a gap between places is known no better.
SPACING = 2.220446049250313e-16


@stage
def find_impact_time(address, workspace_address, world, count):
    """Set ``impact_time`` of the workspace to the first impact among pairs with a ``located`` contact.

    ``starts`` and ``ends`` of the workspace are both ends of the way, ``span`` its length, ``bound`` tells how a body
    moves. Returns MEETS if there is an impact before the end, PASSES if all these pairs stay open on this way, else
    UNDECIDED: something touches and neither comes nor goes, slides along for longer than is looked, or turns little
    and is held by other contacts.
    """
    workspace = workspace_at(workspace_address)
    contacts = table(workspace.contacts, workspace.contacts_size, CONTACT)
    workspace.impact_time = workspace.span
    found = PASSES
    pair = np.int64(-1)
    first = np.int64(0)
    for index in range(count):
        contact = contacts[index]
        if index == 0 or contact.pair != contacts[index - 1].pair:
            first = index
        if contact.located > 0 and contact.pair != pair:
            pair = contact.pair
            outcome = _search(address, workspace_address, world, contacts, first, count)
            if outcome == MEETS or found == PASSES:
                found = outcome
    return found


@kernel
def _search(address, workspace_address, world, contacts, first, count):
    """Look for an impact of one pair of colliders before ``impact_time``, and move that up to it; return as above."""
    header = header_at(address)
    workspace = workspace_at(workspace_address)
    contact = contacts[first]
    a, b, pair, size = contact.body_a, contact.body_b, contact.pair, contact.size
    bodies = bodies_of(header, world)
    fields = fields_of(header)
    starts = starts_of(header, workspace)
    ends = table(workspace.ends, header.num_bodies, BODY_STATE)
    states = table(workspace.working, header.num_bodies, BODY_STATE)
    later = table(workspace.predicted, header.num_bodies, BODY_STATE)
    bound = table(workspace.bound, header.num_bodies, np.int64)
    asked = table(workspace.asked, workspace.asked_size, CONTACT)
    num_colliders = colliders_of(header).shape[0]
    i = pair // num_colliders
    j = pair - i * num_colliders
    query = query_at(workspace.query)
    aim(query, address, world, workspace, workspace.asked, workspace.asked_size)
    span = workspace.span
    shape_a, shape_b = colliders_of(header)[i].shape, colliders_of(header)[j].shape
    spanning = SPANNING * size if shape_a == MESH and shape_b == MESH else 0.0
    spacing = min(spacing_of(header, colliders_of(header)[i]), spacing_of(header, colliders_of(header)[j]))
    center = vec3.load(starts[a].center)
    near = MET * size + 4.0 * SPACING * (abs(center[0]) + abs(center[1]) + abs(center[2]))
    # What is said at the instant that is found serves the impact, and the part after it (detection.find_contacts).
    keeps = traits_of(header, world).moving_heights == 0 and header.cross_seams == 0
    keeps = keeps and keeps_answers(colliders_of(header), bodies[a], bodies[b])
    farther = FORESIGHT if keeps else 1.0
    slack = SLACK * size if keeps else 0.0
    instant = 0.0
    clear = 0.0
    blocked = math.inf
    overlapping = 0
    begins_open = True
    speed = 0.0
    # Bodies that other contacts hold and that turn little in a step show the same faces at its end: for them the way
    # with all contacts takes up what touches by round-off as well. Flight is exact: what stays open on it is open.
    spin = vec3.norm(vec3.load(starts[a].angular_velocity)) + vec3.norm(vec3.load(starts[b].angular_velocity))
    decides = spin * header.time_step > FAR_TURN or (bound[a] == 0 and bound[b] == 0)
    passes = PASSES if decides else UNDECIDED
    for _ in range(MOST_INSTANTS):
        place_at(bodies[a], fields, starts[a], ends[a], bound[a], instant, span, states[a])
        place_at(bodies[b], fields, starts[b], ends[b], bound[b], instant, span, states[b])
        left = workspace.impact_time - instant
        spin_a = vec3.norm(vec3.load(states[a].angular_velocity))
        spin_b = vec3.norm(vec3.load(states[b].angular_velocity))
        relative = vec3.sub(vec3.load(states[b].velocity), vec3.load(states[a].velocity))
        turning = turning_between(bodies[a], states[a], bodies[b], states[b], states[a], states[b])
        gain = gain_on_way(bodies[b], starts[b], ends[b], bound[b], span)
        gain = vec3.sub(gain, gain_on_way(bodies[a], starts[a], ends[a], bound[a], span))
        acceleration = vec3.scale(1.0 / span, gain)
        speed = vec3.norm(relative) + turning + vec3.norm(gain) + workspace.fastest_rate
        motion = max(farther * speed * left + TOUCHING * size, spanning)
        look_ahead(query, states[a], states[b], left, turning, motion)
        query.margin = motion + slack
        place_ground(header, workspace, query, world, workspace.elapsed + instant)
        number = np.int64(UNKNOWN)
        if instant == 0.0:
            # The part that has been stepped began here, and was asked about. Where velocities go straight from one end
            # of the way to the other, no way is longer than the mean of both speeds makes it.
            at_end = turning_between(bodies[a], states[a], bodies[b], states[b], ends[a], ends[b])
            at_end += vec3.norm(vec3.add(relative, gain))
            way = 0.5 * span * (vec3.norm(relative) + turning + at_end)
            number = recall_answers(workspace, starts, a, b, pair, way + TOUCHING * size, way, asked, np.int64(0))
        if number < 0:
            number = collide_pair(header, workspace.query, states, a, i, b, j, np.int64(0))
        known = number
        number = min(number, asked.shape[0])
        if header.cross_seams != 0:
            number = call_stage(header.cross_seams, address, workspace_address, world, pair, number, workspace.working)
        # A facet behind a convex edge is no bound of what comes over it, and is not listed before that is there.
        step = spacing / speed if speed > 0.0 else math.inf
        # As far as nothing at all can close, listed or not.
        sure = math.inf
        nearest = -1
        deepest = math.inf
        fastest_closing = 0.0
        unseen = False
        for index in range(number):
            found = asked[index]
            normal = vec3.load(found.normal)
            surface = vec3.dot(normal, vec3.load(found.surface_velocity))
            gap = found.gap
            point = vec3.load(found.position)
            core_a = vec3.add_scaled(point, -found.radius_a - 0.5 * found.gap, normal)
            core_b = vec3.add_scaled(point, found.radius_b + 0.5 * found.gap, normal)
            drift = vec3.sub(point_velocity(states[b], core_b), point_velocity(states[a], core_a))
            closing = -vec3.dot(normal, drift) - surface
            slow = abs(closing) * header.time_step <= SLOW * size
            if gap <= RESTING * size:
                binds = binds_on_way(contacts, first, count, found, slow)
                if not binds and header.cross_seams != 0:
                    binds = binds_elsewhere(bodies, contacts, count, found, slow, num_colliders)
                if binds:
                    if turning > 0.0:
                        sure = 0.0
                    continue
            swinging = swing_of(states[a], core_a) + swing_of(states[b], core_b)
            turns = vec3.sub(
                turning_acceleration(states[a], starts[a], ends[a], span, core_a),
                turning_acceleration(states[b], starts[b], ends[b], span, core_b),
            )
            gained = vec3.add(acceleration, vec3.load(found.surface_acceleration))
            pressing = vec3.dot(normal, vec3.sub(turns, gained))
            if found.curved == 1:
                along = vec3.norm(vec3.add_scaled(drift, -vec3.dot(normal, drift), normal))
                whirl = spin_a * swing_of(states[a], core_a) + spin_b * swing_of(states[b], core_b)
                pressing = whirl + 2.0 * (spin_a + spin_b) * along - vec3.dot(normal, gained)
            elif found.frame != BETWEEN:
                carrier = states[a] if found.frame == ON_A else states[b]
                tilting = vec3.cross(vec3.load(carrier.angular_velocity), normal)
                core = found.radius_b if found.frame == ON_A else found.radius_a
                pressing += vec3.norm_squared(tilting) * (gap + core) - 2.0 * vec3.dot(tilting, drift)
            if gap < -max(near, RESTING * size):
                if instant == 0.0:
                    begins_open = False
                elif begins_open and closing * header.time_step <= TOUCHING * size:
                    # It has closed on the way, and opens again.
                    unseen = True
            if gap <= near:
                if closing * header.time_step > TOUCHING * size:
                    if gap < deepest:
                        deepest = gap
                        fastest_closing = closing
                    continue
                if closing >= 0.0 or pressing * left <= -closing:
                    # It rests, or does not come back in what is left.
                    if abs(closing) * header.time_step <= TOUCHING * size:
                        passes = UNDECIDED
                        continue
                gap = max(gap, 0.0)
            second = no_sooner(gap, closing, pressing)
            # A sphere turns about its core: nothing of it but the listed feature can close.
            first_order = math.inf
            if swinging > 0.0 or vec3.norm_squared(turns) > 0.0:
                approach = -vec3.dot(normal, relative)
                fastest = max(approach, 0.0) + max(turning, swinging) + abs(surface)
                first_order = no_sooner(gap, fastest, max(-vec3.dot(normal, gained), 0.0))
            else:
                first_order = second
            sure = min(sure, first_order)
            bold = size * 0.5 / speed if speed > 0.0 else math.inf
            pace = max(first_order, min(second, bold))
            if pace < step:
                step = pace
                # What rolls on, or moves by itself, is not followed.
                followed = second <= bold and first_order <= second and found.curved == 0 and surface == 0.0
                nearest = index if followed else -1
        if deepest < math.inf:
            # What overlaps by more than it can have moved since springs up so, as a facet does under a corner that
            # comes over it. An instant before, the impact would not know of it, and be found again and again.
            springs = speed * (instant - clear) <= min(-0.5 * deepest, TOUCHING * size)
            if deepest >= -near or instant == 0.0 or springs or instant - clear <= 4.0 * SPACING * span:
                workspace.impact_time = instant
                if keeps and instant > 0.0:
                    note_answers(
                        workspace, states, a, b, np.int64(ON_WAY), query.margin, motion, asked, np.int64(0), known
                    )
                return MEETS
            blocked = instant
            overlapping += 1
            instant += deepest / fastest_closing
            if not clear < instant < blocked or overlapping > MOST_NEWTON:
                instant = 0.5 * (clear + blocked)
            continue
        if unseen and speed * (instant - clear) <= TOUCHING * size:
            # It springs up overlapped, and leaves: there is nothing to strike.
            begins_open = False
            blocked = math.inf
        elif unseen:
            blocked = instant
            instant = 0.5 * (clear + blocked)
            continue
        clear = instant
        if nearest >= 0 and blocked == math.inf and instant + step < workspace.impact_time:
            step = follow(bodies, fields, starts, ends, bound, a, b, instant, span, step, asked[nearest], states, later)
        if blocked < math.inf:
            if blocked - clear <= 4.0 * SPACING * span:
                workspace.impact_time = blocked
                return MEETS
            if instant + step >= blocked:
                step = 0.5 * (blocked - clear)
        if instant + step >= workspace.impact_time:
            if instant == workspace.impact_time or instant + sure >= workspace.impact_time:
                return passes
            instant = workspace.impact_time
            continue
        if instant + step == instant:
            workspace.impact_time = instant
            return MEETS
        instant += step
    # What could pass through the other in the rest of the way is looked at again from here.
    if clear > 0.0 and speed * (workspace.impact_time - clear) > size:
        workspace.impact_time = clear
        return MEETS
    return UNDECIDED
