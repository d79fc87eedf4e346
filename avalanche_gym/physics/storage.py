"""Owns the memory of a world: every table, the header that leads kernels to them, and scratch for each thread."""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import detection, groups, hindsight, response, seams
from .broad_phase.tables import CELL, GRID, PROXY
from .construction import Tables
from .contacts import sleeping
from .events import impact_time
from .jit import Stage
from .memory import HEADER, MODEL_TABLES, WORKSPACE, WORKSPACE_TABLES, WORLD_TABLES
from .model import (
    CONTACT,
    CONTACTS_FULL,
    DYNAMIC,
    HEIGHT_POOLS,
    KINEMATIC,
    LEAST_BODIES,
    NUM_SHAPES,
    PAIRS_FULL,
    PLANE,
    REPORT,
    REST,
    SHAPE_NAMES,
    SOLVER_FULL,
)
from .narrow_phase.answers import MOST_ANSWERS, MOST_QUESTIONS
from .narrow_phase.pair_query import PAIR_QUERY
from .narrow_phase.pairs import PAIR_STAGES
from .options import Options
from .probes.ask import NEAREST_STAGES
from .probes.probe import PROBE
from .solver.workspace import BLOCKS_PER_BODY, INDEX_PER_BODY

FIRST_CONTACTS = 32  # capacity of a new world; it doubles when a step finds more
GRID_FROM = 64  # bodies; with fewer, testing each with each is cheaper than looking up those that move
CLIPPING_FLOATS = 264 * 8  # scratch of one pair of shapes
MOST_ASKED = 64  # contacts of one pair of colliders that are followed through a step; more are guessed

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
        self.grid = False  # whether pairs come from the hash grid
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
        self.arrays["contacts"] = np.zeros((num_worlds, options.max_contacts or FIRST_CONTACTS), CONTACT)
        self.arrays["num_contacts"] = np.zeros(num_worlds, np.int64)
        self.arrays["asleep_contacts"] = np.zeros_like(self.arrays["contacts"][:, : None if options.sleeping else 0])
        self.arrays["num_asleep_contacts"] = np.zeros(num_worlds, np.int64)
        self.arrays["rest"] = np.zeros((num_worlds, num_bodies), REST)
        self.arrays["remaining"] = np.zeros(num_worlds, np.int64)
        self.arrays["reports"] = np.zeros(num_worlds, REPORT)
        self.initial: dict[str, NDArray[Any]] = {}
        self.room = num_bodies  # for bodies; only that of a single world is ever larger than their number
        self._whole = {name: self.arrays[name] for name in BODY_TABLES}
        self._whole_initial: dict[str, NDArray[Any]] = {}
        self.header = np.zeros(1, HEADER)
        self._write_constants()
        self._make_grid()
        threads = min(options.threads, num_worlds)
        self.workspaces = [np.zeros(1, WORKSPACE) for _ in range(threads)]
        self._scratch: list[dict[str, NDArray[Any]]] = [{} for _ in range(threads)]
        for number in range(threads):
            self.size_workspace(number, pairs=self._pair_capacity(), blocks=0, integers=0)
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
            self.size_workspace(0, pairs=self._pair_capacity(), blocks=0, integers=0)
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
    def address(self) -> int:
        return int(self.header.ctypes.data)

    def _write_constants(self) -> None:
        """What never changes: sizes of the scene, options, and the addresses of the stages that it needs."""
        header, arrays, options = self.header[0], self.arrays, self.options
        bodies = arrays["bodies"][0]
        header["num_worlds"], header["num_bodies"] = arrays["bodies"].shape
        header["num_materials"] = int(bodies["material"].max(initial=0)) + 1
        header["collisions"] = bool((bodies["motion"] == DYNAMIC).any() and (bodies["num_colliders"] > 0).sum() > 1)
        header["time_step"] = options.time_step
        header["tolerance"] = options.tolerance
        header["max_iterations"] = options.max_iterations
        header["substeps"] = options.substeps
        header["events"] = options.events
        header["fly_bodies"] = detection.fly_bodies.address
        header["commit"] = response.commit.address
        header["sleeping"] = bool(options.sleeping and (bodies["motion"] == DYNAMIC).any())
        if header["sleeping"]:
            header["settle"] = sleeping.settle.address
        if header["collisions"]:
            self._choose_broad_phase()
            header["find_contacts"] = detection.find_contacts.address
            header["sort_contacts"] = response.sort_contacts.address
            header["step_islands"] = response.step_islands.address
            header["solve_problem"] = response.solve_problem.address
            self.choose_tiers()
            arrays["pair_functions"] = self._pair_functions()
            header["part_overlaps"] = hindsight.part_overlaps.address
            header["follow_contacts"] = detection.follow_contacts.address
            self._watch_seams()
            header["step_groups"] = groups.step_groups.address
            header["find_impact_time"] = impact_time.find_impact_time.address
            header["strike"] = response.strike.address

    def choose_tiers(self) -> None:
        """The pile tier is there for worlds of many bodies; call it when bodies have come or gone."""
        many = (self.arrays["bodies"]["motion"][0] == DYNAMIC).sum() >= LEAST_BODIES
        self.header["step_pile"] = response.step_pile.address if many else 0

    def _choose_broad_phase(self) -> None:
        self.grid = self.room >= GRID_FROM
        find_pairs = detection.find_pairs_in_grid if self.grid else detection.find_pairs
        self.header["find_pairs"] = find_pairs.address

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
        """Write what the parameters ask for into the header; call it whenever one was changed."""
        header, arrays = self.header[0], self.arrays
        bounces = arrays["bodies"]["restitution"].any() or (arrays["pair_rules"]["restitution"] > 0.0).any()
        header["restitution"] = bool(bounces)
        header["driven"] = bool((arrays["bodies"]["motion"] == KINEMATIC).any())
        header["moments"] = bool(
            arrays["bodies"]["rolling_friction"].any() or arrays["bodies"]["torsional_friction"].any()
        )
        header["moving_heights"] = self.moving_heights = bool(arrays["height_rates"].any())
        if self.moving_heights:
            self._make_room_for_moving_heights()

    def _pair_functions(self) -> NDArray[np.int64]:
        """Addresses of the functions of the pairs of shapes that can meet in this scene; these alone are compiled."""
        colliders, motion = self.arrays["colliders"], self.arrays["bodies"]["motion"][0]
        owners: dict[int, set[int]] = {}
        for shape, body in zip(colliders["shape"].tolist(), colliders["body"].tolist(), strict=True):
            owners.setdefault(shape, set()).add(body)
        dynamic = set(np.flatnonzero(motion == DYNAMIC).tolist())
        addresses = np.zeros((NUM_SHAPES, NUM_SHAPES), np.int64)
        for pair in itertools.combinations_with_replacement(sorted(owners), 2):
            a, b = (owners[shape] for shape in pair)
            # Two different bodies, at least one of them dynamic.
            if any(one & dynamic and other and len((one & dynamic) | other) > 1 for one, other in ((a, b), (b, a))):
                addresses[pair] = self.pair_stage(pair).address
        return addresses.reshape(-1)

    def _watch_seams(self) -> None:
        """Where several colliders are ground together, what one of them hides of another is left out (seams.py)."""
        colliders, motion = self.arrays["colliders"], self.arrays["bodies"]["motion"][0]
        ground = colliders["shape"][(motion[colliders["body"]] != DYNAMIC)]
        if len(ground) > 1 and (ground != PLANE).any():
            for shape in set(ground.tolist()):
                self.arrays["nearest_functions"][shape] = NEAREST_STAGES[shape].address
            self.header[0]["hide_seams"] = seams.hide_seams.address
            self.header[0]["cross_seams"] = seams.cross_seams.address

    @staticmethod
    def pair_stage(pair: tuple[int, int]) -> Stage:
        """The function of a pair of shapes, the smaller code first."""
        if pair not in PAIR_STAGES:
            a, b = (SHAPE_NAMES[code] for code in pair)
            raise ValueError(
                f"World: this scene lets a {a} meet a {b}, and there is no collision test for that pair. Use other "
                "shapes, or make neither of the two dynamic."
            )
        return PAIR_STAGES[pair]

    def size_workspace(self, number: int, *, pairs: int, blocks: int, integers: int) -> None:
        """Allocate the scratch of one thread; contacts follow the capacity of the worlds."""
        num_bodies = self.room
        contacts = self.arrays["contacts"].shape[1]
        sizes = {
            "flown": num_bodies,
            "predicted": num_bodies,
            "working": num_bodies,
            "ends": num_bodies,
            "begins": num_bodies,
            "group": num_bodies,
            "waits": num_bodies,
            "members": num_bodies,
            "chain": num_bodies,
            "chain_starts": num_bodies,
            "movers": num_bodies,
            "past_links": 2 * contacts,
            "past_starts": num_bodies,
            "near": num_bodies,
            "strayed": num_bodies,
            "stray": num_bodies,
            "bound": num_bodies,
            "reached": 6 * num_bodies,
            "recent": contacts,
            "kept": contacts,
            "gone": contacts,
            "boxes": 6 * num_bodies,
            "pairs": 2 * pairs,
            "ground_links": pairs,
            "ground_firsts": num_bodies,
            "found": pairs if self.grid else 0,
            "contacts": contacts,
            "asked": MOST_ASKED,
            "questions": MOST_QUESTIONS,
            "answers": MOST_ANSWERS,
            "sums": 6 * num_bodies,
            "island": num_bodies,
            "island_starts": num_bodies + 1,
            "island_bodies": num_bodies,
            "body_starts": num_bodies + 1,
            "order": contacts,
            "clipping": CLIPPING_FLOATS,
            "query": PAIR_QUERY.itemsize,
            "probe": PROBE.itemsize,
            "solver_rows": 2 * contacts,  # contacts and moments
            "solver_nodes": num_bodies + 1,
            "solver_blocks": 36 * max(blocks, BLOCKS_PER_BODY * num_bodies + 1),
            "pile_rows": contacts,
            "pile_moments": contacts,
            "pile_nodes": num_bodies + 1,
            "solver_index": max(integers, INDEX_PER_BODY * num_bodies + 64),
        }
        scratch, record = self._scratch[number], self.workspaces[number][0]
        for name, size in sizes.items():
            if name not in scratch or scratch[name].size < size:
                scratch[name] = np.zeros(size, WORKSPACE_TABLES[name])
            record[name] = scratch[name].ctypes.data
            record[f"{name}_size"] = scratch[name].size

    def _make_room_for_moving_heights(self) -> None:
        """Allocate in each workspace the samples at another instant than the start of a step."""
        samples = self.arrays["heights"].shape[1]
        for scratch, record in zip(self._scratch, self.workspaces, strict=True):
            for name in ("heights_then", "height_velocities", "height_accelerations"):
                if name not in scratch or scratch[name].size < samples:
                    scratch[name] = np.zeros(samples)
                    record[0][name], record[0][f"{name}_size"] = scratch[name].ctypes.data, samples

    def make_room(self) -> None:
        """Enlarge what the last run found too small, as its reports say."""
        status, detail = self.arrays["reports"]["status"], self.arrays["reports"]["detail"]
        pairs = int(detail[status == PAIRS_FULL].max(initial=0))
        if pairs:
            self._make_candidates(2 * pairs)
            self.link()
            for number in range(len(self.workspaces)):
                self.size_workspace(number, pairs=2 * pairs, blocks=0, integers=0)
        if (status == SOLVER_FULL).any():
            self._grow_solver()
        contacts = int(detail[status == CONTACTS_FULL].max(initial=0))
        if contacts and self.options.max_contacts is None:
            self.resize_contacts(max(contacts + contacts // 2, 2 * self.arrays["contacts"].shape[1]))

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
        for number in range(len(self.workspaces)):
            self.size_workspace(number, pairs=0, blocks=0, integers=0)
        self.link()

    def _grow_solver(self) -> None:
        """Room for the factorisation that did not fit; the solver left the sizes it wants in its index."""
        for number, scratch in enumerate(self._scratch):
            blocks, integers = (int(size) for size in scratch["solver_index"][:2])
            self.size_workspace(number, pairs=0, blocks=blocks + blocks // 2, integers=integers + integers // 2)

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
