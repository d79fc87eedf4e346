"""Free rotation of a sphere and of a body with an axis of symmetry: closed forms.

Every flow takes and returns the orientation q (principal frame to world) and the angular velocity [rad/s] in the world
frame. A rotation of the body is applied as the increment q (d - 1), so that a small turn adds only the round-off of the
last sum to q.
"""

from __future__ import annotations

import math

from ..jit import kernel
from ..maths import quat, vec3


@kernel
def turn_increment(half_angle):
    """cos(half_angle) - 1, without cancellation for small angles, and sin(half_angle)."""
    s = math.sin(half_angle)
    c = math.cos(half_angle)
    return (-s * s / (1.0 + c) if c > 0.0 else c - 1.0), s


@kernel
def rotation_increment(rotation_vector):
    """d - 1 for the quaternion d of the turn by the angle |rotation_vector| [rad] about it."""
    angle = vec3.norm(rotation_vector)
    if angle == 0.0:
        return (0.0, 0.0, 0.0, 0.0)
    c, s = turn_increment(0.5 * angle)
    s /= angle
    return (c, s * rotation_vector[0], s * rotation_vector[1], s * rotation_vector[2])


@kernel
def add_normalized(q, change):
    """q + change, drawn back to unit length to first order of the error of |q|^2: free of drift, and no second rounding."""
    excess = (1.0 - q[0] * q[0]) - q[1] * q[1] - q[2] * q[2] - q[3] * q[3]
    s = 0.5 * excess
    return (
        q[0] + (change[0] + s * q[0]),
        q[1] + (change[1] + s * q[1]),
        q[2] + (change[2] + s * q[2]),
        q[3] + (change[3] + s * q[3]),
    )


@kernel
def turn_in_world(q, rotation_vector):
    """q after the turn by a rotation vector [rad] given in the world frame."""
    return add_normalized(q, quat.multiply(rotation_increment(rotation_vector), q))


@kernel
def symmetry_axis(inertia):
    """Index of the principal axis whose moment differs most from the other two."""
    a = abs(inertia[1] - inertia[2])
    b = abs(inertia[2] - inertia[0])
    c = abs(inertia[0] - inertia[1])
    if a <= b and a <= c:
        return 0
    return 1 if b <= c else 2


@kernel
def body_axis(q, axis):
    """Principal axis 0, 1 or 2 in the world frame."""
    w, x, y, z = q
    if axis == 0:
        return (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y))
    if axis == 1:
        return (2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x))
    return (2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y))


@kernel
def advance_sphere(q, angular_velocity, time_step):
    """Free rotation of a body with three equal moments: a steady turn; the angular velocity stays."""
    return turn_in_world(q, vec3.scale(time_step, angular_velocity))


@kernel
def advance_symmetric(q, angular_velocity, inertia, time_step):
    """Free rotation of a body with two equal moments I1: returns q and the angular velocity.

    With the axis of symmetry e, its moment I3 and s = (1 - I3 / I1) (omega.e), the motion is a steady turn in the world
    with omega - s e = L / I1 after a steady turn in the body with s e; s and L / I1 are constant (Landau and Lifshitz,
    Mechanics, sec. 33).
    """
    axis = symmetry_axis(inertia)
    axial = inertia[axis]
    transverse = 0.5 * (inertia[(axis + 1) % 3] + inertia[(axis + 2) % 3])
    e = body_axis(q, axis)
    s = (transverse - axial) / transverse * vec3.dot(e, angular_velocity)
    precession = vec3.add_scaled(angular_velocity, -s, e)
    c_body, s_body = turn_increment(0.5 * s * time_step)
    body = (c_body, s_body * e[0], s_body * e[1], s_body * e[2])
    world = rotation_increment(vec3.scale(time_step, precession))
    # (1 + w)(1 + b) - 1, where b is the turn about the body's axis where it lies at the start, seen from the world.
    both = quat.multiply(world, body)
    change = (world[0] + body[0] + both[0], world[1] + body[1] + both[1], world[2] + body[2] + both[2], world[3] + body[3] + both[3])
    q_new = add_normalized(q, quat.multiply(change, q))
    return q_new, vec3.add_scaled(angular_velocity, s, vec3.sub(body_axis(q_new, axis), e))
