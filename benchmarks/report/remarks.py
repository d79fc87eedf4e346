"""Why a goal is missed today, and what it takes. Shown only beside a row that misses; delete what no longer does."""

FLIGHT = (
    "nobody errs here, and a step of free flight costs us what it costs the others; needs fewer layers around the step "
    "of a lone body"
)
DRIVEN = (
    "what the user moves is taken to accelerate evenly within a step; what is left is how that acceleration itself "
    "changes; needs motion given with its acceleration"
)

NOBODY = "the best peer does not err either, and a step of ours costs as much as one of its"
ROLLING = "rims and rounded bodies that roll have order 2: half the step, a quarter of the error"
SPACING = "in spacings of floats: the least there is"

REMARKS = {
    "throw": FLIGHT,
    "rotation_sphere": FLIGHT,
    "painleve": "nobody gains energy here; the instant at which the rod jams is a contact problem of many iterations",
    "tippe_top": "a body that turns far in a step is stepped in parts, and that has order 1: half the step, half the "
    "error; needs parts of order 2",
    "euler_disk": ROLLING,
    "coin": ROLLING,
    "far_1e3": SPACING,
    "far_1e6": SPACING,
    "balls_inelastic": "sweeps of the pile tier leave that much overlap where balls strike one another; needs impacts "
    "of a crowd located in time, or more substeps",
    "swing_sticks": DRIVEN,
    "swing_slips": DRIVEN + "; the instants of sticking are not found: needs events of friction",
    "carpet": DRIVEN,
    "wave": DRIVEN,
    "bowl_facets": "facets stand in for the smooth surface, and a ball without rebound loses energy at each crease, "
    "while springs without damping hop over creases; needs the smooth surface: the row above",
}
