"""World: the object over the kernels. It checks what comes in, and hands it to the tables and kernels."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import frames, membership, parameters
from .construction import build_tables
from .contacts.sleeping import wake
from .features import describe_features
from .options import Options
from .queries import Prober
from .readings import Readings
from .report import Features
from .scene import Body, Scene
from .selection import WorldIndex, select_body, select_worlds, spread
from .shapes import HeightField, checks
from .stepping import Stepper
from .storage import Storage

PUBLIC_ARRAYS = ("position", "orientation", "linear_velocity", "angular_velocity")


@dataclass(frozen=True, eq=False)
class Snapshot:
    """Every bit that decides the future of one World; made by ``World.snapshot``."""

    owner: World
    bodies: list[Body | None]
    arrays: dict[str, NDArray[Any]]


class World(Readings):
    """One or many copies of a scene, stepped together.

    Args:
        scene: what there is; copied, so later changes of it do not reach this world.
        num_worlds: copies that live side by side, each with its own state.
        options: see Options.

    Attributes:
        position: (worlds, bodies, 3) [m], world frame, of the origin of the frame the shape was given in.
        orientation: (worlds, bodies, 4) unit quaternions wxyz, body to world.
        linear_velocity: (worlds, bodies, 3) [m/s] of that origin.
        angular_velocity: (worlds, bodies, 3) [rad/s], world frame.
        impulse_buffer: (worlds, bodies, 6) writable: impulse [N s] at the centre of mass and angular impulse [N m s],
            world frame, unchecked; the next ``step`` applies it to dynamic bodies and zeroes it.

    The first four are read-only and always current; copy what is to be kept. A removed body reads NaN.
    """

    def __init__(self, scene: Scene, num_worlds: int = 1, options: Options | None = None) -> None:
        if not isinstance(scene, Scene):
            raise TypeError(f"World(scene={scene!r}): give a Scene.")
        if isinstance(num_worlds, bool) or not isinstance(num_worlds, (int, np.integer)) or num_worlds < 1:
            raise ValueError(f"World(num_worlds={num_worlds!r}): give a whole number of at least 1.")
        if options is not None and not isinstance(options, Options):
            raise TypeError(f"World(options={options!r}): give Options(...), or None for the default.")
        self.options = options or Options()
        self._build(scene.copy(), int(num_worlds))

    # --- Building -----------------------------------------------------------------------------------------------------

    def _build(self, scene: Scene, num_worlds: int) -> None:
        """Adopt a scene, all bodies at their initial state; a scene that cannot be built changes nothing."""
        tables = build_tables(scene)
        storage = Storage(tables, num_worlds, self.options)
        frames.adopt(storage.address, np.ones(num_worlds, np.bool_), -1)
        self.scene = scene
        for index, body in enumerate(scene.bodies):
            storage.arrays["rest"]["barred"][:, index] = body is not None and not body.allow_sleep
        storage.keep_initial()
        self._tables = tables
        self._storage = storage
        self._stepper = Stepper(storage)
        self._address = storage.address
        self._show()

    def _show(self) -> None:
        """Bring the public arrays up to date with the tables."""
        self._prober: Prober | None = None
        arrays = self._storage.arrays
        self.impulse_buffer: NDArray[np.float64] = arrays["impulses"]
        self.position, self.orientation, self.linear_velocity, self.angular_velocity = (
            _read_only(arrays[name]) for name in PUBLIC_ARRAYS
        )

    @property
    def features(self) -> Features:
        """What this scene made the engine model, and what it left out."""
        self._storage.note_features()
        return describe_features(self.scene, self._storage)

    # --- Stepping -----------------------------------------------------------------------------------------------------

    def step(self, num_steps: int = 1) -> None:
        """Advance every world by ``num_steps`` of ``options.time_step``.

        Raises:
            PhysicsError: a state became non-finite. The other worlds finish; these stand at their last good step.
            RuntimeError: a world has more contacts than ``Options.max_contacts``; it stands at its last completed step.
        """
        if type(num_steps) is not int or num_steps < 1:
            if isinstance(num_steps, bool) or not isinstance(num_steps, (int, np.integer)) or num_steps < 1:
                raise ValueError(f"step(num_steps={num_steps!r}): give a whole number of at least 1.")
            num_steps = int(num_steps)
        self._stepper.run(num_steps, self.scene.bodies)

    # --- Acting on bodies ---------------------------------------------------------------------------------------------

    def apply_impulse(
        self, body: int, impulse: ArrayLike, point: ArrayLike | None = None, world: WorldIndex = None
    ) -> None:
        """Change the velocity of a dynamic body at once.

        An impulse so large that the kinetic energy would not be finite waits for the next ``step``, which refuses it.

        Args:
            body: handle.
            impulse: (3,) or (selected worlds, 3) [N s], world frame.
            point: (3,) or (selected worlds, 3) [m], world frame, where it acts; the centre of mass by default.
            world: which worlds: an index, a slice, a boolean mask, or ``None`` for all.
        """
        self._push("apply_impulse", "impulse", body, impulse, point, world, False)

    def apply_force(
        self, body: int, force: ArrayLike, point: ArrayLike | None = None, world: WorldIndex = None
    ) -> None:
        """Hold a force [N] on a dynamic body through every step of the next ``step`` call; calls add up.

        The moment about the centre of mass is that of the present place of ``point``. Arguments as in apply_impulse.
        """
        self._push("apply_force", "force", body, force, point, world, True)

    def _push(
        self,
        call: str,
        what: str,
        body: int,
        value: ArrayLike,
        point: ArrayLike | None,
        world: WorldIndex,
        hold: bool,
    ) -> None:
        index = select_body(self, call, body, moving="dynamic")
        mask = select_worlds(self, call, world)
        values = spread(f"{call}({what})", value, mask, 3)
        self._wake(mask, index)
        points = np.full((self.num_worlds, 3), np.nan)
        if point is not None:
            points = spread(f"{call}(point)", point, mask, 3)
        frames.apply_impulses(self._address, mask, index, values, points, hold)

    def set_state(
        self,
        body: int,
        *,
        position: ArrayLike | None = None,
        orientation: ArrayLike | None = None,
        linear_velocity: ArrayLike | None = None,
        angular_velocity: ArrayLike | None = None,
        world: WorldIndex = None,
    ) -> None:
        """Place a body and set its velocities; what is ``None`` stays. One value for all selected worlds, or one each.

        A kinematic body keeps the velocities until they are set again; a static one can be placed but has no velocity.
        """
        index = select_body(self, "set_state", body)
        mask = select_worlds(self, "set_state", world)
        given: dict[str, NDArray[np.float64]] = {}
        for name, value, width in (
            ("position", position, 3),
            ("orientation", orientation, 4),
            ("linear_velocity", linear_velocity, 3),
            ("angular_velocity", angular_velocity, 3),
        ):
            if value is not None:
                given[name] = spread(f"set_state({name})", value, mask, width)
        if orientation is not None:
            for number in np.flatnonzero(mask):
                given["orientation"][number] = checks.unit_quaternion(
                    "set_state(orientation)", given["orientation"][number]
                )
        description = self.scene.bodies[index]
        if description is not None and description.motion == "static":
            for name in ("linear_velocity", "angular_velocity"):
                if name in given and given[name].any():
                    raise ValueError(
                        f"set_state({name}) on the static body {description.name!r}, which has no velocity; give it "
                        "motion='kinematic' to move it."
                    )
        self._wake(mask, index)
        for name, values in given.items():
            self._storage.arrays[name][mask, index] = values[mask]
        frames.adopt(self._address, mask, index)

    def set_parameters(self, body: int, *, world: WorldIndex = None, **values: ArrayLike) -> None:
        """Change parameters of a body in some worlds, without a rebuild: domain randomisation.

        Args:
            body: handle.
            world: as in apply_impulse.
            values: any of ``shape``, the number of one of the alternatives of the body (0: its own), which brings
                its mass and inertia along (the frame that shapes are given in stays where it is), ``mass`` [kg] (the
                inertia follows in proportion), ``inertia`` (3,) or (3, 3) [kg m^2] with the principal axes that the
                shape has, ``friction``, ``restitution``, ``rolling_friction`` [m], ``torsional_friction`` [m]; one for
                all selected worlds or one each. Pairs fixed by ``Scene.set_pair`` keep their values.
        """
        index = select_body(self, "set_parameters", body)
        mask = select_worlds(self, "set_parameters", world)
        self._wake(mask, index)
        choices = self._tables.choices.get(index)
        parameters.set_parameters(self._storage, choices, self.scene.bodies[index], index, mask, values)
        self._forget_places(mask)
        if "shape" in values:
            frames.adopt(self._address, mask, index)
            self._prober = None

    def set_heights(
        self,
        body: int,
        heights: ArrayLike | None = None,
        height_rates: ArrayLike | None = None,
        *,
        world: WorldIndex = None,
    ) -> None:
        """Replace the samples of a height field, and how fast they move.

        Args:
            body: handle of a static or kinematic height field.
            heights: (rows, columns) or (selected worlds, rows, columns) [m]; ``None`` keeps them. Where they lie in one
                plane, but for 1e-9 of the size of the field, they are put into it.
            height_rates: the same [m/s]; heights advance by them, and contacts feel them as the velocity of the ground,
                until set again. ``None`` means at rest.
            world: as in apply_impulse. Worlds share terrain that is the same in all and at rest; otherwise each gets
                its own copy.
        """
        index = select_body(self, "set_heights", body)
        mask = select_worlds(self, "set_heights", world)
        description = self.scene.bodies[index]
        assert description is not None
        if not isinstance(description.shape, HeightField):
            kind = type(description.shape).__name__
            raise ValueError(f"set_heights: body {description.name!r} is a {kind}; give the handle of a HeightField.")
        if height_rates is not None and description.motion != "kinematic":
            raise ValueError(
                f"set_heights(height_rates): {description.name!r} is {description.motion}; moving ground needs "
                'motion="kinematic".'
            )
        self._wake(mask, index)
        parameters.set_heights(self._storage, self._tables.shapes.height_field_rows[index], mask, heights, height_rates)
        self._forget_places(mask)

    # --- Sleep --------------------------------------------------------------------------------------------------------

    @property
    def sleeping(self) -> NDArray[np.bool_]:
        """(worlds, bodies) whether a body is asleep: in balance, and left alone until something disturbs it."""
        asleep: NDArray[np.bool_] = self._storage.arrays["rest"]["asleep"] > 0
        return asleep

    def wake(self, body: int | None = None, *, world: WorldIndex = None) -> None:
        """Wake a body and all that rests on it or bears it; everything if ``body`` is ``None``, or is not dynamic.

        Args:
            body: handle.
            world: as in apply_impulse.
        """
        index = -1 if body is None else select_body(self, "wake", body)
        self._wake(select_worlds(self, "wake", world), index)

    def _wake(self, mask: NDArray[np.bool_], index: int) -> None:
        if self._storage.arrays["num_asleep_contacts"].any() or self.sleeping.any():
            wake(self._address, mask, index)

    def _forget_places(self, mask: NDArray[np.bool_]) -> None:
        """What stands where it did may have other contacts, or impulses, now."""
        self._storage.arrays["rest"]["seen"][mask] = 0.0

    # --- Bodies that come and go --------------------------------------------------------------------------------------

    def add_body(self, *args: Any, **kwargs: Any) -> int:
        """Add a body while running; arguments and errors as in Scene.add_body. Needs ``num_worlds=1``.

        Other handles stay valid; the state arrays may be new objects, one longer, unless a removed slot was free.
        """
        self._single("add_body")
        if kwargs.get("alternatives"):
            raise ValueError("World.add_body(alternatives=...): give alternatives to Scene.add_body, before the World.")
        handle = self.scene.add_body(*args, **kwargs)
        self._wake(np.ones(1, np.bool_), -1)
        try:
            if membership.insert_body(self._storage, self._tables, self.scene, handle):
                self._show()
            else:
                self._rebuild(self.scene, handle)
        except ValueError:
            if handle == self.num_bodies:
                self.scene.bodies.pop()
            else:
                self.scene.bodies[handle] = None
            raise
        return handle

    def remove_body(self, body: int) -> None:
        """Take a body out; its slot reads NaN until ``add_body`` uses it again. Needs ``num_worlds=1``."""
        self._single("remove_body")
        index = select_body(self, "remove_body", body)
        description = self.scene.bodies[index]
        assert description is not None
        self.scene.bodies[index] = None
        self._wake(np.ones(1, np.bool_), -1)
        if membership.take_body(self._storage, index, description):
            self._prober = None
        else:
            self._rebuild(self.scene, index)

    def _single(self, call: str) -> None:
        if self.num_worlds != 1:
            raise ValueError(
                f"{call} in a world of num_worlds={self.num_worlds}; it needs num_worlds=1. Add every body to "
                "the scene first, and place what is not needed yet far away."
            )
        if self._tables.choices:
            raise ValueError(f"{call} in a world with alternatives (Scene.add_body), whose bodies stay; build another.")

    def _rebuild(self, scene: Scene, changed: int) -> None:
        """New tables for a scene in which one body is another; all other bodies keep their state and their contacts."""
        old = self._storage
        self._wake(np.ones(1, np.bool_), -1)
        self._build(scene, 1)
        kept = [index for index in range(old.num_bodies) if index != changed]
        for name in ("states", "impulses", *PUBLIC_ARRAYS):
            self._storage.arrays[name][:, kept] = old.arrays[name][:, kept]
        self._storage.arrays["reports"][:] = old.arrays["reports"]
        parameters.carry_parameters(old, self._storage, kept)
        parameters.carry_contacts(old, self._storage, changed)
        parameters.carry_heights(old, self._storage, kept)
        self._storage.link()

    # --- State as a whole ---------------------------------------------------------------------------------------------

    def reset(self, world: WorldIndex = None) -> None:
        """Put the selected worlds back to the initial state of the scene, heights included; parameters stay as set."""
        mask = select_worlds(self, "reset", world)
        arrays = self._storage.arrays
        for name in ("states", *PUBLIC_ARRAYS):
            arrays[name][mask] = self._storage.initial[name][mask]
        arrays["impulses"][mask] = 0.0
        arrays["num_contacts"][mask] = 0
        arrays["num_asleep_contacts"][mask] = 0
        for name in arrays["rest"].dtype.names or ():
            if name != "barred":
                arrays["rest"][name][mask] = 0
        for index in self._tables.choices:
            # Where its centre of mass is depends on the shape it now has.
            frames.adopt(self._address, mask, index)
        parameters.reset_heights(self._storage, mask, self._storage.initial["heights"])

    def snapshot(self) -> Snapshot:
        """Every bit that decides the future, warm starts and parameters included; restore it any number of times."""
        return Snapshot(self, list(self.scene.bodies), self._storage.save())

    def restore(self, snapshot: Snapshot) -> None:
        """Back to a snapshot of this world."""
        if not isinstance(snapshot, Snapshot):
            raise TypeError(f"restore({snapshot!r}): give what World.snapshot returned.")
        if snapshot.owner is not self:
            raise ValueError("restore: this snapshot was made by another World; restore it there.")
        if snapshot.bodies != self.scene.bodies:
            self._build(self.scene.with_bodies(snapshot.bodies), self.num_worlds)
            self._storage.load(parameters.renumbered(snapshot.arrays, self._storage))
        else:
            self._storage.load(snapshot.arrays)


def _read_only(array: NDArray[np.float64]) -> NDArray[np.float64]:
    view = array.view()
    view.flags.writeable = False
    return view
