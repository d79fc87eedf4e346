"""Bounding-volume tree of the faces of a mesh: built once with NumPy, queried in kernels.

The tree is a perfect binary tree. Every level halves the faces of each node at the median along the longest axis of
their centroids (the k-d rule of Bentley 1975), all nodes of a level in one sort. Nodes lie depth first, each with the
index of the node that follows its subtree, so a query walks an array and needs no stack (Smits 1998, "Efficiency
issues for ray tracing", section 2.2).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ..jit import kernel
from ..maths import vec3
from ..shape_rows import NODE_ROW

# Most faces of a leaf. Smaller: a deeper tree, more memory; larger: more faces tested in vain.
FACES_OF_LEAF = 4


def build_static_tree(
    lower: NDArray[np.float64], upper: NDArray[np.float64]
) -> tuple[NDArray[np.void], NDArray[np.int64]]:
    """Build the tree over boxes.

    Args:
        lower, upper: (n, 3) [m] bounds of the faces, n >= 1.

    Returns:
        nodes: table of NODE_ROW, depth first.
        order: (n,) faces in the order of the leaves; ``first`` and ``count`` of a leaf refer to it.
    """
    n = len(lower)
    depth = max(0, math.ceil(math.log2(n / FACES_OF_LEAF)))
    leaves = 1 << depth
    starts = np.arange(leaves + 1) * n // leaves
    centroids = 0.5 * (lower + upper)
    order = np.arange(n)
    for level in range(depth):
        first = starts[:: leaves >> level]
        node = np.repeat(np.arange(1 << level), np.diff(first))
        ordered = centroids[order]
        low = np.minimum.reduceat(ordered, first[:-1])
        span = np.maximum.reduceat(ordered, first[:-1]) - low
        axis = np.argmax(span, axis=1)
        rows = np.arange(1 << level)
        low, span = low[rows, axis], span[rows, axis]
        along = (ordered[np.arange(n), axis[node]] - low[node]) / np.where(span > 0.0, span, 1.0)[node]
        # 0.5 keeps the nodes apart whatever the rounding of the sum.
        order = order[np.argsort(node + 0.5 * along, kind="stable")]

    nodes = np.zeros(2 * leaves - 1, NODE_ROW)
    position = np.zeros(1, np.int64)  # of the nodes of a level, depth first
    levels = [position]
    for level in range(depth):
        size = (leaves >> level) - 1  # of the subtree of a child
        position = np.stack([position + 1, position + 1 + size], axis=1).ravel()
        levels.append(position)
    low = np.minimum.reduceat(lower[order], starts[:-1])
    high = np.maximum.reduceat(upper[order], starts[:-1])
    nodes["first"][position] = starts[:-1]
    nodes["count"][position] = np.diff(starts)
    for level in range(depth, -1, -1):
        position = levels[level]
        nodes["lower"][position] = np.nextafter(low.astype(np.float32), np.float32(-np.inf))
        nodes["upper"][position] = np.nextafter(high.astype(np.float32), np.float32(np.inf))
        nodes["skip"][position] = position + 2 * (leaves >> level) - 1
        if level:
            low = np.minimum(low[0::2], low[1::2])
            high = np.maximum(high[0::2], high[1::2])
    return nodes, order


@kernel
def is_clear(node, lower, upper):
    """Whether the bounds of a node and a box [m] have nothing in common."""
    return (
        node.lower[0] > upper[0]
        or node.lower[1] > upper[1]
        or node.lower[2] > upper[2]
        or node.upper[0] < lower[0]
        or node.upper[1] < lower[1]
        or node.upper[2] < lower[2]
    )


@kernel
def box_distance_squared(node, p):
    """Squared distance [m^2] of a point from the box of a node."""
    x = max(node.lower[0] - p[0], 0.0, p[0] - node.upper[0])
    y = max(node.lower[1] - p[1], 0.0, p[1] - node.upper[1])
    z = max(node.lower[2] - p[2], 0.0, p[2] - node.upper[2])
    return vec3.norm_squared((x, y, z))


@kernel
def leaf_within(nodes, node, p, square):
    """The first leaf from ``node`` on that is nearer to p than the root of ``square`` [m^2], or their number."""
    while node < nodes.shape[0]:
        here = nodes[node]
        if box_distance_squared(here, p) >= square:
            node = int(here.skip)
        elif here.count == 0:
            node += 1
        else:
            break
    return node


@kernel
def leaf_near(nodes, p):
    """A leaf close to a point: always down to the nearer child. Gives a search its first bound."""
    node = 0
    while nodes[node].count == 0:
        left = node + 1
        right = int(nodes[left].skip)
        nearer = box_distance_squared(nodes[left], p) <= box_distance_squared(nodes[right], p)
        node = left if nearer else right
    return node
