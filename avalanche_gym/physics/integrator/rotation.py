"""Free rotation of a sphere and of a body with an axis of symmetry: closed forms.

Every flow takes and returns the orientation q (principal frame to world). A turn is applied as an increment of q, so
that a small one adds only the round-off of the last sum.
"""

from __future__ import annotations

import math

from ..jit import kernel
from ..maths import quat, vec3


@kernel
def half_turn(half_angle):
    """cos(half_angle) - 1, without cancellation for small angles [rad], and sin(half_angle)."""
    s = math.sin(half_angle)
    c = math.cos(half_angle)
    return (-s * s / (1.0 + c) if c > 0.0 else c - 1.0), s


@kernel
def turn(vector):
    """d - 1 for the quaternion d of the turn by the angle |vector| [rad] about it."""
    angle = vec3.norm(vector)
    c, s = half_turn(0.5 * angle)
    ratio = s / angle if angle != 0.0 else 0.0
    return (c, ratio * vector[0], ratio * vector[1], ratio * vector[2])


@kernel
def add_normalized(q, change):
    """q + change, drawn back to unit length to first order of the error of |q|^2: no drift, and no second rounding.

    Along the new direction: along q itself a turn by more than half a circle would drive it away.
    """
    s = 0.5 * ((1.0 - q[0] * q[0]) - q[1] * q[1] - q[2] * q[2] - q[3] * q[3])
    return (
        q[0] + (change[0] + s * (q[0] + change[0])),
        q[1] + (change[1] + s * (q[1] + change[1])),
        q[2] + (change[2] + s * (q[2] + change[2])),
        q[3] + (change[3] + s * (q[3] + change[3])),
    )


@kernel
def advance_steady(q, angular_velocity, time_step):
    """Orientation of a body that turns steadily, as a free sphere does; ``angular_velocity`` [rad/s] in the world."""
    return add_normalized(q, quat.multiply(turn(vec3.scale(time_step, angular_velocity)), q))


@kernel
def advance_symmetric(q, momentum, inertia, time_step):
    """Orientation of a free body with two equal moments I1 and the angular momentum L [kg m^2/s] in the world frame.

    With the axis of symmetry e and its moment I3 the angular velocity is L / I1 + s e, s = (1 / I3 - 1 / I1) L.e
    constant: a steady turn about e in the body and one about L in the world (Landau and Lifshitz, Mechanics, sec. 33).
    """
    # The moment that differs most from the other two belongs to the axis of symmetry.
    i1, i2, i3 = inertia
    first = abs(i2 - i3)
    second = abs(i3 - i1)
    third = abs(i1 - i2)
    if first <= second and first <= third:
        axial = i1
        transverse = 0.5 * (i2 + i3)
        e = (1.0, 0.0, 0.0)
    elif second <= third:
        axial = i2
        transverse = 0.5 * (i3 + i1)
        e = (0.0, 1.0, 0.0)
    else:
        axial = i3
        transverse = 0.5 * (i1 + i2)
        e = (0.0, 0.0, 1.0)
    # Of unit length: else the error of |q| would come back doubled.
    e = vec3.normalize(quat.rotate(q, e))
    s = (transverse - axial) / (transverse * axial) * vec3.dot(momentum, e)
    # The turn in the body, seen from the world, is one about the axis where it lies at the start.
    c_body, s_body = half_turn(0.5 * time_step * s)
    body = (1.0 + c_body, s_body * e[0], s_body * e[1], s_body * e[2])
    world = turn(vec3.scale(time_step / transverse, momentum))
    # (1 + world) body - 1
    both = quat.multiply(world, body)
    change = (both[0] + c_body, both[1] + body[1], both[2] + body[2], both[3] + body[3])
    return add_normalized(q, quat.multiply(change, q))
