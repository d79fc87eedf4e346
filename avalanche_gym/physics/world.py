"""World: the object over the kernels. It checks what comes in, owns the memory, and turns a status into an exception."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import frames, parameters
from .construction import build_tables
from .diagnostics import measure
from .errors import PhysicsError
from .features import describe_features
from .model import CONTACTS_FULL, DYNAMIC, NON_FINITE, PAIRS_FULL, SOLVER_FULL, STATIC
from .options import Options
from .pipeline import advance
from .report import METHODS, Features, StepReport
from .scene import Body, Scene
from .selection import select_body, select_worlds, spread
from .shapes import HeightField, checks
from .storage import STATE_TABLES, Storage

WorldIndex = int | slice | NDArray[np.bool_] | None

CONTACT_FIELDS = ("body_a", "body_b", "position", "normal", "gap", "impulse")
CONTACT_DTYPE = np.dtype(
    [
        ("body_a", np.int64),
        ("body_b", np.int64),
        ("position", np.float64, 3),  # [m] world frame
        ("normal", np.float64, 3),  # unit, from a to b
        ("gap", np.float64),  # [m] at the end of the step, positive apart
        ("impulse", np.float64, 3),  # [N s] on body_b, summed over the last step
    ]
)


class Snapshot:
    """Every bit that decides the future of one World; made by ``World.snapshot``."""

    def __init__(self, owner: World, bodies: list[Body | None], arrays: dict[str, NDArray[Any]]) -> None:
        self.owner = owner
        self.bodies = bodies
        self.arrays = arrays


class World:
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
        impulse_buffer: (worlds, bodies, 6) writable: impulse [N s] at the centre of mass and angular impulse [N m s], world
            frame, unchecked; the next ``step`` applies it to dynamic bodies and zeroes it.

    The first four are read-only and always current; copy what is to be kept. A removed body reads NaN.
    """

    def __init__(self, scene: Scene, num_worlds: int = 1, options: Options | None = None) -> None:
        if not isinstance(scene, Scene):
            raise TypeError(f"World(scene={scene!r}): give a Scene.")
        if isinstance(num_worlds, bool) or not isinstance(num_worlds, (int, np.integer)) or num_worlds < 1:
            raise ValueError(f"World(num_worlds={num_worlds!r}): give a whole number of at least 1.")
        if options is not None and not isinstance(options, Options):
            raise TypeError(f"World(options={options!r}): give Options(...), or None for the default.")
        self.scene = scene.copy()
        self.options = options or Options()
        self._build(int(num_worlds))
        self._adopt_initial()

    # --- Building ------------------------------------------------------------------------------------------------------

    def _build(self, num_worlds: int) -> None:
        """Tables of the scene as it is now, all bodies at their initial state."""
        tables = build_tables(self.scene)
        self._height_field_rows = tables.height_fields
        self._storage = Storage(tables, num_worlds, self.options)
        self._initial = {name: array.copy() for name, array in self._storage.arrays.items() if name in STATE_TABLES}
        self._refresh()

    def _adopt_initial(self) -> None:
        frames.adopt(self._storage.address, self._everywhere, -1)
        self._initial["states"] = self._storage.arrays["states"].copy()

    def _refresh(self) -> None:
        """Views and addresses after tables were replaced."""
        arrays = self._storage.arrays
        self._address = self._storage.address
        self._workspace_addresses = [int(workspace.ctypes.data) for workspace in self._storage.workspaces]
        self._everywhere = np.ones(self._storage.num_worlds, np.bool_)
        self._remaining = arrays["remaining"]
        self.impulse_buffer: NDArray[np.float64] = arrays["impulses"]
        self.position = _read_only(arrays["position"])
        self.orientation = _read_only(arrays["orientation"])
        self.linear_velocity = _read_only(arrays["linear_velocity"])
        self.angular_velocity = _read_only(arrays["angular_velocity"])

    @property
    def num_worlds(self) -> int:
        return self._storage.num_worlds

    @property
    def num_bodies(self) -> int:
        """Handles in use or free: the length of axis 1 of every state array."""
        return self._storage.num_bodies

    @property
    def features(self) -> Features:
        """What this scene made the engine model, and what it left out."""
        return describe_features(self.scene, self._storage)

    # --- Stepping ------------------------------------------------------------------------------------------------------

    def step(self, num_steps: int = 1) -> None:
        """Advance every world by ``num_steps`` of ``options.time_step``.

        Raises:
            PhysicsError: a state became non-finite. The other worlds finish; the bad ones stand at their last good step.
            RuntimeError: a world has more contacts than ``Options.max_contacts``; it stands at its last completed step.
        """
        if num_steps < 1:
            raise ValueError(f"step(num_steps={num_steps!r}): give a whole number of at least 1.")
        self._remaining[:] = num_steps
        if self._advance(1):
            self._finish(int(num_steps))

    def _advance(self, begin: int) -> int:
        """Run the kernel over all worlds; return how many stopped early."""
        addresses = self._workspace_addresses
        if len(addresses) == 1:
            return int(advance(self._address, addresses[0], 0, self._storage.num_worlds, begin))
        bounds = np.linspace(0, self.num_worlds, len(addresses) + 1).astype(int).tolist()
        with ThreadPoolExecutor(len(addresses)) as pool:
            parts = [
                pool.submit(advance, self._address, address, first, last, begin)
                for address, first, last in zip(addresses, bounds[:-1], bounds[1:], strict=True)
            ]
            return sum(part.result() for part in parts)

    def _finish(self, num_steps: int) -> None:
        """Grow what was full and go on until every world has finished or failed."""
        failures: list[tuple[int, str, int, str]] = []
        crowded: dict[int, int] = {}
        while True:
            reports = self._storage.arrays["reports"]
            for world in np.flatnonzero(reports["status"]):
                report = reports[world]
                if report["status"] == NON_FINITE:
                    body = self.scene.bodies[report["body"]]
                    name = repr(body.name) if body else str(report["body"])
                    failures.append((int(world), name, int(report["steps"]), "its state is not finite"))
                    self._remaining[world] = 0
            needed = [int(workspace[0]["needed"]) for workspace in self._storage.workspaces]
            status = reports["status"]
            if (status == PAIRS_FULL).any():
                for number in range(len(needed)):
                    self._storage.size_workspace(number, pairs=2 * max(needed), blocks=0, integers=0)
            if (status == SOLVER_FULL).any():
                self._storage.grow_solver()
            if (status == CONTACTS_FULL).any():
                if self.options.max_contacts is None:
                    self._storage.grow_contacts(max(needed))
                else:
                    for world in np.flatnonzero(status == CONTACTS_FULL):
                        crowded[int(world)] = max(needed)
                        self._remaining[world] = 0
            self._refresh()
            if not self._remaining.any():
                break
            self._advance(0)
            if not self._storage.arrays["reports"]["status"].any():
                break
        if crowded:
            world, count = next(iter(crowded.items()))
            raise RuntimeError(
                f"World {world}: {count} contacts exceed Options(max_contacts={self.options.max_contacts}); raise it, or "
                "leave None to let it grow. This world stands at its last completed step."
            )
        if failures:
            raise PhysicsError(failures)

    # --- Acting on bodies ----------------------------------------------------------------------------------------------

    def apply_impulse(
        self, body: int, impulse: ArrayLike, point: ArrayLike | None = None, world: WorldIndex = None
    ) -> None:
        """Change the velocity of a dynamic body at once.

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
        """Place a body and set its velocities; what is ``None`` stays. Arrays as in the attributes, or one value for all.

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
        if self._storage.arrays["bodies"]["motion"][0, index] == STATIC:
            for name in ("linear_velocity", "angular_velocity"):
                if name in given and given[name][mask].any():
                    raise ValueError(
                        f"set_state({name}) on the static body {self.scene.bodies[index].name!r}, which has no velocity; "  # type: ignore[union-attr]
                        "give it motion='kinematic' to move it."
                    )
        for name, values in given.items():
            self._storage.arrays[name][mask, index] = values[mask]
        frames.adopt(self._address, mask, index)

    def set_parameters(self, body: int, *, world: WorldIndex = None, **values: ArrayLike) -> None:
        """Change parameters of a body in some worlds, without a rebuild: domain randomisation.

        Args:
            body: handle.
            world: as in apply_impulse.
            values: any of ``mass`` [kg] (the inertia follows in proportion), ``inertia`` (3,) [kg m^2] about the body axes,
                ``friction``, ``restitution``, ``rolling_friction`` [m], ``torsional_friction`` [m]; one number for all
                selected worlds or one each. Pairs fixed by ``Scene.set_pair`` keep their values.
        """
        index = select_body(self, "set_parameters", body)
        mask = select_worlds(self, "set_parameters", world)
        parameters.set_parameters(self._storage.arrays["bodies"], self.scene.bodies[index], index, mask, values)
        self._storage.link()

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
            heights: (rows, columns) or (selected worlds, rows, columns) [m]; ``None`` keeps them.
            height_rates: the same [m/s]; heights advance by them, and contacts feel them as the velocity of the ground,
                until set again. ``None`` means at rest.
            world: as in apply_impulse. Choosing some of the worlds gives each its own copy.
        """
        index = select_body(self, "set_heights", body)
        mask = select_worlds(self, "set_heights", world)
        description = self.scene.bodies[index]
        if description is None or not isinstance(description.shape, HeightField):
            raise ValueError(f"set_heights: body {index} is no HeightField; give the handle of one.")
        if height_rates is not None and description.motion != "kinematic":
            raise ValueError(
                f"set_heights(height_rates): {description.name!r} is {description.motion}; moving ground needs "
                'motion="kinematic".'
            )
        parameters.set_heights(
            self._storage, self._height_field_rows[index], mask, heights, height_rates, world is None
        )
        self._refresh()

    # --- Bodies that come and go ---------------------------------------------------------------------------------------

    def add_body(self, *args: Any, **kwargs: Any) -> int:
        """Add a body while running; arguments and errors as in Scene.add_body. Needs ``num_worlds=1``.

        Other handles stay valid; the state arrays may be new objects, one longer, unless a removed slot was free.
        """
        self._single("add_body")
        handle = self.scene.add_body(*args, **kwargs)
        self._rebuild(new=handle)
        return handle

    def remove_body(self, body: int) -> None:
        """Take a body out; its slot reads NaN until ``add_body`` uses it again. Needs ``num_worlds=1``."""
        self._single("remove_body")
        index = select_body(self, "remove_body", body)
        self.scene.bodies[index] = None
        self._rebuild(new=index)

    def _single(self, call: str) -> None:
        if self.num_worlds != 1:
            raise ValueError(
                f"{call} in a world of num_worlds={self.num_worlds}; it is allowed with num_worlds=1. Add every body to the "
                "scene first, and place what is not needed yet far away."
            )

    def _rebuild(self, new: int) -> None:
        """New tables for the changed scene; every body but ``new`` keeps its state, and its contacts."""
        old = self._storage
        kept = [index for index in range(min(old.num_bodies, len(self.scene.bodies))) if index != new]
        self._build(1)
        self._adopt_initial()
        arrays = self._storage.arrays
        for name in ("bodies", "states", "position", "orientation", "linear_velocity", "angular_velocity", "impulses"):
            if name != "bodies":
                arrays[name][:, kept] = old.arrays[name][:, kept]
        parameters.carry_parameters(old.arrays["bodies"], arrays["bodies"], kept)
        parameters.carry_contacts(old, self._storage, new)
        parameters.carry_heights(old, self._storage, kept)
        self._refresh()

    # --- State as a whole ----------------------------------------------------------------------------------------------

    def reset(self, world: WorldIndex = None) -> None:
        """Put the selected worlds back to the initial state of the scene; parameters set since then stay."""
        mask = select_worlds(self, "reset", world)
        arrays = self._storage.arrays
        for name in ("states", "position", "orientation", "linear_velocity", "angular_velocity"):
            arrays[name][mask] = self._initial[name][mask]
        arrays["impulses"][mask] = 0.0
        arrays["num_contacts"][mask] = 0
        if arrays["heights"].shape[0] == self.num_worlds:
            arrays["heights"][mask] = self._initial["heights"][0]
            arrays["height_rates"][mask] = 0.0
        else:
            arrays["heights"][:] = self._initial["heights"]
            arrays["height_rates"][:] = 0.0

    def snapshot(self) -> Snapshot:
        """Every bit that decides the future, warm starts and parameters included; restore it any number of times."""
        arrays = {name: self._storage.arrays[name].copy() for name in STATE_TABLES}
        return Snapshot(self, list(self.scene.bodies), arrays)

    def restore(self, snapshot: Snapshot) -> None:
        """Back to a snapshot of this world."""
        if not isinstance(snapshot, Snapshot):
            raise TypeError(f"restore({snapshot!r}): give what World.snapshot returned.")
        if snapshot.owner is not self:
            raise ValueError("restore: this snapshot was made by another World; restore it there.")
        if snapshot.bodies != self.scene.bodies:
            self.scene.bodies = list(snapshot.bodies)
            self._build(self.num_worlds)
            self._adopt_initial()
        for name, array in snapshot.arrays.items():
            if self._storage.arrays[name].shape == array.shape:
                self._storage.arrays[name][...] = array
            else:
                self._storage.arrays[name] = array.copy()
        self._storage.fit_workspaces()
        self._refresh()

    # --- Reading -------------------------------------------------------------------------------------------------------

    def _measure(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        energies, momenta = np.empty((self.num_worlds, 2)), np.empty((self.num_worlds, 6))
        measure(self._address, energies, momenta)
        return energies, momenta

    def kinetic_energy(self) -> NDArray[np.float64]:
        """(worlds,) [J] of the dynamic bodies."""
        return self._measure()[0][:, 0]

    def potential_energy(self) -> NDArray[np.float64]:
        """(worlds,) [J]: the sum of -m g.x and -m mu/r over dynamic bodies."""
        return self._measure()[0][:, 1]

    def linear_momentum(self) -> NDArray[np.float64]:
        """(worlds, 3) [kg m/s] of the dynamic bodies."""
        return self._measure()[1][:, :3]

    def angular_momentum(self) -> NDArray[np.float64]:
        """(worlds, 3) [kg m^2/s] of the dynamic bodies about the world's origin."""
        return self._measure()[1][:, 3:]

    def contacts(self, world: int = 0) -> NDArray[Any]:
        """The contacts of the last step of one world, as records of CONTACT_DTYPE."""
        mask = select_worlds(self, "contacts", world)
        number = int(np.flatnonzero(mask)[0])
        rows = self._storage.arrays["contacts"][number, : self._storage.arrays["num_contacts"][number]]
        found = np.empty(len(rows), CONTACT_DTYPE)
        for name in CONTACT_FIELDS:
            found[name] = rows[name]
        return found

    def report(self) -> StepReport:
        """What the last call of ``step`` did; see StepReport."""
        rows = self._storage.arrays["reports"]
        return StepReport(
            residual=rows["residual"].copy(),
            iterations=rows["iterations"].copy(),
            tier=np.array(METHODS)[rows["method"]],
            events=rows["events"].copy(),
            event_limit=rows["event_limit"].copy(),
            penetration=rows["penetration"].copy(),
            energy_change=rows["energy_end"] - rows["energy_start"],
            contacts=rows["contacts"].copy(),
            steps=rows["steps"].copy(),
        )


def _read_only(array: NDArray[np.float64]) -> NDArray[np.float64]:
    view = array.view()
    view.flags.writeable = False
    return view


__all__ = ["CONTACT_DTYPE", "DYNAMIC", "Snapshot", "World"]
