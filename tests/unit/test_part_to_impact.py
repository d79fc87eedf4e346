"""A part of a step that is made shorter, up to an impact on its way, begins with what the longer one has found."""

import numpy as np
import pytest

from avalanche_gym.physics.contacts.located import leave_open
from avalanche_gym.physics.groups.contacts import hand_back
from avalanche_gym.physics.layout import WORKSPACE
from avalanche_gym.physics.model import BODY, BODY_STATE, CONTACT, LIVELY
from avalanche_gym.physics.response.lasting import settle_where_foreseen

SPAN = 0.005  # [s] of the longer part
LOAD = (0.0, 0.0, 0.03)  # [N s]
ALMOST, SIZE = 1e-6, 0.1


@pytest.fixture
def parts():
    """A workspace, the contacts of the part before it, and those of the longer part: one that lasts, one left out."""
    recent, contacts = np.zeros(3, CONTACT), np.zeros(2, CONTACT)
    recent["pair"], recent["feature"] = 1, (7, 8, 9)
    recent["normal"] = (0.0, 0.0, 1.0)
    recent["impulse"][:, 2] = 0.5
    recent["span"] = 1.0
    contacts["pair"], contacts["feature"] = 1, (8, 9)
    contacts["normal"] = (0.0, 0.0, 1.0)
    contacts["span"] = SPAN
    contacts["impulse"] = LOAD
    contacts["persistent"], contacts["located"] = (1, 0), (0, LIVELY)
    record = np.zeros(1, WORKSPACE)
    record["recent"], record["recent_size"], record["num_recent"] = recent.ctypes.data, 3, 3
    record["contacts"], record["contacts_size"] = contacts.ctypes.data, 2
    return record[0], recent, contacts


def test_forces_are_handed_back(parts):
    workspace, recent, _ = parts
    assert hand_back(workspace, np.int64(2))
    np.testing.assert_array_equal(recent["impulse"], [(0.0, 0.0, 0.5), LOAD, (0.0, 0.0, 0.5)])
    np.testing.assert_array_equal(recent["span"], [1.0, SPAN, 1.0])


def test_what_bore_nothing_keeps_what_it_came_with(parts):
    workspace, recent, contacts = parts
    contacts["impulse"] = 0.0
    assert hand_back(workspace, np.int64(2))
    np.testing.assert_array_equal(recent["impulse"][:, 2], 0.5)


def test_a_struck_part_hands_nothing_back(parts):
    workspace, recent, contacts = parts
    contacts["persistent"] = 0
    assert not hand_back(workspace, np.int64(2))
    np.testing.assert_array_equal(recent["impulse"][:, 2], 0.5)


def test_what_does_not_last_is_left_out():
    contacts = np.zeros(3, CONTACT)
    contacts["persistent"] = (1, 0, 1)
    order = np.array([2, 1, 0])
    assert leave_open(contacts, order, np.int64(0), np.int64(3)) == LIVELY
    np.testing.assert_array_equal(contacts["located"], (0, LIVELY, 0))


@pytest.mark.parametrize(("missed", "there"), [(0.5 * ALMOST * SIZE, True), (2.0 * ALMOST * SIZE, False)])
@pytest.mark.parametrize("turns", [False, True])
def test_a_place_that_came_true_is_where_the_part_ends(missed, there, turns):
    bodies, flown, predicted, ends = np.zeros(1, BODY), *np.zeros((3, 1), BODY_STATE)
    bodies["inverse_mass"], bodies["size"], bodies["radius"] = 2.0, SIZE, SIZE
    for states in (flown, predicted, ends):
        states["orientation"][:, 0] = 1.0
    if turns:
        half = 0.5 * missed / SIZE
        predicted["orientation"][0] = (np.cos(half), 0.0, np.sin(half), 0.0)
    else:
        predicted["center"][0, 1] = missed
    flown["velocity"][0] = (0.0, 0.0, -0.05)
    sums = np.array([[*LOAD, 0.0, 0.0, 0.0]])
    members = np.zeros(1, np.int64)
    settle_where_foreseen(bodies, ALMOST, flown, sums, members, np.int64(0), np.int64(1), predicted, ends)
    for name in ("center", "orientation"):
        assert np.array_equal(ends[name], predicted[name]) == (there or name != ("orientation" if turns else "center"))
    if there:
        np.testing.assert_allclose(ends["velocity"][0], (0.0, 0.0, 0.01), atol=1e-15)
