"""What the narrow phase said in this step is used again only where it still holds."""

import numpy as np
import pytest

from avalanche_gym.physics.layout import WORKSPACE
from avalanche_gym.physics.model import ANSWER, BODY_STATE, CONTACT, QUESTION
from avalanche_gym.physics.narrow_phase.answers import (
    ANY_PAIR,
    AT_START,
    MOST_ANSWERS,
    MOST_QUESTIONS,
    ON_WAY,
    UNKNOWN,
    forget_answers,
    note_answers,
    recall_answers,
)

A, B = np.int64(0), np.int64(1)
MARGIN, MOTION = 0.02, 0.01  # [m]


def states_of_two():
    """(2,) states of two bodies at rest at the origin."""
    states = np.zeros(2, BODY_STATE)
    states["orientation"][:, 0] = 1.0
    return states


@pytest.fixture
def memory():
    """A workspace in which two contacts of two bodies are noted, those bodies, and the contacts."""
    tables = np.zeros(MOST_QUESTIONS, QUESTION), np.zeros(MOST_ANSWERS, ANSWER)
    record = np.zeros(1, WORKSPACE)
    record["questions"], record["answers"] = (table.ctypes.data for table in tables)
    contacts = np.zeros(2, CONTACT)
    contacts["pair"], contacts["feature"] = (3, 4), (5, 6)
    contacts["body_b"] = B
    contacts["gap"] = (0.001, 0.002)
    contacts["normal"] = (0.0, 0.0, 1.0)
    contacts["radius_b"] = 0.3
    states = states_of_two()
    forget_answers(record[0])
    note_answers(record[0], states, A, B, AT_START, MARGIN, MOTION, contacts, np.int64(0), np.int64(2))
    return record[0], states, contacts, tables


def recall(workspace, states, pair=ANY_PAIR, margin=MARGIN, motion=MOTION, room=4):
    contacts = np.zeros(room, CONTACT)
    count = recall_answers(workspace, states, A, B, np.int64(pair), margin, motion, contacts, np.int64(0))
    return count, contacts


def test_what_was_said_comes_back(memory):
    workspace, states, noted, _ = memory
    count, contacts = recall(workspace, states, margin=0.5 * MARGIN)
    assert count == 2
    for name in ("pair", "feature", "body_a", "body_b", "gap", "normal", "radius_b"):
        np.testing.assert_array_equal(contacts[name][:2], noted[name])


def test_one_pair_of_colliders(memory):
    workspace, states, _, _ = memory
    count, contacts = recall(workspace, states, pair=4)
    assert count == 1
    assert contacts["feature"][0] == 6


@pytest.mark.parametrize("asked", [{"margin": 1.1 * MARGIN}, {"motion": 1.1 * MOTION}])
def test_more_was_not_asked(memory, asked):
    workspace, states, _, _ = memory
    assert recall(workspace, states, **asked)[0] == UNKNOWN


@pytest.mark.parametrize("body", [0, 1])
@pytest.mark.parametrize("field", ["center", "orientation"])
def test_a_body_that_has_moved_is_another_question(memory, body, field):
    workspace, states, _, _ = memory
    states[field][body][1] = 1e-300
    assert recall(workspace, states)[0] == UNKNOWN


def test_another_step_begins_with_nothing(memory):
    workspace, states, _, _ = memory
    forget_answers(workspace)
    assert recall(workspace, states)[0] == UNKNOWN


def test_a_full_list_is_told_how_many_there_were(memory):
    workspace, states, _, _ = memory
    assert recall(workspace, states, room=1)[0] == 2


def test_when_the_table_is_full_all_is_forgotten(memory):
    workspace, states, noted, _ = memory
    for _ in range(MOST_ANSWERS // 2):
        note_answers(workspace, states, A, B, AT_START, MARGIN, MOTION, noted, np.int64(0), np.int64(2))
    assert workspace["num_answers"] == 2
    assert recall(workspace, states)[0] == 2


def test_what_a_search_was_told_serves_the_part_that_begins_there(memory):
    """Beside what was said at the start, which the part up to there asks once more, and then for the next search."""
    workspace, start, noted, _ = memory
    there = states_of_two()
    there["center"][:, 0] = 0.5
    note_answers(workspace, there, A, B, ON_WAY, MARGIN, MOTION, noted, np.int64(0), np.int64(1))
    assert recall(workspace, start)[0] == 2
    assert recall(workspace, there)[0] == 1
    farther = states_of_two()
    farther["center"][:, 0] = 0.7
    note_answers(workspace, farther, A, B, ON_WAY, MARGIN, MOTION, noted, np.int64(0), np.int64(2))
    assert recall(workspace, there)[0] == 1
    assert recall(workspace, farther)[0] == 2
