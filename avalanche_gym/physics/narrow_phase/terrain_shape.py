"""The moving shape as terrain sees it: a core of corners and edges with a radius, in the terrain's frame.

Sphere, capsule and box are the points within ``radius`` of a box whose half extents are zero along all axes (sphere),
two (capsule) or none (box, radius 0). Of a cylinder or hull the table holds a box around it; their corners come in
turns (terrain_hull.py) or depend on the face they meet (terrain_cylinder.py).

All kernels of a pair of shape and terrain share the caller's (264, 8) scratch table and find what they need there, so a
call passes two or three arguments instead of twenty:

    rows        content
    0 ...       candidates of contacts (terrain_candidates.py)
    64 ...      features of the terrain (terrain_features.py)
    144         center (3) [m], half extents (3) [m], radius [m], margin [m]
    145, 146    axes: the rotation of the core, row by row (9); its size [m]; the square of its reach from the center
                [m^2]; the gap [m] from which on an open contact counts less (terrain_candidates.py); how far [m] it
                can come within the step; 1 for a box; how far [rad] the terrain turns within the step
    147         lower bounds (3), upper bounds (3) [m], with radius and margin
    148 ...     eight corners: position (3) [m], feature number; the last three columns hold, row by row, how the shape
                moves within the step (path.py): displacement [m] of what is at the frame's origin, turn [rad],
                displacement of the core; then (how near [m] counts whatever moves, how far [m] the core reaches from
                its third axis, -), the center once more (the first may stand for the side on which a sheet acts), and
                nine nodes of the terrain's tree (mesh_mesh.py)
    156 ...     what a kind of terrain needs for itself
    256 ...     scores of the candidates while they are reduced
"""

from __future__ import annotations

import math

from ..jit import kernel
from ..maths import mat3, vec3
from ..model import BOX, CAPSULE, SPHERE

FIRST_FEATURE_ROW = 64
END_FEATURE_ROW = 144
CENTER_ROW = 144
AXES_ROW = 145
BOUNDS_ROW = 147
CORNER_ROW = 148
PATH_COLUMN = 5
LEVELS = 9
FIRST_FREE_ROW = 156
END_FREE_ROW = 256
SCORE_ROW = 256


@kernel
def get(scratch, row, column):
    """Three neighbouring entries."""
    return (scratch[row, column], scratch[row, column + 1], scratch[row, column + 2])


@kernel
def put(scratch, row, column, a):
    """Write three neighbouring entries."""
    scratch[row, column] = a[0]
    scratch[row, column + 1] = a[1]
    scratch[row, column + 2] = a[2]


@kernel
def axis_of(scratch, axis):
    """Axis 0, 1 or 2 of the core."""
    second = 3 + axis
    third = 6 + axis
    return (
        scratch[AXES_ROW, axis],
        scratch[AXES_ROW + (second >> 3), second & 7],
        scratch[AXES_ROW + (third >> 3), third & 7],
    )


@kernel
def axes_of(scratch):
    """Rotation of the core, nine floats."""
    a, b = AXES_ROW, AXES_ROW + 1
    return (
        scratch[a, 0],
        scratch[a, 1],
        scratch[a, 2],
        scratch[a, 3],
        scratch[a, 4],
        scratch[a, 5],
        scratch[a, 6],
        scratch[a, 7],
        scratch[b, 0],
    )


@kernel
def margin_of(scratch):
    """[m]"""
    return scratch[CENTER_ROW, 7]


@kernel
def radius_of(scratch):
    """[m]"""
    return scratch[CENTER_ROW, 6]


@kernel
def scale_of(scratch):
    """[m] size of the shape: the unit of its tolerances."""
    return scratch[AXES_ROW + 1, 1]


@kernel
def set_scale(scale, scratch):
    """Replace the size [m]: a piece of a body has the tolerances of the whole."""
    scratch[AXES_ROW + 1, 1] = scale


@kernel
def rank_by_motion(motion, scratch):
    """Let contacts that the ``motion`` [m] within a step cannot close count less than those it can."""
    scratch[AXES_ROW + 1, 3] = motion


@kernel
def falloff_of(scratch):
    """[m]"""
    return scratch[AXES_ROW + 1, 3]


@kernel
def set_motion(motion, scratch):
    """Say how far [m] the shape can come within the step."""
    scratch[AXES_ROW + 1, 4] = motion


@kernel
def motion_of(scratch):
    """[m]"""
    return scratch[AXES_ROW + 1, 4]


@kernel
def put_path(seen, core, rest, scratch):
    """Say how the shape moves (path.py) in the terrain's frame; ``core`` [m] is the displacement of its middle."""
    put(scratch, CORNER_ROW, PATH_COLUMN, seen[0])
    put(scratch, CORNER_ROW + 1, PATH_COLUMN, seen[1])
    put(scratch, CORNER_ROW + 2, PATH_COLUMN, core)
    scratch[CORNER_ROW + 3, PATH_COLUMN] = rest


@kernel
def stand_still(margin, scratch):
    """All within ``margin`` [m] counts alike."""
    put_path((vec3.ZERO, vec3.ZERO), vec3.ZERO, margin, scratch)


@kernel
def path_in(scratch):
    """``seen`` of path.py"""
    return get(scratch, CORNER_ROW, PATH_COLUMN), get(scratch, CORNER_ROW + 1, PATH_COLUMN)


