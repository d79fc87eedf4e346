"""Motion under a constant acceleration: exact for every time step."""

from __future__ import annotations

from ..jit import kernel
from ..maths import vec3


@kernel
def advance(position, velocity, acceleration, time_step):
    """Position [m] and velocity [m/s] after ``time_step`` [s] of constant acceleration [m/s^2].

    x + h (v + h a / 2): the small terms are added first, so that only the last addition rounds at the size of x.
    """
    mean_velocity = vec3.add_scaled(velocity, 0.5 * time_step, acceleration)
    return vec3.add_scaled(position, time_step, mean_velocity), vec3.add_scaled(velocity, time_step, acceleration)
