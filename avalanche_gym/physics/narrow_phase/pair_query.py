"""One question to the narrow phase: two placed colliders, and where their contacts go.

The function of a pair of shapes is reached through its address (jit.stage), with the address of this record: a scene
compiles only the pairs it has.
"""

from __future__ import annotations

import numpy as np

from ..jit import kernel
from ..maths import mat3, vec3
from ..memory import table
from ..model import CONTACT

# Of eight floats: the scratch table of one pair, whatever its function writes there (polytope.py, terrain_shape.py).
SCRATCH_ROWS = 264

PAIR_QUERY = np.dtype(
    [
        ("shape_a", np.int64),
        ("shape_b", np.int64),
        ("data_a", np.int64),  # row in the table of the shape
        ("data_b", np.int64),
        ("position_a", np.float64, 3),  # [m] world frame
        ("rotation_a", np.float64, 9),  # collider frame -> world, row by row
        ("size_a", np.float64, 3),  # [m] as in model.COLLIDER
        ("position_b", np.float64, 3),
        ("rotation_b", np.float64, 9),
        ("size_b", np.float64, 3),
        ("margin", np.float64),  # [m] contacts farther apart are left out
        ("motion", np.float64),  # [m] bound of how far the bodies come closer by themselves
        ("pivot", np.float64, 3),  # [m] these three: how body b moves against body a by itself (path.py)
        ("shift", np.float64, 3),  # [m]
        ("turn", np.float64, 3),  # [rad]
        ("loose", np.float64),  # [m] what of the motion these do not say
        ("turned_a", np.float64),  # [rad] bound of how far body a turns
        ("turned_b", np.float64),
        ("sense", np.float64),  # 1.0 if shape a is that of body a, else -1.0
        ("world", np.int64),
        ("heights", np.int64),  # address of the pool of heights [m]; these three are of one world, at one instant
        ("height_velocities", np.int64),  # [m/s], this and the next only where heights move
        ("height_accelerations", np.int64),  # [m/s^2]
        ("header", np.int64),  # address
        ("contacts", np.int64),  # address of the list to append to
        ("capacity", np.int64),  # of that list
        ("scratch", np.int64),  # address of floats (scratch_rows, 8)
        ("scratch_rows", np.int64),
    ],
    align=True,
)


@kernel
def query_at(address):
    return table(address, 1, PAIR_QUERY)[0]


@kernel
def aim(query, address, world, workspace, contacts, capacity):
    """Let a query be about one world, and its answers go to the list at ``contacts``; ``address`` is of the header."""
    query.world = world
    query.header = address
    query.contacts = contacts
    query.capacity = capacity
    query.scratch = workspace.pair_scratch
    query.scratch_rows = workspace.pair_scratch_size // 8


@kernel
def move_by(query, pivot, shift, turn, loose, motion, turned_a, turned_b):
    """Say how body b moves against body a: path.py; ``motion`` [m] bounds all of it, ``turned`` [rad] their turns."""
    vec3.store(query.pivot, pivot)
    vec3.store(query.shift, shift)
    vec3.store(query.turn, turn)
    query.loose = loose
    query.motion = motion
    query.turned_a = turned_a
    query.turned_b = turned_b


@kernel
def move_anyhow(query, motion):
    """Say that the bodies move against each other by no more than ``motion`` [m]."""
    move_by(query, vec3.ZERO, vec3.ZERO, vec3.ZERO, motion, motion, 0.0, 0.0)


@kernel
def turned_of_second(query):
    """[rad] how far the second shape turns."""
    return query.turned_b if query.sense > 0.0 else query.turned_a


@kernel
def store_rotation(a, m):
    for index in range(9):
        a[index] = m[index]


@kernel
def first_of(query):
    """Position, rotation and size of the first collider."""
    return vec3.load(query.position_a), mat3.load(query.rotation_a), vec3.load(query.size_a)


@kernel
def second_of(query):
    """Position, rotation and size of the second collider."""
    return vec3.load(query.position_b), mat3.load(query.rotation_b), vec3.load(query.size_b)


@kernel
def contact_list(query):
    return table(query.contacts, query.capacity, CONTACT)


@kernel
def scratch_of(query):
    return table(query.scratch, (query.scratch_rows, 8), np.float64)
