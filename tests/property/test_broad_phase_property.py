"""The hash grid finds the pairs that comparing every two boxes finds, in the same order, whatever happened before."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from avalanche_gym.physics.broad_phase.all_pairs import all_pairs
from avalanche_gym.physics.broad_phase.candidates import meeting_pairs, update_candidates
from avalanche_gym.physics.broad_phase.tables import CELL, GRID, PROXY
from avalanche_gym.physics.jit import entry_point
from avalanche_gym.physics.model import BODY, BODY_STATE, DYNAMIC, STATIC
from tests.oracles import pairs_oracle


@entry_point
def _update(grids, bodies, starts, flown, boxes, proxies, cells, candidates, moved, found, pairs):
    count = update_candidates(grids[0], bodies, starts, flown, boxes, proxies, cells, candidates, moved, found, pairs)
    return count if grids[0].valid == 0 else meeting_pairs(candidates, count, boxes, pairs)


class Grid:
    """The tables of one world for the broad phase alone."""

    def __init__(self, dynamic: NDArray[np.bool_], capacity: int) -> None:
        count = len(dynamic)
        self.bodies = np.zeros(count, BODY)
        self.bodies["motion"] = np.where(dynamic, DYNAMIC, STATIC)
        self.bodies["num_colliders"] = 1
        self.bodies["radius"] = 1.0
        self.states, self.flown = np.zeros(count, BODY_STATE), np.zeros(count, BODY_STATE)
        self.grids, self.proxies = np.zeros(1, GRID), np.zeros(count, PROXY)
        self.cells = np.zeros(1 << (4 * count - 1).bit_length(), CELL)
        self.moved = np.zeros(count + 1, np.int64)
        self.resize(capacity)

    def resize(self, capacity: int) -> None:
        self.candidates, self.found = np.zeros(capacity, np.int64), np.zeros(capacity, np.int64)
        self.pairs = np.zeros(2 * capacity, np.int64)
        self.grids["valid"] = 0

    def find(self, boxes: NDArray[np.float64], motion: NDArray[np.float64]) -> list[tuple[int, int]]:
        """Pairs by the grid; its tables grow as those of a World do."""
        self.flown["center"] = motion
        while True:
            count = _update(
                self.grids, self.bodies, self.states, self.flown, boxes.ravel(), self.proxies, self.cells,
                self.candidates, self.moved, self.found, self.pairs,
            )  # fmt: skip
            if self.grids["valid"][0] == 1:
                return [(int(a), int(b)) for a, b in self.pairs[: 2 * count].reshape(-1, 2)]
            self.resize(2 * count)

    def find_all(self, boxes: NDArray[np.float64]) -> list[tuple[int, int]]:
        pairs = np.zeros(len(boxes) ** 2, np.int64)
        count = all_pairs(self.bodies, boxes.ravel(), pairs)
        return [(int(a), int(b)) for a, b in pairs[: 2 * count].reshape(-1, 2)]


def random_boxes(generator: np.random.Generator, count: int, decades: float, offset: float) -> NDArray[np.float64]:
    """Boxes of sizes over so many decades, some without end, some that are no numbers, some that touch."""
    size = 10.0 ** generator.uniform(-decades, 0.0, (count, 1)) * generator.uniform(0.2, 1.0, (count, 3))
    low = offset + generator.uniform(-1.0, 1.0, (count, 3))
    if generator.random() < 0.3:
        low, size = np.round(low * 4) / 4, np.maximum(np.round(size * 4), 1.0) / 4
    boxes = np.concatenate([low, low + size], axis=1)
    for index in np.flatnonzero(generator.random(count) < 0.05):
        strange = (
            [-np.inf] * 3 + [np.inf] * 3, [np.nan] * 6, [-np.inf, low[index, 1], np.nan] + [np.inf] * 3,
            [np.inf] * 6, [-1e300] * 3 + [1e300] * 3,
        )  # fmt: skip
        boxes[index] = strange[generator.integers(len(strange))]
    return boxes


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    count=st.integers(1, 70),
    decades=st.sampled_from([0.3, 2.0, 4.0]),
    offset=st.sampled_from([0.0, 1e6, -1e12]),
    share=st.sampled_from([0.0, 0.1, 1.0]),
)
def test_grid_finds_the_pairs_of_all_pairs(seed, count, decades, offset, share):
    generator = np.random.default_rng(seed)
    grid = Grid(generator.random(count) < 0.6, capacity=4)
    boxes = random_boxes(generator, count, decades, offset)
    motion = np.zeros((count, 3))
    for _ in range(8):
        expected = pairs_oracle.meeting_pairs(boxes, grid.bodies["motion"] == DYNAMIC)
        assert grid.find_all(boxes) == expected
        assert grid.find(boxes, motion) == expected
        # A share of them goes elsewhere, the others drift within and out of their fat bounds, some come and go.
        drift = generator.normal(0.0, 0.1, (count, 3)) * generator.random((count, 1))
        boxes = boxes + np.tile(drift, 2)
        jump = generator.random(count) < share
        boxes[jump] = random_boxes(generator, count, decades, offset)[jump]
        motion = generator.normal(0.0, 10.0 ** generator.uniform(-6, 2), (count, 3))
        switched = generator.random(count) < 0.05
        grid.bodies["num_colliders"][switched] ^= 1
        boxes[grid.bodies["num_colliders"] == 0] = np.nan
        gone = (grid.bodies["num_colliders"] == 1) & np.isnan(boxes).any(axis=1)
        boxes[gone] = random_boxes(generator, count, decades, offset)[gone]
        grid.bodies["motion"][switched] = np.where(generator.random(switched.sum()) < 0.5, DYNAMIC, STATIC)


def test_a_fresh_grid_and_an_old_one_give_the_same_pairs_among_thousands():
    generator = np.random.default_rng(5)
    count = 3000
    dynamic = generator.random(count) < 0.3
    boxes = random_boxes(generator, count, 3.0, 1e6)
    old = Grid(dynamic, 20 * count)
    for _ in range(5):
        motion = generator.normal(0.0, 0.01, (count, 3))
        boxes[dynamic] += np.tile(motion[dynamic], 2)
        found = old.find(boxes, motion)
        assert found == Grid(dynamic, 20 * count).find(boxes, motion)
        assert found == pairs_oracle.meeting_pairs(boxes, dynamic)
