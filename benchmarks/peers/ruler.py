"""How deep the bodies of a pile are in one another, measured for every engine by one of them: MuJoCo's collision tests.

Contacts with the ground are left out: height fields differ between engines, bodies do not.
"""

from __future__ import annotations

import mujoco
import numpy as np

from avalanche_gym.physics.scenes import HardCase, Recording

from .mujoco_engine import MuJoCo


def overlaps(case: HardCase, recording: Recording) -> dict[str, float]:
    """[m] overlap of pairs of bodies in the last sample: the 99th percentile of those that touch, and the deepest."""
    simulation = MuJoCo(case, case.scene(), 1.0 / 240.0, "EULER")
    model, data = simulation.model, simulation.data
    for body, (at, _) in simulation.joints.items():
        data.qpos[at : at + 3] = recording.position[-1, body]
        data.qpos[at + 3 : at + 7] = recording.orientation[-1, body]
    mujoco.mj_fwdPosition(model, data)
    moving = np.isin(np.arange(model.nbody), [model.body(f"b{body}").id for body in simulation.joints])
    first, second = (moving[model.geom_bodyid[data.contact.geom[:, side]]] for side in (0, 1))
    depths = np.maximum(0.0, -data.contact.dist[first & second])
    if len(depths) == 0:
        return {"overlap 99 %": 0.0, "overlap max": 0.0}
    return {"overlap 99 %": float(np.percentile(depths, 99)), "overlap max": float(depths.max())}
