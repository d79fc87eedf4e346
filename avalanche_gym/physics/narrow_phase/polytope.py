"""Face against face: clip the one by the sides of the other, measure, reduce, emit.

The *reference* face gives a frame: an origin in its plane, two tangents u, v and the outward normal w. The *incident*
face of the other shape is a convex polygon in that frame, a row of the scratch array for each vertex. Clipping by one
half plane for each side of the reference face (Sutherland & Hodgman 1974) leaves the part that lies over it. Every
vertex q of that part faces a point p of the reference face, and all share one normal n, the direction of least
separation of the two shapes. The incident face is projected *along n* on the plane of the reference face before it is
clipped, so that q - p is parallel to n: gap = (q - p) . n. No gap is smaller than the separation, and that of the
closest features equals it, whether n is the normal of either face or, between slightly tilted faces, of two crossing
edges.

Use, for a polygon of ``count`` <= MOST_CORNERS vertices and a normal (n_u, n_v, n_w) in the frame:

    set_vertex(scratch, first, k, x, y, height)            # for each vertex, in cyclic order; first = FIRST_BUFFER
    project(scratch, first, count, n_u / n_w, n_v / n_w)   # nothing to do if n = w
    first, count = clip(scratch, first, count, nx, ny, offset, tolerance, tag)   # each side: tag FIRST_SIDE + number
    least = measure(scratch, first, count, abs(n_w))       # the gaps
    count = append(scratch, first, count, x, y, gap, feature)                    # if the closest pair is not among them
    total = emit_rows(scratch, first, count, ...)          # at most four

Features of the rows: incident vertex k, or a crossing of an edge (tag k: from incident vertex k to the
next; FIRST_SIDE and more: along a side) with a side.
"""

from __future__ import annotations

import math

from ..jit import kernel
from ..maths import vec3
from .manifold import emit
from .reduction import FEATURE, GAP, HEIGHT, TAG, X, Y, drop_beyond, select_four

# Two polygons are kept in the first 128 rows of the scratch table; clipping goes from one to the other.
FIRST_BUFFER, SECOND_BUFFER = 0, 64

# Corners of the incident face and sides of the reference face, at most.
MOST_CORNERS = 32

# Tags below are incident edges, from here on sides of the reference face.
FIRST_SIDE = MOST_CORNERS

# Numbers of one pair of faces: the feature of a row is below.
ROW_FEATURES = 8192

# A vertex beyond a side of the reference face by less than this fraction of the pair's size counts as within: flush
# faces keep their own vertices, whatever the round-off. Contacts may lie outside of the face by as much.
FLUSH = 1e-9

# A contact as close as the true closest pair, within this fraction of the pair's size, stands for it.
AS_CLOSE = 2e-10

# Cosine between the normal and a face's below which that face gets no polygon: 3.6 degrees. Beyond it, the far corners
# rise so steeply that the closest pair alone describes the contact.
FACE_ALIGNED = 0.998

# The second shape's face must be better aligned by this difference of cosines to become the reference.
REFERENCE_BIAS = 1e-6


@kernel
def set_vertex(scratch, first, k, x, y, height):
    """Vertex k of the incident face, in the frame of the reference face."""
    row = scratch[first + k]
    row[X] = x
    row[Y] = y
    row[HEIGHT] = height
    row[TAG] = k
    row[FEATURE] = k


@kernel
def project(scratch, first, count, slope_u, slope_v):
    """Move the vertices along the contact normal on the plane of the reference face; their heights stay.

    Slopes: the normal's components along u and v, each divided by that along w.
    """
    for i in range(first, first + count):
        scratch[i, X] -= slope_u * scratch[i, HEIGHT]
        scratch[i, Y] -= slope_v * scratch[i, HEIGHT]


@kernel
def _cross_side(scratch, target, previous, distance_previous, current, distance, tag_edge, tag_side, tag_out):
    """Write into row ``target`` where the edge between two rows meets a side."""
    t = distance_previous / (distance_previous - distance)
    for column in range(HEIGHT + 1):
        start = scratch[previous, column]
        scratch[target, column] = start + t * (scratch[current, column] - start)
    scratch[target, TAG] = tag_out
    scratch[target, FEATURE] = (1 + tag_edge) * (2 * MOST_CORNERS) + tag_side


@kernel
def clip(scratch, first, count, nx, ny, offset, tolerance, tag):
    """Keep the part of the polygon with nx x + ny y <= offset; return its first row and number of rows.

    ``(nx, ny)`` unit outward normal of the side, ``tolerance`` [m] for vertices to count as within, ``tag`` of the
    side.
    """
    outside = 0
    for i in range(first, first + count):
        if nx * scratch[i, X] + ny * scratch[i, Y] - offset > tolerance:
            outside += 1
    if outside == 0:
        return first, count
    target = FIRST_BUFFER + SECOND_BUFFER - first
    kept = target
    previous = first + count - 1
    distance_previous = nx * scratch[previous, X] + ny * scratch[previous, Y] - offset
    for i in range(first, first + count):
        distance = nx * scratch[i, X] + ny * scratch[i, Y] - offset
        # A vertex on the side itself stands for the crossing.
        if (distance > tolerance and distance_previous < -tolerance) or (
            distance < -tolerance and distance_previous > tolerance
        ):
            edge = scratch[previous, TAG]
            leaves = distance > tolerance
            _cross_side(
                scratch, kept, previous, distance_previous, i, distance, edge, tag, tag * 1.0 if leaves else edge
            )
            kept += 1
        if distance <= tolerance:
            for column in range(FEATURE + 1):
                scratch[kept, column] = scratch[i, column]
            kept += 1
        previous, distance_previous = i, distance
    return target, kept - target


@kernel
def measure(scratch, first, count, cosine):
    """Fill in the gaps, height by the cosine between outward face normal and contact normal; return the smallest."""
    least = math.inf
    for i in range(first, first + count):
        gap = scratch[i, HEIGHT] / cosine
        scratch[i, GAP] = gap
        least = min(least, gap)
    return least


@kernel
def append(scratch, first, count, x, y, gap, feature):
    """Add a contact that clipping did not find, by its point on the reference face; return the new count."""
    row = scratch[first + count]
    row[X] = x
    row[Y] = y
    row[HEIGHT] = 0.0
    row[TAG] = 0.0
    row[GAP] = gap
    row[FEATURE] = feature
    return count + 1


@kernel
def emit_rows(scratch, first, rows, origin, u, v, normal, sense, size, margin, feature, contacts, count):
    """Emit up to four of the rows with a gap of at most ``margin``; return the new count of contacts.

    ``origin`` [m], ``u``, ``v`` frame of the reference face in the world; ``normal`` from a to b; ``sense`` 1.0 if
    the reference face is a's, -1.0 if it is b's; ``feature`` is added to that of each row.
    """
    rows = drop_beyond(scratch, first, rows, margin)
    one, two, three, four = select_four(scratch, first, rows, size)
    for i in range(first, first + rows):
        if i == one or i == two or i == three or i == four:
            point = vec3.add_scaled(origin, scratch[i, X], u)
            point = vec3.add_scaled(point, scratch[i, Y], v)
            gap = scratch[i, GAP]
            position = vec3.add_scaled(point, 0.5 * sense * gap, normal)
            count = emit(contacts, count, position, normal, gap, feature + int(scratch[i, FEATURE]))
    return count
