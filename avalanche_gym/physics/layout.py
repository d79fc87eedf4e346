"""Which tables a world has, by name, and the two records that lead kernels to them: HEADER and WORKSPACE.

HEADER says what a world is; WORKSPACE is scratch memory, one a thread. Both hold addresses, so that a call from Python
passes two numbers instead of forty arrays (memory.py).
"""

from __future__ import annotations

import numpy as np

from .broad_phase.tables import CELL, GRID, PROXY
from .model import (
    ANSWER,
    BODY,
    BODY_STATE,
    COLLIDER,
    CONTACT,
    FIELD,
    PAIR_RULE,
    QUESTION,
    REPORT,
    REST,
    TRAITS,
)
from .shape_rows import (
    FACE_ROW,
    HEIGHT_FIELD_ROW,
    HULL_EDGE_ROW,
    HULL_FACE_ROW,
    HULL_ROW,
    MESH_ROW,
    NODE_ROW,
    VERTEX_ROW,
)
from .solver.pile_memory import PILE_MOMENT, PILE_NODE, PILE_ROW
from .solver.workspace import NODE, ROW

# Tables by name. Those of WORLD_TABLES have one block for each world.
MODEL_TABLES = {
    "colliders": COLLIDER,
    "fields": FIELD,
    "pair_rules": PAIR_RULE,  # (materials * materials,)
    "height_fields": HEIGHT_FIELD_ROW,
    "hulls": HULL_ROW,
    "hull_points": np.dtype(np.float64),  # (points * 3,) [m]
    "hull_faces": HULL_FACE_ROW,
    "hull_corners": np.dtype(np.int64),
    "hull_edges": HULL_EDGE_ROW,
    "meshes": MESH_ROW,
    "mesh_vertices": VERTEX_ROW,
    "mesh_faces": FACE_ROW,
    "mesh_nodes": NODE_ROW,
    "pair_functions": np.dtype(np.int64),  # (NUM_SHAPES * NUM_SHAPES,) addresses of narrow_phase/pairs.py
    "nearest_functions": np.dtype(np.int64),  # (NUM_SHAPES,) addresses of the nearest points, for seams
}
WORLD_TABLES = {
    "bodies": BODY,  # (worlds, bodies)
    "states": BODY_STATE,  # (worlds, bodies)
    "contacts": CONTACT,  # (worlds, capacity)
    "num_contacts": np.dtype(np.int64),  # (worlds,)
    "rest": REST,  # (worlds, bodies)
    "traits": TRAITS,  # (worlds,)
    "asleep_contacts": CONTACT,  # (worlds, capacity, 0 if nothing may sleep)
    "num_asleep_contacts": np.dtype(np.int64),  # (worlds,)
    "position": np.dtype(np.float64),  # (worlds, bodies, 3) [m] of the user's frame
    "orientation": np.dtype(np.float64),  # (worlds, bodies, 4)
    "linear_velocity": np.dtype(np.float64),  # (worlds, bodies, 3) [m/s]
    "angular_velocity": np.dtype(np.float64),  # (worlds, bodies, 3) [rad/s]
    "impulses": np.dtype(np.float64),  # (worlds, bodies, 6) [N s], [N m s] about the centre of mass, for the next call
    "heights": np.dtype(np.float64),  # (1 or worlds, samples) [m]
    "height_rates": np.dtype(np.float64),  # (1 or worlds, samples) [m/s]
    "height_rates_before": np.dtype(np.float64),  # (1 or worlds, samples) [m/s] in the last step
    "height_rate_changes": np.dtype(np.float64),  # (1 or worlds, samples) [m/s] by which those differed from before
    "remaining": np.dtype(np.int64),  # (worlds,) steps left in this call
    "reports": REPORT,  # (worlds,)
    "grids": GRID,  # (worlds,) these four are empty unless the scene has many bodies
    "proxies": PROXY,  # (worlds, bodies)
    "cells": CELL,  # (worlds, slots)
    "candidates": np.dtype(np.int64),  # (worlds, pair capacity)
}

