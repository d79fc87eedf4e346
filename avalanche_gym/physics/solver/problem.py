"""The contact problem of one island, in scaled velocities.

Let v collect the velocities of the island's dynamic bodies, M their mass matrix, and v_f the velocities they have
without contact impulses. With y = M^(1/2) (v - v_f), impulses r_i on body b of contact i (world frame), J_i the map
from v to the relative velocity at the contact and G_i = J_i M^(-1/2),

    y = G^T r,        u = G y + w,        w_i = J_i v_f + prescribed velocities + bias_i n_i.

y is measured from v_f, so that only 1/sqrt(m) and 1/sqrt(I) enter: a body that cannot turn about some axis, or not move
at all, has a zero there and needs no case of its own. Angular components live in the principal frame of the body, where
I is diagonal; ``axes`` = R diag(1/sqrt(I)) leads to the world frame, where contacts are handled: with arm x,

    impulse r at x:  (sum r, sum x cross r) -> scaled (r / sqrt(m), axes^T (x cross r)),
    velocity at x:   v + omega cross x,  v = y_lin / sqrt(m),  omega = axes y_ang.

Contacts keep plain world vectors; no tangent basis and no Jacobian is stored. Bodies that are not dynamic share one
last node with zeros, so no loop over contacts has a branch for them.
"""

from __future__ import annotations

import math

from ..jit import kernel
from ..maths import mat3, quat, vec3
from ..model import DYNAMIC
from .sharing import SLACK

# index[:RESERVED] reports the memory wanted; the table body -> node starts behind it.
RESERVED = 2


@kernel
def prepare_nodes(bodies, states, island_bodies, num_bodies, nodes, index):
    """Fill the nodes of the island's bodies and the table that leads from a body to its node."""
    for i in range(num_bodies):
        handle = island_bodies[i]
        index[RESERVED + handle] = i
        body = bodies[handle]
        node = nodes[i]
        rotation = quat.to_matrix(quat.load(states[handle].orientation))
        inverse = vec3.load(body.inverse_inertia)
        x = math.sqrt(inverse[0])
        y = math.sqrt(inverse[1])
        z = math.sqrt(inverse[2])
        node.root = math.sqrt(body.inverse_mass)
        node.trace = inverse[0] + inverse[1] + inverse[2]
        axes = node.axes
        axes[0], axes[1], axes[2] = rotation[0] * x, rotation[1] * y, rotation[2] * z
        axes[3], axes[4], axes[5] = rotation[3] * x, rotation[4] * y, rotation[5] * z
        axes[6], axes[7], axes[8] = rotation[6] * x, rotation[7] * y, rotation[8] * z
    last = nodes[num_bodies]
    last.root = 0.0
    last.trace = 0.0
    for j in range(9):
        last.axes[j] = 0.0


@kernel
def rotational_response(node, arm):
    """Trace of the part of W_ii that a body's rotation adds: sum_j (|x|^2 - x_j^2) / I_j, x in the principal frame."""
    scaled = mat3.apply_transposed(mat3.load(node.axes), arm)
    return max(node.trace * vec3.norm_squared(arm) - vec3.norm_squared(scaled), 0.0)


@kernel
def point_velocity(state, arm):
    """Velocity of the point of a body that lies at ``arm`` from its centre of mass."""
    return vec3.add(vec3.load(state.velocity), vec3.cross(vec3.load(state.angular_velocity), arm))


@kernel
def _squares(state, arm):
    """Squares [m^2/s^2] of what the velocity of a point is the sum of."""
    turning = vec3.cross(vec3.load(state.angular_velocity), arm)
    return vec3.norm_squared(vec3.load(state.velocity)) + vec3.norm_squared(turning)


@kernel
def prepare_rows(contacts, order, num_contacts, bodies, states, num_bodies, rows, nodes, index):
    """Fill the rows of the island's contacts; their impulses are the warm start."""
    for i in range(num_contacts):
        contact = contacts[order[i]]
        row = rows[i]
        handle_a = contact.body_a
        handle_b = contact.body_b
        a = index[RESERVED + handle_a] if bodies[handle_a].motion == DYNAMIC else num_bodies
        b = index[RESERVED + handle_b] if bodies[handle_b].motion == DYNAMIC else num_bodies
        node_a = nodes[a]
        node_b = nodes[b]
        state_a = states[handle_a]
        state_b = states[handle_b]
        position = vec3.load(contact.position)
        arm_a = vec3.sub(position, vec3.load(state_a.center))
        arm_b = vec3.sub(position, vec3.load(state_b.center))
        normal = vec3.load(contact.normal)
        free = vec3.sub(point_velocity(state_b, arm_b), point_velocity(state_a, arm_a))
        free = vec3.add(free, vec3.add(vec3.load(contact.surface_velocity), vec3.load(contact.turning)))
        scale = node_a.root * node_a.root + node_b.root * node_b.root
        scale += (rotational_response(node_a, arm_a) + rotational_response(node_b, arm_b)) / 3.0
        row.a = a
        row.b = b
        row.of = -1
        row.shared = 0
        # A blow has no duration.
        row.slack = SLACK * contact.size / contact.span if contact.span > 0.0 else 0.0
        row.friction = contact.friction
        row.scale = scale
        row.inverse = 1.0 / scale if scale > 0.0 else 0.0
        row.speed = _squares(state_a, arm_a) + _squares(state_b, arm_b)
        vec3.store(row.normal, normal)
        vec3.store(row.arm_a, arm_a)
        vec3.store(row.arm_b, arm_b)
        vec3.store(row.free, vec3.add_scaled(free, contact.bias, normal))
        # Where nothing can move no impulse changes anything: such a contact carries none.
        vec3.store(row.impulse, vec3.load(contact.impulse) if scale > 0.0 else vec3.ZERO)


@kernel
def prepare_moments(contacts, order, num_contacts, states, rows, nodes):
    """Append a row for each contact with rolling or torsional friction; return the number of rows.

    Its free velocity is the relative angular velocity of the bodies, its limit follows the load of its contact.
    """
    count = num_contacts
    for i in range(num_contacts):
        contact = contacts[order[i]]
        scale = (nodes[rows[i].a].trace + nodes[rows[i].b].trace) / 3.0
        if (contact.rolling_friction > 0.0 or contact.torsional_friction > 0.0) and scale > 0.0:
            row = rows[count]
            row.a = rows[i].a
            row.b = rows[i].b
            row.of = i
            row.friction = contact.rolling_friction
            row.torsion = contact.torsional_friction
            row.scale = scale
            row.inverse = 1.0 / scale
            vec3.store(row.normal, vec3.load(rows[i].normal))
            vec3.store(row.arm_a, vec3.load(rows[i].arm_a))
            vec3.store(row.arm_b, vec3.load(rows[i].arm_b))
            spin_a = vec3.load(states[contact.body_a].angular_velocity)
            spin_b = vec3.load(states[contact.body_b].angular_velocity)
            row.speed = vec3.norm_squared(spin_a) + vec3.norm_squared(spin_b)
            vec3.store(row.free, vec3.sub(spin_b, spin_a))
            vec3.store(row.impulse, vec3.load(contact.moment))
            count += 1
    return count
