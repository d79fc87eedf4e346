"""One question to one collider, in the collider's frame; the function of a shape is reached through its address."""

from __future__ import annotations

import numpy as np

from ..jit import kernel
from ..maths import vec3
from ..memory import table

PROBE = np.dtype(
    [
        ("header", np.int64),  # address
        ("world", np.int64),
        ("shape", np.int64),
        ("data", np.int64),  # row in the table of the shape
        ("size", np.float64, 3),  # [m] as in model.COLLIDER
        ("origin", np.float64, 3),  # [m] of the ray, or the point
        ("direction", np.float64, 3),  # unit, of the ray
        ("limit", np.float64),  # [m] what is farther does not count
        ("distance", np.float64),  # [m] answer: along the ray, or signed from the surface
        ("normal", np.float64, 3),  # answer: unit, outward
        ("scratch", np.int64),  # address of floats (256, 8)
    ],
    align=True,
)

MISS, HIT = 0, 1


@kernel
def probe_at(address):
    return table(address, 1, PROBE)[0]


@kernel
def answer(probe, distance, normal):
    """Write an answer that is within the limit; return HIT, or MISS if it is not."""
    if not distance <= probe.limit:
        return MISS
    probe.distance = distance
    vec3.store(probe.normal, normal)
    return HIT


@kernel
def answer_inside(probe):
    """A ray that starts in a solid meets it at once, head on."""
    return answer(probe, 0.0, vec3.neg(vec3.load(probe.direction)))
