"""How contacts of one pair of bodies share a load that the contact law does not divide among them.

A box that slides on a floor touches it with four corners, a rigid motion has three velocities along their normals, and
one combination of four normal forces does nothing: the law leaves it open. But friction goes with the load, and where
the box turns as it slides its corners slip in different directions, so its motion depends on that combination. Left to
the method it is what round-off made of the last step's. Here it is a law, that of equal springs under all of them (a
Winkler foundation, as stiff as one likes): with g_i the normal velocity of contact i in the six relative motions of the
pair,

    r_n = max(0, g_i . lambda)    for all contacts that touch;

of all loads that do the same it is the one with the least sum of squares. Loads of contacts that bear are then in the
range of G_n = (g_i), and with an orthonormal basis Q of that range (Gram and Schmidt)

    r_n = Q Q^T r_n,        u_n = Q Q^T u_n,

the second since the velocities of a rigid motion are in that range as well. A Newton step moves loads outside of it by
nothing but round-off divided by its weight, so both are asserted in every step and it converges as before.

Velocities that no rigid motion can have (gaps and turns that differ) decide by themselves which contacts bear: such
pairs are left alone. But where they come to less than SLACK of a body in the step, as on a floor whose triangles are
flat to some digits only, the difference is dropped, or the load would jump from corner to corner with each of them.
Pairs in which nothing slips are left alone as well, since sharing changes nothing that moves there.
"""

from __future__ import annotations

import math

from ..jit import kernel
from ..maths import vec3
from .workspace import SLIP

# A motion whose normal velocities at the contacts of a pair differ from those of the others by less than this fraction
# of themselves is none of its own. Smaller: round-off in the normals counts; larger: what is nearly flat is taken for
# flat.
DISTINCT = 1e-6
# A contact whose normal velocity differs by more than this from what the others of its pair tell is plainly its own.
# Larger: more pairs are looked at closely; it must be far above DISTINCT.
PLAIN = 1e-4
# Normal velocity, as a fraction of the velocities that it is the difference of, below which a contact touches: some
# units of round-off. Smaller: round-off decides which contacts touch.
TOUCHING = 64 * 2.220446049250313e-16
# Way within a step, as a fraction of the smaller body, that contacts may differ by and still share. Smaller: less flat
# floors are felt; larger: gaps that open by as much and are made good later.
SLACK = 1e-8
# Motions of one body against another.
MOTIONS = 6
# Fewer contacts have nothing to share but what the law divides.
FEWEST = 3

# ``row.shared``: the contact has no part in it; it is one that bears nothing. Else the rank of G_n.
APART, SPARED = 0, -1


@kernel
def agree_on_shares(rows, num_contacts, num_bodies, tolerance):
    """Find the pairs of bodies that share loads; return whether there is one.

    Impulses and velocities of the rows are up to date. Sets ``shared`` of every contact, and of those that share
    ``basis`` and, in ``share``, the normal velocity that the motion of their pair has.
    """
    found = False
    first = 0
    while first < num_contacts and rows[first].of < 0:
        last = first
        closed = 0
        slides = False
        while last < num_contacts and rows[last].of < 0:
            row = rows[last]
            if row.a != rows[first].a or row.b != rows[first].b:
                break
            row.shared = APART
            touches, slips = _touches(row)
            if touches:
                row.shared = 1
                closed += 1
                slides = slides or slips
            last += 1
        if slides and closed >= FEWEST and _share(rows, first, last, closed, rows[first].b < num_bodies, tolerance):
            found = True
        else:
            for i in range(first, last):
                rows[i].shared = APART
        first = last
    return found


@kernel
def _touches(row):
    """Whether a contact touches, and whether it slips under load."""
    if row.scale == 0.0:
        return False, False
    normal = vec3.load(row.normal)
    velocity = vec3.load(row.velocity)
    impulse = vec3.load(row.impulse)
    z = vec3.add_scaled(impulse, -row.inverse, velocity)
    z_n = vec3.dot(z, normal)
    if z_n < 0.0 and z_n * row.scale < -TOUCHING * math.sqrt(row.speed):
        return False, False
    limit = row.friction * z_n
    slips = z_n > 0.0 and limit > 0.0 and vec3.norm_squared(vec3.add_scaled(z, -z_n, normal)) > limit * limit
    return True, slips


