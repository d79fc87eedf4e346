"""Angular momentum of a body: what free rotation keeps, and what its angular velocity is computed from.

L = R I R^T omega. Computing it anew from the angular velocity of each step rounds it in each step; these errors add up
and shift the period of a tumbling body. So the state keeps L beside omega, and L holds as long as omega is, bit for
bit, the one computed from it: whoever changes the angular velocity or the orientation need not know of L.
"""

from __future__ import annotations

from ..jit import kernel
from ..maths import mat3, quat, vec3


@kernel
def angular_velocity_of(q, momentum, inertia):
    """Angular velocity [rad/s] for an angular momentum [kg m^2/s], both in the world frame."""
    rotation = quat.to_matrix(q)
    body = mat3.apply_transposed(rotation, momentum)
    return mat3.apply(rotation, (body[0] / inertia[0], body[1] / inertia[1], body[2] / inertia[2]))


@kernel
def momentum_of(q, angular_velocity, inertia):
    """Angular momentum [kg m^2/s] for an angular velocity [rad/s], both in the world frame."""
    rotation = quat.to_matrix(q)
    return mat3.apply(rotation, vec3.multiply(inertia, mat3.apply_transposed(rotation, angular_velocity)))


@kernel
def load_momentum(state, q, angular_velocity, inertia):
    """The angular momentum [kg m^2/s] of a state in the world frame."""
    momentum = vec3.load(state.angular_momentum)
    implied = angular_velocity_of(q, momentum, inertia)
    if implied[0] == angular_velocity[0] and implied[1] == angular_velocity[1] and implied[2] == angular_velocity[2]:
        return momentum
    return momentum_of(q, angular_velocity, inertia)


@kernel
def store_momentum(state, momentum):
    vec3.store(state.angular_momentum, momentum)
