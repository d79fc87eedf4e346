"""What the pile tier keeps of each contact and body of one island: short records, read in a row by every sweep."""

from __future__ import annotations

import numpy as np

PILE_ROW = np.dtype(  # (contacts of the island,); vectors of three numbers are in the frame (normal, t1, t2)
    [
        ("a", np.int64),  # node of body a
        ("b", np.int64),  # node of body b
        # All that the position sweeps read stands together, up to ``local``.
        ("normal", np.float64, 3),  # unit, from a to b, world frame
        ("lever_a", np.float64, 3),  # [m] arm_a x normal
        ("lever_b", np.float64, 3),
        ("answer_a", np.float64, 3),  # [1/(kg m)] I_a^-1 lever_a
        ("answer_b", np.float64, 3),
        ("gap", np.float64),  # [m] at the start of the step; with the swing of turning bodies over the step
        ("floor", np.float64),  # [m] least gap that the position sweeps ask for
        ("push", np.float64),  # [kg m] multiplier of the position sweeps
        ("local", np.float64, 6),  # W [1/kg]: nn, n1, n2, 11, 12, 22
        ("friction", np.float64),
        ("arm_a", np.float64, 3),  # [m] from the centre of mass of a to the contact, world frame
        ("arm_b", np.float64, 3),
        ("t1", np.float64, 3),
        ("t2", np.float64, 3),
        ("prescribed", np.float64, 3),  # [m/s] relative velocity of what is not dynamic, and of moving surfaces
        ("inverse", np.float64, 6),  # of W [kg], in the same order
        # [kg] of a step along the surface that cannot overshoot: 1 / the larger eigenvalue of W's tangent part
        ("slide", np.float64),
        ("impulse", np.float64, 3),  # [N s] of the present substep
        ("earlier", np.float64, 3),  # [N s] of the substep before
        ("total", np.float64, 3),  # [N s] of the step
        ("lasting", np.int64),  # 1: it is taken to touch all the while
        ("bias", np.float64),  # [m/s] the sweeps ask for: normal velocity + bias >= 0
        ("open", np.float64),  # [m] what is left of a gap at this substep
    ],
    align=True,
)

PILE_MOMENT = np.dtype(  # (contacts of the island,) rolling and torsional friction; vectors as in PILE_ROW
    [
        ("rolling", np.float64),  # [m]
        ("torsion", np.float64),  # [m]
        ("stiffness", np.float64),  # [kg m^2] of a step that cannot overshoot; 0: the contact has no moment
        ("scale", np.float64),  # [1/(kg m^2)] mean response, for the residual
        ("prescribed", np.float64, 3),  # [rad/s] relative angular velocity of what is not dynamic
        ("impulse", np.float64, 3),  # [N m s] of the present substep
        ("total", np.float64, 3),  # [N m s] of the step
    ],
    align=True,
)

PILE_NODE = np.dtype(  # (dynamic bodies of the island + 1,); the last one stands for all that cannot be moved
    [
        # All that the position sweeps read stands together, up to ``inverse_inertia``.
        ("inverse_mass", np.float64),  # [1/kg]
        ("shoved", np.int64),  # number of the position sweep that moved it last; 0: none has, -1: it cannot be moved
        ("moved", np.float64, 3),  # [m] since the start of the step
        ("turned", np.float64, 3),  # [rad]
        ("inverse_inertia", np.float64, 6),  # [1/(kg m^2)] world frame: xx, xy, xz, yy, yz, zz
        ("velocity", np.float64, 3),  # [m/s]
        ("spin", np.float64, 3),  # [rad/s]
        ("before", np.float64, 3),  # [m/s] at the end of the substep before
        ("spin_before", np.float64, 3),  # [rad/s]
        ("gain", np.float64, 3),  # [m/s] that flight adds in a substep
        ("spin_gain", np.float64, 3),  # [rad/s]
        ("push", np.float64, 3),  # [N s] sum of the impulses of the step
        ("moment", np.float64, 3),  # [N m s]
    ],
    align=True,
)
