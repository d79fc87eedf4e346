"""The way of a body within a step: where it is, and how fast, at an instant between both ends.

It is the flight itself, and for a body bound by contacts what these add to it, evenly in time as the smooth step has it
(response/lasting.py). With dx, dv, dw what they have added at the end of the step, of length h,

    x(t) = x_free(t) + (t / h)^2 dx,    v(t) = v_free(t) + (2 t / h^2) dx,
    R(t) = exp(t^2 / (2 h) dw) R_free(t),    w(t) = w_free(t) + (t / h) dw.

The velocity is that of this way, or Newton's method on gaps would not converge; at the end of a smooth step, where
dx = h dv / 2, it is the velocity there. A struck step moves the body by its final velocity all the time.
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
def place_at(body, fields, start, flown, end, bound, instant, span, out):
    """State of a body at an instant [s] of its way from ``start`` to ``end``; ``flown`` is the end of its flight."""
    fly(start, body, fields, instant, out)
    if body.motion != DYNAMIC or bound == 0 or span <= 0.0:
        return
    part = instant / span
    added = vec3.sub(vec3.load(end.center), vec3.load(flown.center))
    vec3.store(out.center, vec3.add_scaled(vec3.load(out.center), part * part, added))
    vec3.store(out.velocity, vec3.add_scaled(vec3.load(out.velocity), 2.0 * part / span, added))
    change = vec3.sub(vec3.load(end.angular_velocity), vec3.load(flown.angular_velocity))
    turn = quat.from_rotation_vector(vec3.scale(0.5 * part * instant, change))
    quat.store(out.orientation, quat.normalize(quat.multiply(turn, quat.load(out.orientation))))
    vec3.store(out.angular_velocity, vec3.add_scaled(vec3.load(out.angular_velocity), part, change))
