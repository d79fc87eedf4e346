"""What the narrow phase has said of two bodies in this step holds as long as neither of them has moved.

A step whose impacts are located is made in parts, and most parts begin where another one began: the part up to an
impact at the start of the whole step, the one after it at the instant of the blow, with other velocities. Contacts are
a function of both places and of how far the bodies may come, and what was listed for a longer way holds for a shorter
one. Only a mesh looks at the way itself, and heights that move are others at another instant: what these say is not
kept.
"""

from __future__ import annotations

import numpy as np

from ..jit import kernel
from ..maths import quat, vec3
from ..memory import table
from ..model import ANSWER, MESH, QUESTION

# Places for questions, each with the pairs that may take it, and for answers; if these are full all is forgotten. They
# never grow: what is asked again, and so the last bits of a world, must not depend on the worlds beside it.
MOST_QUESTIONS, MOST_ANSWERS = 128, 512
# Half of the questions are about places where parts of the step begin, half about the instant of an impact that a
# search has found: what was asked at the start is asked once more, for the part up to there.
AT_START, ON_WAY = 0, MOST_QUESTIONS // 2
# Contacts are asked for so much farther than flight can lead: what contacts turn faster than it flies would have to be
# asked about again. Larger: more contacts that cannot matter.
FORESIGHT = 1.1
# A way that is longer by round-off is no longer one.
ALMOST = 1.0 - 1e-12
# In place of a collider pair: all of two bodies.
ANY_PAIR = -1
# In place of a number of contacts: it has not been asked.
UNKNOWN = -1


@kernel
def forget_answers(workspace):
    """Nothing has been asked."""
    workspace.step += 1
    workspace.num_answers = 0


@kernel
def keeps_answers(colliders, body_a, body_b):
    """Whether the answers about two bodies are worth keeping: both of one piece, and none of them a mesh."""
    if body_a.num_colliders != 1 or body_b.num_colliders != 1:
        return False
    return colliders[body_a.first_collider].shape != MESH and colliders[body_b.first_collider].shape != MESH


@kernel
def _question_about(workspace, a, b, half):
    """The only place in one half where that about two bodies may be: another pair may have taken it."""
    return table(workspace.questions, MOST_QUESTIONS, QUESTION)[half + (7 * a + b) % ON_WAY]


@kernel
def _note_place(places, start, state):
    for axis in range(3):
        places[start + axis] = state.center[axis]
    q = quat.load(state.orientation)
    for index in range(4):
        places[start + 3 + index] = q[index]


@kernel
def _stands_there(places, start, state):
    for axis in range(3):
        if places[start + axis] != state.center[axis]:
            return False
    q = quat.load(state.orientation)
    return (
        places[start + 3] == q[0]
        and places[start + 4] == q[1]
        and places[start + 5] == q[2]
        and places[start + 6] == q[3]
    )


@kernel
def note_answers(workspace, states, a, b, half, margin, motion, contacts, first, last):
    """Keep contacts[first:last], all that bodies a and b at ``states`` have within ``margin`` [m] if they come closer
    by no more than ``motion`` [m]; ``half``: AT_START or ON_WAY.
    """
    answers = table(workspace.answers, MOST_ANSWERS, ANSWER)
    if last > contacts.shape[0] or last - first > MOST_ANSWERS:
        return
    if workspace.num_answers + last - first > MOST_ANSWERS:
        forget_answers(workspace)
    question = _question_about(workspace, a, b, half)
    question.body_a = a
    question.body_b = b
    question.step = workspace.step
    question.margin = margin
    question.motion = motion
    question.first = workspace.num_answers
    question.count = last - first
    _note_place(question.places, 0, states[a])
    _note_place(question.places, 7, states[b])
    for index in range(first, last):
        contact = contacts[index]
        answer = answers[workspace.num_answers]
        answer.pair = contact.pair
        answer.feature = contact.feature
        vec3.store(answer.position, vec3.load(contact.position))
        vec3.store(answer.normal, vec3.load(contact.normal))
        answer.gap = contact.gap
        answer.frame = contact.frame
        answer.curved = contact.curved
        answer.radius_a = contact.radius_a
        answer.radius_b = contact.radius_b
        workspace.num_answers += 1


@kernel
def _answers(workspace, question, states, a, b, margin, motion):
    """Whether a question was about these bodies at these places, and about as much."""
    if question.step != workspace.step or question.body_a != a or question.body_b != b:
        return False
    if question.margin < ALMOST * margin or question.motion < ALMOST * motion:
        return False
    return _stands_there(question.places, 0, states[a]) and _stands_there(question.places, 7, states[b])


@kernel
def recall_answers(workspace, states, a, b, pair, margin, motion, contacts, count):
    """Append the contacts of bodies a < b, or of one ``pair`` of their colliders, if they are known.

    Returns the new count as ``manifold.emit`` does, or UNKNOWN.
    """
    question = _question_about(workspace, a, b, AT_START)
    if not _answers(workspace, question, states, a, b, margin, motion):
        found = _question_about(workspace, a, b, ON_WAY)
        if not _answers(workspace, found, states, a, b, margin, motion):
            return np.int64(UNKNOWN)
        # A part begins there, on whose way the next impact is looked for.
        questions = table(workspace.questions, MOST_QUESTIONS, QUESTION)
        questions[AT_START + (7 * a + b) % ON_WAY] = found
    answers = table(workspace.answers, MOST_ANSWERS, ANSWER)
    for index in range(question.first, question.first + question.count):
        answer = answers[index]
        if pair != ANY_PAIR and answer.pair != pair:
            continue
        if count < contacts.shape[0]:
            contact = contacts[count]
            contact.pair = answer.pair
            contact.body_a = a
            contact.body_b = b
            contact.feature = answer.feature
            vec3.store(contact.position, vec3.load(answer.position))
            vec3.store(contact.normal, vec3.load(answer.normal))
            contact.gap = answer.gap
            contact.frame = answer.frame
            contact.curved = answer.curved
            contact.radius_a = answer.radius_a
            contact.radius_b = answer.radius_b
            vec3.store(contact.surface_velocity, vec3.ZERO)
            vec3.store(contact.surface_acceleration, vec3.ZERO)
        count += 1
    return count