@kernel
def _share(rows, first, last, closed, own, tolerance):
    """Whether the contacts of a pair that are marked share loads; settles which of them do, and their basis."""
    if closed <= MOTIONS and _are_independent(rows, first, last, closed, own):
        return False
    rank = _orthonormalise(rows, first, last, closed, own)
    if rank == closed or not _is_rigid(rows, first, last, tolerance):
        return False
    while True:
        # What springs would pull bears nothing; the one that pulls most is let go first.
        least = 0.0
        pulling = -1
        for i in range(first, last):
            if rows[i].shared > 0:
                load = _spread(rows, first, last, i)
                if load < least:
                    least = load
                    pulling = i
        if pulling < 0:
            return True
        rows[pulling].shared = SPARED
        closed -= 1
        _orthonormalise(rows, first, last, closed, own)


@kernel
def _arm(row, own):
    """[m] From the centre of a body of the island: what cannot move may have its own far away, which costs digits."""
    return vec3.load(row.arm_b) if own else vec3.load(row.arm_a)


@kernel
def _square(rows, first, last, k):
    """Of column k of the basis."""
    total = 0.0
    for i in range(first, last):
        if rows[i].shared > 0:
            total += rows[i].basis[k] ** 2
    return total


@kernel
def _middle(rows, first, last, closed, own):
    """[m] Middle of the marked contacts, and the inverse of how far the farthest one is from it."""
    center = vec3.ZERO
    for i in range(first, last):
        if rows[i].shared > 0:
            center = vec3.add_scaled(center, 1.0 / closed, _arm(rows[i], own))
    reach = 0.0
    for i in range(first, last):
        if rows[i].shared > 0:
            reach = max(reach, vec3.norm_squared(vec3.sub(_arm(rows[i], own), center)))
    return center, 1.0 / math.sqrt(reach) if reach > 0.0 else 0.0


@kernel
def _are_independent(rows, first, last, closed, own):
    """Whether the marked contacts have plainly independent normal velocities, so that there is nothing to share.

    Gram and Schmidt over the few contacts, not over the motions as for the basis: on uneven ground this is most pairs,
    and a small part of that work. ``basis`` is scratch.
    """
    center, inverse = _middle(rows, first, last, closed, own)
    for i in range(first, last):
        row = rows[i]
        if row.shared == 0:
            continue
        push = vec3.load(row.normal)
        turn = vec3.scale(inverse, vec3.cross(vec3.sub(_arm(row, own), center), push))
        for k in range(first, i):
            other = rows[k]
            if other.shared > 0:
                b = other.basis
                other_push = (b[0], b[1], b[2])
                other_turn = (b[3], b[4], b[5])
                along = vec3.dot(other_push, push) + vec3.dot(other_turn, turn)
                push = vec3.add_scaled(push, -along, other_push)
                turn = vec3.add_scaled(turn, -along, other_turn)
        square = vec3.norm_squared(push) + vec3.norm_squared(turn)
        if square <= PLAIN * PLAIN:
            return False
        length = 1.0 / math.sqrt(square)
        b = row.basis
        b[0], b[1], b[2] = vec3.scale(length, push)
        b[3], b[4], b[5] = vec3.scale(length, turn)
    return True


@kernel
def _orthonormalise(rows, first, last, closed, own):
    """Q of the marked contacts among rows[first:last], into ``basis``; return its rank, which becomes the mark."""
    center, inverse = _middle(rows, first, last, closed, own)
    rank = 0
    for motion in range(MOTIONS):
        if rank == closed:
            break
        for i in range(first, last):
            row = rows[i]
            if row.shared > 0:
                normal = vec3.load(row.normal)
                turn = vec3.cross(vec3.sub(_arm(row, own), center), normal)
                row.basis[rank] = normal[motion] if motion < 3 else inverse * turn[motion - 3]
        square = _square(rows, first, last, rank)
        # Again where most of it was taken away: round-off of that is left.
        again = square > DISTINCT * DISTINCT * closed
        while again:
            before = square
            for k in range(rank):
                along = 0.0
                for i in range(first, last):
                    if rows[i].shared > 0:
                        along += rows[i].basis[k] * rows[i].basis[rank]
                for i in range(first, last):
                    if rows[i].shared > 0:
                        rows[i].basis[rank] -= along * rows[i].basis[k]
            square = _square(rows, first, last, rank)
            again = DISTINCT * DISTINCT * closed < square < 0.5 * before
        if square > DISTINCT * DISTINCT * closed:
            for i in range(first, last):
                if rows[i].shared > 0:
                    rows[i].basis[rank] /= math.sqrt(square)
            rank += 1
    for i in range(first, last):
        if rows[i].shared > 0:
            rows[i].shared = rank
    return rank


