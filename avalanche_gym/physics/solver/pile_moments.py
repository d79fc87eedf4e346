"""Rolling and torsional friction in the sweeps of the pile tier.

A contact with load r_n holds against the relative angular velocity w of its bodies by a moment m with

    |m_t| <= rho r_n,     |m_n| <= tau r_n,     opposite to w where it is at its limit.

For given loads that minimises the energy of what is left of w, so a step of projected gradient descent,

    m <- nearest allowed moment to  m - w / L,       L no less than any eigenvalue of W_m = I_a^-1 + I_b^-1,

never overshoots. L is the largest sum of a row's magnitudes (Gershgorin), which is the eigenvalue itself for balls. The
limits follow the load, which the sweep has just set.
"""

from __future__ import annotations

from ..jit import kernel
from ..maths import vec3
from .cone import limit
from .pile_response import respond, to_local, to_world

NORMAL = (1.0, 0.0, 0.0)  # in the frame of a contact


@kernel
def prepare_moment(row, moment, nodes):
    """Stiffness 1 / L of a contact's moment, and the scale of its residual: trace(W_m) / 3."""
    m = nodes[row.a].inverse_inertia
    n = nodes[row.b].inverse_inertia
    xx, yy, zz = m[0] + n[0], m[3] + n[3], m[5] + n[5]
    xy, xz, yz = abs(m[1] + n[1]), abs(m[2] + n[2]), abs(m[4] + n[4])
    largest = max(xx + xy + xz, xy + yy + yz, xz + yz + zz)
    moment.stiffness = 1.0 / largest if largest > 0.0 else 0.0
    moment.scale = (xx + yy + zz) / 3.0


@kernel
def turn_bodies(row, nodes, change):
    """Add the angular velocities that a moment [N m s], frame of the contact, makes."""
    turn = to_world(row, change)
    node_a = nodes[row.a]
    node_b = nodes[row.b]
    vec3.store(node_a.spin, vec3.sub(vec3.load(node_a.spin), respond(node_a, turn)))
    vec3.store(node_b.spin, vec3.add(vec3.load(node_b.spin), respond(node_b, turn)))


@kernel
def relative_spin(row, moment, nodes):
    """w of a contact, in its own frame [rad/s]."""
    change = vec3.sub(vec3.load(nodes[row.b].spin), vec3.load(nodes[row.a].spin))
    return vec3.add(to_local(row, change), vec3.load(moment.prescribed))


@kernel
def allowed(moment, load, turn):
    """The nearest moment to ``turn`` that a load [N s] allows."""
    return limit(turn, NORMAL, moment.rolling * load, moment.torsion * load)


@kernel
def relax_moment(row, moment, nodes):
    """One step of a contact's moment, all else held."""
    old = vec3.load(moment.impulse)
    load = row.impulse[0]
    if moment.stiffness == 0.0 or (load == 0.0 and old[0] == 0.0 and old[1] == 0.0 and old[2] == 0.0):
        return
    new = allowed(moment, load, vec3.add_scaled(old, -moment.stiffness, relative_spin(row, moment, nodes)))
    vec3.store(moment.impulse, new)
    turn_bodies(row, nodes, vec3.sub(new, old))


@kernel
def moment_error(row, moment, nodes):
    """Share of a moment in the residual (solver/residual.py): scale |F|^2 and scale |m|^2 of that of the whole step."""
    if moment.scale <= 0.0:
        return 0.0, 0.0
    total = vec3.load(moment.total)
    aim = vec3.add_scaled(total, -1.0 / moment.scale, relative_spin(row, moment, nodes))
    error = vec3.sub(total, allowed(moment, max(row.total[0], 0.0), aim))
    return moment.scale * vec3.norm_squared(error), moment.scale * vec3.norm_squared(total)
