"""The tables of a world: what is constant (Model) and what changes (State).

Every table is one NumPy array of records whose fields are declared with shape, unit and frame, here or, for the shapes,
in shape_rows.py; layout.py lists them by name, and memory.py says how kernels reach them.

Inside the engine a dynamic body is described in its *principal frame*: origin at the centre of mass, axes along the
principal axes of inertia. The user's frame (``position``, ``orientation``) is the one the shape was given in;
``BODY.origin`` and ``BODY.principal`` lead from one to the other.
"""

from __future__ import annotations

import numpy as np

# Motion of a body.
REMOVED, STATIC, KINEMATIC, DYNAMIC = -1, 0, 1, 2

# Free motion of a body: the cheapest flow that is exact for it (integrator/flight.py).
FLOW_NONE, FLOW_TRANSLATE, FLOW_SPHERE, FLOW_SYMMETRIC, FLOW_TRIAXIAL = 0, 1, 2, 3, 4

# Shapes of colliders. The order matters: a pair is always tested with the smaller type first.
SPHERE, CAPSULE, BOX, CYLINDER, HULL, PLANE, HEIGHT_FIELD, MESH, SMOOTH_FIELD = 0, 1, 2, 3, 4, 5, 6, 7, 8
NUM_SHAPES = 9
SHAPE_NAMES = (
    *("Sphere", "Capsule", "Box", "Cylinder", "ConvexHull", "Plane", "HeightField", "TriangleMesh"),
    'HeightField(surface="smooth")',
)

UNIFORM_GRAVITY, POINT_GRAVITY = 0, 1

# What the normal of a contact turns with: a flat side of body a or b, or the line between two points of the bodies.
ON_A, ON_B, BETWEEN = 0, 1, 2

# Features of contacts. One with the bit SLIDING names a point of a body in the bits above PLACE_BITS, and below the
# part of the terrain under it: equal numbers above say that the point has moved from one facet to the next.
SLIDING = 1 << 60
PLACE_BITS = 26
# Most contacts of a pair of shape and terrain, or of two meshes: four corners of a box at each of three walls.
MOST_ON_TERRAIN = 12

# Part of a step: all of it, in which islands with impacts to locate wait; up to an impact, without the contacts to be
# located; what is left of it after the last one.
WHOLE, TO_IMPACT, LAST = 0, 1, 2
# [rad] Beyond this angle in a step a turn is not small: bodies show other faces by its end. Smaller: more contacts are
# looked at on their way.
FAR_TURN = 0.25
# A contact whose gap ends larger than this fraction of the smaller body is left out of the problem. It can still come
# into play when a neighbour is pushed by more than that in one step; smaller values then allow overlap for one step,
# larger ones list more of a rough terrain than can matter: five times as much costs twice the time there.
SLACK = 0.01
# What the search for the time of impact finds: nothing closes, something does, it cannot tell.
PASSES, MEETS, UNDECIDED = 0, 1, 2
# What an impact came to.
NO_ROOM, UNTOUCHED, STOPPED, BOUNCED, LOSSLESS = 0, 1, 2, 3, 4

# Why the instant of an impact changes the outcome: it stops a body that touches no other; what follows may be anywhere.
DULL, LIVELY = 1, 2

# Status of a world after a call.
OK, NON_FINITE, CONTACTS_FULL, PAIRS_FULL, SOLVER_FULL = 0, 1, 2, 3, 4

# So many bodies are a crowd. A world with fewer has no pile tier (response/pile_stage.py): all is solved exactly.
LEAST_BODIES = 12
# Of so many at most also when a body is so fast that it may pass another in a step. More: an impact among a hundred
# bodies costs a tenth of a second.
MOST_FOLLOWED = 32
# What the workspace notes of an island that the pile tier has stepped, in place of whether its impacts are located.
CROWD = 4
# [steps] that the exact tier waits at most until it tries an island of a crowd again that it could not solve.
LONGEST_PAUSE = 127

# Model: constant while the world steps.

