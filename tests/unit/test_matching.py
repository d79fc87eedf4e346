"""What a contact inherits from the same contact before."""

from __future__ import annotations

import numpy as np
import pytest

from avalanche_gym.physics.contacts.matching import match_contacts
from avalanche_gym.physics.model import BODY, CONTACT, DYNAMIC, STATIC


@pytest.mark.parametrize(("acted", "expected"), [(0.01, 2.0), (0.02, 1.0), (0.0, 1.0)])
def test_a_force_grows_with_the_step_and_a_blow_does_not(acted: float, expected: float) -> None:
    """A blow taken for a force of the tiny part of a step in which it fell threw bodies at 4 km/s."""
    bodies = np.zeros(2, BODY)
    bodies["motion"] = (STATIC, DYNAMIC)
    old, new = np.zeros(1, CONTACT), np.zeros(1, CONTACT)
    for contact in (old, new):
        contact["body_b"] = 1
        contact["size"] = 0.1
        contact["normal"] = (0.0, 0.0, 1.0)
    old["impulse"] = (0.0, 0.0, 1.0)
    old["span"] = acted
    match_contacts(bodies, old, 1, new, 1, 0.02, np.zeros(3, np.int64), np.zeros(1, np.int64))
    assert new["impulse"][0, 2] == expected
    assert new["persistent"][0] == 1
