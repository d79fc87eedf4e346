"""The matrix I + G^T B G and the right side G^T A of a Newton step.

The contacts between the same two bodies are first summed up about one point p, the first of them. With the arm e from p
to a contact and its 3 x 3 stiffness B, the law dr = -B du of a force becomes the law of a wrench and a twist at p,

    K = sum [ B        -B [e]     ]            [x] v = x cross v
            [ [e] B    -[e] B [e] ].

A scaled velocity of body i makes the twist T_i y_i at p, which lies at d_i from its centre of mass:

    T_i = [ 1/sqrt(m_i)   -[d_i] axes_i ]
          [ 0              axes_i       ].

Block (i, j) gets +T_i^T K T_j for i = j and -T_i^T K T_j else, for i, j in {a, b}.
"""

from __future__ import annotations

from ..jit import kernel
from ..maths import mat3, vec3
from .elimination import position_at, rows_at, start_at
from .linearisation import linearise, linearise_moment
from .residual import load_on
from .response import add_impulse, clear
from .workspace import OPEN, SLIP

# Blocks behind the factorisation in which sums and products are made.
SCRATCH_BLOCKS = 2


@kernel
def linearise_row(rows, row, delta):
    """A and B of a row into its fields; return what it adds to the sums of A, and whether its B is symmetric.

    A moment gains with the load of its contact, which comes before it.
    """
    if row.of < 0:
        linearise(row, delta)
        return vec3.load(row.offset), row.status != SLIP or row.friction == 0.0
    linearise_moment(row, load_on(rows, row), delta)
    offset = vec3.load(row.offset)
    coupling = vec3.load(row.coupling)
    if vec3.norm_squared(coupling) > 0.0:
        contact = rows[row.of]
        rise = vec3.dot(vec3.load(contact.offset), vec3.load(contact.normal))
        return vec3.add_scaled(offset, rise, coupling), False
    return offset, True


@kernel
def linearise_rows(rows, nodes, num_contacts, num_bodies, delta):
    """A and B of every contact, and the sums of A over the contacts of each node; 1 if every B is symmetric, else 0."""
    clear(nodes, num_bodies + 1)
    symmetric = 1
    for i in range(num_contacts):
        offset, is_symmetric = linearise_row(rows, rows[i], delta)
        if not is_symmetric:
            symmetric = 0
        add_impulse(rows[i], nodes, offset)
    return symmetric


@kernel
def add_stiffness(blocks, slot, row, arm):
    """Add the B of one contact, at ``arm`` from p, to K."""
    b = mat3.load(row.stiffness)
    first = vec3.cross(arm, (b[0], b[1], b[2]))
    second = vec3.cross(arm, (b[3], b[4], b[5]))
    third = vec3.cross(arm, (b[6], b[7], b[8]))
    top = (b[0], b[1], b[2], *first, b[3], b[4], b[5], *second, b[6], b[7], b[8], *third)
    for c in range(6):
        x = top[c]
        y = top[c + 6]
        z = top[c + 12]
        blocks[slot, c] += x
        blocks[slot, c + 6] += y
        blocks[slot, c + 12] += z
        blocks[slot, c + 18] += arm[1] * z - arm[2] * y
        blocks[slot, c + 24] += arm[2] * x - arm[0] * z
        blocks[slot, c + 30] += arm[0] * y - arm[1] * x


@kernel
def add_angular_stiffness(blocks, slot, rows, row, arm):
    """Add the B of a moment to K: it acts between turns alone, and on its contact's normal impulse by ``coupling``."""
    contact = rows[row.of]
    fall = mat3.apply_transposed(mat3.load(contact.stiffness), vec3.load(contact.normal))
    turned = vec3.cross(arm, fall)
    for r in range(3):
        c_r = row.coupling[r]
        for c in range(3):
            blocks[slot, 18 + 6 * r + c] += c_r * fall[c]
            blocks[slot, 21 + 6 * r + c] += row.stiffness[3 * r + c] + c_r * turned[c]


@kernel
def add_row_stiffness(blocks, slot, rows, row, arm):
    """Add the B of a contact or moment, at ``arm`` from p, to K."""
    if row.of >= 0:
        add_angular_stiffness(blocks, slot, rows, row, arm)
    else:
        add_stiffness(blocks, slot, row, arm)


