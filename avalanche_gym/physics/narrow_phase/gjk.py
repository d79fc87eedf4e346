"""Distance of two convex cores by their support points alone.

The closest points belong to the point v of the Minkowski difference b - a that is nearest to the origin. A simplex of
up to four of its points is improved by the support point against v until that is no nearer (Gilbert, Johnson & Keerthi
1988); the nearest point of the simplex follows by the regions of a triangle (Ericson 2005, sec. 5.1.5). Where it lies
inside a triangle, the normal is the triangle's, which stays sharp however small the distance is.

Scratch rows 0 to 3 hold the simplex: columns 0 to 2 the point of the difference, 3 to 5 that of a, 6 its weight.
"""

from __future__ import annotations

import math

from ..jit import kernel
from ..maths import vec3
from .solid import placed_support

# Cores closer than this fraction of the pair's size count as touching: epa.py takes over.
TOUCH = 1e-11

# The search ends when upper and lower bound of the distance agree within this fraction of it ...
RELATIVE_ACCURACY = 1e-14
# ... or of the pair's size.
ABSOLUTE_ACCURACY = 1e-15

# More steps than any pair of polytopes takes; at smooth shapes, the last ones improve the last digits.
MOST_STEPS = 100

APART, TOUCHING = 0, 1


@kernel
def store_support(scratch, i, a, b, points, direction, shift):
    """Write into row i the point of b + shift - a furthest against a direction; return it."""
    on_a = placed_support(a, points, direction)
    on_b = vec3.add(shift, placed_support(b, points, vec3.neg(direction)))
    w = vec3.sub(on_b, on_a)
    vec3.store(scratch[i], w)
    vec3.store(scratch[i, 3:], on_a)
    return w


@kernel
def nearest_on_triangle(a, b, c):
    """Weights (3) of the point of a triangle that is nearest to the origin; the regions of Ericson 2005, sec. 5.1.5."""
    ab, ac = vec3.sub(b, a), vec3.sub(c, a)
    d1, d2 = -vec3.dot(ab, a), -vec3.dot(ac, a)
    if d1 <= 0.0 and d2 <= 0.0:
        return 1.0, 0.0, 0.0
    d3, d4 = -vec3.dot(ab, b), -vec3.dot(ac, b)
    if d3 >= 0.0 and d4 <= d3:
        return 0.0, 1.0, 0.0
    d5, d6 = -vec3.dot(ab, c), -vec3.dot(ac, c)
    if d6 >= 0.0 and d5 <= d6:
        return 0.0, 0.0, 1.0
    normal = vec3.cross(ab, ac)
    area_c = vec3.dot(normal, vec3.cross(a, b))
    if area_c <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        t = d1 / (d1 - d3)
        return 1.0 - t, t, 0.0
    area_b = vec3.dot(normal, vec3.cross(c, a))
    if area_b <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        t = d2 / (d2 - d6)
        return 1.0 - t, 0.0, t
    area_a = vec3.dot(normal, vec3.cross(b, c))
    if area_a <= 0.0 and d4 - d3 >= 0.0 and d5 - d6 >= 0.0:
        t = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        return 0.0, 1.0 - t, t
    total = area_a + area_b + area_c
    return area_a / total, area_b / total, area_c / total


@kernel
def _weigh(scratch, i, weight_i, j, weight_j, k, weight_k):
    """The combination of three rows of the simplex."""
    v = vec3.scale(weight_i, vec3.load_row(scratch, i))
    v = vec3.add_scaled(v, weight_j, vec3.load_row(scratch, j))
    return vec3.add_scaled(v, weight_k, vec3.load_row(scratch, k))


@kernel
def _plane_normal(scratch, i, j, k):
    """The normal of a triangle of the simplex; its length is twice the area."""
    a = vec3.load_row(scratch, i)
    return vec3.cross(vec3.sub(vec3.load_row(scratch, j), a), vec3.sub(vec3.load_row(scratch, k), a))


@kernel
def _copy_row(scratch, source, target):
    for column in range(6):
        scratch[target, column] = scratch[source, column]


