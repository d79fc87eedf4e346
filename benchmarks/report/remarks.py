"""Why a goal is missed today, and what it takes. Shown only beside a row that misses; delete what no longer does."""

FIRST_ORDER_IMPACT = "impacts are placed at the end of their step; needs their instant, by a root on the exact flight"
CONTACT_MOVES = (
    "the contact's place and normal are those of the start of the step, so a rim that rolls errs at order 1; needs "
    "them at the middle and end of the step"
)
FACETS = "facets stand in for the smooth surface, and each crease takes energy; needs the smooth surface"
CREASES = "the place of a crease within a step is not found; needs events at creases, or the smooth surface"
CRADLE = "all contacts of a row are solved together, which shares the blow; needs impacts of pairs, one after the other"
NO_SHARED_EDGE = "triangles that meet at a T-junction or a seam share no edge; needs flat neighbours joined"

REMARKS = {
    "bounce_path": FIRST_ORDER_IMPACT,
    "orbit_touchdown": FIRST_ORDER_IMPACT,
    "zeno": FIRST_ORDER_IMPACT,
    "cradle": CRADLE,
    "swing_slips": "the instants of sticking are not found; needs events of friction",
    "bowl_facets": FACETS,
    "trough": CREASES,
    "euler_disk": CONTACT_MOVES,
    "coin": CONTACT_MOVES,
    "tippe_top": CONTACT_MOVES,
    "tippe_top_rolls": CONTACT_MOVES,
    "internal_edges_sphere": NO_SHARED_EDGE,
    "internal_edges_capsule": NO_SHARED_EDGE,
}
