"""Bodies that cannot be, past the checks of our Scene: how the peers take them."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from avalanche_gym.physics import Scene, Sphere
from avalanche_gym.physics.scenes import HardCase
from avalanche_gym.physics.scenes.invariance import BAD_INPUTS


def unchecked(name: str) -> Scene:
    """A scene with one body whose fields were replaced after it was checked."""
    scene = Scene()
    scene.add_body(Sphere(0.1), mass=1.0, name="culprit")
    values = {key: value for key, value in BAD_INPUTS[name].items() if key in ("shape", "mass")}
    for key in ("position", "linear_velocity"):
        if key in BAD_INPUTS[name]:
            values[key] = np.array(BAD_INPUTS[name][key], float)
    if "inertia" in BAD_INPUTS[name]:
        values["inertia"] = np.diag(BAD_INPUTS[name]["inertia"])
    body = scene.bodies[0]
    assert body is not None
    scene.bodies[0] = replace(body, **values)
    return scene


def past_the_checks(case: HardCase) -> HardCase:
    """The same case, its scene unchecked."""
    return replace(case, scene=partial(unchecked, case.name.removeprefix("input_")))
