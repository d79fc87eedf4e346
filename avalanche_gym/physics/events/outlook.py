"""How far two bodies may come against each other on the rest of their way: what the narrow phase is asked for."""

from __future__ import annotations

from ..jit import kernel
from ..maths import vec3
from ..narrow_phase.pair_query import move_by


@kernel
def turning_between(body_a, place_a, body_b, place_b, motion_a, motion_b):
    """[m/s] at which points of two bodies may come closer because these turn as in ``motion_*``.

    A surface without end turns under the other body: the arc where that body is counts.
    """
    apart = vec3.norm(vec3.sub(vec3.load(place_b.center), vec3.load(place_a.center)))
    turning = vec3.norm(vec3.load(motion_a.angular_velocity)) * min(body_a.radius, apart + body_b.radius)
    return turning + vec3.norm(vec3.load(motion_b.angular_velocity)) * min(body_b.radius, apart + body_a.radius)


@kernel
def look_ahead(query, state_a, state_b, left, turning, motion):
    """Say how body b moves against body a in the time ``left`` [s], by no more than ``motion`` [m] in all.

    The turns are taken to first order, as in detection.py; what they are beyond that is loose, and what the fields add.
    """
    relative = vec3.sub(vec3.load(state_b.velocity), vec3.load(state_a.velocity))
    turn_a = vec3.scale(left, vec3.load(state_a.angular_velocity))
    turn_b = vec3.scale(left, vec3.load(state_b.angular_velocity))
    spun_a = vec3.norm(turn_a)
    spun_b = vec3.norm(turn_b)
    place_b = vec3.load(state_b.center)
    arm = vec3.sub(place_b, vec3.load(state_a.center))
    shift = vec3.sub(vec3.scale(left, relative), vec3.cross(turn_a, arm))
    loose = motion - left * (vec3.norm(relative) + turning)
    loose += 0.5 * left * turning * max(spun_a, spun_b)
    move_by(query, place_b, shift, vec3.sub(turn_b, turn_a), loose, motion, spun_a, spun_b)
