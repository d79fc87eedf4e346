"""Numbers, verdicts and tables as the page writes them."""

from __future__ import annotations

import math
from collections.abc import Sequence

from avalanche_gym.physics.scenes import HardCase

from .table import OK, REFUSED, TOO_LONG, UNSUPPORTED, Row


def number(value: float) -> str:
    """Two digits, or a dash."""
    if math.isnan(value):
        return "-"
    if math.isinf(value):
        return "none"
    return f"{value:.1e}" if value != 0.0 and not 0.01 <= abs(value) < 1000 else f"{value:.3g}"


def table(head: Sequence[str], lines: Sequence[Sequence[str]]) -> str:
    rows = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    return "\n".join(rows + ["| " + " | ".join(line) + " |" for line in lines]) + "\n"


def verdict(case: HardCase, row: Row | None) -> str:
    """Passed, failed and by how much, or why there is none."""
    if row is None:
        return "not run"
    if row.status == OK:
        if case.refusal == "required":
            return "**fail** (accepted)"
        word = "pass" if row.error <= case.passes_at else "**fail**"
        return f"{word} ({number(row.error)})"
    if row.status == REFUSED:
        return "pass (refused)"
    return {UNSUPPORTED: "cannot", TOO_LONG: "too long"}.get(row.status, "**fail** (error)")


def gain_text(gain: float) -> str:
    return "we do not reach it" if gain == 0.0 else "no peer reaches it" if math.isinf(gain) else f"{gain:.2g}"


def ratio_text(ratio: float, enough: bool) -> str:
    """A ratio, bold where it is not enough."""
    text = "none" if math.isinf(ratio) else f"{ratio:.2g}" if ratio < 1e4 else f"{ratio:.0e}"
    return text if enough else f"**{text}**"
