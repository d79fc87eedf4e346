"""Rays against triangle meshes, by the tree.

A ray crosses a triangle if it passes all three edges on one side: the signs of d . ((a - o) x (b - o)), which are exact
opposites for the two triangles of an edge, so no ray slips through between them (Woop, Benthin and Wald 2013, section
2). Nodes are clipped by their boxes, nearest hit so far included, nearer child first.

A closed mesh whose first crossing is from behind holds the start of the ray. An open mesh is crossed from behind
freely, unless it is two-sided.
"""

from __future__ import annotations

import math

import numpy as np

from ..jit import kernel, stage
from ..maths import vec3
from ..memory import header_at, mesh_of, table
from ..narrow_phase.mesh_side import corners_of
from .probe import MISS, answer, answer_inside, probe_at

ROUND_OFF = 4.0 * 2.220446049250313e-16


@kernel
def enter_box(lower, upper, o, inverse, limit):
    """t where a ray enters a box, infinite if it does not before ``limit``; ``inverse`` holds 1 / d."""
    enter, leave = 0.0, limit
    for axis in range(3):
        if math.isinf(inverse[axis]):
            if o[axis] < lower[axis] or o[axis] > upper[axis]:
                return math.inf
            continue
        t0 = (lower[axis] - o[axis]) * inverse[axis]
        t1 = (upper[axis] - o[axis]) * inverse[axis]
        enter = max(enter, min(t0, t1))
        leave = min(leave, max(t0, t1))
    return enter if enter <= leave else math.inf


@kernel
def inverse_of(d):
    """1 / d along each axis, infinite where d is zero."""
    return (
        1.0 / d[0] if d[0] != 0.0 else math.inf,
        1.0 / d[1] if d[1] != 0.0 else math.inf,
        1.0 / d[2] if d[2] != 0.0 else math.inf,
    )


@kernel
def cross_triangle(o, d, a, b, c, normal):
    """t where the line o + t d crosses a triangle, infinite if it does not."""
    a, b, c = vec3.sub(a, o), vec3.sub(b, o), vec3.sub(c, o)
    u = vec3.dot(d, vec3.cross(a, b))
    v = vec3.dot(d, vec3.cross(b, c))
    w = vec3.dot(d, vec3.cross(c, a))
    slope = vec3.dot(d, normal)
    if slope == 0.0 or not ((u >= 0.0 and v >= 0.0 and w >= 0.0) or (u <= 0.0 and v <= 0.0 and w <= 0.0)):
        return math.inf
    return vec3.dot(a, normal) / slope


@stage
def ray_mesh(address):
    probe = probe_at(address)
    o, d = vec3.load(probe.origin), vec3.load(probe.direction)
    rows, vertices, faces, nodes = mesh_of(header_at(probe.header), probe.data)
    mesh = rows[0]
    stack = table(probe.scratch, (256, 8), np.float64)
    inverse = inverse_of(d)
    both_sides = mesh.two_sided == 1 or mesh.closed == 1
    # Whether the ray starts in a closed mesh is told by its first crossing, however far.
    best = math.inf if mesh.closed == 1 else probe.limit * (1.0 + ROUND_OFF)
    found = -1
    depth = 0
    node = 0
    if enter_box(nodes[0].lower, nodes[0].upper, o, inverse, best) == math.inf:
        return MISS
    while node >= 0:
        here = nodes[node]
        following = -1
        if here.count > 0:
            for index in range(here.first, here.first + here.count):
                a, b, c = corners_of(vertices, faces[index])
                n = vec3.load(faces[index].normal)
                if not both_sides and vec3.dot(n, d) >= 0.0:
                    continue
                t = cross_triangle(o, d, a, b, c, n)
                if 0.0 <= t < best:
                    best, found = t, index
        else:
            left = node + 1
            right = int(nodes[left].skip)
            t_left = enter_box(nodes[left].lower, nodes[left].upper, o, inverse, best)
            t_right = enter_box(nodes[right].lower, nodes[right].upper, o, inverse, best)
            following, later, t_later = left, right, t_right
            if t_right < t_left:
                following, later, t_later = right, left, t_left
                t_left = t_right
            if t_left == math.inf:
                following = -1
            elif t_later < math.inf:
                stack[depth, 0], stack[depth, 1] = later, t_later
                depth += 1
        while following < 0 and depth > 0:
            depth -= 1
            if stack[depth, 1] <= best:
                following = int(stack[depth, 0])
        node = following
    if found < 0:
        return MISS
    n = vec3.load(faces[found].normal)
    if vec3.dot(n, d) > 0.0:
        if mesh.closed == 1:
            return answer_inside(probe)
        n = vec3.neg(n)
    return answer(probe, best, n)
