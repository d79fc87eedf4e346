"""Which compiled stages a scene needs: only these are compiled, and the header leads to them by address."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import detection, following, groups, hindsight, response, seams
from .contacts import sleeping
from .events import impact_time
from .jit import Stage
from .model import DYNAMIC, LEAST_BODIES, NUM_SHAPES, PLANE, SHAPE_NAMES
from .narrow_phase.pairs import PAIR_STAGES
from .options import Options
from .probes.ask import NEAREST_STAGES

GRID_FROM = 64  # bodies; with fewer, testing each with each is cheaper than looking up those that move

Arrays = dict[str, NDArray[Any]]


def write_stages(header: NDArray[Any], arrays: Arrays, options: Options) -> None:
    """Write the options of the steps and the addresses of their stages; tables of functions go to ``arrays``."""
    bodies = arrays["bodies"][0]
    moves = bool((bodies["motion"] == DYNAMIC).any())
    header["collisions"] = moves and bool((bodies["num_colliders"] > 0).sum() > 1)
    header["time_step"] = options.time_step
    header["tolerance"] = options.tolerance
    header["max_iterations"] = options.max_iterations
    header["substeps"] = options.substeps
    header["events"] = options.events
    header["fly_bodies"] = detection.fly_bodies.address
    header["commit"] = response.commit.address
    header["sleeping"] = options.sleeping and moves
    if header["sleeping"]:
        header["settle"] = sleeping.settle.address
    if header["collisions"]:
        header["find_contacts"] = detection.find_contacts.address
        header["sort_contacts"] = response.sort_contacts.address
        header["step_islands"] = response.step_islands.address
        header["solve_problem"] = response.solve_problem.address
        choose_tiers(header, arrays)
        arrays["pair_functions"] = _pair_functions(arrays)
        header["part_overlaps"] = hindsight.part_overlaps.address
        header["follow_contacts"] = following.follow_contacts.address
        watch_seams(header, arrays)
        header["step_groups"] = groups.step_groups.address
        header["find_impact_time"] = impact_time.find_impact_time.address
        header["strike"] = response.strike.address


def choose_broad_phase(header: NDArray[Any], bodies: int) -> bool:
    """How pairs are found in a world with room for so many bodies; True if it is by the hash grid."""
    grid = bodies >= GRID_FROM
    find_pairs = detection.find_pairs_in_grid if grid else detection.find_pairs
    header["find_pairs"] = find_pairs.address
    return grid


def choose_tiers(header: NDArray[Any], arrays: Arrays) -> None:
    """The pile tier is there for worlds of many bodies; call it when bodies have come or gone."""
    many = (arrays["bodies"]["motion"][0] == DYNAMIC).sum() >= LEAST_BODIES
    header["step_pile"] = response.step_pile.address if many else 0


def pair_stage(pair: tuple[int, int]) -> Stage:
    """The function of a pair of shapes, the smaller code first.

    Raises:
        ValueError: there is no collision test for that pair.
    """
    if pair not in PAIR_STAGES:
        a, b = (SHAPE_NAMES[code] for code in pair)
        raise ValueError(
            f"World: this scene lets a {a} meet a {b}, and there is no collision test for that pair. Use other "
            "shapes, or make neither of the two dynamic."
        )
    return PAIR_STAGES[pair]


def _pair_functions(arrays: Arrays) -> NDArray[np.int64]:
    """Addresses of the functions of the pairs of shapes that can meet in this scene; these alone are compiled."""
    colliders, motion = arrays["colliders"], arrays["bodies"]["motion"][0]
    owners: dict[int, set[int]] = {}
    for shape, body in zip(colliders["shape"].tolist(), colliders["body"].tolist(), strict=True):
        owners.setdefault(shape, set()).add(body)
    dynamic = set(np.flatnonzero(motion == DYNAMIC).tolist())
    addresses = np.zeros((NUM_SHAPES, NUM_SHAPES), np.int64)
    for pair in itertools.combinations_with_replacement(sorted(owners), 2):
        a, b = (owners[shape] for shape in pair)
        # Two different bodies, at least one of them dynamic.
        if any(one & dynamic and other and len((one & dynamic) | other) > 1 for one, other in ((a, b), (b, a))):
            addresses[pair] = pair_stage(pair).address
    return addresses.reshape(-1)


def watch_seams(header: NDArray[Any], arrays: Arrays) -> None:
    """Where several colliders are ground together, what one of them hides of another is left out (seams).

    Call it when ground has gone.
    """
    colliders, motion = arrays["colliders"], arrays["bodies"]["motion"][0]
    ground = colliders["shape"][(motion[colliders["body"]] != DYNAMIC)]
    several = len(ground) > 1 and bool((ground != PLANE).any())
    if several:
        for shape in set(ground.tolist()):
            arrays["nearest_functions"][shape] = NEAREST_STAGES[shape].address
    header["hide_seams"] = seams.hide_seams.address if several else 0
    header["cross_seams"] = seams.cross_seams.address if several else 0
