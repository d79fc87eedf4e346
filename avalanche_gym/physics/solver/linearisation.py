"""One contact of the proximal Newton step: dr = A - B du.

The equations are those of Alart & Curnier (1991): with z = r - rho u, rho = 1 / Wd, and z_n its normal part,

    r_n = max(0, z_n),        r_t = projection of z_t on the disc of radius mu max(0, z_n),

linearised at the present iterate with a proximal weight delta on dr (a step of size delta in r costs as much as the
equation it should reduce). The inverse of delta is the stiffness k = rho / delta of a closed contact:

    open   z_n < 0:          dr = -r / (1 + delta)
    stick  |z_t| <= mu z_n:  dr = -k (u + du)
    slip   otherwise, with t = z_t / |z_t|, p = n x t, d = mu z_n / |z_t|, F_t = r_t - mu z_n t:
           n . dr = -k (u_n + du_n)
           t . dr = (-t . F_t - mu k u_n - mu (k + rho) du_n) / (1 + delta)
           p . dr = (-p . F_t - rho d p . du) / (1 - d + delta)

The last is the direction in which the slip can still turn. B is symmetric unless a contact slips with friction.
"""

from __future__ import annotations

import math

from ..jit import kernel
from ..maths import vec3
from .sharing import SPARED, approach
from .workspace import OPEN, SLIP, STICK


@kernel
def outer(s, a, b):
    """s a b^T as a matrix."""
    x = s * a[0]
    y = s * a[1]
    z = s * a[2]
    return (x * b[0], x * b[1], x * b[2], y * b[0], y * b[1], y * b[2], z * b[0], z * b[1], z * b[2])


@kernel
def add_matrices(a, b):
    return (
        a[0] + b[0],
        a[1] + b[1],
        a[2] + b[2],
        a[3] + b[3],
        a[4] + b[4],
        a[5] + b[5],
        a[6] + b[6],
        a[7] + b[7],
        a[8] + b[8],
    )


@kernel
def store_law(row, status, offset, stiffness):
    """Note what a row does in the step."""
    row.status = status
    vec3.store(row.offset, offset)
    for k in range(9):
        row.stiffness[k] = stiffness[k]


@kernel
def linearise_moment(row, load, delta):
    """Status, A and B of a moment whose contact bears ``load`` [N s]: F = m - projection of m - rho w.

    Each part sticks, dm = -k (w + dw), or is at its limit as the tangential part of a contact that slips. A limit moves
    with the load: dm = A - B dw + c dr_n, with c stored in ``coupling``.
    """
    coupling = vec3.ZERO
    velocity = vec3.load(row.velocity)
    impulse = vec3.load(row.impulse)
    normal = vec3.load(row.normal)
    rho = row.inverse
    k = rho / delta
    z = vec3.add_scaled(impulse, -rho, velocity)
    z_n = vec3.dot(z, normal)
    z_t = vec3.add_scaled(z, -z_n, normal)
    length = math.sqrt(vec3.norm_squared(z_t))
    along = row.torsion * load
    across = row.friction * load
    # Normal part: torsion.
    if abs(z_n) <= along and row.torsion > 0.0:
        a = vec3.scale(-k * vec3.dot(velocity, normal), normal)
        b = outer(k, normal, normal)
    else:
        error = vec3.dot(impulse, normal) - min(max(z_n, -along), along)
        a = vec3.scale(-error / (1.0 + delta), normal)
        b = outer(0.0, normal, normal)
        if load > 0.0:
            coupling = vec3.scale(math.copysign(row.torsion, z_n) / (1.0 + delta), normal)
    # Tangential part: rolling.
    velocity_t = vec3.add_scaled(velocity, -vec3.dot(velocity, normal), normal)
    impulse_t = vec3.add_scaled(impulse, -vec3.dot(impulse, normal), normal)
    if length <= across and row.friction > 0.0:
        a = vec3.add_scaled(a, -k, velocity_t)
        b = add_matrices(b, outer(-k, normal, normal))
        b = add_matrices(b, (k, 0.0, 0.0, 0.0, k, 0.0, 0.0, 0.0, k))
    elif length > 0.0:
        t = vec3.scale(1.0 / length, z_t)
        p = vec3.cross(normal, t)
        d = across / length
        error_t = vec3.add_scaled(impulse_t, -across, t)
        turn = 1.0 / (1.0 - d + delta)
        a = vec3.add_scaled(a, -vec3.dot(t, error_t) / (1.0 + delta), t)
        a = vec3.add_scaled(a, -turn * vec3.dot(p, error_t), p)
        b = add_matrices(b, outer(rho * d * turn, p, p))
        if load > 0.0:
            coupling = vec3.add_scaled(coupling, row.friction / (1.0 + delta), t)
    vec3.store(row.coupling, coupling)
    store_law(row, STICK, a, b)


@kernel
def linearise(row, delta):
    """Status, A and B of a contact at its present impulse and velocity."""
    zero = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    impulse = vec3.load(row.impulse)
    if row.scale == 0.0:
        store_law(row, OPEN, vec3.ZERO, zero)
        return
    velocity = vec3.load(row.velocity)
    normal = vec3.load(row.normal)
    friction = row.friction
    rho = row.inverse
    z = vec3.add_scaled(impulse, -rho, velocity)
    z_n = vec3.dot(z, normal)
    # A contact that just touches and bears nothing counts as closed: in a stack that starts to fall all but the lowest
    # are like that, and would otherwise be found one a step.
    if z_n < 0.0 or row.shared == SPARED:
        store_law(row, OPEN, vec3.scale(-1.0 / (1.0 + delta), impulse), zero)
        return
    k = rho / delta
    z_t = vec3.add_scaled(z, -z_n, normal)
    length = math.sqrt(vec3.norm_squared(z_t))
    if friction > 0.0 and length <= friction * z_n:
        pace = vec3.add_scaled(velocity, approach(row) - vec3.dot(velocity, normal), normal)
        store_law(row, STICK, vec3.scale(-k, pace), (k, 0.0, 0.0, 0.0, k, 0.0, 0.0, 0.0, k))
        return
    impulse_n = vec3.dot(impulse, normal)
    impulse_t = vec3.add_scaled(impulse, -impulse_n, normal)
    velocity_n = approach(row)
    along_normal = vec3.scale(-k * velocity_n, normal)
    if friction == 0.0 or length == 0.0:
        offset = vec3.add_scaled(along_normal, -1.0 / (1.0 + delta), impulse_t)
        store_law(row, SLIP, offset, outer(k, normal, normal))
        return
    t = vec3.scale(1.0 / length, z_t)
    p = vec3.cross(normal, t)
    d = friction * z_n / length
    error = vec3.add_scaled(impulse_t, -friction * z_n, t)
    across = 1.0 / (1.0 - d + delta)
    a = vec3.add_scaled(along_normal, -(vec3.dot(t, error) + friction * k * velocity_n) / (1.0 + delta), t)
    a = vec3.add_scaled(a, -across * vec3.dot(p, error), p)
    # k n n^T + mu (k + rho) / (1 + delta) t n^T = (k n + ... t) n^T
    first = vec3.add_scaled(vec3.scale(k, normal), friction * (k + rho) / (1.0 + delta), t)
    store_law(row, SLIP, a, add_matrices(outer(1.0, first, normal), outer(rho * d * across, p, p)))
