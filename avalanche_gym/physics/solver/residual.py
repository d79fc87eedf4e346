"""The residual: how far impulses r are from solving the contact problem. One definition for every method.

Contact with Coulomb friction is u + mu |u_t| n in K*, r in K, orthogonal to each other (De Saxce & Feng 1998, sec. 3;
K the friction cone, K* its dual), which holds if and only if

    F_i = r_i - P_K( r_i - (u_i + mu_i |u_it| n_i) / Wd_i ) = 0        for any Wd_i > 0; here Wd_i = trace(W_ii) / 3.

Wd F is a velocity and sqrt(Wd) F the root of an energy, so res = sqrt(sum_i Wd_i |F_i|^2) adds light and heavy contacts
in one unit. It is reported relative to the larger of the impulses themselves and of what free motion would violate,

    residual = res / max( sqrt(sum_i Wd_i |r_i|^2), res(r = 0) ).

A moment with rolling friction rho and torsional friction tau opposes the relative angular velocity: the same with the
projection on |m_t| <= rho r_n, |m_n| <= tau r_n for the one on the cone, r_n being the normal impulse of its contact.

The same sums give the level of round-off: r, u and the velocities of both bodies, whose difference u is, are known to
a few units in the last place, so no method can push res below about eps sqrt(sum_i Wd_i (|r_i| + |v_i| / Wd_i)^2).
"""

from __future__ import annotations

import math

from ..jit import kernel
from ..maths import vec3
from .cone import limit
from .response import (
    add_impulse,
    clear,
    impulses_to_velocities,
    relative_velocity,
    relative_velocity_alone,
    velocities_alone,
)

# Units of round-off in res below which an iterate counts as solved whatever the tolerance says. Lower: steps are wasted
# on noise when bodies are much faster than what contacts change in a step. Higher: accuracy is given away.
ROUND_OFF = 4 * 2.220446049250313e-16


# Root of an energy [kg^1/2 m/s] whose square a float does not hold to full precision: nothing moves.
NOTHING = 1e-145


@kernel
def load_on(rows, row):
    """The normal impulse [N s] that limits a moment."""
    contact = rows[row.of]
    return max(vec3.dot(vec3.load(contact.impulse), vec3.load(contact.normal)), 0.0)


@kernel
def moment_error(row, load, impulse, velocity):
    """|F_i|^2 and |u_i / Wd_i|^2 of a moment whose contact bears ``load`` [N s]."""
    corrected = vec3.scale(row.inverse, velocity)
    kept = limit(vec3.sub(impulse, corrected), vec3.load(row.normal), row.friction * load, row.torsion * load)
    return vec3.norm_squared(vec3.sub(impulse, kept)), vec3.norm_squared(corrected)


@kernel
def contact_error(row, impulse, velocity):
    """|F_i|^2 and |(u_i + mu |u_it| n_i) / Wd_i|^2 of a contact.

    The projection of solver/cone.py, by parts along the normal and across it: where z is in the cone F is the corrected
    velocity, where it is in the polar cone F is r.
    """
    normal = vec3.load(row.normal)
    friction = row.friction
    inverse = row.inverse
    along = vec3.dot(velocity, normal)
    across = vec3.add_scaled(velocity, -along, normal)
    slip_square = vec3.norm_squared(across)
    lift = along + friction * math.sqrt(slip_square)
    corrected = inverse * inverse * (lift * lift + slip_square)
    load = vec3.dot(impulse, normal)
    held = vec3.add_scaled(impulse, -load, normal)
    aim = load - inverse * lift
    aim_across = vec3.add_scaled(held, -inverse, across)
    reach = math.sqrt(vec3.norm_squared(aim_across))
    if aim >= 0.0 and reach <= friction * aim:
        return corrected, corrected
    if friction * reach <= -aim:
        return vec3.norm_squared(impulse), corrected
    foot = (aim + friction * reach) / (1.0 + friction * friction)
    share = friction * foot / reach if reach > 0.0 else 0.0
    short = load - foot
    return short * short + vec3.norm_squared(vec3.add_scaled(held, -share, aim_across)), corrected


@kernel
def has_friction(rows, num_contacts):
    """Whether anything keeps the bodies from sliding or turning."""
    friction = 0.0
    for i in range(num_contacts):
        friction = max(friction, rows[i].friction)
    return friction > 0.0


@kernel
def free_violation(rows, num_contacts):
    """res at r = 0: what the free motion violates.

    There F_i = -P_K(z) with z = -(w + mu |w_t| n) / Wd. If w does not approach, z is in the polar cone; if it sticks, z
    is its own projection; else the foot on the surface has the normal part -w_n / (Wd (1 + mu^2)).
    """
    total = 0.0
    for i in range(num_contacts):
        row = rows[i]
        if row.scale > 0.0 and row.of < 0:
            velocity = vec3.load(row.free)
            normal = vec3.load(row.normal)
            along = vec3.dot(velocity, normal)
            if along < 0.0:
                friction = row.friction
                slip = math.sqrt(vec3.norm_squared(vec3.add_scaled(velocity, -along, normal)))
                pressed = -along - friction * slip
                if slip <= friction * pressed:
                    square = pressed * pressed + slip * slip
                else:
                    square = along * along / (1.0 + friction * friction)
                total += square / row.scale
    return math.sqrt(total)


@kernel
def evaluate(rows, nodes, num_contacts, num_bodies, violation):
    """Velocities of bodies and contacts under the present impulses, and their residual.

    Args:
        violation: res(r = 0), from ``free_violation``.

    Returns:
        the relative residual, and the level that round-off alone can explain.
    """
    alone = num_bodies == 1
    linear = vec3.ZERO
    angular = vec3.ZERO
    if alone:
        linear, angular = velocities_alone(rows, nodes, num_contacts)
    else:
        clear(nodes, num_bodies + 1)
        for i in range(num_contacts):
            row = rows[i]
            impulse = vec3.load(row.impulse)
            if impulse[0] != 0.0 or impulse[1] != 0.0 or impulse[2] != 0.0:
                add_impulse(row, nodes, impulse)
        impulses_to_velocities(nodes, num_bodies + 1)
    squares = 0.0
    impulses = 0.0
    magnitudes = 0.0
    for i in range(num_contacts):
        row = rows[i]
        change = relative_velocity_alone(row, linear, angular) if alone else relative_velocity(row, nodes)
        velocity = vec3.add(vec3.load(row.free), change)
        vec3.store(row.velocity, velocity)
        if row.scale > 0.0:
            magnitudes += row.speed * row.inverse
            impulse = vec3.load(row.impulse)
            if row.of < 0 and impulse[0] == 0.0 and impulse[1] == 0.0 and impulse[2] == 0.0:
                normal = vec3.load(row.normal)
                along = vec3.dot(velocity, normal)
                if along >= 0.0:
                    # Open and unloaded: F = 0, without a projection.
                    slip = math.sqrt(vec3.norm_squared(vec3.add_scaled(velocity, -along, normal)))
                    lift = along + row.friction * slip
                    magnitudes += (lift * lift + slip * slip) * row.inverse
                    continue
            if row.of >= 0:
                error, corrected = moment_error(row, load_on(rows, row), impulse, velocity)
            else:
                error, corrected = contact_error(row, impulse, velocity)
            squares += row.scale * error
            impulses += row.scale * vec3.norm_squared(impulse)
            magnitudes += row.scale * corrected
    size = max(violation, math.sqrt(impulses))
    if size < NOTHING:
        return 0.0, 0.0
    return math.sqrt(squares) / size, ROUND_OFF * (math.sqrt(impulses) + math.sqrt(magnitudes)) / size
