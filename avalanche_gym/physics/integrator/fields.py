"""Force fields: the acceleration they give a body and their potential."""

from __future__ import annotations

from ..jit import kernel
from ..maths import vec3
from ..model import UNIFORM_GRAVITY


@kernel
def field_acceleration(field, position):
    """Acceleration [m/s^2] that one FIELD record gives a body at ``position`` [m].

    Not finite at the centre of a point field.
    """
    vector = vec3.load(field.vector)
    if field.kind == UNIFORM_GRAVITY:
        return vector
    offset = vec3.sub(vector, position)
    distance = vec3.norm(offset)
    # Divided one by one: the cube of the distance would overflow long before the acceleration does.
    return vec3.scale(field.mu / distance / distance / distance, offset)


@kernel
def acceleration(fields, position):
    """Sum of the accelerations [m/s^2] of all fields (1-D array of FIELD) at ``position`` [m]."""
    total = vec3.ZERO
    for i in range(fields.shape[0]):
        total = vec3.add(total, field_acceleration(fields[i], position))
    return total


@kernel
def potential(fields, position):
    """Potential energy per unit mass [J/kg] at ``position`` [m]: -g.x of a uniform, -mu / r of a point field."""
    total = 0.0
    for i in range(fields.shape[0]):
        field = fields[i]
        vector = vec3.load(field.vector)
        if field.kind == UNIFORM_GRAVITY:
            total -= vec3.dot(vector, position)
        else:
            total -= field.mu / vec3.norm(vec3.sub(position, vector))
    return total
