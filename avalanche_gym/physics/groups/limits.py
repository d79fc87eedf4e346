"""How much of a step is spent on impacts, and what may not be stepped through when nothing is left of it."""

from __future__ import annotations

from ..contacts.turning import turning_speed, whirls
from ..jit import kernel
from ..maths import vec3
from ..memory import bodies_of, colliders_of, table
from ..model import BOUNCED, CONTACT, DYNAMIC, LOSSLESS, MESH
from .members import states_in

# What the parts of a step may spend: so much for a group of few bodies, and less for a large one, whose parts cost
# more.
MOST_SPENT = 8192
MOST_BODIES_SPEND = 1 << 20
FEWEST_SPENT = 512
# What a part spends that ends with an impact without loss, any other, and one with an impact without rebound. Only what
# loses energy goes on without end; of what loses none a single impact left out shows in the energy. And what comes to
# rest rocks from corner to corner without end, and loses little if it is not followed. Where there are other bodies a
# quarter as many such impacts are due to each of them, until they are MANY and every impact costs more for it.
NO_LOSS, A_PART, NO_REBOUND = 1, 8, 256
MANY = 64


@kernel
def most_spent(count):
    """What a group of so many bodies may spend in a step."""
    return min(MOST_SPENT, max(FEWEST_SPENT, MOST_BODIES_SPEND // count))


@kernel
def spent_by(blow, count):
    """What a part of a group of ``count`` bodies spends that ends with an impact that came to ``blow``."""
    if blow == LOSSLESS:
        return NO_LOSS
    if blow == BOUNCED:
        return A_PART
    return min(NO_REBOUND, NO_REBOUND * max(4 * MANY // (3 + count), count) // MANY)


@kernel
def moves_mesh(header, bodies, contacts, num_contacts):
    """Whether a moving body of these contacts is a mesh.

    Only the corners of it that lead are listed. After a short part others lead, and one that should hold may not be
    among them: its step is not made of such parts.
    """
    colliders = colliders_of(header)
    for index in range(num_contacts):
        contact = contacts[index]
        for body, collider in (
            (contact.body_a, contact.pair // colliders.shape[0]),
            (contact.body_b, contact.pair % colliders.shape[0]),
        ):
            if bodies[body].motion == DYNAMIC and colliders[collider].shape == MESH:
                return True
    return False


@kernel
def could_pass(header, workspace, world, num_contacts, left):
    """Whether a body of the group turns so far in what is left [s] of the step that it could pass through another.

    What flies straight is held by the contacts of the last part, along the normals that these begin with.
    """
    bodies = bodies_of(header, world)
    begins = states_in(header, workspace.begins)
    contacts = table(workspace.contacts, workspace.contacts_size, CONTACT)
    for index in range(num_contacts):
        for side in range(2):
            body = contacts[index].body_a if side == 0 else contacts[index].body_b
            if bodies[body].motion == DYNAMIC:
                if whirls(bodies[body], begins[body], left):
                    speed = vec3.norm(vec3.load(begins[body].velocity))
                    speed += bodies[body].radius * turning_speed(bodies[body], begins[body])
                    if speed * left > contacts[index].size:
                        return True
    return False
