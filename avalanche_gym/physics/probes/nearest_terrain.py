"""Nearest points of height fields and triangle meshes.

* Facets: the cells around the point, ring by ring, until a ring is farther away than the nearest point found.
* Smooth: a search from below the point, then one from the middle of every cell whose coefficients leave room for a
  nearer one.
* Both are solid below, with upright walls; a point inside leaves through the surface or the nearer wall.
* Mesh: the tree; on a closed mesh the pseudo-normal of the nearest feature tells inside from outside (Baerentzen and
  Aanaes 2005). The distance from an open one is that from the sheet, never negative.
"""

from __future__ import annotations

import math

from ..jit import kernel, stage
from ..maths import vec3
from ..memory import header_at, height_field_of, heights_of, mesh_of
from ..narrow_phase.height_field_grid import face_normal, grid_of, sample
from ..narrow_phase.height_field_walls import facet_height, nearest_wall
from ..narrow_phase.mesh_surface import nearest_face
from ..narrow_phase.smooth_surface import coefficients_of, locate, patch_of, signed_distance
from ..narrow_phase.triangle import EDGE, REGION_SLACK, VERTEX, closest_point
from ..shapes.static_tree import leaf_near
from .probe import MISS, answer, probe_at

# Of a squared distance, where a search looks for what is nearer than that.
BOUND = 1.001


@kernel
def nearest_facet(grid, heights, rows, columns, p):
    """Squared distance [m^2] of the nearest point of the facets, and that point."""
    row, _ = locate(p[1] - grid[1], grid[5], rows - 1)
    column, _ = locate(p[0] - grid[0], grid[4], columns - 1)
    # Outside the rectangle the rings are about the nearest cell, at the distance of the rectangle.
    x = min(max(p[0], grid[0]), -grid[0]) - (grid[0] + column * grid[2])
    y = min(max(p[1], grid[1]), -grid[1]) - (grid[1] + row * grid[3])
    inner = min(x, grid[2] - x, y, grid[3] - y)
    best, found = math.inf, p
    for ring in range(max(rows, columns)):
        reach = inner + (ring - 1) * min(grid[2], grid[3]) if ring > 0 else 0.0
        if reach * reach >= best:
            break
        for i in range(max(row - ring, 0), min(row + ring, rows - 2) + 1):
            step = 1 if i == row - ring or i == row + ring else max(2 * ring, 1)
            for k in range(column - ring, column + ring + 1, step):
                if k < 0 or k > columns - 2:
                    continue
                a, c = sample(grid, heights, columns, i, k), sample(grid, heights, columns, i + 1, k + 1)
                for upper in range(2):
                    b = sample(grid, heights, columns, i + upper, k + 1 - upper)
                    nearest, _ = closest_point(p, a, b, c)
                    square = vec3.norm_squared(vec3.sub(p, nearest))
                    if square < best:
                        best, found = square, nearest
    return best, found


@stage
def near_facets(address):
    probe = probe_at(address)
    p = vec3.load(probe.origin)
    header = header_at(probe.header)
    field = height_field_of(header, probe.data)
    grid = grid_of(field)
    rows, columns = field.rows, field.columns
    heights = heights_of(header, probe.world)[field.first : field.first + rows * columns]
    x, y = min(max(p[0], grid[0]), -grid[0]), min(max(p[1], grid[1]), -grid[1])
    below = p[2] < facet_height(grid, heights, rows, columns, x, y)
    if below and (x != p[0] or y != p[1]):
        d = (p[0] - x, p[1] - y, 0.0)
        distance = vec3.norm(d)
        return answer(probe, distance, vec3.scale(1.0 / distance, d))
    square, nearest = nearest_facet(grid, heights, rows, columns, p)
    distance = math.sqrt(square)
    if below:
        wall, outward = nearest_wall(p, -grid[0], -grid[1])
        if wall < distance:
            return answer(probe, -wall, outward)
    if distance <= REGION_SLACK * grid[2]:
        row, v = locate(y - grid[1], grid[5], rows - 1)
        column, u = locate(x - grid[0], grid[4], columns - 1)
        if below:
            distance = -distance
        return answer(probe, distance, face_normal(grid, heights, row * columns + column, columns, 1 if v > u else 0))
    normal = vec3.scale((-1.0 if below else 1.0) / distance, vec3.sub(p, nearest))
    return answer(probe, -distance if below else distance, normal)


