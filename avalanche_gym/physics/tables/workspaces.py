"""Scratch of each thread: what a step writes before it reads. It grows when a step finds it too small."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..layout import WORKSPACE, WORKSPACE_TABLES
from ..narrow_phase.answers import MOST_ANSWERS, MOST_QUESTIONS
from ..narrow_phase.pair_query import PAIR_QUERY, SCRATCH_ROWS
from ..probes.probe import PROBE
from ..solver.workspace import BLOCKS_PER_BODY, INDEX_PER_BODY

MOST_ASKED = 64  # contacts of one pair of colliders that are followed through a step; more are guessed


def table_sizes(bodies: int, contacts: int, pairs: int, *, grid: bool, blocks: int, integers: int) -> dict[str, int]:
    """Entries of every table of a workspace.

    Args:
        bodies: of a world.
        contacts: room for them in a world.
        pairs: of bodies whose boxes overlap, room for them.
        grid: whether they come from the hash grid.
        blocks: 6 x 6 blocks of a factorisation, if more are needed than most islands take.
        integers: of its index, likewise.
    """
    return {
        "flown": bodies,
        "predicted": bodies,
        "working": bodies,
        "ends": bodies,
        "begins": bodies,
        "group": bodies,
        "waits": bodies,
        "members": bodies,
        "chain": bodies,
        "chain_starts": bodies,
        "movers": bodies,
        "past_links": 2 * contacts,
        "past_starts": bodies,
        "near": bodies,
        "strayed": bodies,
        "stray": bodies,
        "bound": bodies,
        "reached": 6 * bodies,
        "recent": contacts,
        "kept": contacts,
        "gone": contacts,
        "boxes": 6 * bodies,
        "pairs": 2 * pairs,
        "ground_links": pairs,
        "ground_firsts": bodies,
        "found": pairs if grid else 0,
        "contacts": contacts,
        "asked": MOST_ASKED,
        "questions": MOST_QUESTIONS,
        "answers": MOST_ANSWERS,
        "sums": 6 * bodies,
        "island": bodies,
        "island_starts": bodies + 1,
        "island_bodies": bodies,
        "body_starts": bodies + 1,
        "order": contacts,
        "touching": contacts,
        "pair_scratch": 8 * SCRATCH_ROWS,
        "query": PAIR_QUERY.itemsize,
        "probe": PROBE.itemsize,
        "solver_rows": 2 * contacts,  # contacts and moments
        "solver_nodes": bodies + 1,
        "solver_blocks": 36 * max(blocks, BLOCKS_PER_BODY * bodies + 1),
        "pile_rows": contacts,
        "pile_moments": contacts,
        "pile_nodes": bodies + 1,
        "solver_index": max(integers, INDEX_PER_BODY * bodies + 64),
    }


class Workspaces:
    """One for each thread: a record of addresses and sizes, and the tables it leads to."""

    def __init__(self, threads: int) -> None:
        self.tables: list[dict[str, NDArray[Any]]] = [{} for _ in range(threads)]
        self._records = [np.zeros(1, WORKSPACE) for _ in range(threads)]

    @property
    def addresses(self) -> list[int]:
        return [int(record.ctypes.data) for record in self._records]

    def make_room(self, sizes: dict[str, int], threads: slice = slice(None)) -> None:
        """Let every table of these threads have ``sizes`` entries or more. What is replaced starts at zero."""
        for tables, record in zip(self.tables[threads], self._records[threads], strict=True):
            for name, size in sizes.items():
                if name not in tables or tables[name].size < size:
                    tables[name] = np.zeros(size, WORKSPACE_TABLES[name])
                record[0][name] = tables[name].ctypes.data
                record[0][f"{name}_size"] = tables[name].size