@kernel
def _overlap_of(row, other):
    """Entry of Q Q^T between two contacts."""
    total = 0.0
    for k in range(row.shared):
        total += row.basis[k] * other.basis[k]
    return total


@kernel
def _spread(rows, first, last, i):
    """Entry i of Q Q^T r_n."""
    total = 0.0
    for j in range(first, last):
        if rows[j].shared > 0:
            total += _overlap_of(rows[i], rows[j]) * vec3.dot(vec3.load(rows[j].impulse), vec3.load(rows[j].normal))
    return total


@kernel
def _smoothed(rows, first, last, i):
    """Entry i of Q Q^T u_n."""
    total = 0.0
    for j in range(first, last):
        if rows[j].shared > 0:
            total += _overlap_of(rows[i], rows[j]) * vec3.dot(vec3.load(rows[j].velocity), vec3.load(rows[j].normal))
    return total


@kernel
def _is_rigid(rows, first, last, tolerance):
    """Whether the normal velocities of the marked contacts are those of a rigid motion, as far as ``tolerance`` or the
    ``slack`` of each contact goes.

    ``share`` becomes their part that is; of those that are spared later it is of no use. What is more than round-off of
    the rest is no longer asked for.
    """
    misfit = 0.0
    load = 0.0
    noise = 0.0
    little = True
    for i in range(first, last):
        row = rows[i]
        if row.shared > 0:
            row.share = _smoothed(rows, first, last, i)
            rest = row.share - vec3.dot(vec3.load(row.velocity), vec3.load(row.normal))
            misfit += rest * rest / row.scale
            noise += row.speed / row.scale
            load += row.scale * vec3.norm_squared(vec3.load(row.impulse))
            little = little and abs(rest) <= row.slack
    if misfit <= tolerance * tolerance * load + TOUCHING * TOUCHING * noise:
        return True
    if little:
        for i in range(first, last):
            row = rows[i]
            if row.shared > 0:
                normal = vec3.load(row.normal)
                velocity = vec3.load(row.velocity)
                rest = row.share - vec3.dot(velocity, normal)
                vec3.store(row.velocity, vec3.add_scaled(velocity, rest, normal))
                vec3.store(row.free, vec3.add_scaled(vec3.load(row.free), rest, normal))
    return little


@kernel
def approach(row):
    """u_n of a contact; of one that shares without what round-off left in it, which by way of u would come back."""
    return row.share if row.shared > 0 else vec3.dot(vec3.load(row.velocity), vec3.load(row.normal))


@kernel
def part(rows, num_contacts):
    """No contact shares."""
    for i in range(num_contacts):
        rows[i].shared = APART


@kernel
def share_loads(rows, num_contacts):
    """Divide the loads of the pairs that ``agree_on_shares`` found; friction of what slips goes with them."""
    first = 0
    while first < num_contacts and rows[first].of < 0:
        last = first
        while last < num_contacts and rows[last].of < 0:
            if rows[last].a != rows[first].a or rows[last].b != rows[first].b:
                break
            last += 1
        for i in range(first, last):
            rows[i].share = max(_spread(rows, first, last, i), 0.0) if rows[i].shared > 0 else 0.0
        for i in range(first, last):
            row = rows[i]
            if row.shared != APART:
                normal = vec3.load(row.normal)
                impulse = vec3.load(row.impulse)
                load = vec3.dot(impulse, normal)
                tangential = vec3.add_scaled(impulse, -load, normal)
                if row.status == SLIP and load > 0.0:
                    tangential = vec3.scale(row.share / load, tangential)
                elif row.share == 0.0:
                    tangential = vec3.ZERO
                vec3.store(row.impulse, vec3.add_scaled(tangential, row.share, normal))
        first = last
