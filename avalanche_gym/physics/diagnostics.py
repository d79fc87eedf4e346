"""Energies and momenta: what a user checks a simulation by."""

from __future__ import annotations

from .jit import entry_point, kernel
from .maths import quat, vec3
from .memory import bodies_of, fields_of, header_at, states_of
from .model import DYNAMIC, UNIFORM_GRAVITY


@kernel
def angular_momentum_of(body, state):
    """About the centre of mass, world frame [kg m^2/s]: R I R^T w."""
    q = quat.load(state.orientation)
    spin = quat.rotate_inverse(q, vec3.load(state.angular_velocity))
    return quat.rotate(q, vec3.multiply(vec3.load(body.inertia), spin))


@kernel
def kinetic_energy_of(bodies, states):
    """Of all dynamic bodies [J]: m v^2 / 2 + w . L / 2."""
    energy = 0.0
    for index in range(bodies.shape[0]):
        if bodies[index].motion == DYNAMIC:
            state = states[index]
            energy += 0.5 * bodies[index].mass * vec3.norm_squared(vec3.load(state.velocity))
            energy += 0.5 * vec3.dot(vec3.load(state.angular_velocity), angular_momentum_of(bodies[index], state))
    return energy


@kernel
def potential_energy_of(bodies, states, fields):
    """Of all dynamic bodies [J]: the sum of -m g . x and -m mu / r."""
    energy = 0.0
    for index in range(bodies.shape[0]):
        if bodies[index].motion == DYNAMIC:
            center = vec3.load(states[index].center)
            for number in range(fields.shape[0]):
                vector = vec3.load(fields[number].vector)
                if fields[number].kind == UNIFORM_GRAVITY:
                    energy -= bodies[index].mass * vec3.dot(vector, center)
                else:
                    energy -= bodies[index].mass * fields[number].mu / vec3.norm(vec3.sub(center, vector))
    return energy


@entry_point
def measure(address, energies, momenta):
    """Fill energies (worlds, 2) [J] with kinetic and potential energy, momenta (worlds, 6) with linear [kg m/s] and
    angular momentum about the world's origin [kg m^2/s].
    """
    header = header_at(address)
    fields = fields_of(header)
    for world in range(header.num_worlds):
        bodies = bodies_of(header, world)
        states = states_of(header, world)
        energies[world, 0] = kinetic_energy_of(bodies, states)
        energies[world, 1] = potential_energy_of(bodies, states, fields)
        linear = vec3.ZERO
        angular = vec3.ZERO
        for index in range(bodies.shape[0]):
            if bodies[index].motion == DYNAMIC:
                momentum = vec3.scale(bodies[index].mass, vec3.load(states[index].velocity))
                linear = vec3.add(linear, momentum)
                orbital = vec3.cross(vec3.load(states[index].center), momentum)
                angular = vec3.add(angular, vec3.add(orbital, angular_momentum_of(bodies[index], states[index])))
        for axis in range(3):
            momenta[world, axis] = linear[axis]
            momenta[world, 3 + axis] = angular[axis]
