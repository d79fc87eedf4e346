"""The way of a body within a step: where it is, and how fast, at an instant between both ends.

It is the flight itself, or for a body bound by contacts the parabola in time between both ends of its step, which is
what the trapezoid makes of a smooth one (response/lasting.py); its velocity is that of this parabola, or Newton's
method on gaps would not converge.
"""

from __future__ import annotations

from ..jit import kernel
from ..maths import quat, vec3
from ..model import DYNAMIC
from .flight import fly


@kernel
def gain_on_way(body, start, end, bound, span):
    """What the way adds to the velocity of a body [m/s].

    Of one that is bound not the change that its step ends with: a struck step moves it by the final velocity all the
    time. The parabola that starts with v and leads there has 2 (x' - x - v h) / h.
    """
    v = vec3.load(start.velocity)
    if body.motion != DYNAMIC or bound == 0 or span <= 0.0:
        return vec3.sub(vec3.load(end.velocity), v)
    way = vec3.sub(vec3.load(end.center), vec3.load(start.center))
    return vec3.scale(2.0 / span, vec3.add_scaled(way, -span, v))


@kernel
def place_at(body, fields, start, end, bound, instant, span, out):
    """State of a body at an instant [s] of its way."""
    if body.motion != DYNAMIC or bound == 0 or span <= 0.0:
        fly(start, body, fields, instant, out)
        return
    part = instant / span
    v = vec3.load(start.velocity)
    gain = gain_on_way(body, start, end, bound, span)
    vec3.store(out.velocity, vec3.add_scaled(v, part, gain))
    way = vec3.add_scaled(vec3.scale(instant, v), 0.5 * part * instant, gain)
    vec3.store(out.center, vec3.add(vec3.load(start.center), way))
    spin = vec3.load(start.angular_velocity)
    change = vec3.sub(vec3.load(end.angular_velocity), spin)
    vec3.store(out.angular_velocity, vec3.add_scaled(spin, part, change))
    angle = vec3.add_scaled(vec3.scale(instant, spin), 0.5 * part * instant, change)
    turn = quat.from_rotation_vector(angle)
    quat.store(out.orientation, quat.normalize(quat.multiply(turn, quat.load(start.orientation))))