# Pools of the samples of all height fields, of one world or of each: heights and how they move.
HEIGHT_POOLS = ("heights", "height_rates", "height_rates_before", "height_rate_changes")

# Stages of the step by name: pipeline.py calls them through the addresses in the header.
STAGES = (
    *("fly_bodies", "find_pairs", "find_contacts", "sort_contacts", "step_islands", "follow_contacts", "solve_problem"),
    *("step_groups", "find_impact_time", "strike", "step_pile", "part_overlaps", "settle", "commit"),
    *("hide_seams", "cross_seams"),  # 0: no two colliders of this scene are ground together
)

HEADER = np.dtype(
    [
        ("num_worlds", np.int64),
        ("num_bodies", np.int64),
        ("num_materials", np.int64),
        ("num_heights", np.int64),  # samples of all height fields of one world
        ("height_worlds", np.int64),  # 1: all worlds share their heights
        ("contact_capacity", np.int64),  # a world
        ("num_slots", np.int64),  # cells of the grid, a world: a power of two
        ("candidate_capacity", np.int64),  # a world
        ("asleep_capacity", np.int64),
        ("sleeping", np.int64),  # 0: nothing may sleep
        ("collisions", np.int64),  # 0: no two bodies of this scene can meet
        ("driven", np.int64),  # 0: this scene has no kinematic bodies
        ("time_step", np.float64),  # [s]
        ("tolerance", np.float64),
        ("max_iterations", np.int64),
        ("substeps", np.int64),
        ("events", np.int64),
        *((name, np.int64) for name in STAGES),
        *((name, np.int64) for name in (*MODEL_TABLES, *WORLD_TABLES)),
        *((f"{name}_size", np.int64) for name in MODEL_TABLES),
    ],
    align=True,
)

WORKSPACE_TABLES = {
    "flown": BODY_STATE,  # (bodies,) at the end of the step if nothing touched
    "predicted": BODY_STATE,  # (bodies,) at the end of the step under the impulses of the last one
    "working": BODY_STATE,  # (bodies,) places and velocities the contact problem is written about
    "ends": BODY_STATE,  # (bodies,) at the end of the step
    "begins": BODY_STATE,  # (bodies,) where the present part of a step begins, in groups whose impacts are located
    "group": np.dtype(np.int64),  # (bodies,) island of each body in the whole step, -1 for none
    "waits": np.dtype(np.int64),  # (bodies,) of each of those islands: 1 if its impacts are to be located
    "members": np.dtype(np.int64),  # (bodies,) the dynamic ones that are stepped: of the world, or of a group
    "chain": np.dtype(np.int64),  # (bodies,) next body of the same group, -1 for none
    "chain_starts": np.dtype(np.int64),  # (bodies,) first body of each group, by its island
    "movers": np.dtype(np.int64),  # (bodies,) kinematic bodies
    "past_links": np.dtype(np.int64),  # (contact capacity * 2,) next contact of the last step of the same body, or -1
    "past_starts": np.dtype(np.int64),  # (bodies,) first of them, or -1
    "near": np.dtype(np.int64),  # (bodies,) whose bounds meet those of a member
    "strayed": np.dtype(np.int64),  # (bodies,) that have left the bounds by which the grid finds them
    "stray": np.dtype(np.int64),  # (bodies,) 1: listed there
    "bound": np.dtype(np.int64),  # (bodies,) 1: contacts keep the body from flying freely
    "reached": np.dtype(np.float64),  # (bodies * 6,) [m] bounds of all parts of the step
    "recent": CONTACT,  # (contact capacity,) of the part of the step before
    "kept": CONTACT,  # (contact capacity,) of what has been stepped to the end
    "gone": CONTACT,  # (contact capacity,) that bore a blow earlier in the step and are out of reach since
    "boxes": np.dtype(np.float64),  # (bodies * 6,) [m] swept bounds: low, high
    "pairs": np.dtype(np.int64),  # (pair capacity * 2,)
    "ground_links": np.dtype(np.int64),  # (pair capacity,) next pair of the same dynamic body with ground, or -1
    "ground_firsts": np.dtype(np.int64),  # (bodies,) first of them, or -1
    "found": np.dtype(np.int64),  # (pair capacity,) new candidates of the grid
    "contacts": CONTACT,  # (contact capacity,)
    "asked": CONTACT,  # (ASKED,) of one pair of colliders, after moving
    "questions": QUESTION,  # (MOST_QUESTIONS,) that the narrow phase has answered in this step
    "answers": ANSWER,  # (MOST_ANSWERS,)
    # (samples,) these three only while heights move:
    "heights_then": np.dtype(np.float64),  # [m] at ``heights_time``
    "height_velocities": np.dtype(np.float64),  # [m/s] then
    "height_accelerations": np.dtype(np.float64),  # [m/s^2] in this step
    "sums": np.dtype(np.float64),  # (bodies * 6,) [N s], [N m s] impulse and angular impulse on each body
    "island": np.dtype(np.int64),  # (bodies,) of each body, -1 for none
    "island_starts": np.dtype(np.int64),  # (bodies + 1,) first contact of each island in ``order``
    "island_bodies": np.dtype(np.int64),  # (bodies,) dynamic bodies sorted by island
    "body_starts": np.dtype(np.int64),  # (bodies + 1,) first body of each island in ``island_bodies``
    "order": np.dtype(np.int64),  # (contact capacity,) contacts sorted by island
    "touching": np.dtype(np.int64),  # (contact capacity,) those of one island that touch, in that order
    "pair_scratch": np.dtype(np.float64),  # (SCRATCH_ROWS * 8,) of narrow_phase/pair_query.py
    "query": np.dtype(np.uint8),  # bytes of a PAIR_QUERY
    "probe": np.dtype(np.uint8),  # bytes of a PROBE
    "solver_rows": ROW,
    "solver_nodes": NODE,
    "solver_blocks": np.dtype(np.float64),  # (blocks * 36,)
    "solver_index": np.dtype(np.int64),
    "pile_rows": PILE_ROW,  # (contact capacity,)
    "pile_moments": PILE_MOMENT,  # (contact capacity,)
    "pile_nodes": PILE_NODE,  # (bodies + 1,)
}