@kernel
def _cell_distance(patch, c, p, row, column):
    """A lower bound of the distance [m] of p from the surface of a cell, by the coefficients that weigh in it."""
    low, high = math.inf, -math.inf
    for i in range(row, row + 4):
        for k in range(column, column + 4):
            low, high = min(low, c[i, k]), max(high, c[i, k])
    x, y = patch[0] + column * patch[2], patch[1] + row * patch[3]
    return vec3.norm(
        (
            max(x - p[0], 0.0, p[0] - x - patch[2]),
            max(y - p[1], 0.0, p[1] - y - patch[3]),
            max(low - p[2], 0.0, p[2] - high),
        )
    )


@kernel
def _nearest_smooth(patch, c, p):
    """Signed distance [m] and normal of a point: the best of a search from below it and of one in each near cell."""
    x, y = min(max(p[0], patch[0]), patch[6]), min(max(p[1], patch[1]), patch[7])
    distance, normal = signed_distance(patch, c, p, x, y)
    reach = min(abs(distance), patch[6] - patch[0] + patch[7] - patch[1])
    first_column, _ = locate(p[0] - reach - patch[0], patch[4], patch[8])
    last_column, _ = locate(p[0] + reach - patch[0], patch[4], patch[8])
    first_row, _ = locate(p[1] - reach - patch[1], patch[5], patch[9])
    last_row, _ = locate(p[1] + reach - patch[1], patch[5], patch[9])
    for row in range(first_row, last_row + 1):
        for column in range(first_column, last_column + 1):
            if _cell_distance(patch, c, p, row, column) < abs(distance):
                x, y = patch[0] + (column + 0.5) * patch[2], patch[1] + (row + 0.5) * patch[3]
                other, direction = signed_distance(patch, c, p, x, y)
                if abs(other) < abs(distance):
                    distance, normal = other, direction
    return distance, normal


@stage
def near_smooth(address):
    probe = probe_at(address)
    header = header_at(probe.header)
    field = height_field_of(header, probe.data)
    c = coefficients_of(field, heights_of(header, probe.world))
    distance, normal = _nearest_smooth(patch_of(field), c, vec3.load(probe.origin))
    return answer(probe, distance, normal)


@stage
def near_mesh(address):
    probe = probe_at(address)
    p = vec3.load(probe.origin)
    rows, vertices, faces, nodes = mesh_of(header_at(probe.header), probe.data)
    mesh = rows[0]
    # Any vertex near by gives the search its bound; a little more, to find at least that one.
    near = vertices[faces[nodes[leaf_near(nodes, p)].first].vertices[0]]
    bound = BOUND * vec3.norm_squared(vec3.sub(p, vec3.load(near.position)))
    if mesh.closed == 0:
        if probe.limit < 0.0:
            return MISS
        bound = min(bound, BOUND * probe.limit * probe.limit)
    index, nearest, lies_on = nearest_face(vertices, faces, nodes, p, bound)
    if index < 0:
        return MISS
    face = faces[index]
    n = vec3.load(face.normal)
    if lies_on >= VERTEX:
        n = vec3.load(vertices[face.vertices[lies_on - VERTEX]].normal)
    elif lies_on >= EDGE and face.neighbours[lies_on - EDGE] >= 0:
        n = vec3.normalize(vec3.add(n, vec3.load(faces[face.neighbours[lies_on - EDGE]].normal)))
    d = vec3.sub(p, nearest)
    inside = mesh.closed == 1 and vec3.dot(n, d) < 0.0
    distance = vec3.norm(d)
    # What is left of the difference of two equal points has no direction.
    edge = vec3.sub(vec3.load(vertices[face.vertices[1]].position), vec3.load(vertices[face.vertices[0]].position))
    if distance * distance <= REGION_SLACK * REGION_SLACK * vec3.norm_squared(edge):
        return answer(probe, -distance if inside else distance, n)
    return answer(probe, -distance if inside else distance, vec3.scale((-1.0 if inside else 1.0) / distance, d))
