"""How bodies carry the points of a contact: displacement, gap and velocity when they move from one state to another.

A corner is displaced with the material of its body; of a rounded shape it is the point of its core (the centre of a
sphere) that tells how the surface moves, for the surface does not move where a sphere spins.
"""

from __future__ import annotations

from ..jit import kernel
from ..maths import quat, vec3


@kernel
def surface_shift(contact, span):
    """Displacement [m] of b's surface against a's within ``span`` [s], beyond those of the bodies (moving heights)."""
    velocity = vec3.add_scaled(vec3.load(contact.surface_velocity), 0.5 * span, vec3.load(contact.surface_acceleration))
    return vec3.scale(span, velocity)


@kernel
def surface_gain(contact, span):
    """By how much the velocity [m/s] of b's surface against a's changes within ``span`` [s] (moving heights)."""
    return vec3.scale(span, vec3.load(contact.surface_acceleration))


@kernel
def turn_between(start, end):
    """Rotation from ``start`` to ``end``; contacts of the same bodies share it."""
    before = quat.load(start.orientation)
    after = quat.load(end.orientation)
    # What is static has not turned, and most of what rests on it has not either.
    if before[1] == after[1] and before[2] == after[2] and before[3] == after[3]:
        return quat.IDENTITY
    return quat.multiply(after, quat.conjugate(before))


@kernel
def carried(start, end, turn, point):
    """Displacement [m] from ``start`` to ``end``, between which the body turns by ``turn``, of its material that is at
    ``point`` [m] in ``start``.
    """
    moved = vec3.sub(vec3.load(end.center), vec3.load(start.center))
    if turn[1] == 0.0 and turn[2] == 0.0 and turn[3] == 0.0:
        return moved
    arm = vec3.sub(point, vec3.load(start.center))
    return vec3.add(moved, vec3.sub(quat.rotate(turn, arm), arm))


@kernel
def point_displacement(start, end, point):
    """Displacement [m] from ``start`` to ``end`` of the body's material that is at ``point`` [m] in ``start``."""
    return carried(start, end, turn_between(start, end), point)


@kernel
def turned_gap_change(contact, position, normal, gap, start_a, end_a, turn_a, start_b, end_b, turn_b):
    """``gap_change`` where the turns of both bodies are known."""
    half = 0.5 * gap
    moved_a = carried(start_a, end_a, turn_a, vec3.add_scaled(position, -half - contact.radius_a, normal))
    moved_b = carried(start_b, end_b, turn_b, vec3.add_scaled(position, half + contact.radius_b, normal))
    return vec3.dot(normal, vec3.sub(moved_b, moved_a))


@kernel
def gap_change(contact, position, normal, gap, start_a, end_a, start_b, end_b):
    """How much the gap [m] of a contact, where it is in ``start``, changes when its bodies move to ``end``."""
    turn_a = turn_between(start_a, end_a)
    turn_b = turn_between(start_b, end_b)
    return turned_gap_change(contact, position, normal, gap, start_a, end_a, turn_a, start_b, end_b, turn_b)


@kernel
def velocity_at(place, motion, point):
    """Velocity [m/s] of the body's material at ``point``: lever arm from where its centre is in ``place``, velocities
    of ``motion``.
    """
    arm = vec3.sub(point, vec3.load(place.center))
    return vec3.add(vec3.load(motion.velocity), vec3.cross(vec3.load(motion.angular_velocity), arm))
