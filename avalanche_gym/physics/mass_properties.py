"""Volume, centre of mass and inertia of solids of uniform density, and the principal frame of an inertia.

Everything here is per unit density: multiply the volume and the inertia by the density [kg/m^3] for kilograms.

Closed meshes. Each face (a, b, c), counter-clockwise seen from outside, spans a tetrahedron with a reference point;
its signed volume is det[a b c] / 6. Over the tetrahedron (0, a, b, c) the integrals of 1, x and x x^T are polynomials
in the corners, so their signed sum over the faces is exact (Mirtich 1996, "Fast and accurate computation of polyhedral
mass properties"; Eberly 2002, "Polyhedral mass properties (revisited)"):

    D = det[a b c],    s = a + b + c,
    V = D / 6,    int x = D / 24 s,    int x x^T = D / 120 (a a^T + b b^T + c c^T + s s^T).

With C = int x x^T about the centre the inertia is trace(C) 1 - C.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .given import LARGEST_MASS, SMALLEST_MASS, real_array, real_number

FloatArray = NDArray[np.float64]

# Products of inertia below this share of the trace are round-off of the integration: the axes are kept as given, and
# the inertia is wrong by at most this share.
DIAGONAL_TOLERANCE = 1e-13

# By this share of the trace a given inertia may miss symmetry or the triangle inequality: room for round-off only.
INERTIA_TOLERANCE = 1e-9


@dataclass(frozen=True, eq=False)
class MassProperties:
    """Of a solid of density 1."""

    volume: float  # [m^3]
    center: FloatArray  # (3,) [m] centre of mass, frame of the shape
    inertia: FloatArray  # (3, 3) [m^5] about the centre of mass, axes of the shape, per unit density

    def moved(self, position: ArrayLike, orientation: ArrayLike) -> MassProperties:
        """The same solid at ``position`` (3,) [m], turned by the unit quaternion ``orientation`` (4,) wxyz."""
        rotation = rotation_matrix(orientation)
        center = np.asarray(position, dtype=np.float64) + rotation @ self.center
        return MassProperties(self.volume, center, rotation @ self.inertia @ rotation.T)


def rotation_matrix(quaternion: ArrayLike) -> FloatArray:
    """The (3, 3) matrix of a unit quaternion wxyz; exactly the identity for (1, 0, 0, 0)."""
    w, x, y, z = (float(value) for value in np.asarray(quaternion, dtype=np.float64))
    return np.array(
        [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
            [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
            [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
        ]
    )


def _centred(volume: float, moments: tuple[float, float, float]) -> MassProperties:
    return MassProperties(volume, np.zeros(3), np.diag(moments))


def of_sphere(radius: float) -> MassProperties:
    """Ball of this radius [m]: I = 2/5 V r^2."""
    volume = 4.0 / 3.0 * math.pi * radius**3
    moment = 0.4 * volume * radius**2
    return _centred(volume, (moment, moment, moment))


def of_box(half_extents: Iterable[float]) -> MassProperties:
    """Box with these half extents [m]: Ixx = V (hy^2 + hz^2) / 3."""
    x, y, z = half_extents
    volume = 8.0 * x * y * z
    return _centred(volume, tuple(volume / 3.0 * s for s in (y * y + z * z, x * x + z * z, x * x + y * y)))  # type: ignore[arg-type]


def of_cylinder(radius: float, half_length: float) -> MassProperties:
    """Cylinder along z: Izz = V r^2 / 2, Ixx = V (r^2 / 4 + h^2 / 3), h the half length [m]."""
    volume = 2.0 * math.pi * radius**2 * half_length
    across = volume * (radius**2 / 4.0 + half_length**2 / 3.0)
    return _centred(volume, (across, across, 0.5 * volume * radius**2))


def of_capsule(radius: float, half_length: float) -> MassProperties:
    """Capsule along z, caps beyond ``half_length`` [m].

    A half ball has 2/5 m r^2 about the centre of its ball and its centre of mass 3/8 r above it, so two caps at
    distance h from the middle have Ixx = V_caps (2/5 r^2 + 3/4 r h + h^2).
    """
    tube = of_cylinder(radius, half_length)
    ball = of_sphere(radius)
    across = tube.inertia[0, 0] + ball.volume * (0.4 * radius**2 + 0.75 * radius * half_length + half_length**2)
    return _centred(tube.volume + ball.volume, (across, across, tube.inertia[2, 2] + ball.inertia[2, 2]))


def of_mesh(vertices: FloatArray, faces: NDArray[np.int64]) -> MassProperties:
    """Solid inside a closed mesh, by signed tetrahedra (see above).

    Args:
        vertices: (n, 3) [m].
        faces: (m, 3) indices, counter-clockwise seen from outside. The caller vouches that the mesh is closed.

    Raises:
        ValueError: the enclosed volume is not positive.
    """
    reference = vertices.mean(axis=0)  # near the solid, so that little cancels in the sums
    a, b, c = (vertices[faces[:, corner]] - reference for corner in range(3))
    determinant = np.einsum("ij,ij->i", a, np.cross(b, c))
    volume = float(determinant.sum()) / 6.0
    if not volume > 0.0:
        raise ValueError(
            f"TriangleMesh encloses a volume of {volume:.6g} m^3; a solid needs a positive one, with faces "
            "counter-clockwise seen from outside. Reverse the faces (faces[:, ::-1]) or repair the mesh."
        )
    total = a + b + c
    offset = (determinant @ total) / (24.0 * volume)
    second = sum((corner * determinant[:, None]).T @ corner for corner in (a, b, c, total)) / 120.0
    second = second - volume * np.outer(offset, offset)
    second = 0.5 * (second + second.T)
    return MassProperties(volume, reference + offset, np.trace(second) * np.eye(3) - second)


def combined(parts: Iterable[MassProperties]) -> MassProperties:
    """All parts as one solid, by the parallel axis theorem; where parts overlap the volume counts twice."""
    listed = list(parts)
    volume = sum(part.volume for part in listed)
    center = sum((part.volume * part.center for part in listed), np.zeros(3)) / volume
    inertia = np.zeros((3, 3))
    for part in listed:
        arm = part.center - center
        inertia += part.inertia + part.volume * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    return MassProperties(volume, center, inertia)


def principal_frame(inertia: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Principal moments and axes of a symmetric inertia.

    Args:
        inertia: (3, 3), any unit, axes of the user's frame.

    Returns:
        moments (3,), in the unit of ``inertia``, and the quaternion (4,) wxyz that takes coordinates of the user's
        frame to the principal frame. A diagonal inertia keeps its axes and their order: the quaternion is then exactly
        (1, 0, 0, 0). Otherwise the axes are numbered and directed so that the turn is small, right-handed, w >= 0.
    """
    matrix = np.asarray(inertia, dtype=np.float64)
    matrix = 0.5 * (matrix + matrix.T)
    products = np.abs(matrix[[0, 0, 1], [1, 2, 2]])
    if products.max() <= DIAGONAL_TOLERANCE * np.trace(matrix):
        return np.diagonal(matrix).copy(), np.array([1.0, 0.0, 0.0, 0.0])
    moments, axes = np.linalg.eigh(matrix)
    order = max(itertools.permutations(range(3)), key=lambda p: sum(abs(axes[i, p[i]]) for i in range(3)))
    moments, axes = moments[list(order)], axes[:, list(order)]
    axes = axes * np.where(np.diagonal(axes) < 0.0, -1.0, 1.0)
    if np.linalg.det(axes) < 0.0:
        axes[:, np.argmin(np.diagonal(axes))] *= -1.0
    return moments, _quaternion(axes.T)


