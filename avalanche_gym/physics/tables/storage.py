"""Owns the memory of a world: every table, and the header that leads kernels to them."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..broad_phase.tables import CELL, GRID, PROXY
from ..layout import HEADER, HEIGHT_POOLS, MODEL_TABLES, WORLD_TABLES
from ..model import (
    CONTACT,
    CONTACTS_FULL,
    KINEMATIC,
    PAIRS_FULL,
    REMOVED,
    REPORT,
    REST,
    SOLVER_FULL,
    TRAITS,
)
from ..options import LARGEST_COUNT, Options
from ..stages import choose_broad_phase, choose_tiers, write_stages
from .construction import Tables
from .workspaces import Workspaces, table_sizes

FIRST_CONTACTS = 32  # capacity of a new world; it doubles when a step finds more

# Mass and inertia that belong together: from these a mass set later gets its inertia, whatever was set in between.
PROPORTION = np.dtype([("mass", np.float64), ("inertia", np.float64, 3)])  # (worlds, bodies) [kg], [kg m^2]

# Tables (worlds, bodies, ...) that keep room for bodies to come, and what a reset puts back of them.
BODY_TABLES = (
    *("bodies", "states", "proportions", "position", "orientation", "linear_velocity", "angular_velocity", "impulses"),
    "rest",
)
INITIAL_TABLES = ("states", "position", "orientation", "linear_velocity", "angular_velocity")

# What a snapshot must hold: every bit that decides the future.
STATE_TABLES = (
    "bodies",
    "proportions",
    "states",
    "contacts",
    "num_contacts",
    "rest",
    "asleep_contacts",
    "num_asleep_contacts",
    "position",
    "orientation",
    "linear_velocity",
    "angular_velocity",
    "impulses",
    *HEIGHT_POOLS,
)


class Storage:
    """Tables of ``num_worlds`` worlds that share one model."""

    def __init__(self, tables: Tables, num_worlds: int, options: Options) -> None:
        self.num_worlds = num_worlds
        self.options = options
        own = tables.arrays
        num_bodies = len(own["bodies"])
        self.arrays: dict[str, NDArray[Any]] = {name: np.ascontiguousarray(own[name]) for name in MODEL_TABLES}
        for name in ("bodies", "states"):
            self.arrays[name] = np.repeat(own[name][None], num_worlds, axis=0)
        self.arrays["proportions"] = np.zeros((num_worlds, num_bodies), PROPORTION)
        for name in PROPORTION.names or ():
            self.arrays["proportions"][name] = self.arrays["bodies"][name]
        for name, array in tables.public.items():
            self.arrays[name] = np.repeat(array[None], num_worlds, axis=0)
        for name in HEIGHT_POOLS:
            self.arrays[name] = np.zeros_like(own["heights"])[None]
        self.arrays["heights"][:] = own["heights"]
        self.arrays["impulses"] = np.zeros((num_worlds, num_bodies, 6))
        self.arrays["contacts"] = np.zeros((num_worlds, min(self.most_contacts, FIRST_CONTACTS)), CONTACT)
        self.arrays["num_contacts"] = np.zeros(num_worlds, np.int64)
        self.arrays["asleep_contacts"] = np.zeros_like(self.arrays["contacts"][:, : None if options.sleeping else 0])
        self.arrays["num_asleep_contacts"] = np.zeros(num_worlds, np.int64)
        self.arrays["rest"] = np.zeros((num_worlds, num_bodies), REST)
        self.arrays["traits"] = np.zeros(num_worlds, TRAITS)
        self.arrays["remaining"] = np.zeros(num_worlds, np.int64)
        self.arrays["reports"] = np.zeros(num_worlds, REPORT)
        self.initial: dict[str, NDArray[Any]] = {}
        self.room = num_bodies  # for bodies; only that of a single world is ever larger than their number
        self._whole = {name: self.arrays[name] for name in BODY_TABLES}
        self._whole_initial: dict[str, NDArray[Any]] = {}
        self.header = np.zeros(1, HEADER)
        self._write_constants()
        self._choose_broad_phase()
        self._make_grid()
        self.workspaces = Workspaces(min(options.threads, num_worlds))
        self._size_workspaces(pairs=self._pair_capacity())
        self.link()

    def keep_initial(self) -> None:
        """Remember the present state as the one that a reset goes back to."""
        self.initial = {name: self.arrays[name].copy() for name in (*INITIAL_TABLES, "heights")}
        self._whole_initial = {name: self.initial[name] for name in INITIAL_TABLES}

    def show_bodies(self, count: int) -> None:
        """Let the tables of a single world hold ``count`` bodies."""
        grown = False
        if count > self.room:
            before = self.num_bodies
            self.room = 2 * count
            for whole in (self._whole, self._whole_initial):
                for name, table in whole.items():
                    whole[name] = np.zeros((1, self.room, *table.shape[2:]), table.dtype)
                    whole[name][:, :before] = table[:, :before]
            self._choose_broad_phase()
            self._make_grid()
            self._size_workspaces(pairs=self._pair_capacity())
            grown = True
        for name, table in self._whole.items():
            self.arrays[name] = table[:, :count]
        for name, table in self._whole_initial.items():
            self.initial[name] = table[:, :count]
        self.header["num_bodies"] = count
        if grown:
            self.link()

    def _pair_capacity(self) -> int:
        """Pairs of a new world; the table grows when a step finds more."""
        return max(4 * self.room, 16)

    def _make_grid(self) -> None:
        """Empty tables of the hash grid, of size 0 for scenes that search all pairs."""
        bodies = self.room if self.grid else 0
        # Half of the slots stay free, and half of the others are for cells that bodies have left.
        slots = 1 << (4 * bodies - 1).bit_length() if bodies else 0
        self.arrays["grids"] = np.zeros(self.num_worlds if self.grid else 0, GRID)
        self.arrays["proxies"] = np.zeros((self.num_worlds, bodies), PROXY)
        self.arrays["cells"] = np.zeros((self.num_worlds, slots), CELL)
        self._make_candidates(self._pair_capacity())

    def _make_candidates(self, capacity: int) -> None:
        """Room for candidates of the grid, all of them to be found anew."""
        self.arrays["candidates"] = np.zeros((self.num_worlds, capacity if self.grid else 0), np.int64)
        self.arrays["grids"]["valid"] = 0

    @property
    def num_bodies(self) -> int:
        return int(self.arrays["bodies"].shape[1])

    @property
    def most_contacts(self) -> int:
        """That a world may have; there is room for as many only once they are met."""
        return self.options.max_contacts or LARGEST_COUNT

    @property
    def address(self) -> int:
        return int(self.header.ctypes.data)

    def _write_constants(self) -> None:
        """What never changes: sizes of the scene, options, and the addresses of the stages that it needs."""
        header, arrays = self.header[0], self.arrays
        header["num_worlds"], header["num_bodies"] = arrays["bodies"].shape
        header["num_materials"] = int(arrays["bodies"]["material"][0].max(initial=0)) + 1
        write_stages(header, arrays, self.options)

    def choose_tiers(self) -> None:
        """Call it when bodies have come or gone."""
        choose_tiers(self.header[0], self.arrays)

    def _choose_broad_phase(self) -> None:
        """Whether pairs come from the hash grid."""
        self.grid = bool(self.header["collisions"][0]) and choose_broad_phase(self.header[0], self.room)

    def link(self) -> None:
        """Write sizes and addresses of all tables into the header; call it whenever some were replaced."""
        header, arrays = self.header[0], self.arrays
        header["height_worlds"], header["num_heights"] = arrays["heights"].shape
        header["contact_capacity"] = arrays["contacts"].shape[1]
        header["asleep_capacity"] = arrays["asleep_contacts"].shape[1]
        header["num_slots"], header["candidate_capacity"] = arrays["cells"].shape[1], arrays["candidates"].shape[1]
        self.link_tables((*MODEL_TABLES, *WORLD_TABLES))
        self.note_features()

    def link_tables(self, names: Iterable[str]) -> None:
        """Write the addresses of these tables, and the sizes of those of the model."""
        header, arrays = self.header[0], self.arrays
        for name in names:
            header[name] = arrays[name].ctypes.data
            if name in MODEL_TABLES:
                header[f"{name}_size"] = arrays[name].size

    def note_features(self) -> None:
        """Write what the parameters of each world ask for; call it whenever one was changed."""
        arrays = self.arrays
        bodies, traits = arrays["bodies"], arrays["traits"]
        # Rules of materials that no body has any more ask for nothing.
        used = np.unique(bodies["material"][0][bodies["motion"][0] != REMOVED])
        rules = arrays["pair_rules"]["restitution"].reshape(2 * (math.isqrt(arrays["pair_rules"].size),))
        bouncy_pairs = bool((rules[np.ix_(used, used)] > 0.0).any())
        traits["restitution"] = bodies["restitution"].any(axis=1) | bouncy_pairs
        traits["moments"] = bodies["rolling_friction"].any(axis=1) | bodies["torsional_friction"].any(axis=1)
        traits["moving_heights"] = arrays["height_rates"].any(axis=1)
        self.header[0]["driven"] = bool((bodies["motion"][0] == KINEMATIC).any())
        self.moving_heights = bool(traits["moving_heights"].any())
        if self.moving_heights:
            self._make_room_for_moving_heights()

    def _size_workspaces(
        self, pairs: int = 0, blocks: int = 0, integers: int = 0, threads: slice = slice(None)
    ) -> None:
        """Room for the bodies and contacts of a world, for as many pairs, and for a factorisation."""
        contacts = self.arrays["contacts"].shape[1]
        sizes = table_sizes(self.room, contacts, pairs, grid=self.grid, blocks=blocks, integers=integers)
        self.workspaces.make_room(sizes, threads)

    def _make_room_for_moving_heights(self) -> None:
        """Allocate in each workspace the samples at another instant than the start of a step."""
        samples: int = self.arrays["heights"].shape[1]
        sizes = dict.fromkeys(("heights_then", "height_velocities", "height_accelerations"), samples)
        self.workspaces.make_room(sizes)

    def make_room(self) -> None:
        """Enlarge what the last run found too small, as its reports say."""
        status, detail = self.arrays["reports"]["status"], self.arrays["reports"]["detail"]
        pairs = int(detail[status == PAIRS_FULL].max(initial=0))
        if pairs:
            self._make_candidates(2 * pairs)
            self.link()
            self._size_workspaces(pairs=2 * pairs)
        if (status == SOLVER_FULL).any():
            self._grow_solver()
        wanted = detail[status == CONTACTS_FULL]
        contacts = int(wanted[wanted <= self.most_contacts].max(initial=0))
        if contacts:
            room = max(contacts + contacts // 2, 2 * self.arrays["contacts"].shape[1])
            self.resize_contacts(min(room, self.most_contacts))

    def save(self) -> dict[str, NDArray[Any]]:
        """Copies of every table that decides the future."""
        return {name: self.arrays[name].copy() for name in STATE_TABLES}

    def load(self, saved: dict[str, NDArray[Any]]) -> None:
        """Back to what ``save`` returned."""
        if saved["contacts"].shape[1] > self.arrays["contacts"].shape[1]:
            self.resize_contacts(saved["contacts"].shape[1])
        for name, array in saved.items():
            own = self.arrays[name]
            if name in ("contacts", "asleep_contacts"):
                own[:, : array.shape[1]] = array  # there may be room for more by now
            elif own.shape == array.shape:
                own[...] = array
            else:
                self.arrays[name] = array.copy()  # heights: shared by the worlds, or not
        self.separate_heights(moving=True) if self.arrays["height_rates"].any() else self.link()
        self.bound_heights()

    def resize_contacts(self, capacity: int) -> None:
        """Room for ``capacity`` contacts a world; those that are there stay."""
        for name in ("contacts", "asleep_contacts"):
            old = self.arrays[name]
            if old.shape[1]:
                grown = np.zeros((self.num_worlds, capacity), CONTACT)
                grown[:, : old.shape[1]] = old
                self.arrays[name] = grown
        self._size_workspaces()
        self.link()

    def _grow_solver(self) -> None:
        """Room for the factorisation that did not fit; the solver left the sizes it wants in its index."""
        for number, tables in enumerate(self.workspaces.tables):
            blocks, integers = (size + size // 2 for size in tables["solver_index"][:2].tolist())
            self._size_workspaces(blocks=blocks, integers=integers, threads=slice(number, number + 1))

    def separate_heights(self, moving: bool) -> None:
        """Give every world heights of its own, and rates if they move. Rates that worlds share are zero."""
        for name in HEIGHT_POOLS if moving else ("heights",):
            if len(self.arrays[name]) != self.num_worlds:
                self.arrays[name] = np.repeat(self.arrays[name], self.num_worlds, axis=0)
        self.link()

    def bound_heights(self, num_steps: int = 0) -> None:
        """Set ``lowest`` and ``highest`` of each height field to bounds for now and the next ``num_steps`` steps.

        Within a step, whose rate is a mean, samples may swing beyond its ends by a quarter of the fastest rate.
        """
        time = num_steps * self.options.time_step
        for row in self.arrays["height_fields"]:
            samples = slice(int(row["first"]), int(row["first"] + row["size"]))
            heights, rates = (self.arrays[name][:, samples] for name in ("heights", "height_rates"))
            swing = 0.25 * self.options.time_step * np.abs(rates).max()
            row["lowest"] = heights.min() + min(time * rates.min(), 0.0) - swing
            row["highest"] = heights.max() + max(time * rates.max(), 0.0) + swing
