"""Which impacts without rebound are worth the cost of stopping an island for them (contacts/located.py)."""

from __future__ import annotations

from ..contacts.located import ALL, FLYING, NONE, ROUND, any_lasts
from ..jit import kernel
from ..maths import vec3
from ..memory import colliders_of, table
from ..model import DYNAMIC, LEAST_BODIES, MESH, MOST_ON_TERRAIN, PLANE
from ..shape_rows import MESH_ROW

# Islands of so many bodies are stopped for all that they strike, and stepped in parts in which they turn little.
PAIR = 2
# A mesh that moves by more than this share of its facets within a step is struck somewhere all the time as it rolls on
# ground, and is not stopped for each. Larger: more searches; smaller: a coarse solid lands only where its step ends.
SOON = 0.1


@kernel
def worth_locating(header, bodies, starts, contacts, order, first, last, members, first_body, last_body):
    """Which impacts without rebound of an island are worth the cost of stopping it: NONE, ROUND, FLYING or ALL of them.

    In a world of few bodies those of an island in flight, of what comes flying to one that rests, and all that a body
    alone or a pair strikes; in a crowd those of an island in flight where the normal depends on the instant.
    """
    num_bodies = last_body - first_body
    if num_bodies >= LEAST_BODIES:
        return NONE
    if not any_lasts(contacts, order, first, last):
        return ALL if header.step_pile == 0 else ROUND
    if header.step_pile != 0 or _rolls_on_facets(header, bodies, starts, contacts, order, first, last):
        return NONE
    if num_bodies > 1:
        for index in range(first_body, last_body):
            if colliders_of(header)[bodies[members[index]].first_collider].shape == MESH:
                # Meshes that touch one another strike somewhere in every step.
                return NONE
    return ALL if num_bodies <= PAIR else FLYING


@kernel
def _rolls_on_facets(header, bodies, starts, contacts, order, first, last):
    """Whether a contact that lasts is between a mesh and ground, and it is struck there somewhere in every step.

    It has more contacts than are known, or comes to its next facets in few steps.
    """
    colliders = colliders_of(header)
    known = 0
    lasts = False
    for index in range(first, last):
        contact = contacts[order[index]]
        for body, number, other in (
            (contact.body_a, contact.pair // colliders.shape[0], contact.pair % colliders.shape[0]),
            (contact.body_b, contact.pair % colliders.shape[0], contact.pair // colliders.shape[0]),
        ):
            if bodies[body].motion != DYNAMIC or colliders[number].shape != MESH or colliders[other].shape <= PLANE:
                continue
            known += 1
            if contact.persistent == 0:
                continue
            lasts = True
            mesh = table(header.meshes, header.meshes_size, MESH_ROW)[colliders[number].data]
            radius = bodies[body].radius
            speed = vec3.norm(vec3.load(starts[body].velocity))
            speed += radius * vec3.norm(vec3.load(starts[body].angular_velocity))
            # The length of a facet is about 4 radius / sqrt(num_faces): a box of half diagonal r has area 8 r^2.
            way = speed * header.time_step
            if way * way * mesh.num_faces > (SOON * 4.0 * radius) ** 2:
                return True
    return lasts and known >= MOST_ON_TERRAIN
