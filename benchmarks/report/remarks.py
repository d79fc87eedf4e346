"""Why a goal is missed today, and what it takes. Shown only beside a row that misses; delete what no longer does."""

FIRST_ORDER_IMPACT = "impacts are placed at the end of their step; needs their instant, by a root on the exact flight"
FACETS = "facets stand in for the smooth surface, and each crease takes energy; needs the smooth surface"
CREASES = "the place of a crease within a step is not found; needs events at creases, or the smooth surface"
CRADLE = "all contacts of a row are solved together, which shares the blow; needs impacts of pairs, one after the other"
SEAM = "a seam between two bodies is met as an edge when the capsule turns far in a step; needs flat neighbours joined"

REMARKS = {
    "bounce_path": FIRST_ORDER_IMPACT,
    "orbit_touchdown": FIRST_ORDER_IMPACT,
    "zeno": FIRST_ORDER_IMPACT,
    "cradle": CRADLE,
    "swing_slips": "the instants of sticking are not found; needs events of friction",
    "bowl_facets": FACETS,
    "trough": CREASES,
    "internal_edges_capsule": SEAM,
}
