"""When a contact that was found closes, as far as it alone can tell: its two features are followed on their way.

The narrow phase answers for one instant. Between its answers a side turns with its body, and a point of the core of
the other one moves with its own; so the gap g of the pair is known at every instant s of the way without asking again,

    flat side:        g = n . (core - side) - r,      n turned with the body of the side
    rounded points:   g = |core_b - core_a| - r_a - r_b

and its root is found by Newton's method, s <- s + g / u, with u the speed at which the features close. The narrow phase
then has to confirm that instant, instead of leading there.
"""

from __future__ import annotations

from ..integrator.way import place_at
from ..jit import kernel
from ..maths import quat, vec3
from ..model import BETWEEN, ON_A
from .closing import point_velocity

# Newton's method starts near the root and comes to round-off in three of these.
MOST_ROUNDS = 4
# A change of the instant by so many units of round-off is none.
SPACINGS = 4.0 * 2.220446049250313e-16


@kernel
def _carried(here, there, point):
    """Where the material of a body is in ``there`` that is at ``point`` in ``here``."""
    arm = quat.rotate_inverse(quat.load(here.orientation), vec3.sub(point, vec3.load(here.center)))
    return vec3.add(vec3.load(there.center), quat.rotate(quat.load(there.orientation), arm))


@kernel
def gap_there(found, here_a, there_a, here_b, there_b):
    """Gap [m] of a contact found with the bodies at ``here_*`` when they are at ``there_*``, and how fast [m/s] it
    closes.
    """
    normal = vec3.load(found.normal)
    point = vec3.load(found.position)
    core_a = _carried(here_a, there_a, vec3.add_scaled(point, -found.radius_a - 0.5 * found.gap, normal))
    core_b = _carried(here_b, there_b, vec3.add_scaled(point, found.radius_b + 0.5 * found.gap, normal))
    apart = vec3.sub(core_b, core_a)
    if found.frame == BETWEEN:
        distance = vec3.norm(apart)
        normal = vec3.scale(1.0 / distance, apart) if distance > 0.0 else normal
    elif found.frame == ON_A:
        normal = quat.rotate(quat.load(there_a.orientation), quat.rotate_inverse(quat.load(here_a.orientation), normal))
    else:
        normal = quat.rotate(quat.load(there_b.orientation), quat.rotate_inverse(quat.load(here_b.orientation), normal))
    closing = vec3.dot(normal, vec3.sub(point_velocity(there_a, core_a), point_velocity(there_b, core_b)))
    return vec3.dot(normal, apart) - found.radius_a - found.radius_b, closing


@kernel
def follow(bodies, fields, starts, ends, bound, a, b, instant, span, step, found, states, later):
    """The time [s] from ``instant`` until the contact ``found`` there closes, from a ``step`` that is nearly so long.

    ``states`` are the bodies at the instant, ``later`` is scratch.
    """
    refined = step
    for _ in range(MOST_ROUNDS):
        place_at(bodies[a], fields, starts[a], ends[a], bound[a], instant + refined, span, later[a])
        place_at(bodies[b], fields, starts[b], ends[b], bound[b], instant + refined, span, later[b])
        gap, closing = gap_there(found, states[a], later[a], states[b], later[b])
        if closing <= 0.0:
            return step
        refined += gap / closing
        if abs(gap / closing) <= SPACINGS * span:
            break
    # Far from where it was expected it is another root.
    return refined if 0.5 * step <= refined <= 1.5 * step else step
