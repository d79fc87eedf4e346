"""Projection on the Coulomb cone K = {r : |r_t| <= mu r_n}; vectors in the world frame, without a tangent basis."""

from __future__ import annotations

import math

from ..jit import kernel
from ..maths import vec3


@kernel
def project(z, normal, friction):
    """The point of the cone around ``normal`` that is nearest to z.

    Inside: z. In the polar cone (mu |z_t| <= -z_n): 0. Else the foot on the surface, whose normal part is
    (z_n + mu |z_t|) / (1 + mu^2).
    """
    along = vec3.dot(z, normal)
    tangential = vec3.add_scaled(z, -along, normal)
    slip = math.sqrt(vec3.norm_squared(tangential))
    # Without friction the cone is a half line, and -0.0 >= 0.0 holds: the sign has to be asked for.
    if along >= 0.0 and slip <= friction * along:
        return z
    if friction * slip <= -along:
        return (0.0, 0.0, 0.0)
    foot = (along + friction * slip) / (1.0 + friction * friction)
    # ``slip`` is zero here only if friction is infinite or not a number.
    return vec3.add_scaled(vec3.scale(foot, normal), friction * foot / slip if slip > 0.0 else 0.0, tangential)


@kernel
def limit(moment, normal, tangential, along):
    """The nearest moment with |m_t| <= ``tangential`` and |m_n| <= ``along``."""
    part = vec3.dot(moment, normal)
    rest = vec3.add_scaled(moment, -part, normal)
    length = math.sqrt(vec3.norm_squared(rest))
    if length > tangential:
        rest = vec3.scale(tangential / length, rest)
    return vec3.add_scaled(rest, min(max(part, -along), along), normal)