def _quaternion(rotation: FloatArray) -> FloatArray:
    """Unit quaternion (4,) wxyz, w >= 0, of a rotation matrix; Shepperd 1978: divides by the largest component."""
    m = rotation
    trace = np.trace(m)
    candidates = np.array([trace, m[0, 0], m[1, 1], m[2, 2]])
    largest = int(np.argmax(candidates))
    if largest == 0:
        q = np.array([1.0 + trace, m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]])
    else:
        i = largest - 1
        j, k = (i + 1) % 3, (i + 2) % 3
        q = np.empty(4)
        q[0] = m[k, j] - m[j, k]
        q[1 + i] = 1.0 + m[i, i] - m[j, j] - m[k, k]
        q[1 + j] = m[j, i] + m[i, j]
        q[1 + k] = m[k, i] + m[i, k]
    q /= np.linalg.norm(q)
    return -q if q[0] < 0.0 else q


def check_mass(name: str, mass: object) -> float:
    """``mass`` [kg], or a density, as a float.

    Args:
        name: what the value is, for the text of an error: "Body 'ball': mass".
        mass: the value given.

    Raises:
        ValueError: not a finite positive number.
    """
    value = real_number(mass)
    if value is None:
        raise ValueError(f"{name}={mass!r} is not a number; give a finite number above zero.")
    if not (math.isfinite(value) and value > 0.0):
        raise ValueError(
            f"{name}={mass!r}; allowed is a finite number above zero. "
            'For a body that does not move leave it out and give motion="static".'
        )
    return value