@kernel
def reduce_simplex(scratch, count):
    """Keep the part of the simplex on which its nearest point to the origin lies; new count, that point, its direction.

    Weights go into column 6. A count of 4 says that the origin is inside. The direction is the unit normal of a
    triangle, or the point itself, not of unit length, if it lies on an edge or vertex.
    """
    i, j, k = 0, 1, 2
    w_i, w_j, w_k = 1.0, 0.0, 0.0
    if count == 2:
        a, b = vec3.load_row(scratch, 0), vec3.load_row(scratch, 1)
        ab = vec3.sub(b, a)
        t = min(max(-vec3.dot(a, ab) / vec3.norm_squared(ab), 0.0), 1.0)
        w_i, w_j, k = 1.0 - t, t, 0
    elif count == 1:
        j = k = 0
    elif count == 3:
        w_i, w_j, w_k = nearest_on_triangle(
            vec3.load_row(scratch, 0), vec3.load_row(scratch, 1), vec3.load_row(scratch, 2)
        )
    else:
        # The nearest of all four faces, unless the origin is on the inner side of each. If the tetrahedron is all but
        # flat, these signs are round-off, so they don't choose the face.
        smallest = math.inf
        inside = True
        for opposite in range(4):
            p, q, r = (opposite + 1) % 4, (opposite + 2) % 4, (opposite + 3) % 4
            normal = _plane_normal(scratch, p, q, r)
            height = vec3.dot(normal, vec3.load_row(scratch, p))
            side = vec3.dot(normal, vec3.load_row(scratch, opposite)) - height
            inside = inside and height * side < 0.0
            a, b, c = nearest_on_triangle(
                vec3.load_row(scratch, p), vec3.load_row(scratch, q), vec3.load_row(scratch, r)
            )
            squared = vec3.norm_squared(_weigh(scratch, p, a, q, b, r, c))
            if squared < smallest:
                smallest = squared
                i, j, k, w_i, w_j, w_k = p, q, r, a, b, c
        if inside:
            return count, vec3.ZERO, vec3.ZERO
    v = _weigh(scratch, i, w_i, j, w_j, k, w_k)
    direction = v
    if w_i > 0.0 and w_j > 0.0 and w_k > 0.0:
        normal = vec3.normalize(_plane_normal(scratch, i, j, k))
        height = vec3.dot(normal, vec3.load_row(scratch, i))
        direction = normal if height >= 0.0 else vec3.neg(normal)
        v = vec3.scale(height, normal)
    # Compact: the kept rows move to the front, by way of rows 4 to 6.
    kept = 0
    for corner in range(3):
        row = i if corner == 0 else (j if corner == 1 else k)
        weight = w_i if corner == 0 else (w_j if corner == 1 else w_k)
        if weight > 0.0:
            _copy_row(scratch, row, 4 + kept)
            scratch[4 + kept, 6] = weight
            kept += 1
    for row in range(kept):
        _copy_row(scratch, 4 + row, row)
        scratch[row, 6] = scratch[4 + row, 6]
    return kept, v, direction


@kernel
def point_on_a(scratch, count):
    """The closest point of a, from the weights of the simplex."""
    total = vec3.ZERO
    for i in range(count):
        weight = scratch[i, 6]
        total = (
            total[0] + weight * scratch[i, 3],
            total[1] + weight * scratch[i, 4],
            total[2] + weight * scratch[i, 5],
        )
    return total


@kernel
def closest_points(a, b, points, shift, start, size, margin, scratch):
    """Distance of a and b + shift: status, distance, unit normal from a to b, closest point of a.

    ``start`` a direction from a to b to begin with; ``size`` of the pair [m]. If TOUCHING, the other values mean
    nothing. Beyond ``margin``, a lower bound of the distance is returned as soon as it is known.
    """
    direction = start
    if vec3.norm_squared(direction) == 0.0:
        direction = (1.0, 0.0, 0.0)
    squared = math.inf
    count = 0
    # Any direction along which the cores are apart proves it, with a lower bound of the distance; the best one is kept.
    best_bound = -math.inf
    normal = direction
    for _ in range(MOST_STEPS):
        w = store_support(scratch, count, a, b, points, direction, shift)
        bound = vec3.dot(direction, w) / math.sqrt(vec3.norm_squared(direction))
        if bound > best_bound:
            best_bound, normal = bound, direction
            if bound > margin:
                return APART, bound, vec3.normalize(direction), vec3.ZERO
        distance = math.sqrt(squared)
        if count > 0 and distance - bound <= RELATIVE_ACCURACY * distance + ABSOLUTE_ACCURACY * size:
            break
        # The best simplex so far is kept in rows 8 to 11, in case round-off makes the next one worse.
        for row in range(count):
            _copy_row(scratch, row, 8 + row)
            scratch[8 + row, 6] = scratch[row, 6]
        last_count = count
        count, v, turned = reduce_simplex(scratch, count + 1)
        squared_new = vec3.norm_squared(v)
        if count == 4 or squared_new >= squared:
            if count == 4 and best_bound <= TOUCH * size:
                return TOUCHING, 0.0, normal, vec3.ZERO
            count = last_count
            for row in range(count):
                _copy_row(scratch, 8 + row, row)
                scratch[row, 6] = scratch[8 + row, 6]
            break
        direction, squared = turned, squared_new
        if squared <= (TOUCH * size) ** 2:
            break
    if best_bound <= TOUCH * size:
        return TOUCHING, 0.0, normal, vec3.ZERO
    return APART, best_bound, vec3.normalize(normal), point_on_a(scratch, count)
