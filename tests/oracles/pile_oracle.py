"""Slow, obvious twins of the pile tier's short records: dense matrices, one contact at a time."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray


def contact_response(row: Any, nodes: Any) -> NDArray[np.float64]:
    """(3, 3) W of a contact in the frame (normal, t1, t2), from J M^-1 J^T."""
    frame = np.array([row["normal"], row["t1"], row["t2"]])
    total = np.zeros((3, 3))
    for node, arm in ((nodes[row["a"]], row["arm_a"]), (nodes[row["b"]], row["arm_b"])):
        inertia = np.zeros((3, 3))
        inertia[np.triu_indices(3)] = node["inverse_inertia"]
        inertia = inertia + inertia.T - np.diag(np.diag(inertia))
        turning = np.cross(arm, frame)  # rows: arm x direction
        total += node["inverse_mass"] * np.eye(3) + turning @ inertia @ turning.T
    return total


def law_residual(
    friction: float, response: NDArray[np.float64], impulse: NDArray[np.float64], velocity: NDArray[np.float64]
) -> float:
    """|F| of one contact: F = r - P_K(r - (u + mu |u_t| n) / Wd), with Wd = trace(W) / 3."""
    corrected = velocity + np.array([friction * np.hypot(velocity[1], velocity[2]), 0.0, 0.0])
    aim = impulse - corrected / (response.trace() / 3.0)
    slip = np.hypot(aim[1], aim[2])
    if slip <= friction * aim[0]:
        nearest = aim
    elif friction * slip <= -aim[0]:
        nearest = np.zeros(3)
    else:
        foot = (aim[0] + friction * slip) / (1.0 + friction**2)
        nearest = np.array([foot, *(friction * foot / slip * aim[1:])])
    return float(np.linalg.norm(impulse - nearest))


def spin_response(row: Any, nodes: Any) -> NDArray[np.float64]:
    """(3, 3) W_m of a contact's moment in the frame (normal, t1, t2)."""
    frame = np.array([row["normal"], row["t1"], row["t2"]])
    total = np.zeros((3, 3))
    for node in (nodes[row["a"]], nodes[row["b"]]):
        inertia = np.zeros((3, 3))
        inertia[np.triu_indices(3)] = node["inverse_inertia"]
        total += inertia + inertia.T - np.diag(np.diag(inertia))
    return frame @ total @ frame.T


def moment_residual(
    rolling: float, torsion: float, scale: float, moment: NDArray[np.float64], spin: NDArray[np.float64]
) -> float:
    """|F| of a moment (normal, t1, t2): F = m - P(m - w / scale), P on |m_t| <= ``rolling``, |m_n| <= ``torsion``."""
    aim = moment - spin / scale
    length = np.hypot(aim[1], aim[2])
    share = min(1.0, rolling / length) if length > 0.0 else 1.0
    nearest = np.array([np.clip(aim[0], -torsion, torsion), share * aim[1], share * aim[2]])
    return float(np.linalg.norm(moment - nearest))