def check_inertia(name: str, inertia: ArrayLike) -> FloatArray:
    """A given inertia as a symmetric (3, 3) matrix [kg m^2].

    Args:
        name: what the value is, for the text of an error: "Body 'ball': inertia".
        inertia: (3,) moments about the body axes, or (3, 3), about the centre of mass.

    Raises:
        ValueError: wrong form, not finite, not symmetric, not positive, or no body can have it because a moment is
            larger than the sum of the other two. Equality, a flat disc, is allowed.
    """
    remedy = "Give (Ixx, Iyy, Izz) or a symmetric 3 x 3 matrix about the centre of mass in kg m^2, or leave it out."
    try:
        matrix = np.array(real_array(inertia))
    except (TypeError, ValueError):
        raise ValueError(f"{name}={inertia!r} is not numeric. {remedy}") from None
    if matrix.shape == (3,):
        matrix = np.diag(matrix)
    if matrix.shape != (3, 3):
        raise ValueError(f"{name} has shape {matrix.shape}; allowed are (3,) and (3, 3). {remedy}")
    if not np.isfinite(matrix).all():
        raise ValueError(f"{name}={inertia!r} holds values that are not finite. {remedy}")
    if np.abs(matrix).max() > LARGEST_MASS:
        raise ValueError(f"{name}={inertia!r}; allowed are moments up to {LARGEST_MASS:g} kg m^2. {remedy}")
    scale = abs(np.trace(matrix))
    if np.abs(matrix - matrix.T).max() > INERTIA_TOLERANCE * scale:
        raise ValueError(f"{name}={inertia!r} is not symmetric. {remedy}")
    matrix = 0.5 * (matrix + matrix.T)
    moments = np.linalg.eigvalsh(matrix)
    if not moments[0] > 0.0:
        raise ValueError(f"{name} has principal moments {moments.tolist()}; all must be positive. {remedy}")
    if moments[0] + moments[1] < moments[2] - INERTIA_TOLERANCE * scale:
        raise ValueError(
            f"{name} has principal moments {moments.tolist()}; no body has a moment larger than the sum of the other "
            f"two. {remedy}"
        )
    return matrix


def check_range(label: str, mass: float, moments: Iterable[float]) -> None:
    """Refuse a mass [kg] or principal moments [kg m^2] with which floats cannot reckon.

    Raises:
        ValueError: one is outside 1e-300 to 1e300, or no number; the text begins with ``label``.
    """
    listed = list(moments)
    if not all(SMALLEST_MASS <= value <= LARGEST_MASS for value in (mass, *listed)):
        raise ValueError(
            f"{label} has a mass of {mass:g} kg and moments of inertia {[float(f'{m:.6g}') for m in listed]} kg m^2; "
            f"allowed is {SMALLEST_MASS:g} to {LARGEST_MASS:g} for each. Give the shape a size in m, and the mass or "
            "density a value, that are not so extreme."
        )