BODY = np.dtype(  # (worlds, bodies)
    [
        ("motion", np.int64),
        ("flow", np.int64),
        ("material", np.int64),
        ("first_collider", np.int64),
        ("num_colliders", np.int64),
        ("mass", np.float64),  # [kg]
        ("inverse_mass", np.float64),  # [1/kg], 0 unless dynamic
        ("inertia", np.float64, 3),  # [kg m^2], principal
        ("inverse_inertia", np.float64, 3),  # [1/(kg m^2)], principal, 0 unless dynamic
        ("origin", np.float64, 3),  # [m] origin of the user's frame, in the principal frame
        ("principal", np.float64, 4),  # quaternion: user's frame -> principal frame
        ("radius", np.float64),  # [m] of the smallest sphere about the centre of mass that holds the body
        ("size", np.float64),  # [m] smallest half extent: the scale of its tolerances
        ("inner", np.float64),  # [m] turning moves no point along its normal faster than sqrt(radius^2 - inner^2) a rad
        ("friction", np.float64),
        ("restitution", np.float64),
        ("rolling_friction", np.float64),  # [m]
        ("torsional_friction", np.float64),  # [m]
    ],
    align=True,
)

COLLIDER = np.dtype(  # (colliders,): a compound has one for each of its parts
    [
        ("body", np.int64),
        ("shape", np.int64),
        ("size", np.float64, 3),  # [m] sphere: r; capsule, cylinder: r, half length; box: half extents
        ("position", np.float64, 3),  # [m] in the principal frame of the body
        ("orientation", np.float64, 4),  # quaternion: collider frame -> principal frame
        ("radius", np.float64),  # [m] of the smallest sphere about ``position`` that holds it
        ("data", np.int64),  # row in the table of its shape (height fields, meshes, hulls)
        ("two_sided", np.int64),
    ],
    align=True,
)

FIELD = np.dtype(  # (fields,)
    [
        ("kind", np.int64),
        ("vector", np.float64, 3),  # uniform: [m/s^2]; point: centre [m]
        ("mu", np.float64),  # point: [m^3/s^2]
    ],
    align=True,
)

PAIR_RULE = np.dtype(  # (materials, materials): set_pair; NaN where the bodies' own values are mixed
    [("friction", np.float64), ("restitution", np.float64)], align=True
)

# State: what a step changes.

BODY_STATE = np.dtype(  # (worlds, bodies)
    [
        ("center", np.float64, 3),  # [m] centre of mass, world frame
        ("orientation", np.float64, 4),  # quaternion: principal frame -> world
        ("velocity", np.float64, 3),  # [m/s] of the centre of mass, world frame
        ("angular_velocity", np.float64, 3),  # [rad/s] world frame
        ("angular_momentum", np.float64, 3),  # [kg m^2/s] world frame; holds while angular_velocity is what follows
        # from it
        ("force", np.float64, 3),  # [N] at the centre of mass, held until the end of the call; of a driven body its
        # acceleration [m/s^2] within the step
        ("torque", np.float64, 3),  # [N m] about the centre of mass; of a driven body [rad/s^2]
    ],
    align=True,
)

TRAITS = np.dtype(  # (worlds,): what the parameters of a world ask for, whatever those of others do
    [
        ("restitution", np.int64),  # 0: nothing in this world bounces
        ("moments", np.int64),  # 0: no contact of this world has rolling or torsional friction
        ("moving_heights", np.int64),  # 0: the heights of this world rest
    ],
    align=True,
)

REST = np.dtype(  # (worlds, bodies): what is remembered of bodies that hardly move
    [
        ("asleep", np.int64),  # 0: awake; else one more than the lowest handle of the island it sleeps with
        ("still", np.int64),  # steps in a row in which it has hardly moved
        ("barred", np.int64),  # 1: the user lets it never sleep
        ("seen", np.float64, 13),  # state in which the last step began (contacts/coherence.py); orientation 0: none
        # Of a driven body (integrator/driven.py) velocity [m/s] and angular velocity [rad/s] as the user gave them:
        ("driven", np.float64, 6),  # in this step
        ("driven_before", np.float64, 6),  # in the last one
        ("driven_change", np.float64, 6),  # by how much those differed from the ones before
        # Of the first body of an island in a crowd:
        ("tried", np.int64),  # 1: the exact tier has tried in the last step
        ("pause", np.int64),  # [steps] after its next failure
        ("wait", np.int64),  # [steps] until it tries again
        ("residual", np.float64),  # what it reached
    ],
    align=True,
)

