"""Scratch memory of the contact solver: one per thread, allocated once and reused by every island and step.

Four arrays, so that kernels allocate nothing:

``rows``    one record a contact: the data of its three equations and the present iterate; behind them one for each
            contact with rolling or torsional friction, whose impulse is a moment and whose velocity an angular one
``nodes``   one record a dynamic body of the island, and a last one that stands for everything that cannot be moved
``blocks``  6 x 6 blocks of the factorisation (solver/factorisation.py)
``index``   integers: which body is which node, elimination order, pattern of the factorisation (solver/elimination.py)

``blocks`` and ``index`` are sized for ordinary islands. An island whose pattern does not fit makes ``solve_island``
return NEEDS_MEMORY and write the sizes it wants into ``index[:2]``; ``Workspace.grow`` then enlarges both.
"""

from __future__ import annotations

import numpy as np

# ``row.status``: what a contact does in a Newton step.
OPEN, STICK, SLIP = 0, 1, 2

ROW = np.dtype(  # (contacts of the island,)
    [
        ("a", np.int64),  # node of body a
        ("b", np.int64),  # node of body b
        ("of", np.int64),  # -1: a contact; else a moment, and this is the row whose normal impulse limits it
        ("friction", np.float64),  # of a moment: rolling friction [m]
        ("torsion", np.float64),  # of a moment: torsional friction [m]
        ("scale", np.float64),  # [1/kg] trace(W_ii) / 3: velocity per impulse at this contact; 0 if nothing can move
        ("inverse", np.float64),  # [kg] 1 / scale, or 0
        ("normal", np.float64, 3),  # unit, from a to b, world frame
        ("arm_a", np.float64, 3),  # [m] from the centre of mass of a to the contact, world frame
        ("arm_b", np.float64, 3),
        # w [m/s]: relative velocity of b against a without impulses, plus bias along the normal
        ("free", np.float64, 3),
        ("speed", np.float64),  # [m^2/s^2] squares of the velocities that w is made of: their round-off is in it
        ("impulse", np.float64, 3),  # r [N s] on b, world frame
        ("velocity", np.float64, 3),  # u = G y + w [m/s]
        ("accepted", np.float64, 3),  # r before the step that is on trial
        ("best", np.float64, 3),  # r of the smallest residual so far
        ("status", np.int64),  # OPEN, STICK or SLIP
        ("shared", np.int64),  # part in the sharing of loads (solver/sharing.py)
        ("slack", np.float64),  # [m/s] that its normal velocity may differ from that of a rigid motion by
        ("share", np.float64),  # [N s] or [m/s] of it, in between
        ("basis", np.float64, 6),  # row of Q
        ("coupling", np.float64, 3),  # of a moment: what it gains per normal impulse of its contact [m]
        ("offset", np.float64, 3),  # A of the Newton step dr = A - B du [N s]
        ("stiffness", np.float64, 9),  # B [kg]
        ("x", np.float64, 3),  # (mu r_n, r_t) of the interior-point method [N s]
        ("z", np.float64, 3),  # (u_n / mu + |u_t|, u_t) [m/s]
        ("scaling", np.float64, 3),  # w and h with x = h (2 w w^T - 2 n n^T + 1) z
        ("stretch", np.float64),
        ("dx", np.float64, 3),
        ("dz", np.float64, 3),
        ("local", np.float64, 6),  # W_ii [1/kg] in the frame (normal, t1, t2): nn, n1, n2, 11, 12, 22; for sweeps only
    ],
    align=True,
)

NODE = np.dtype(  # (dynamic bodies of the island + 1,)
    [
        ("root", np.float64),  # 1 / sqrt(m) [kg^-1/2], 0 for what cannot be moved
        ("axes", np.float64, 9),  # R diag(1 / sqrt(I)) [kg^-1/2 m^-1]: scaled angular velocity -> world frame
        ("trace", np.float64),  # sum of 1 / I [1/(kg m^2)]
        ("linear", np.float64, 3),  # sum of impulses [N s], then the change of velocity they make [m/s]
        ("angular", np.float64, 3),  # sum of moments [N m s], then the change of angular velocity [rad/s]
        ("scaled", np.float64, 6),  # right side, then solution y of the linear system [kg^1/2 m/s]
    ],
    align=True,
)

# Blocks and integers a body for which a new workspace has room: the fill of ordinary piles.
BLOCKS_PER_BODY = 12
INDEX_PER_BODY = 16


class Workspace:
    """The scratch arrays of one thread.

    Args:
        max_contacts: most contacts of an island.
        max_bodies: bodies of a world, static ones included (handles are below this number).
    """

    def __init__(self, max_contacts: int, max_bodies: int) -> None:
        self.rows = np.zeros(max(max_contacts, 1), ROW)
        self.nodes = np.zeros(max_bodies + 1, NODE)
        self.blocks = np.zeros((BLOCKS_PER_BODY * max_bodies + 4, 36))
        self.index = np.zeros(INDEX_PER_BODY * max_bodies + 64, np.int64)

    @property
    def arrays(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """``rows, nodes, blocks, index``: the last four arguments of ``solve_island`` and ``project_island``."""
        return self.rows, self.nodes, self.blocks, self.index

    def grow(self) -> None:
        """Make room for what the last NEEDS_MEMORY asked for. The arrays are replaced; their content is not kept."""
        num_blocks, num_integers = int(self.index[0]), int(self.index[1])
        if num_blocks > len(self.blocks):
            self.blocks = np.zeros((num_blocks + num_blocks // 2, 36))
        if num_integers > len(self.index):
            self.index = np.zeros(num_integers + num_integers // 2, np.int64)
