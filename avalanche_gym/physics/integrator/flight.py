"""Free flight of a body: exact motion between contacts, whatever the time step.

A body carries only what it needs: ``BODY.flow`` names the cheapest flow that is exact for its rotation, and the fields of
the scene decide how its centre of mass moves:

* uniform fields and the held force: one parabola;
* one point field and nothing else: one Kepler arc;
* more: half a kick by everything but the strongest, the exact flow of the strongest, half a kick (Strang splitting,
  order 2; Hairer, Lubich, Wanner, Geometric Numerical Integration, sec. II.5).

A held torque is half a kick of angular momentum, the free rotation, half a kick.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..jit import kernel
from ..maths import quat, vec3
from ..model import (
    DYNAMIC,
    FLOW_NONE,
    FLOW_SPHERE,
    FLOW_SYMMETRIC,
    FLOW_TRANSLATE,
    FLOW_TRIAXIAL,
    KINEMATIC,
    UNIFORM_GRAVITY,
)
from . import kepler, parabola
from .euler_top import advance_triaxial
from .fields import field_acceleration
from .rotation import advance_sphere, advance_symmetric

# Two moments of inertia whose difference is below this share of the largest are equal but for the round-off of computing
# them. Taking them as equal turns the body wrong by at most this share of the angle it turns.
EQUAL_MOMENTS = 4e-15


def flow_class(inertia: Sequence[float]) -> int:
    """The cheapest free rotation that is exact for a body with these principal moments of inertia.

    Parameters
    ----------
    inertia : (3,) [kg m^2]

    Returns
    -------
    FLOW_SPHERE, FLOW_SYMMETRIC or FLOW_TRIAXIAL. Moments that differ by more than ``EQUAL_MOMENTS`` are different: the
    triaxial flow stays exact however near to symmetry a body is.
    """
    a, b, c = sorted(float(moment) for moment in inertia)
    equal = EQUAL_MOMENTS * c
    if c - a <= equal:
        return FLOW_SPHERE
    return FLOW_SYMMETRIC if b - a <= equal or c - b <= equal else FLOW_TRIAXIAL


@kernel
def weaker_acceleration(fields, strongest, uniform, position):
    """Acceleration [m/s^2] by all point fields but number ``strongest``, and by ``uniform`` unless that is -1."""
    total = uniform if strongest >= 0 else vec3.ZERO
    for i in range(fields.shape[0]):
        if i != strongest and fields[i].kind != UNIFORM_GRAVITY:
            total = vec3.add(total, field_acceleration(fields[i], position))
    return total


@kernel
def advance_center(position, velocity, acceleration, fields, time_step):
    """Position and velocity of the centre of mass under all fields and a constant acceleration [m/s^2]."""
    uniform = acceleration
    points = 0
    strongest = -1
    largest = 0.0
    for i in range(fields.shape[0]):
        field = fields[i]
        pull = field_acceleration(field, position)
        if field.kind == UNIFORM_GRAVITY:
            uniform = vec3.add(uniform, pull)
        else:
            points += 1
            strength = vec3.norm(pull)
            # Also true of a NaN: a body at the very centre of a field follows that one.
            if not strength <= largest:
                strongest = i
                largest = strength
    strength = vec3.norm(uniform)
    if points == 0:
        return parabola.advance(position, velocity, uniform, time_step)
    if strength > largest:
        strongest = -1
    split = points > 1 or strength > 0.0
    if split:
        weaker = weaker_acceleration(fields, strongest, uniform, position)
        velocity = vec3.add_scaled(velocity, 0.5 * time_step, weaker)
    if strongest >= 0:
        center = vec3.load(fields[strongest].vector)
        arm, velocity = kepler.advance(vec3.sub(position, center), velocity, fields[strongest].mu, time_step)
        position = vec3.add(center, arm)
    else:
        position, velocity = parabola.advance(position, velocity, uniform, time_step)
    if split:
        weaker = weaker_acceleration(fields, strongest, uniform, position)
        velocity = vec3.add_scaled(velocity, 0.5 * time_step, weaker)
    return position, velocity


@kernel
def torque_kick(q, angular_velocity, inverse_inertia, impulse):
    """Angular velocity [rad/s] after an angular impulse [N m s] in the world frame."""
    return vec3.add(
        angular_velocity, quat.rotate(q, vec3.multiply(inverse_inertia, quat.rotate_inverse(q, impulse)))
    )


@kernel
def advance_rotation(q, angular_velocity, body, torque, time_step):
    """Orientation and angular velocity under a constant torque [N m], by the flow of the body."""
    flow = body.flow
    if flow == FLOW_NONE or flow == FLOW_TRANSLATE:
        return q, angular_velocity
    twisted = torque[0] != 0.0 or torque[1] != 0.0 or torque[2] != 0.0
    inverse_inertia = vec3.load(body.inverse_inertia)
    if twisted:
        angular_velocity = torque_kick(q, angular_velocity, inverse_inertia, vec3.scale(0.5 * time_step, torque))
    if flow == FLOW_SPHERE:
        q = advance_sphere(q, angular_velocity, time_step)
    elif flow == FLOW_SYMMETRIC:
        q, angular_velocity = advance_symmetric(q, angular_velocity, vec3.load(body.inertia), time_step)
    else:
        q, angular_velocity = advance_triaxial(q, angular_velocity, vec3.load(body.inertia), time_step)
    if twisted:
        angular_velocity = torque_kick(q, angular_velocity, inverse_inertia, vec3.scale(0.5 * time_step, torque))
    return q, angular_velocity


@kernel
def fly(state_in, body, fields, time_step, state_out):
    """Advance one body by ``time_step`` [s], of either sign, of motion without contact.

    ``state_in`` and ``state_out`` are BODY_STATE records and may be the same; ``body`` is its BODY record; ``fields`` is a
    1-D array of FIELD. A dynamic body moves under the fields and its held force and torque, a kinematic one keeps its
    velocities, a static one its place. A state without a defined future (at the very centre of a point field, beyond the
    range of floats) comes out not finite.
    """
    position = vec3.load(state_in.center)
    velocity = vec3.load(state_in.velocity)
    q = quat.load(state_in.orientation)
    angular_velocity = vec3.load(state_in.angular_velocity)
    force = vec3.load(state_in.force)
    torque = vec3.load(state_in.torque)
    if body.motion == DYNAMIC:
        position, velocity = advance_center(
            position, velocity, vec3.scale(body.inverse_mass, force), fields, time_step
        )
        q, angular_velocity = advance_rotation(q, angular_velocity, body, torque, time_step)
    elif body.motion == KINEMATIC:
        position = vec3.add_scaled(position, time_step, velocity)
        q = advance_sphere(q, angular_velocity, time_step)
    vec3.store(state_out.center, position)
    vec3.store(state_out.velocity, velocity)
    quat.store(state_out.orientation, q)
    vec3.store(state_out.angular_velocity, angular_velocity)
    vec3.store(state_out.force, force)
    vec3.store(state_out.torque, torque)