@kernel
def set_girth(girth, scratch):
    """Say how far [m] the core reaches from its third axis, if that is less than the corners of its box."""
    scratch[CORNER_ROW + 3, PATH_COLUMN + 1] = girth


@kernel
def middle_of(scratch):
    """[m] of the core, whatever the center stands for."""
    return get(scratch, CORNER_ROW + 4, PATH_COLUMN)


@kernel
def set_first_leaf(scratch, level, node):
    """Note the first leaf of the terrain's tree near the last node of this level of the other tree."""
    scratch[CORNER_ROW + 5 + level // 3, PATH_COLUMN + level % 3] = node


@kernel
def first_leaf_of(scratch, level):
    return int(scratch[CORNER_ROW + 5 + level // 3, PATH_COLUMN + level % 3])


@kernel
def girth_of(scratch):
    """[m]"""
    return scratch[CORNER_ROW + 3, PATH_COLUMN + 1]


@kernel
def core_path_of(scratch):
    """Displacement [m] of the core."""
    return get(scratch, CORNER_ROW + 2, PATH_COLUMN)


@kernel
def rest_of(scratch):
    """[m] how near counts whatever moves."""
    return scratch[CORNER_ROW + 3, PATH_COLUMN]


@kernel
def set_turned(turned, scratch):
    """Say how far [rad] the terrain turns within the step."""
    scratch[AXES_ROW + 1, 6] = turned


@kernel
def turned_of(scratch):
    """[rad]"""
    return scratch[AXES_ROW + 1, 6]


@kernel
def reach_squared_of(scratch):
    """[m^2] square of the radius about the center within which contacts can lie."""
    return scratch[AXES_ROW + 1, 2]


@kernel
def is_box(scratch):
    """Whether the shape fills its core: only then it has edges and corners where the core has them."""
    return scratch[AXES_ROW + 1, 5] == 1.0


@kernel
def put_core(center, axes, half, radius, margin, scratch):
    """Describe what all shapes have: a box ``half`` [m] about ``center`` that holds the core, in the terrain's frame.

    Args:
        center: [m].
        axes: its rotation, nine floats.
        half, radius: [m].
        margin: [m].
        scratch: (264, 8).
    """
    put(scratch, CENTER_ROW, 0, center)
    put(scratch, CENTER_ROW, 3, half)
    scratch[CENTER_ROW, 6] = radius
    scratch[CENTER_ROW, 7] = margin
    for k in range(9):
        scratch[AXES_ROW + (k >> 3), k & 7] = axes[k]
    scratch[AXES_ROW + 1, 1] = max(half[0], half[1], half[2]) + radius
    scratch[AXES_ROW + 1, 2] = (math.sqrt(vec3.norm_squared(half)) + radius + margin) ** 2
    scratch[AXES_ROW + 1, 3] = margin
    scratch[AXES_ROW + 1, 4] = 0.0
    scratch[AXES_ROW + 1, 5] = 0.0
    scratch[AXES_ROW + 1, 6] = 0.0
    stand_still(margin, scratch)
    put(scratch, CORNER_ROW + 4, PATH_COLUMN, center)
    set_girth(math.sqrt(half[0] * half[0] + half[1] * half[1]), scratch)
    for k in range(3):
        reach = radius + margin
        for j in range(3):
            reach += abs(axes[3 * k + j]) * half[j]
        scratch[BOUNDS_ROW, k] = center[k] - reach
        scratch[BOUNDS_ROW, 3 + k] = center[k] + reach


@kernel
def put_corner(scratch, number, point, feature):
    """Write corner ``number`` of the list: its place [m] in the terrain's frame and its feature number."""
    put(scratch, CORNER_ROW + number, 0, point)
    scratch[CORNER_ROW + number, 3] = feature


@kernel
def in_frame(position_a, rotation_a, position_b, rotation_b):
    """Place of a shape in the frame of the terrain b: centre [m] and rotation."""
    center = mat3.apply_transposed(rotation_b, vec3.sub(position_a, position_b))
    return center, mat3.multiply(mat3.transpose(rotation_b), rotation_a)


@kernel
def put_shape(shape, position_a, rotation_a, size_a, position_b, rotation_b, margin, scratch):
    """Describe a sphere, capsule or box in the scratch table; return its number of corners.

    Args:
        shape: its code.
        position_a, rotation_a, size_a: its place [m], body-to-world matrix and size.
        position_b, rotation_b: place of the terrain.
        margin: [m].
        scratch: (264, 8).
    """
    center, axes = in_frame(position_a, rotation_a, position_b, rotation_b)
    half = size_a
    radius = 0.0
    if shape == SPHERE:
        half = vec3.ZERO
        radius = size_a[0]
    elif shape == CAPSULE:
        half = (0.0, 0.0, size_a[1])
        radius = size_a[0]
    put_core(center, axes, half, radius, margin, scratch)
    scratch[AXES_ROW + 1, 5] = 1.0 if shape == BOX else 0.0
    num_corners = 0
    for corner in range(8):
        # Along an axis without extent there is one side only.
        if (half[0] > 0.0 or corner & 1 == 0) and (half[1] > 0.0 or corner & 2 == 0) and (half[2] > 0.0 or corner < 4):
            signs = (2.0 * (corner & 1) - 1.0, (corner & 2) - 1.0, 0.5 * (corner & 4) - 1.0)
            put_corner(scratch, num_corners, vec3.add(center, mat3.apply(axes, vec3.multiply(signs, half))), corner)
            num_corners += 1
    return num_corners
