"""Rays against sphere, capsule, box, cylinder, plane and convex hull: where o + t d, |d| = 1, t >= 0 enters.

Rounded shapes: with the part of o at right angles to d, q = o - (o . d) d, a sphere of radius r about the origin is
entered at t = -(o . d) - sqrt(r^2 - |q|^2); taking q first keeps the digits of a sphere far away (Haines et al. 2019,
"Precision improvements for ray/sphere intersection"). Boxes and hulls are intersections of half-spaces: the ray is
clipped by each (Kay and Kajiya 1986).
"""

from __future__ import annotations

import math

from ..jit import kernel, stage
from ..maths import vec3
from ..memory import header_at, hulls_of
from ..model import CAPSULE
from .probe import MISS, answer, answer_inside, probe_at


@kernel
def enter_sphere(o, d, center, radius):
    """t where a ray from outside enters a ball, infinite if it does not."""
    r = vec3.sub(o, center)
    along = vec3.dot(r, d)
    square = radius * radius - vec3.norm_squared(vec3.add_scaled(r, -along, d))
    if along >= 0.0 or square < 0.0:
        return math.inf
    return -along - math.sqrt(square)


@kernel
def enter_tube(o, d, radius):
    """t where a ray from outside enters the endless cylinder about z, infinite if it does not."""
    across = d[0] * d[0] + d[1] * d[1]
    along = o[0] * d[0] + o[1] * d[1]
    if across == 0.0 or along >= 0.0:
        return math.inf
    moment = o[0] * d[1] - o[1] * d[0]
    square = radius * radius * across - moment * moment
    if square < 0.0:
        return math.inf
    return (-along - math.sqrt(square)) / across


@stage
def ray_sphere(address):
    probe = probe_at(address)
    o, d = vec3.load(probe.origin), vec3.load(probe.direction)
    radius = probe.size[0]
    if vec3.norm_squared(o) <= radius * radius:
        return answer_inside(probe)
    t = enter_sphere(o, d, vec3.ZERO, radius)
    if t == math.inf:
        return MISS
    return answer(probe, t, vec3.normalize(vec3.add_scaled(o, t, d)))


@stage
def ray_tube(address):
    """Capsule and cylinder: the side, then the ends."""
    probe = probe_at(address)
    o, d = vec3.load(probe.origin), vec3.load(probe.direction)
    radius, half = probe.size[0], probe.size[1]
    rounded = probe.shape == CAPSULE
    beyond = abs(o[2]) - half
    off_axis = o[0] * o[0] + o[1] * o[1]
    beyond_square = beyond * beyond if rounded and beyond > 0.0 else 0.0
    if off_axis + beyond_square <= radius * radius and (rounded or beyond <= 0.0):
        return answer_inside(probe)
    if off_axis > radius * radius:
        t = enter_tube(o, d, radius)
        if t < math.inf and abs(o[2] + t * d[2]) <= half:
            return answer(probe, t, ((o[0] + t * d[0]) / radius, (o[1] + t * d[1]) / radius, 0.0))
    if rounded:
        lower = enter_sphere(o, d, (0.0, 0.0, -half), radius)
        upper = enter_sphere(o, d, (0.0, 0.0, half), radius)
        t = min(lower, upper)
        if t == math.inf:
            return MISS
        p = vec3.add_scaled(o, t, d)
        return answer(probe, t, vec3.normalize((p[0], p[1], p[2] + half if lower < upper else p[2] - half)))
    side = math.copysign(1.0, o[2])
    if beyond < 0.0 or side * d[2] >= 0.0:
        return MISS
    t = beyond / abs(d[2])
    x, y = o[0] + t * d[0], o[1] + t * d[1]
    if x * x + y * y > radius * radius:
        return MISS
    return answer(probe, t, (0.0, 0.0, side))


@kernel
def clip(o_along, d_along, offset, enter, leave):
    """Clip the part enter <= t <= leave of a ray by the half-space n . x <= offset; whether ``enter`` moved."""
    over = o_along - offset
    if d_along == 0.0:
        return enter, (leave if over <= 0.0 else -math.inf), False
    t = -over / d_along
    if d_along < 0.0:
        return max(enter, t), leave, t > enter
    return enter, min(leave, t), False


@stage
def ray_box(address):
    probe = probe_at(address)
    o, d = vec3.load(probe.origin), vec3.load(probe.direction)
    size = vec3.load(probe.size)
    enter, leave = 0.0, math.inf
    normal = vec3.neg(d)
    for axis in range(3):
        for sign in range(2):
            s = 2.0 * sign - 1.0
            enter, leave, moved = clip(s * o[axis], s * d[axis], size[axis], enter, leave)
            if moved:
                normal = (s if axis == 0 else 0.0, s if axis == 1 else 0.0, s if axis == 2 else 0.0)
    return answer(probe, enter, normal) if enter <= leave else MISS


@stage
def ray_plane(address):
    probe = probe_at(address)
    if probe.origin[2] <= 0.0:
        return answer_inside(probe)
    if probe.direction[2] >= 0.0:
        return MISS
    return answer(probe, -probe.origin[2] / probe.direction[2], (0.0, 0.0, 1.0))


@stage
def ray_hull(address):
    probe = probe_at(address)
    o, d = vec3.load(probe.origin), vec3.load(probe.direction)
    hulls, points, faces, corners = hulls_of(header_at(probe.header))
    hull = hulls[probe.data]
    enter, leave = 0.0, math.inf
    normal = vec3.neg(d)
    for number in range(hull.first_face, hull.first_face + hull.num_faces):
        n = vec3.load(faces[number].normal)
        corner = vec3.load(points[hull.first_vertex + corners[faces[number].first_corner]])
        enter, leave, moved = clip(vec3.dot(n, o), vec3.dot(n, d), vec3.dot(n, corner), enter, leave)
        if moved:
            normal = n
        if enter > leave:
            return MISS
    return answer(probe, enter, normal)
