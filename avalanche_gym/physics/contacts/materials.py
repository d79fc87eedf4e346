"""How two surfaces act on each other: the larger friction, the product of restitutions, or what ``set_pair`` fixed."""

from __future__ import annotations

import math

from ..jit import kernel


@kernel
def mix_materials(body_a, body_b, rule, contact):
    """Write the coefficients of a pair into a contact; ``rule`` is its PAIR_RULE record, NaN where it says nothing."""
    friction = rule.friction
    if math.isnan(friction):
        friction = max(body_a.friction, body_b.friction)
    restitution = rule.restitution
    if math.isnan(restitution):
        restitution = body_a.restitution * body_b.restitution
    contact.friction = friction
    contact.restitution = restitution
    contact.rolling_friction = max(body_a.rolling_friction, body_b.rolling_friction)
    contact.torsional_friction = max(body_a.torsional_friction, body_b.torsional_friction)