CONTACT = np.dtype(  # (worlds, capacity): the contacts of the last step, sorted by pair
    [
        ("pair", np.int64),  # collider_a * num_colliders + collider_b
        ("feature", np.int64),  # which vertex, edge or face of the pair: the same in the next step if contact lasts,
        # but for the place of a SLIDING one
        ("body_a", np.int64),
        ("body_b", np.int64),
        ("position", np.float64, 3),  # [m] midway between the two surfaces, world frame
        ("normal", np.float64, 3),  # unit, from a to b, world frame
        ("gap", np.float64),  # [m] positive apart: at the start of the step where it was found, at the end in the list
        ("start_position", np.float64, 3),  # the same three at the start of the step
        ("start_normal", np.float64, 3),
        ("start_gap", np.float64),
        ("end_position", np.float64, 3),  # and at the end that was predicted
        ("end_normal", np.float64, 3),
        ("end_gap", np.float64),
        ("frame", np.int64),  # ON_A, ON_B or BETWEEN: what the normal turns with
        ("curved", np.int64),  # 1: where the bodies touch after moving is asked of the narrow phase again
        ("size", np.float64),  # [m] of the smaller body: the scale of its tolerances
        ("impulse", np.float64, 3),  # [N s] on b, world frame
        ("moment", np.float64, 3),  # [N m s] on b, of rolling and torsional friction
        ("span", np.float64),  # [s] over which ``impulse`` and ``moment`` acted; 0: at once
        ("blow", np.float64, 3),  # [N s] impulse on b before that, in the same step
        ("radius_a", np.float64),  # [m] of the rounding of a at the contact: of a sphere, capsule or rolling cylinder,
        # else 0
        ("radius_b", np.float64),
        ("friction", np.float64),
        ("restitution", np.float64),
        ("rolling_friction", np.float64),  # [m]
        ("torsional_friction", np.float64),  # [m]
        ("bias", np.float64),  # [m/s] the solver asks for: normal velocity + bias >= 0
        ("turning", np.float64, 3),  # [m/s] what the turning of the contact within the step adds to its velocity
        ("creep", np.float64, 3),  # [m] of b against a along the surface since the contact sticks: error of the step
        ("sticks", np.int64),  # 1: it bears load without slipping
        ("stuck", np.int64),  # 1: it did in the last step
        ("approach", np.float64),  # [m/s] normal velocity at the start of the step
        ("free", np.float64),  # [m/s] the same at the end of the step without impulses
        ("free_gap", np.float64),  # [m] at the end of the step without impulses
        ("surface_velocity", np.float64, 3),  # [m/s] of b's surface against a's, beyond the rigid motions (moving
        # heights), where it was asked for
        ("surface_acceleration", np.float64, 3),  # [m/s^2] how that changes within the step
        ("end_surface_velocity", np.float64, 3),  # [m/s] at the end that was predicted
        ("warm", np.int64),  # 1: the prediction of its place has an impulse to go by
        ("persistent", np.int64),  # 1: it touches and does not approach
        ("steady", np.int64),  # 1: the step left its island as it was, impulses and places (response/standing.py)
        ("located", np.int64),  # DULL or LIVELY: the instant of its impact changes the outcome; else 0
        ("island", np.int64),
    ],
    align=True,
)

ANSWER = np.dtype(  # what the narrow phase said of a contact: the fields of CONTACT that it fills
    [
        ("pair", np.int64),
        ("feature", np.int64),
        ("position", np.float64, 3),  # [m]
        ("normal", np.float64, 3),
        ("gap", np.float64),  # [m]
        ("frame", np.int64),
        ("curved", np.int64),
        ("radius_a", np.float64),  # [m]
        ("radius_b", np.float64),
    ],
    align=True,
)

QUESTION = np.dtype(  # what it was asked about two bodies, and where the answers are (narrow_phase/answers.py)
    [
        ("body_a", np.int64),
        ("body_b", np.int64),
        ("step", np.int64),  # in which it was asked: WORKSPACE.step
        ("margin", np.float64),  # [m] as in PAIR_QUERY
        ("motion", np.float64),  # [m]
        ("places", np.float64, 14),  # center [m] and orientation of both bodies
        ("first", np.int64),
        ("count", np.int64),
    ],
    align=True,
)

REPORT = np.dtype(  # (worlds,): worst value or sum over the last call
    [
        ("residual", np.float64),  # worst, relative, free of units
        ("iterations", np.int64),  # sum of factorisations and sweeps
        ("method", np.int64),  # the last method the solver had to fall back to
        ("contacts", np.int64),  # most in a step
        ("events", np.int64),  # sum
        ("event_limit", np.int64),  # steps that met the limit of events
        ("penetration", np.float64),  # [m] worst
        ("energy_start", np.float64),  # [J] at the start of the call
        ("energy_end", np.float64),  # [J]
        ("steps", np.int64),  # done in this call
        ("status", np.int64),
        ("detail", np.int64),  # with the status: the body that is not finite, or the entries that a full table needs
    ],
    align=True,
)
