"""World: the object over the kernels. It checks what comes in, and hands it to the tables and kernels.

Here is its life: how it is built, steps, takes in and gives up bodies, goes back to a state. What acts on its bodies
is in actions.py, what it tells of them in readings.py.
"""

from __future__ import annotations

import copy
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import frames
from .actions import Actions
from .contacts.sleeping import wake
from .features import describe_features
from .given import whole_number
from .options import Options
from .queries import Prober
from .report import Features
from .scene import Body, Scene
from .selection import WorldIndex, select_body, select_worlds
from .stepping import Stepper
from .tables import height_samples, membership, rebuild
from .tables.construction import build_tables
from .tables.storage import Storage

MOST_STEPS = 2**63 - 1  # of one call: what the kernel counts with
PUBLIC_ARRAYS = ("position", "orientation", "linear_velocity", "angular_velocity")


@dataclass(frozen=True, eq=False)
class Snapshot:
    """Every bit that decides the future of one World; made by ``World.snapshot``."""

    owner: World
    bodies: list[Body | None]
    arrays: dict[str, NDArray[Any]]

    def __deepcopy__(self, memo: dict[int, Any]) -> Snapshot:
        """Of the copy of its World, with the bodies that this shares with it."""
        return Snapshot(copy.deepcopy(self.owner, memo), list(self.bodies), self.arrays)


class World(Actions):
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
        count = whole_number(num_worlds)
        if count is None or count < 1:
            raise ValueError(f"World(num_worlds={num_worlds!r}): give a whole number of at least 1.")
        if options is not None and not isinstance(options, Options):
            raise TypeError(f"World(options={options!r}): give Options(...), or None for the default.")
        self.options = options or Options()
        self._build(scene.copy(), count)

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
        if type(num_steps) is not int or not 1 <= num_steps <= MOST_STEPS:
            count = whole_number(num_steps)
            if count is None or not 1 <= count <= MOST_STEPS:
                raise ValueError(
                    f"step(num_steps={num_steps!r}): give a whole number of at least 1 and at most {MOST_STEPS}."
                )
            num_steps = count
        self._stepper.run(num_steps, self.scene.bodies)

    # --- Bodies that come and go --------------------------------------------------------------------------------------

    def add_body(self, *args: Any, **kwargs: Any) -> int:
        """Add a body while running; arguments and errors as in Scene.add_body. Needs ``num_worlds=1``.

        Other handles stay valid; the state arrays may be new objects, one longer, unless a removed slot was free.
        """
        self._single("add_body")
        if kwargs.get("alternatives"):
            raise ValueError("World.add_body(alternatives=...): give alternatives to Scene.add_body, before the World.")
        handle = self.scene.add_body(*args, **kwargs)
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
        self._build(scene, 1)
        wake(old.address, membership.EVERY_WORLD, -1)
        kept = [index for index in range(old.num_bodies) if index != changed]
        for name in ("states", "impulses", *PUBLIC_ARRAYS):
            self._storage.arrays[name][:, kept] = old.arrays[name][:, kept]
        self._storage.arrays["reports"][:] = old.arrays["reports"]
        rebuild.carry_parameters(old, self._storage, kept)
        rebuild.carry_memories(old, self._storage, kept)
        rebuild.carry_contacts(old, self._storage, changed)
        rebuild.carry_heights(old, self._storage, kept)
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
        height_samples.reset_heights(self._storage, mask, self._storage.initial["heights"])

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
        self._load(snapshot.arrays)

    def _load(self, saved: dict[str, NDArray[Any]]) -> None:
        """Take over what ``Storage.save`` returned, of tables with the same bodies."""
        # Colliders have other numbers when tables were built anew since. Where bodies can't come or go they never are.
        lasting = self.num_worlds > 1 or bool(self._tables.choices)
        self._storage.load(saved if lasting else rebuild.renumbered(saved, self._storage))

    # --- Copies -------------------------------------------------------------------------------------------------------

    # Tables hold addresses of each other: a copy, entry by entry, would step the tables of the world it was made from.

    def __copy__(self) -> World:
        """A world of its own in the same state; the bodies' shapes and materials, which never change, are shared."""
        return _in_state(self.scene, self.num_worlds, self.options, self._storage.save(), self._reports())

    def __deepcopy__(self, memo: dict[int, Any]) -> World:
        """The same: a material that the user holds means the same in both worlds."""
        return self.__copy__()

    def __reduce__(self) -> tuple[Any, ...]:
        """For pickle."""
        return _in_state, (self.scene, self.num_worlds, self.options, self._storage.save(), self._reports())

    def _reports(self) -> NDArray[Any]:
        return self._storage.arrays["reports"].copy()


def _in_state(
    scene: Scene, num_worlds: int, options: Options, saved: dict[str, NDArray[Any]], reports: NDArray[Any]
) -> World:
    """A World in the state that ``Storage.save`` returned of another one."""
    world = World(scene, num_worlds, options)
    world._load(saved)
    world._storage.arrays["reports"][:] = reports
    return world


def _read_only(array: NDArray[np.float64]) -> NDArray[np.float64]:
    view = array.view()
    view.flags.writeable = False
    return view
