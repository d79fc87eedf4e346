"""How fast a contact may close, from the motion of its two bodies at one instant.

A point of a body moves with velocity v + omega x x against the world, and a contact of gap g whose features come closer
at speed c, pressed together with acceleration A, is open at least until

    g = c t + A t^2 / 2.
"""

from __future__ import annotations

import math

from ..jit import kernel
from ..maths import vec3


@kernel
def point_velocity(state, point):
    arm = vec3.sub(point, vec3.load(state.center))
    return vec3.add(vec3.load(state.velocity), vec3.cross(vec3.load(state.angular_velocity), arm))


@kernel
def swing_of(state, point):
    """[m/s] bound of the velocity of a point through turning."""
    spin = vec3.norm(vec3.load(state.angular_velocity))
    return spin * vec3.norm(vec3.sub(point, vec3.load(state.center)))


@kernel
def turning_acceleration(state, start, end, span, point):
    """[m/s^2] of a point against the centre of its body: alpha x r + omega x (omega x r)."""
    arm = vec3.sub(point, vec3.load(state.center))
    spin = vec3.load(state.angular_velocity)
    gain = vec3.sub(vec3.load(end.angular_velocity), vec3.load(start.angular_velocity))
    return vec3.add_scaled(vec3.cross(spin, vec3.cross(spin, arm)), 1.0 / span, vec3.cross(gain, arm))


@kernel
def no_sooner(gap, closing, pressing):
    """The least time [s] in which gap - closing t - pressing t^2 / 2 comes to zero."""
    root = closing * closing + 2.0 * pressing * gap
    if root < 0.0 or (closing <= 0.0 and pressing <= 0.0):
        return math.inf
    root = math.sqrt(root)
    if closing >= 0.0:
        return 2.0 * gap / (closing + root) if closing + root > 0.0 else math.inf
    return (root - closing) / pressing
