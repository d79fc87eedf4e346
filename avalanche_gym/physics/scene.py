"""What a user describes: bodies, materials, force fields. A World turns it into tables."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .body_mass import mass_of
from .given import real_number
from .shapes import HeightField, Plane, Shape, TriangleMesh, checks

MOTIONS = ("dynamic", "kinematic", "static")


def checked_vector(name: str, value: ArrayLike) -> NDArray[np.float64]:
    """A finite vector (3,), or an error that names it."""
    return checks.finite_array(name, value, (3,), "three finite numbers")


@dataclass(frozen=True, eq=False)
class Material:
    """How a surface touches. Two materials are the same only if they are the same object.

    A pair takes the larger friction of the two, the product of the restitutions, and the larger of each moment arm,
    unless ``Scene.set_pair`` says otherwise.

    Args:
        friction: Coulomb coefficient, >= 0.
        restitution: ratio of separation to approach speed, 0 to 1.
        rolling_friction: [m] the rolling moment is at most this times the normal force.
        torsional_friction: [m] the same about the normal.
    """

    friction: float = 0.5
    restitution: float = 0.0
    rolling_friction: float = 0.0
    torsional_friction: float = 0.0

    def __post_init__(self) -> None:
        for name in ("friction", "restitution", "rolling_friction", "torsional_friction"):
            value = check_coefficient(f"Material({name}", name, getattr(self, name), ")")
            object.__setattr__(self, name, value)


def check_coefficient(prefix: str, name: str, value: Any, suffix: str = "") -> float:
    """Friction and its kin are finite and >= 0; restitution also <= 1."""
    upper = 1.0 if name == "restitution" else math.inf
    number = real_number(value)
    if number is None:
        raise ValueError(f"{prefix}={value!r}{suffix}: give a number.")
    if not (math.isfinite(number) and 0.0 <= number <= upper):
        allowed = "a number from 0 to 1" if upper == 1.0 else "a finite number of at least 0"
        raise ValueError(f"{prefix}={value!r}{suffix}: give {allowed}.")
    return number


DEFAULT_MATERIAL = Material()


@dataclass(frozen=True)
class UniformGravity:
    """The same acceleration [m/s^2] everywhere, world frame."""

    acceleration: Sequence[float]

    def __post_init__(self) -> None:
        vector = checked_vector("UniformGravity(acceleration)", self.acceleration)
        object.__setattr__(self, "acceleration", tuple(vector.tolist()))


@dataclass(frozen=True)
class PointGravity:
    """Acceleration mu / r^2 towards ``center`` [m], with ``mu`` [m^3/s^2]."""

    center: Sequence[float]
    mu: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "center", tuple(checked_vector("PointGravity(center)", self.center).tolist()))
        number = real_number(self.mu)
        if number is None or not math.isfinite(number):
            raise ValueError(f"PointGravity(mu={self.mu!r}): give a finite number [m^3/s^2]; negative pushes away.")
        object.__setattr__(self, "mu", number)


@dataclass(frozen=True, eq=False)
class Body:
    """One body of a scene, checked; see ``Scene.add_body``."""

    name: str
    shape: Shape
    motion: str
    material: Material
    mass: float  # [kg]; 0 unless dynamic
    center_of_mass: NDArray[np.float64]  # (3,) [m] in the shape's frame
    inertia: NDArray[np.float64]  # (3, 3) [kg m^2] about the centre of mass, body frame
    position: NDArray[np.float64]  # (3,) [m]
    orientation: NDArray[np.float64]  # (4,)
    linear_velocity: NDArray[np.float64]  # (3,) [m/s] of the origin of the shape's frame
    angular_velocity: NDArray[np.float64]  # (3,) [rad/s]
    visual: TriangleMesh | None = field(default=None)
    allow_sleep: bool = True
    alternatives: tuple[Body, ...] = ()  # the same body with each of the other shapes that it may have


class Scene:
    """Bodies, force fields and pair rules: everything that a World is built from.

    Example:
        >>> scene = Scene()
        >>> scene.add_field(UniformGravity((0, 0, -9.81)))
        >>> ball = scene.add_body(Sphere(0.1), mass=1.0, position=(0, 0, 1), name="ball")
    """

    def __init__(self) -> None:
        self.bodies: list[Body | None] = []
        self._handles: dict[str, int] = {}  # by name; may hold bodies that are gone
        self.fields: list[UniformGravity | PointGravity] = []
        self.pair_rules: dict[tuple[Material, Material], tuple[float | None, float | None]] = {}

    def copy(self) -> Scene:
        """A scene of its own with the same bodies, materials, fields and rules; so are ``copy`` and ``deepcopy``."""
        return self.with_bodies(self.bodies)

    # Bodies never change and rules go by the identity of materials: a copy, deep or not, shares both.

    def __copy__(self) -> Scene:
        return self.copy()

    def __deepcopy__(self, memo: dict[int, Any]) -> Scene:
        return self.copy()

    def with_bodies(self, bodies: Sequence[Body | None]) -> Scene:
        """A scene of its own with these bodies, and the fields and rules of this one."""
        other = Scene()
        other.bodies = list(bodies)
        other._handles = {body.name: handle for handle, body in enumerate(bodies) if body is not None}
        other.fields = list(self.fields)
        other.pair_rules = dict(self.pair_rules)
        return other

    def add_field(self, force_field: UniformGravity | PointGravity) -> None:
        """Add a force field; several add up."""
        if not isinstance(force_field, (UniformGravity, PointGravity)):
            raise TypeError(f"add_field({force_field!r}): give a UniformGravity or a PointGravity.")
        self.fields.append(force_field)

    def add_body(
        self,
        shape: Shape,
        *,
        motion: str = "dynamic",
        position: ArrayLike = (0.0, 0.0, 0.0),
        orientation: ArrayLike = (1.0, 0.0, 0.0, 0.0),
        material: Material = DEFAULT_MATERIAL,
        name: str | None = None,
        mass: float | None = None,
        density: float | None = None,
        inertia: ArrayLike | None = None,
        center_of_mass: ArrayLike | None = None,
        linear_velocity: ArrayLike = (0.0, 0.0, 0.0),
        angular_velocity: ArrayLike = (0.0, 0.0, 0.0),
        visual: TriangleMesh | None = None,
        allow_sleep: bool = True,
        alternatives: Sequence[Shape] = (),
    ) -> int:
        """Add a body and return its handle, the index on axis 1 of every state array.

        Args:
            shape: collider, in the frame that ``position`` and ``orientation`` place.
            motion: ``"dynamic"``, ``"kinematic"`` (moved by its velocities) or ``"static"``.
            position: (3,) [m], world frame.
            orientation: (4,) unit quaternion wxyz.
            material: surface; see Material.
            name: unique; ``body_<handle>`` by default.
            mass: [kg], from 1e-300 to 1e300, as the moments of inertia [kg m^2]; or
            density: [kg/m^3]; 1000 if neither is given.
            inertia: [kg m^2] (Ixx, Iyy, Izz) or (3, 3) about the centre of mass, body frame; the shape's by default.
            center_of_mass: (3,) [m] in the shape's frame; the shape's by default.
            linear_velocity: (3,) [m/s] of the origin of the shape's frame, world frame.
            angular_velocity: (3,) [rad/s], world frame.
            visual: mesh to draw instead of the collider.
            allow_sleep: ``False`` keeps the body, and what touches it, awake (Options.sleeping).
            alternatives: other shapes that single worlds may give the body (World.set_parameters); they take the mass
                or the density given here, and their own centre and inertia.

        Raises:
            ValueError, TypeError: the text names the body, what was given, what is allowed and what to do.
        """
        handle = self.bodies.index(None) if None in self.bodies else len(self.bodies)
        label = f"body_{handle}" if name is None else name
        if not isinstance(label, str) or not label:
            raise TypeError(f"add_body(name={name!r}): give a non-empty string, or None.")
        if self._has(label):
            raise ValueError(f"add_body(name={label!r}): a body of this scene has that name already; give another one.")
        if not isinstance(shape, Shape):
            raise TypeError(
                f"Body {label!r}: shape={shape!r} is no shape; give Sphere(...), Box(...) or another of physics.shapes."
            )
        if not isinstance(motion, str) or motion not in MOTIONS:
            raise ValueError(f"Body {label!r}: motion={motion!r}; give one of {', '.join(map(repr, MOTIONS))}.")
        if not isinstance(material, Material):
            raise TypeError(f"Body {label!r}: material={material!r}; give a Material(...).")
        others = _checked_alternatives(label, shape, alternatives, inertia, center_of_mass)
        if visual is not None and not isinstance(visual, TriangleMesh):
            raise TypeError(f"Body {label!r}: visual={visual!r}; give a TriangleMesh, or None to draw the collider.")
        given = {"linear_velocity": linear_velocity, "angular_velocity": angular_velocity}
        vectors = {key: checked_vector(f"Body {label!r}: {key}", value) for key, value in given.items()}
        if motion == "static" and any(vector.any() for vector in vectors.values()):
            raise ValueError(f"Body {label!r}: a static body has no velocity; use motion='kinematic'.")
        properties = mass_of(label, shape, motion, mass, density, inertia, center_of_mass)
        body = Body(
            name=label,
            shape=shape,
            motion=motion,
            material=material,
            mass=properties.volume,
            center_of_mass=properties.center,
            inertia=properties.inertia,
            position=checked_vector(f"Body {label!r}: position", position),
            orientation=checks.unit_quaternion(f"Body {label!r}: orientation", orientation),
            visual=visual,
            allow_sleep=checks.truth(f"Body {label!r}: allow_sleep", allow_sleep),
            linear_velocity=vectors["linear_velocity"],
            angular_velocity=vectors["angular_velocity"],
        )
        if others:
            body = replace(body, alternatives=tuple(_with_shape(body, other, mass, density) for other in others))
        self.bodies[handle : handle + 1] = [body]
        self._handles[label] = handle
        return handle

    def _has(self, name: str) -> bool:
        """Whether a body that is there has this name."""
        handle = self._handles.get(name, len(self.bodies))
        body = self.bodies[handle] if handle < len(self.bodies) else None
        return body is not None and body.name == name

    def set_pair(
        self, a: Material, b: Material, *, friction: float | None = None, restitution: float | None = None
    ) -> None:
        """Fix friction or restitution between two materials, whatever each says; ``None`` keeps the mixing rule.

        Order does not matter, ``a`` may be ``b``, and a later call for the same pair replaces the earlier one.
        """
        for name, material in (("a", a), ("b", b)):
            if not isinstance(material, Material):
                raise TypeError(f"set_pair({name}={material!r}): give a Material.")
        given = {"friction": friction, "restitution": restitution}
        rule = {
            name: None if value is None else check_coefficient(f"set_pair({name}", name, value, ")")
            for name, value in given.items()
        }
        self.pair_rules.pop((b, a), None)
        self.pair_rules[(a, b)] = (rule["friction"], rule["restitution"])


def _checked_alternatives(
    label: str, shape: Shape, alternatives: Sequence[Shape], inertia: ArrayLike | None, center: ArrayLike | None
) -> list[Shape]:
    if isinstance(alternatives, Shape):
        raise TypeError(f"Body {label!r}: alternatives={alternatives!r} is one shape; give a list of shapes.")
    if not np.iterable(alternatives):
        raise TypeError(f"Body {label!r}: alternatives={alternatives!r}; give a list of shapes, or leave it out.")
    others = list(alternatives)
    for other in others:
        if not isinstance(other, Shape):
            raise TypeError(
                f"Body {label!r}: alternatives holds {other!r}, which is no shape; give Sphere(...) and so on."
            )
    for other in (shape, *others) if others else ():
        if isinstance(other, (HeightField, Plane)):
            raise ValueError(
                f"Body {label!r}: a {type(other).__name__} among alternatives; terrain changes by World.set_heights."
            )
    for name, value in (("inertia", inertia), ("center_of_mass", center)):
        if others and value is not None:
            raise ValueError(f"Body {label!r}: {name} with alternatives, which have each their own; leave it out.")
    return others


def _with_shape(body: Body, shape: Shape, mass: float | None, density: float | None) -> Body:
    """The same body with another shape, made of the same material."""
    properties = mass_of(body.name, shape, body.motion, mass, density, None, None)
    return replace(
        body, shape=shape, mass=properties.volume, center_of_mass=properties.center, inertia=properties.inertia
    )