WORKSPACE = np.dtype(
    [
        ("num_pairs", np.int64),  # in ``pairs``
        ("starts", np.int64),  # address of the states (bodies,) where the present part of the step begins
        ("span", np.float64),  # [s] its length
        ("elapsed", np.float64),  # [s] of the step before it
        ("calm", np.float64),  # [s] the span, or the shorter one in which contacts that rest turn little enough to last
        ("part", np.int64),  # WHOLE, TO_IMPACT or LAST: what step_islands does about impacts that have to be located
        ("foreseen", np.int64),  # 1: ``ends`` says where this part leads, as a longer one that was solved has it
        ("waiting", np.int64),  # islands that wait for their impacts to be located
        ("num_members", np.int64),
        ("num_movers", np.int64),
        ("num_strayed", np.int64),
        ("penetration", np.float64),  # [m] in the report before the present step
        ("num_recent", np.int64),
        ("num_kept", np.int64),
        ("num_gone", np.int64),
        ("step", np.int64),  # number of the present one: what ``questions`` says of another one is forgotten
        ("num_answers", np.int64),
        ("fastest_rate", np.float64),  # [m/s] of any sample of moving heights
        ("heights_time", np.float64),  # [s] of the step at which ``heights_then`` are the heights
        ("num_islands", np.int64),
        ("impact_time", np.float64),  # [s] of the first impact, from the beginning of the present part
        ("detail", np.int64),  # entries that a full table needs
        ("tolerance", np.float64),  # asked of the solver
        ("budget", np.int64),  # factorisations it may take
        ("residual", np.float64),  # what it reached
        ("iterations", np.int64),  # what it took
        *((name, np.int64) for name in WORKSPACE_TABLES),
        *((f"{name}_size", np.int64) for name in WORKSPACE_TABLES),
    ],
    align=True,
)
