"""Why a goal is missed today, and what it takes. Shown only beside a row that misses; delete what no longer does."""

FACETS = "facets stand in for the smooth surface, and each crease takes energy; needs the smooth surface"

REMARKS = {
    "swing_slips": "the instants of sticking are not found; needs events of friction",
    "bowl_facets": FACETS,
}
