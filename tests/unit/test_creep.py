"""Which contacts make good what the step left of their gaps and their creep."""

import numpy as np
import pytest

from avalanche_gym.physics.model import BODY, CONTACT, DYNAMIC, STATIC
from avalanche_gym.physics.response.creep import drifts_away, moved_together

FLOOR, OTHER_FLOOR, BOX, BALL = range(4)
SIZE = 0.1


@pytest.fixture
def bodies():
    found = np.zeros(4, BODY)
    found["motion"] = STATIC
    found["motion"][[BOX, BALL]] = DYNAMIC
    return found


def contacts_of(*rows):
    """Lasting contacts: bodies a and b, and the gap [m]."""
    found = np.zeros(len(rows), CONTACT)
    found["persistent"] = 1
    found["size"] = SIZE
    for contact, (a, b, gap) in zip(found, rows, strict=True):
        contact["body_a"], contact["body_b"], contact["start_gap"] = a, b, gap
    return found, np.arange(len(rows))


def drifting(bodies, contacts, order):
    return [drifts_away(bodies, contacts, order, 0, len(order), moved_together(bodies, contacts[n])) for n in order]


def test_a_box_that_rests_is_not_asked_to_mend_round_off_while_a_ball_rolls_along_it(bodies):
    contacts, order = contacts_of((FLOOR, BOX, 1e-9), (FLOOR, BOX, -1e-9), (FLOOR, BALL, 1e-6), (BOX, BALL, 1e-5))
    assert drifting(bodies, contacts, order) == [False, False, True, True]


def test_all_contacts_of_one_relative_motion_are_asked_together(bodies):
    """Whatever the ground is made of, and whichever of the two bodies comes first."""
    contacts, order = contacts_of((FLOOR, BOX, 1e-5), (OTHER_FLOOR, BOX, 1e-9), (BOX, BALL, 1e-5), (BALL, BOX, 0.0))
    assert drifting(bodies, contacts, order) == [True] * 4


def test_what_strikes_does_not_count(bodies):
    contacts, order = contacts_of((FLOOR, BOX, 1e-9), (FLOOR, BOX, 1e-3))
    contacts["persistent"][1] = 0
    assert drifting(bodies, contacts, order) == [False, False]
