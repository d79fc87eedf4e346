"""What the trapezoid leaves of gaps, overlaps and creep, and how it is made good.

A point that rests on turning ground is left behind by O(h^3) in each step. The solver knows velocities only, so it
would never be told. A lasting contact therefore remembers how far it has crept along the surface since it sticks, and
asks for a velocity that makes a share of that, and of its gap, good in a step.
"""

from __future__ import annotations

from ..contacts.kinematics import point_displacement
from ..contacts.prediction import DRIFT, OVERLAP, bears_load
from ..jit import kernel
from ..maths import quat, vec3
from ..model import DYNAMIC, ON_A

# Share of its gap, and of its creep along the surface while it sticks, that a lasting contact makes good in a step, at
# speeds far below any that matter.
CLOSING = 0.25
# Gaps, overlaps and creep below this fraction of the smaller body are left alone: what rests shall be still.
SETTLED = 3e-7


@kernel
def moved_together(bodies, contact):
    """Handles of the dynamic bodies of a contact, the smaller first, -1 for what is not dynamic: contacts with the same
    are parts of one relative motion, whatever colliders touch and however many bodies the ground is made of.
    """
    a = contact.body_a if bodies[contact.body_a].motion == DYNAMIC else -1
    b = contact.body_b if bodies[contact.body_b].motion == DYNAMIC else -1
    return min(a, b), max(a, b)


@kernel
def drifts_away(bodies, contacts, order, first, last, movers):
    """Whether a lasting contact of these bodies has a gap, an overlap or a creep worth making good.

    One answer for all contacts of a relative motion: what each asks for on its own, no motion of rigid bodies may be
    able to give. None for those of others: a box that rests would be asked to mend its round-off while a ball rolls
    along it.
    """
    for index in range(first, last):
        contact = contacts[order[index]]
        if contact.persistent == 1 and moved_together(bodies, contact) == movers:
            squares = contact.start_gap**2 + vec3.norm_squared(vec3.load(contact.creep))
            if squares > (SETTLED * contact.size) ** 2:
                return True
    return False


@kernel
def gap_closing(contact, whole_step):
    """The normal velocity [m/s] by which a lasting contact makes its gap good; what is deeper than DRIFT is left to the
    position stage.
    """
    return CLOSING * contact.start_gap / whole_step if contact.start_gap >= -DRIFT * contact.size else 0.0


@kernel
def note_sticking(time_step, contacts, touching, num_touching, rows):
    """Set ``sticks`` of each contact that touches from the solved problem, whose rows are still there.

    A contact sticks if it bears load and has no velocity, also if its friction happens to be at its limit.
    """
    for index in range(num_touching):
        contact = contacts[touching[index]]
        velocity = vec3.load(rows[index].velocity)
        normal = vec3.load(contact.normal)
        slip = time_step * vec3.norm(vec3.add_scaled(velocity, -vec3.dot(velocity, normal), normal))
        sticks = contact.persistent == 1 and bears_load(contact) and slip <= OVERLAP * contact.size
        contact.sticks = 1 if sticks else 0


@kernel
def add_creep(starts, ends, contacts, order, first, last):
    """Add up how far each contact that sticks has crept along its tangents, which a true one would not.

    It counts from the end of the step in which the contact came to rest, and turns with the ground. Only corners: where
    round shapes roll, the material at the contact is always another.
    """
    for index in range(first, last):
        contact = contacts[order[index]]
        creep = vec3.ZERO
        corner = contact.radius_a == 0.0 and contact.radius_b == 0.0 and contact.curved == 0
        if corner and contact.stuck == 1 and contact.sticks == 1:
            a = contact.body_a
            b = contact.body_b
            carrier = a if contact.frame == ON_A else b
            point = vec3.load(contact.start_position)
            moved = point_displacement(starts[b], ends[b], point)
            moved = vec3.sub(moved, point_displacement(starts[a], ends[a], point))
            before = quat.load(starts[carrier].orientation)
            after = quat.load(ends[carrier].orientation)
            if vec3.norm_squared(moved) == 0.0 and before == after:
                # To the last bit: turning it to and fro would change that.
                continue
            creep = quat.rotate(after, quat.rotate_inverse(before, vec3.load(contact.creep)))
            creep = vec3.add(creep, moved)
            normal = vec3.load(contact.end_normal)
            creep = vec3.add_scaled(creep, -vec3.dot(creep, normal), normal)
        vec3.store(contact.creep, creep)
