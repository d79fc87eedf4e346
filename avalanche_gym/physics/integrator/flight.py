"""Free flight of a body: exact motion between contacts, whatever the time step.

A body carries only what it needs: ``BODY.flow`` names the cheapest flow that is exact for its rotation, and the fields
of the scene decide how its centre of mass moves:

* uniform fields and the held force: one parabola;
* one point field and nothing else: one Kepler arc;
* more: half a kick by everything but the strongest, the exact flow of the strongest, half a kick (Strang splitting,
  order 2; Hairer, Lubich, Wanner, Geometric Numerical Integration, sec. II.5).

A held torque is half a kick of angular momentum, the free rotation, half a kick.
"""

from __future__ import annotations

from collections.abc import Sequence

from ..jit import kernel
from ..maths import quat, vec3
from ..model import (
    DYNAMIC,
    FLOW_SPHERE,
    FLOW_SYMMETRIC,
    FLOW_TRIAXIAL,
    KINEMATIC,
    UNIFORM_GRAVITY,
)
from . import kepler, parabola
from .euler_top import advance_triaxial
from .fields import field_acceleration
from .momentum import angular_velocity_of, load_momentum, store_momentum
from .rotation import advance_steady, advance_symmetric

# Two moments of inertia whose difference is below this share of the largest are equal but for the round-off of
# computing them. Taking them as equal turns the body wrong by at most about this share of the angle it turns.
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
    """Acceleration [m/s^2] by all that does not lead.

    With a field of number ``strongest``: the other point fields and ``uniform``; without one: the point fields.
    """
    total = uniform if strongest < fields.shape[0] else vec3.ZERO
    for i in range(fields.shape[0]):
        if i != strongest and fields[i].kind != UNIFORM_GRAVITY:
            total = vec3.add(total, field_acceleration(fields[i], position))
    return total


@kernel
def advance_center(position, velocity, acceleration, fields, time_step):
    """Position and velocity of the centre of mass under all fields and a constant acceleration [m/s^2]."""
    none = fields.shape[0]
    uniform = acceleration
    points = 0
    strongest = none
    largest = 0.0
    for i in range(none):
        pull = field_acceleration(fields[i], position)
        if fields[i].kind == UNIFORM_GRAVITY:
            uniform = vec3.add(uniform, pull)
        else:
            points += 1
            strength = vec3.norm(pull)
            # Also true of a NaN: a body at the very centre of a field follows that one.
            if not strength <= largest:
                strongest = i
                largest = strength
    if points == 0:
        return parabola.advance(position, velocity, uniform, time_step)
    strength = vec3.norm(uniform)
    if strength > largest:
        strongest = none
    split = points > 1 or strength > 0.0
    if split:
        weaker = weaker_acceleration(fields, strongest, uniform, position)
        velocity = vec3.add_scaled(velocity, 0.5 * time_step, weaker)
    if strongest == none:
        position, velocity = parabola.advance(position, velocity, uniform, time_step)
    else:
        field = fields[strongest]
        center = vec3.load(field.vector)
        arm, velocity = kepler.advance(vec3.sub(position, center), velocity, field.mu, time_step)
        position = vec3.add(center, arm)
    if split:
        weaker = weaker_acceleration(fields, strongest, uniform, position)
        velocity = vec3.add_scaled(velocity, 0.5 * time_step, weaker)
    return position, velocity


@kernel
def turn_freely(q, momentum, inertia, flow, time_step):
    """Orientation after ``time_step`` [s] of free rotation of a body whose moments of inertia differ."""
    if flow == FLOW_SYMMETRIC:
        return advance_symmetric(q, momentum, inertia, time_step)
    return advance_triaxial(q, momentum, inertia, time_step)


@kernel
def copy_state(source, target):
    """Copy a BODY_STATE, field by field: the compiler moves records that it knows in part byte by byte."""
    vec3.store(target.center, vec3.load(source.center))
    quat.store(target.orientation, quat.load(source.orientation))
    vec3.store(target.velocity, vec3.load(source.velocity))
    vec3.store(target.angular_velocity, vec3.load(source.angular_velocity))
    vec3.store(target.angular_momentum, vec3.load(source.angular_momentum))
    vec3.store(target.force, vec3.load(source.force))
    vec3.store(target.torque, vec3.load(source.torque))


@kernel
def fly(state_in, body, fields, time_step, state_out):
    """Advance one body by ``time_step`` [s], of either sign, of motion without contact.

    ``state_in`` and ``state_out`` are BODY_STATE records and may be the same; ``body`` is its BODY record; ``fields``
    is a 1-D array of FIELD. A dynamic body moves under the fields and its held force and torque, a kinematic one with
    the accelerations that stand in their place (driven.py), a static one keeps its place. A state without a defined
    future (at the very centre of a point field, beyond the range of floats) comes out not finite.
    """
    position = vec3.load(state_in.center)
    velocity = vec3.load(state_in.velocity)
    q = quat.load(state_in.orientation)
    angular_velocity = vec3.load(state_in.angular_velocity)
    force = vec3.load(state_in.force)
    torque = vec3.load(state_in.torque)
    motion = body.motion
    flow = body.flow
    if motion == DYNAMIC:
        position, velocity = advance_center(position, velocity, vec3.scale(body.inverse_mass, force), fields, time_step)
        if flow == FLOW_SPHERE:
            kick = vec3.scale(0.5 * time_step * body.inverse_inertia[0], torque)
            angular_velocity = vec3.add(angular_velocity, kick)
            q = advance_steady(q, angular_velocity, time_step)
            angular_velocity = vec3.add(angular_velocity, kick)
        elif flow == FLOW_SYMMETRIC or flow == FLOW_TRIAXIAL:
            inertia = vec3.load(body.inertia)
            momentum = load_momentum(state_in, q, angular_velocity, inertia)
            kick = vec3.scale(0.5 * time_step, torque)
            momentum = vec3.add(momentum, kick)
            q = turn_freely(q, momentum, inertia, flow, time_step)
            momentum = vec3.add(momentum, kick)
            angular_velocity = angular_velocity_of(q, momentum, inertia)
            store_momentum(state_out, momentum)
    elif motion == KINEMATIC:
        position, velocity = parabola.advance(position, velocity, force, time_step)
        q = advance_steady(q, vec3.add_scaled(angular_velocity, 0.5 * time_step, torque), time_step)
        angular_velocity = vec3.add_scaled(angular_velocity, time_step, torque)
    vec3.store(state_out.center, position)
    vec3.store(state_out.velocity, velocity)
    quat.store(state_out.orientation, q)
    vec3.store(state_out.angular_velocity, angular_velocity)
    vec3.store(state_out.force, force)
    vec3.store(state_out.torque, torque)
