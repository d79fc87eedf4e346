"""Driven bodies within a step: from the velocities that the user gives them to a motion without jumps.

A kinematic body is given one velocity V_k for each step of length h, the mean over the step of the motion that is
meant. Taken literally it would go in straight pieces and its velocity would jump at every start of a step, while what
it carries gains its velocity evenly: that would lag by half a step, order 1. So it is taken to accelerate evenly,

    a_k = (V_k - V_{k-1}) / h,    v(t) = V_k + (t - h/2) a_k,    x(t) = x_k + V_k t + a_k t (t - h) / 2,

which has the mean V_k and ends where V_k leads. Where the motion that is meant is smooth, the velocity is right to
O(h^2), and so are its jumps at the ends of steps, (a_k - a_{k-1}) h / 2. The same holds for the angular velocity, with
the turn for the displacement: that axes turn too is of order h^2.

A change without a history may be a jump that is meant: a support that starts, stops or turns back at once. It is one if
the last change was not along it, and so is what exceeds twice the last change (a minmod limiter; LeVeque 2002, sec.
6.11):

    h a_k = f d_k,    f = min(1, max(0, 2 d_{k-1} . d_k / |d_k|^2)),    d_k = V_k - V_{k-1}.

Before its first step a body is taken to have been at rest.
"""

from __future__ import annotations

from ..jit import kernel
from ..maths import vec3
from ..model import KINEMATIC

# A change of velocity is one of smooth motion up to this many times the last one. Less than 1 would be biased where an
# acceleration grows; larger takes more of a jump for an acceleration.
GROWTH = 2.0


@kernel
def even_change(before, now, last_change):
    """The part of the change of a velocity from ``before`` to ``now`` that is an even acceleration."""
    change = vec3.sub(now, before)
    square = vec3.norm_squared(change)
    along = GROWTH * vec3.dot(last_change, change)
    if square == 0.0 or along <= 0.0:
        return vec3.ZERO
    return change if along >= square else vec3.scale(along / square, change)


@kernel
def _part(row, first):
    return (row[first], row[first + 1], row[first + 2])


@kernel
def begin_driving(bodies, states, rest, time_step):
    """Let driven bodies have, in ``states``, the velocities that they start a step with, and their accelerations.

    ``rest`` keeps what the user gave them, which ``end_driving`` puts back.
    """
    for index in range(bodies.shape[0]):
        if bodies[index].motion == KINEMATIC:
            state = states[index]
            memory = rest[index]
            velocity = vec3.load(state.velocity)
            spin = vec3.load(state.angular_velocity)
            for axis in range(3):
                memory.driven[axis] = velocity[axis]
                memory.driven[3 + axis] = spin[axis]
            gain = even_change(_part(memory.driven_before, 0), velocity, _part(memory.driven_change, 0))
            spin_gain = even_change(_part(memory.driven_before, 3), spin, _part(memory.driven_change, 3))
            vec3.store(state.velocity, vec3.add_scaled(velocity, -0.5, gain))
            vec3.store(state.angular_velocity, vec3.add_scaled(spin, -0.5, spin_gain))
            vec3.store(state.force, vec3.scale(1.0 / time_step, gain))
            vec3.store(state.torque, vec3.scale(1.0 / time_step, spin_gain))


@kernel
def give_back(state, memory):
    """Give a driven body the velocities back that the user gave it."""
    vec3.store(state.velocity, _part(memory.driven, 0))
    vec3.store(state.angular_velocity, _part(memory.driven, 3))


@kernel
def end_driving(bodies, states, rest, done):
    """The same for all of them, after a step; remember them if it is ``done``."""
    for index in range(bodies.shape[0]):
        if bodies[index].motion == KINEMATIC:
            state = states[index]
            memory = rest[index]
            give_back(state, memory)
            vec3.store(state.force, vec3.ZERO)
            vec3.store(state.torque, vec3.ZERO)
            if done:
                for entry in range(6):
                    memory.driven_change[entry] = memory.driven[entry] - memory.driven_before[entry]
                    memory.driven_before[entry] = memory.driven[entry]