@kernel
def add_transformed(blocks, target, source, sign, node_i, d_i, node_j, d_j):
    """target += sign T_i^T K T_j, K in ``source``; the block behind it is used for K T_j."""
    product = source + 1
    axes = mat3.load(node_j.axes)
    root = sign * node_j.root
    for r in range(0, 36, 6):
        left = (blocks[source, r], blocks[source, r + 1], blocks[source, r + 2])
        right = (blocks[source, r + 3], blocks[source, r + 4], blocks[source, r + 5])
        # A row times -[d] is d cross the row; a row times a matrix is the transposed matrix times a column.
        turned = mat3.apply_transposed(axes, vec3.add(right, vec3.cross(d_j, left)))
        blocks[product, r] = root * left[0]
        blocks[product, r + 1] = root * left[1]
        blocks[product, r + 2] = root * left[2]
        blocks[product, r + 3] = sign * turned[0]
        blocks[product, r + 4] = sign * turned[1]
        blocks[product, r + 5] = sign * turned[2]
    axes = mat3.load(node_i.axes)
    root = node_i.root
    for c in range(6):
        upper = (blocks[product, c], blocks[product, c + 6], blocks[product, c + 12])
        lower = (blocks[product, c + 18], blocks[product, c + 24], blocks[product, c + 30])
        turned = mat3.apply_transposed(axes, vec3.add(lower, vec3.cross(d_i, upper)))
        blocks[target, c] += root * upper[0]
        blocks[target, c + 6] += root * upper[1]
        blocks[target, c + 12] += root * upper[2]
        blocks[target, c + 18] += turned[0]
        blocks[target, c + 24] += turned[1]
        blocks[target, c + 30] += turned[2]


@kernel
def add_pair(blocks, index, nodes, row, num_bodies, num_handles, slots, symmetric):
    """Add the sum K of all contacts between two bodies, about the contact ``row``, to the blocks of the two."""
    n = num_bodies
    position = position_at(num_handles, n)
    k = n + 2 * slots
    node_a = nodes[row.a]
    node_b = nodes[row.b]
    d_a = vec3.load(row.arm_a)
    d_b = vec3.load(row.arm_b)
    if row.a < n:
        i = index[position + row.a]
        add_transformed(blocks, i, k, 1.0, node_a, d_a, node_a, d_a)
    if row.b < n:
        j = index[position + row.b]
        add_transformed(blocks, j, k, 1.0, node_b, d_b, node_b, d_b)
        if row.a < n:
            s = index[start_at(num_handles, n) + min(i, j)]
            pattern = rows_at(num_handles, n)
            while index[pattern + s] != max(i, j):
                s += 1
            # The lower triangle holds block (later, earlier), and if A is symmetric it is all there is.
            if i < j or symmetric == 0:
                add_transformed(blocks, n + s + (0 if i < j else slots), k, -1.0, node_b, d_b, node_a, d_a)
            if i > j or symmetric == 0:
                add_transformed(blocks, n + s + (0 if i > j else slots), k, -1.0, node_a, d_a, node_b, d_b)


@kernel
def assemble_matrix(rows, nodes, blocks, index, num_contacts, num_bodies, num_handles, slots, symmetric):
    """Write the matrix into ``blocks`` (its lower triangle only if it is symmetric)."""
    n = num_bodies
    k = n + 2 * slots
    for s in range(n + (1 if symmetric != 0 else 2) * slots):
        for i in range(36):
            blocks[s, i] = 0.0
    c = 0
    while c < num_contacts:
        first = c
        closed = False
        for i in range(36):
            blocks[k, i] = 0.0
        while c < num_contacts and rows[c].a == rows[first].a and rows[c].b == rows[first].b:
            if rows[c].status != OPEN:
                closed = True
                # Arms from a body of the island: what cannot move may have its origin far away, which costs digits.
                if rows[c].b < n:
                    arm = vec3.sub(vec3.load(rows[c].arm_b), vec3.load(rows[first].arm_b))
                else:
                    arm = vec3.sub(vec3.load(rows[c].arm_a), vec3.load(rows[first].arm_a))
                add_row_stiffness(blocks, k, rows, rows[c], arm)
            c += 1
        if closed:
            add_pair(blocks, index, nodes, rows[first], num_bodies, num_handles, slots, symmetric)
    for j in range(n):
        for i in range(0, 36, 7):
            blocks[j, i] += 1.0


@kernel
def set_right_side(nodes, num_bodies):
    """G^T A into ``nodes.scaled``, from the sums that ``add_impulse`` left in the nodes."""
    for i in range(num_bodies):
        node = nodes[i]
        linear = vec3.scale(node.root, vec3.load(node.linear))
        angular = mat3.apply_transposed(mat3.load(node.axes), vec3.load(node.angular))
        right_side = node.scaled
        right_side[0], right_side[1], right_side[2] = linear
        right_side[3], right_side[4], right_side[5] = angular


@kernel
def set_velocities(nodes, num_bodies):
    """Velocities of the bodies from the solution y in ``nodes.scaled``."""
    for i in range(num_bodies):
        node = nodes[i]
        y = node.scaled
        vec3.store(node.linear, (node.root * y[0], node.root * y[1], node.root * y[2]))
        vec3.store(node.angular, mat3.apply(mat3.load(node.axes), (y[3], y[4], y[5])))
    vec3.store(nodes[num_bodies].linear, vec3.ZERO)
    vec3.store(nodes[num_bodies].angular, vec3.ZERO)
