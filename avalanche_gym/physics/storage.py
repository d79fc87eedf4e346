"""Owns the memory of a world: every table, the header that leads kernels to them, and scratch for each thread."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .construction import Tables
from .memory import HEADER, MODEL_TABLES, WORKSPACE, WORKSPACE_TABLES, WORLD_TABLES
from .jit import Stage
from .model import CONTACT, DYNAMIC, NUM_SHAPES, REPORT, SHAPE_NAMES
from .options import Options
from . import detection, response
from .narrow_phase.pair_query import PAIR_QUERY
from .narrow_phase.pairs import PAIR_STAGES
from .solver.workspace import BLOCKS_PER_BODY, INDEX_PER_BODY

FIRST_CONTACTS = 32  # capacity of a new world; it doubles when a step finds more
CLIPPING_FLOATS = 256 * 8  # scratch of one pair of shapes

# What a snapshot must hold: every bit that decides the future.
STATE_TABLES = (
    "bodies",
    "states",
    "contacts",
    "num_contacts",
    "position",
    "orientation",
    "linear_velocity",
    "angular_velocity",
    "impulses",
    "heights",
    "height_rates",
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
        for name, array in tables.public.items():
            self.arrays[name] = np.repeat(array[None], num_worlds, axis=0)
        for name in ("heights", "height_rates"):
            self.arrays[name] = own[name][None].copy()
        self.arrays["impulses"] = np.zeros((num_worlds, num_bodies, 6))
        self.arrays["contacts"] = np.zeros((num_worlds, options.max_contacts or FIRST_CONTACTS), CONTACT)
        self.arrays["num_contacts"] = np.zeros(num_worlds, np.int64)
        self.arrays["remaining"] = np.zeros(num_worlds, np.int64)
        self.arrays["reports"] = np.zeros(num_worlds, REPORT)
        self.header = np.zeros(1, HEADER)
        threads = min(options.threads, num_worlds)
        self.workspaces = [np.zeros(1, WORKSPACE) for _ in range(threads)]
        self._scratch: list[dict[str, NDArray[Any]]] = [{} for _ in range(threads)]
        for number in range(threads):
            self.size_workspace(number, pairs=max(4 * num_bodies, 16), blocks=0, integers=0)
        self.link()

    @property
    def num_bodies(self) -> int:
        return int(self.arrays["bodies"].shape[1])

    @property
    def address(self) -> int:
        return int(self.header.ctypes.data)

    def link(self) -> None:
        """Write sizes and addresses into the header; call it whenever a table was replaced."""
        header, arrays, options = self.header[0], self.arrays, self.options
        bodies = arrays["bodies"]
        heights = arrays["heights"]
        header["num_worlds"], header["num_bodies"] = bodies.shape
        header["num_materials"] = int(bodies["material"].max(initial=0)) + 1
        header["height_worlds"], header["num_heights"] = heights.shape
        header["contact_capacity"] = arrays["contacts"].shape[1]
        motion = bodies["motion"][0]
        solid = bodies["num_colliders"][0] > 0
        header["collisions"] = bool((motion == DYNAMIC).any() and (solid & (motion >= 0)).sum() > 1)
        header["moving_heights"] = bool(arrays["height_rates"].any())
        header["restitution"] = bool(bodies["restitution"].any() or (arrays["pair_rules"]["restitution"] > 0.0).any())
        header["time_step"] = options.time_step
        header["tolerance"] = options.tolerance
        header["max_iterations"] = options.max_iterations
        header["events"] = options.events
        header["fly_bodies"] = detection.fly_bodies.address
        header["commit"] = response.commit.address
        if header["collisions"]:
            header["find_pairs"] = detection.find_pairs.address
            header["find_contacts"] = detection.find_contacts.address
            header["solve_contacts"] = response.solve_contacts.address
            arrays["pair_functions"] = self._pair_functions()
        for name in (*MODEL_TABLES, *WORLD_TABLES):
            header[name] = arrays[name].ctypes.data
        for name in MODEL_TABLES:
            header[f"{name}_size"] = arrays[name].size

    def _pair_functions(self) -> NDArray[np.int64]:
        """Addresses of the functions of the pairs of shapes that can meet in this scene; these alone are compiled."""
        colliders, motion = self.arrays["colliders"], self.arrays["bodies"]["motion"][0]
        addresses = np.zeros((NUM_SHAPES, NUM_SHAPES), np.int64)
        kinds = {(int(row["shape"]), int(row["body"]), motion[row["body"]] == DYNAMIC) for row in colliders}
        for (shape_a, body_a, dynamic_a), (shape_b, body_b, dynamic_b) in itertools.product(kinds, kinds):
            pair = (shape_a, shape_b)
            if shape_a <= shape_b and body_a != body_b and (dynamic_a or dynamic_b) and not addresses[pair]:
                addresses[pair] = self._pair_stage(pair).address
        return addresses.reshape(-1)

    @staticmethod
    def _pair_stage(pair: tuple[int, int]) -> Stage:
        if pair not in PAIR_STAGES:
            a, b = (SHAPE_NAMES[code] for code in pair)
            raise ValueError(
                f"World: this scene lets a {a} meet a {b}, and there is no collision test for that pair. Use other shapes, or "
                "make neither of the two dynamic."
            )
        return PAIR_STAGES[pair]

    def size_workspace(self, number: int, *, pairs: int, blocks: int, integers: int) -> None:
        """Allocate the scratch of one thread; contacts follow the capacity of the worlds."""
        num_bodies = self.num_bodies
        contacts = self.arrays["contacts"].shape[1]
        sizes = {
            "flown": num_bodies,
            "moving": num_bodies,
            "boxes": 6 * num_bodies,
            "pairs": 2 * pairs,
            "contacts": contacts,
            "corrections": 6 * num_bodies,
            "island": num_bodies,
            "island_starts": num_bodies + 1,
            "island_bodies": num_bodies,
            "order": contacts,
            "clipping": CLIPPING_FLOATS,
            "query": PAIR_QUERY.itemsize,
            "solver_rows": contacts,
            "solver_nodes": num_bodies + 1,
            "solver_blocks": 36 * max(blocks, BLOCKS_PER_BODY * num_bodies + 1),
            "solver_index": max(integers, INDEX_PER_BODY * num_bodies + 64),
        }
        scratch, record = self._scratch[number], self.workspaces[number][0]
        for name, size in sizes.items():
            if name not in scratch or scratch[name].size < size:
                scratch[name] = np.zeros(size, WORKSPACE_TABLES[name])
            record[name] = scratch[name].ctypes.data
            record[f"{name}_size"] = scratch[name].size

    def grow_contacts(self, needed: int) -> None:
        """Room for ``needed`` contacts a world and half as many again; what is there is kept."""
        old = self.arrays["contacts"]
        capacity = self.options.max_contacts or max(needed + needed // 2, 2 * old.shape[1])
        grown = np.zeros((self.num_worlds, capacity), CONTACT)
        grown[:, : old.shape[1]] = old
        self.arrays["contacts"] = grown
        self.fit_workspaces()

    def fit_workspaces(self) -> None:
        """Scratch for the contacts that the tables now hold, and a header that knows them."""
        for number in range(len(self.workspaces)):
            self.size_workspace(number, pairs=0, blocks=0, integers=0)
        self.link()

    def grow_solver(self) -> None:
        """Room for the factorisation that did not fit; the solver left the sizes it wants in its index."""
        for number, scratch in enumerate(self._scratch):
            blocks, integers = (int(size) for size in scratch["solver_index"][:2])
            self.size_workspace(number, pairs=0, blocks=blocks + blocks // 2, integers=integers + integers // 2)

    def separate_heights(self) -> None:
        """Give every world heights of its own."""
        for name in ("heights", "height_rates"):
            if self.arrays[name].shape[0] != self.num_worlds:
                self.arrays[name] = np.repeat(self.arrays[name], self.num_worlds, axis=0)
        self.link()
