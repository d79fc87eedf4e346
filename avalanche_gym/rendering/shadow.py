"""Shadows of the sun: a depth map seen from the sun (Williams 1978), looked up with a smooth filter.

The map covers a square of the plane across the sun's rays. A pixel holds how far along the rays the first surface lies;
a point further away is in the shade. Two things blur that comparison: a pixel stands for a patch of surface, on which the
distance changes by the slope, and neighbouring pixels are averaged for a soft edge. So the point is moved off its surface
by a share of a pixel that grows with the slope (normal offset, Holbert 2011), and the margin of the comparison grows with
the slope too; a constant margin is either too small on steep ground or lets the shadows of low bodies come off.

Static surfaces are drawn once into a map of their own, which is copied before the moving ones are added.
"""

from __future__ import annotations

import math

import numpy as np

from ..physics.jit import entry_point, kernel
from ..physics.maths import quat, vec3

SHADOW = np.dtype(
    [
        ("across", np.float64, 3),  # unit, world frame: along the columns of the map
        ("along", np.float64, 3),  # unit: along the rows
        ("sun", np.float64, 3),  # unit, towards the sun
        ("center", np.float64, 3),  # [m] middle of the map, world frame
        ("scale", np.float64),  # [pixels/m]
        ("pixel", np.float64),  # [m] 1 / scale
        ("half", np.float64),  # [pixels] half the map's side
    ],
    align=True,
)

MAPPED = np.dtype([("place", np.float64, 3)], align=True)  # column, row [map pixels], distance along the rays [m]

# Of a map pixel: the least margin of the comparison, its growth with the tangent of the slope, and the largest slope that
# counts. Smaller values show stripes on lit ground, larger ones a lit seam between a body and its shadow.
BIAS, SLOPE_BIAS, STEEPEST = 0.5, 1.0, 6.0
# [map pixels] how far the point is moved along its normal where light only grazes the surface.
NORMAL_OFFSET = 1.2


@kernel
def draw_caster(instance, shadow, vertices, faces, mapped, depth):
    """Enter one instance into the shadow map; ``depth`` (n, n) float32 holds the distance [m] along the rays."""
    size = depth.shape[0]
    position = vec3.sub(vec3.load(instance.position), vec3.load(shadow.center))
    orientation = quat.load(instance.orientation)
    scale = shadow.scale
    ax = vec3.scale(scale, quat.rotate_inverse(orientation, vec3.load(shadow.across)))
    ay = vec3.scale(scale, quat.rotate_inverse(orientation, vec3.load(shadow.along)))
    az = vec3.neg(quat.rotate_inverse(orientation, vec3.load(shadow.sun)))
    tx = scale * vec3.dot(vec3.load(shadow.across), position) + shadow.half - 0.5
    ty = scale * vec3.dot(vec3.load(shadow.along), position) + shadow.half - 0.5
    tz = -vec3.dot(vec3.load(shadow.sun), position)
    first = instance.first_vertex
    base = instance.first_projected
    center = vec3.load(instance.center)
    x = vec3.dot(ax, center) + tx
    y = vec3.dot(ay, center) + ty
    reach = instance.radius * scale
    if not (x + reach >= 0.0 and y + reach >= 0.0 and x - reach <= size and y - reach <= size):
        return
    for i in range(instance.num_vertices):
        v = vec3.load(vertices[first + i].position)
        place = (vec3.dot(ax, v) + tx, vec3.dot(ay, v) + ty, vec3.dot(az, v) + tz)
        vec3.store(mapped[base + i].place, place)
    for k in range(instance.first_face, instance.first_face + instance.num_faces):
        a = vec3.load(mapped[base + np.int64(faces[k, 0])].place)
        b = vec3.load(mapped[base + np.int64(faces[k, 1])].place)
        c = vec3.load(mapped[base + np.int64(faces[k, 2])].place)
        fill_nearest(a, b, c, instance.two_sided, depth)


@kernel
def fill_nearest(a, b, c, two_sided, depth):
    """Keep the smaller distance at each map pixel under a triangle that faces the sun."""
    size = depth.shape[0]
    low_x = min(a[0], b[0], c[0])
    high_x = max(a[0], b[0], c[0])
    low_y = min(a[1], b[1], c[1])
    high_y = max(a[1], b[1], c[1])
    if not (high_x >= 0.0 and high_y >= 0.0 and low_x <= size - 1.0 and low_y <= size - 1.0):
        return
    left = int(math.ceil(max(low_x, 0.0)))
    right = int(math.floor(min(high_x, size - 1.0)))
    top = int(math.ceil(max(low_y, 0.0)))
    bottom = int(math.floor(min(high_y, size - 1.0)))
    if left > right or top > bottom:
        return
    # Twice the area, positive if the triangle faces the sun.
    area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    if area < 0.0 and two_sided == 1:
        b, c = c, b
        area = -area
    if not area > 0.0:
        return
    ux, uy = b[0] - a[0], b[1] - a[1]
    vx, vy = c[0] - a[0], c[1] - a[1]
    inverse = 1.0 / area
    slope_x = ((b[2] - a[2]) * vy - (c[2] - a[2]) * uy) * inverse
    slope_y = ((c[2] - a[2]) * ux - (b[2] - a[2]) * vx) * inverse
    for j in range(top, bottom + 1):
        y = j - a[1]
        # Edges from a to b, from c to a, from b to c.
        r0 = ux * y + uy * a[0]
        r1 = -vx * y - vy * a[0]
        r2 = (vx - ux) * (j - b[1]) + (vy - uy) * b[0]
        z0 = a[2] + slope_y * y - slope_x * a[0]
        for i in range(left, right + 1):
            if r0 - uy * i >= 0.0 and r1 + vy * i >= 0.0 and r2 - (vy - uy) * i >= 0.0:
                z = np.float32(z0 + slope_x * i)
                if z < depth[j, i]:
                    depth[j, i] = z


@entry_point
def draw_casters(instances, order, shadow, vertices, faces, mapped, depth):
    """Enter the instances numbered in ``order`` into the shadow map."""
    for k in range(len(order)):
        draw_caster(instances[order[k]], shadow[0], vertices, faces, mapped, depth)


@kernel
def sunlight(x, y, z, depth):
    """Share in [0, 1] of the sun that reaches a point.

    Weights of the quadratic B-spline over 3 x 3 map pixels: the edge of a shadow is smooth, without steps.

    Args:
        x: [map pixels] column, 0 at the edge of the map.
        y: [map pixels] row.
        z: [m] distance along the rays, less the margin.
        depth: (n, n) float32, the map.

    All of them float32.
    """
    size = depth.shape[1]
    if not (x >= 2.0 and y >= 2.0 and x <= size - 2.0 and y <= size - 2.0):
        return np.float32(1.0)
    i = int(x)
    j = int(y)
    zero, half, one = np.float32(0.0), np.float32(0.5), np.float32(1.0)
    u = x - np.float32(i)
    v = y - np.float32(j)
    u0, u1, u2 = half * (one - u) * (one - u), half + u * (one - u), half * u * u
    lit = zero
    weight = half * (one - v) * (one - v)
    for row in range(j - 1, j + 2):
        share = u0 if depth[row, i - 1] >= z else zero
        share += u1 if depth[row, i] >= z else zero
        share += u2 if depth[row, i + 1] >= z else zero
        lit += weight * share
        weight = half + v * (one - v) if row < j else half * v * v
    return lit
