"""Overlap at the end of a step is removed by moving the bodies, without adding velocity (solver/projection.py)."""

from __future__ import annotations

import math

from ..contacts.prediction import DRIFT
from ..jit import kernel
from ..maths import vec3
from ..model import SLACK
from ..solver.problem import prepare_nodes, prepare_rows
from ..solver.projection import prepare_gaps
from .bodies import shift

# Relative residual of the projection: what remains is about this part of the overlap.
PROJECTION_TOLERANCE = 1e-9


@kernel
def overlaps(contacts, order, first, last):
    """Whether any contact of an island overlaps by more than round-off."""
    for index in range(first, last):
        contact = contacts[order[index]]
        if contact.gap < -DRIFT * contact.size:
            return True
    return False


@kernel
def prepare_projection(bodies, ends, contacts, order, first, last, members, first_body, last_body, rows, nodes, index):
    """Write the problem of one island's overlaps at the end of the step."""
    size = math.inf
    for number in range(first, last):
        size = min(size, contacts[order[number]].size)
    num_bodies = last_body - first_body
    own = last - first
    prepare_nodes(bodies, ends, members[first_body:], num_bodies, nodes, index)
    prepare_rows(contacts, order[first:], own, bodies, ends, num_bodies, rows, nodes, index)
    prepare_gaps(contacts, order[first:], own, SLACK * size, rows)


@kernel
def push_apart(bodies, nodes, members, first_body, last_body, ends):
    """Move the bodies by the displacements that were solved for."""
    for number in range(first_body, last_body):
        handle = members[number]
        node = nodes[number - first_body]
        shift(bodies[handle], ends[handle], vec3.load(node.linear), vec3.load(node.angular))
