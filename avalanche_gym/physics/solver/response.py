"""What impulses do to the bodies (y = G^T r) and what the bodies do to the contacts (G y), in world vectors.

A body alone on its contacts, the commonest island there is, has both without tables of nodes: its sums stay in
registers, and what does not move is left out.
"""

from __future__ import annotations

from ..jit import kernel
from ..maths import mat3, vec3


@kernel
def clear(nodes, num_nodes):
    """No impulses."""
    for i in range(num_nodes):
        node = nodes[i]
        vec3.store(node.linear, vec3.ZERO)
        vec3.store(node.angular, vec3.ZERO)


@kernel
def add_impulse(row, nodes, impulse):
    """Add ``impulse`` on b and its reaction on a to the sums of impulses and moments of the two nodes.

    Of a moment it is an angular impulse.
    """
    node_a = nodes[row.a]
    node_b = nodes[row.b]
    if row.of >= 0:
        vec3.store(node_a.angular, vec3.sub(vec3.load(node_a.angular), impulse))
        vec3.store(node_b.angular, vec3.add(vec3.load(node_b.angular), impulse))
        return
    moment_a = vec3.cross(vec3.load(row.arm_a), impulse)
    moment_b = vec3.cross(vec3.load(row.arm_b), impulse)
    vec3.store(node_a.linear, vec3.sub(vec3.load(node_a.linear), impulse))
    vec3.store(node_a.angular, vec3.sub(vec3.load(node_a.angular), moment_a))
    vec3.store(node_b.linear, vec3.add(vec3.load(node_b.linear), impulse))
    vec3.store(node_b.angular, vec3.add(vec3.load(node_b.angular), moment_b))


@kernel
def impulses_to_velocities(nodes, num_nodes):
    """Turn the sums of impulses of every node into its change of velocity: M^-1 applied to them."""
    for i in range(num_nodes):
        node = nodes[i]
        axes = mat3.load(node.axes)
        vec3.store(node.linear, vec3.scale(node.root * node.root, vec3.load(node.linear)))
        vec3.store(node.angular, mat3.apply(axes, mat3.apply_transposed(axes, vec3.load(node.angular))))


@kernel
def relative_velocity(row, nodes):
    """G y: the change of the relative velocity at a contact that the nodes' changes of velocity make."""
    node_a = nodes[row.a]
    node_b = nodes[row.b]
    if row.of >= 0:
        return vec3.sub(vec3.load(node_b.angular), vec3.load(node_a.angular))
    spin_a = vec3.cross(vec3.load(node_a.angular), vec3.load(row.arm_a))
    spin_b = vec3.cross(vec3.load(node_b.angular), vec3.load(row.arm_b))
    moved = vec3.sub(vec3.load(node_b.linear), vec3.load(node_a.linear))
    return vec3.add(moved, vec3.sub(spin_b, spin_a))


@kernel
def side_alone(row):
    """(sign, arm [m]) of the only body of an island at a contact: +1 where it is b, -1 where it is a, else 0."""
    if row.b == 0:
        return 1.0, vec3.load(row.arm_b)
    if row.a == 0:
        return -1.0, vec3.load(row.arm_a)
    return 0.0, vec3.ZERO


@kernel
def add_impulse_alone(row, impulse, linear, angular):
    """``add_impulse`` for the only body of an island: its sums of impulses and moments."""
    sign, arm = side_alone(row)
    if row.of >= 0:
        return linear, vec3.add_scaled(angular, sign, impulse)
    return vec3.add_scaled(linear, sign, impulse), vec3.add_scaled(angular, sign, vec3.cross(arm, impulse))


@kernel
def velocities_alone(rows, nodes, num_contacts):
    """(linear, angular) change of velocity of the only body of an island under the present impulses.

    The nodes get it as well.
    """
    linear = vec3.ZERO
    angular = vec3.ZERO
    for i in range(num_contacts):
        row = rows[i]
        impulse = vec3.load(row.impulse)
        if impulse[0] != 0.0 or impulse[1] != 0.0 or impulse[2] != 0.0:
            linear, angular = add_impulse_alone(row, impulse, linear, angular)
    node = nodes[0]
    axes = mat3.load(node.axes)
    linear = vec3.scale(node.root * node.root, linear)
    angular = mat3.apply(axes, mat3.apply_transposed(axes, angular))
    vec3.store(node.linear, linear)
    vec3.store(node.angular, angular)
    vec3.store(nodes[1].linear, vec3.ZERO)
    vec3.store(nodes[1].angular, vec3.ZERO)
    return linear, angular


@kernel
def relative_velocity_alone(row, linear, angular):
    """``relative_velocity`` at a contact of the only body of an island, from its change of velocity."""
    sign, arm = side_alone(row)
    if row.of >= 0:
        return vec3.scale(sign, angular)
    return vec3.scale(sign, vec3.add(linear, vec3.cross(angular, arm)))
