"""On which side a sheet acts: the one on which the middle of the shape lies.

The plane of a face tells that only of what is over the face. Ground that rises towards the middle of a plate and falls
off before it has a plane that leads over the plate, and the plate would be pushed through. So the surface is followed
from the face to where it comes nearest to the middle: nothing of it is between the two, and the pseudo-normal there
tells the side (Baerentzen and Aanaes 2005). It is that of the face as well, for faces that are neighbours run alike.
Sheets that are not joined to the face, as one on the other side of the shape, have no part in it.

Where the surface ends first, at a rim, nothing but the plane of its last face is left.
"""

from __future__ import annotations

from ..jit import kernel
from ..maths import vec3
from .triangle import EDGE, VERTEX, closest_point

# What is nearer by less than this share of the square is no nearer: the way over the surface comes to an end.
NO_NEARER = 1e-12


@kernel
def corners_of(vertices, face):
    """The three corners of a face [m]."""
    return (
        vec3.load(vertices[face.vertices[0]].position),
        vec3.load(vertices[face.vertices[1]].position),
        vec3.load(vertices[face.vertices[2]].position),
    )


@kernel
def _comes_nearer(vertices, face, p, square):
    """Whether a face comes nearer to p than the root of ``square`` [m^2]."""
    a, b, c = corners_of(vertices, face)
    nearest, _ = closest_point(p, a, b, c)
    return vec3.norm_squared(vec3.sub(p, nearest)) < (1.0 - NO_NEARER) * square


@kernel
def _nearer_around(vertices, faces, index, corner, p, square):
    """A face around a corner of a face that comes nearer to p than the root of ``square`` [m^2]; -1 if there is none.

    Counter-clockwise; if that ends at a rim, clockwise from the first face too.
    """
    number = faces[index].vertices[corner]
    for turn in range(2):
        here = index
        k = corner
        while True:
            here = int(faces[here].neighbours[k if turn == 1 else (k + 2) % 3])
            if here < 0 or here == index:
                break
            if _comes_nearer(vertices, faces[here], p, square):
                return here
            k = 0
            while faces[here].vertices[k] != number:
                k += 1
        if here == index:
            break
    return -1


@kernel
def side_of(vertices, faces, index, two_sided, center):
    """-1.0 if a sheet's face acts against its normal, else 1.0; ``center`` [m]: the middle of the shape."""
    if not two_sided:
        return 1.0
    here = int(index)
    while True:
        face = faces[here]
        a, b, c = corners_of(vertices, face)
        nearest, lies_on = closest_point(center, a, b, c)
        off = vec3.sub(center, nearest)
        square = vec3.norm_squared(off)
        n = vec3.load(face.normal)
        following = -1
        if lies_on >= VERTEX:
            k = lies_on - VERTEX
            following = _nearer_around(vertices, faces, here, k, center, square)
            if vertices[face.vertices[k]].rim == 0:
                n = vec3.load(vertices[face.vertices[k]].normal)
        elif lies_on >= EDGE:
            across = int(face.neighbours[lies_on - EDGE])
            if across >= 0:
                if _comes_nearer(vertices, faces[across], center, square):
                    following = across
                n = vec3.add(n, vec3.load(faces[across].normal))
        if following < 0:
            return -1.0 if vec3.dot(n, off) < 0.0 else 1.0
        here = following
