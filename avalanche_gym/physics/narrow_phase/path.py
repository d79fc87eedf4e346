"""How the second shape of a pair moves against the first within the step, if nothing touches it.

A point of it that is at x is displaced by

    d(x) = shift + turn x (x - pivot),

to first order in the turn; what that leaves out, and what is not known, is the query's ``loose`` [m]. Impulses without
rebound take away the part of the motion that goes into the surface: a point that would fly by d ends in the ball about
d / 2 of radius |d| / 2 (Thales). So along the normal n of a surface it comes no closer than -n . d.
"""

from __future__ import annotations

from ..jit import kernel
from ..maths import mat3, vec3

# What is farther off than this many times the motion within a step, and a little (mesh_pieces.NEAR_MARGIN), is listed
# only where nothing is nearer. Larger: more triangles to look at; smaller: a part whipped into the surface dips.
NEAR_MOTIONS = 2.0

# (pivot, shift, turn) of what does not move.
STILL = (vec3.ZERO, vec3.ZERO, vec3.ZERO)


@kernel
def path_of(query):
    """(pivot [m], shift [m], turn [rad]) of the second shape against the first, world frame."""
    return (
        vec3.load(query.pivot),
        vec3.scale(query.sense, vec3.load(query.shift)),
        vec3.scale(query.sense, vec3.load(query.turn)),
    )


@kernel
def seen_from(path, sense, position, rotation):
    """The path in the frame at this place: displacement [m] of what is at its origin, and the turn [rad].

    ``sense``: 1.0 for the second shape against the first, -1.0 for the first against the second.
    """
    pivot, shift, turn = path
    origin = vec3.add(shift, vec3.cross(turn, vec3.sub(position, pivot)))
    return (
        vec3.scale(sense, mat3.apply_transposed(rotation, origin)),
        vec3.scale(sense, mat3.apply_transposed(rotation, turn)),
    )


@kernel
def displacement(seen, x):
    """[m] of what is at x."""
    return vec3.add(seen[0], vec3.cross(seen[1], x))
