"""Nearest points of sphere, capsule, box, cylinder, plane and convex hull: the signed distance of a point, negative
inside, and its gradient, the outward normal there. The nearest point is p - distance * normal.
"""

from __future__ import annotations

import math

from ..jit import kernel, stage
from ..maths import vec3
from ..memory import header_at, hulls_of
from ..narrow_phase.cylinder import point_cylinder
from ..narrow_phase.triangle import closest_point
from .probe import answer, probe_at


@stage
def near_ball(address):
    """Sphere and capsule: the core's nearest point, and the radius."""
    probe = probe_at(address)
    p = vec3.load(probe.origin)
    r = (p[0], p[1], p[2] - min(max(p[2], -probe.size[1]), probe.size[1]))
    distance = vec3.norm(r)
    # On the core every direction at right angles to it is as near.
    normal = vec3.scale(1.0 / distance, r) if distance > 0.0 else (1.0, 0.0, 0.0)
    return answer(probe, distance - probe.size[0], normal)


@stage
def near_box(address):
    probe = probe_at(address)
    p, half = vec3.load(probe.origin), vec3.load(probe.size)
    out = (abs(p[0]) - half[0], abs(p[1]) - half[1], abs(p[2]) - half[2])
    if max(out[0], out[1], out[2]) > 0.0:
        r = (
            math.copysign(max(out[0], 0.0), p[0]),
            math.copysign(max(out[1], 0.0), p[1]),
            math.copysign(max(out[2], 0.0), p[2]),
        )
        distance = vec3.norm(r)
        return answer(probe, distance, vec3.scale(1.0 / distance, r))
    axis = 0
    for k in range(1, 3):
        if out[k] > out[axis]:
            axis = k
    side = math.copysign(1.0, p[axis])
    normal = (side if axis == 0 else 0.0, side if axis == 1 else 0.0, side if axis == 2 else 0.0)
    return answer(probe, out[axis], normal)


@stage
def near_cylinder(address):
    probe = probe_at(address)
    distance, normal = point_cylinder(vec3.load(probe.origin), probe.size[0], probe.size[1])
    return answer(probe, distance, normal)


@stage
def near_plane(address):
    probe = probe_at(address)
    return answer(probe, probe.origin[2], (0.0, 0.0, 1.0))


@kernel
def _hull_point(points, hull, i):
    return vec3.load(points[hull.first_vertex + i])


@stage
def near_hull(address):
    """Inside, the nearest face; outside, the nearest point of the faces that look at p, triangle by triangle."""
    probe = probe_at(address)
    p = vec3.load(probe.origin)
    hulls, points, faces, corners = hulls_of(header_at(probe.header))
    hull = hulls[probe.data]
    highest, inner = -math.inf, vec3.ZERO
    best, outer = math.inf, vec3.ZERO
    for number in range(hull.first_face, hull.first_face + hull.num_faces):
        face = faces[number]
        n = vec3.load(face.normal)
        a = _hull_point(points, hull, corners[face.first_corner])
        above = vec3.dot(n, vec3.sub(p, a))
        if above > highest:
            highest, inner = above, n
        if above <= 0.0 or above * above >= best:
            continue
        for k in range(face.first_corner + 1, face.first_corner + face.num_corners - 1):
            b, c = _hull_point(points, hull, corners[k]), _hull_point(points, hull, corners[k + 1])
            nearest, _ = closest_point(p, a, b, c)
            r = vec3.sub(p, nearest)
            square = vec3.norm_squared(r)
            if square < best:
                best = square
                outer = vec3.scale(1.0 / math.sqrt(square), r)
    if highest > 0.0:
        return answer(probe, math.sqrt(best), outer)
    return answer(probe, highest, inner)
