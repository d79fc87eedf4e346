"""The impulses that an iteration may want back: the best seen so far, and those before the steps on trial."""

from __future__ import annotations

from ..jit import kernel
from ..maths import vec3


@kernel
def keep_best(rows, num_contacts):
    for i in range(num_contacts):
        vec3.store(rows[i].best, vec3.load(rows[i].impulse))


@kernel
def restore_best(rows, num_contacts):
    for i in range(num_contacts):
        vec3.store(rows[i].impulse, vec3.load(rows[i].best))


@kernel
def keep_accepted(rows, num_contacts):
    for i in range(num_contacts):
        vec3.store(rows[i].accepted, vec3.load(rows[i].impulse))


@kernel
def restore_accepted(rows, num_contacts):
    for i in range(num_contacts):
        vec3.store(rows[i].impulse, vec3.load(rows[i].accepted))
