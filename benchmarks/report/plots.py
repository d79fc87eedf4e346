"""Plots that can be read in black and white: engines differ by marker and line, not by colour."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

from avalanche_gym.physics.scenes import HardCase

from .analysis import pareto_front
from .table import OK, Row

FLOOR = 1e-17  # errors of zero are drawn here
CEILING = 1e3  # and those of motions that went to pieces here
STYLES = {
    "avalanche": ("o", "-", "black"),
    "MuJoCo": ("s", "--", "0.35"),
    "MuJoCo RK4": ("D", ":", "0.35"),
    "PyBullet": ("^", "-.", "0.45"),
    "Rapier": ("v", (0, (5, 1, 1, 1, 1, 1)), "0.55"),
}
EXTRA = (("P", "-", "0.6"), ("X", "--", "0.6"))


def style(engine: str) -> tuple:
    return STYLES.get(engine, EXTRA[len(engine) % len(EXTRA)])


def drawn(error: float) -> float:
    return min(max(error, FLOOR), CEILING) if math.isfinite(error) else CEILING


def work_precision(case: HardCase, rows: Sequence[Row], defaults: Mapping[str, int], path: Path) -> bool:
    """Error over CPU time on two logarithmic axes, one line an engine; False if there is nothing to draw."""
    rows = [row for row in rows if row.status == OK and not row.tolerance and math.isfinite(row.cost)]
    if not rows:
        return False
    figure, axes = plt.subplots(figsize=(6.4, 4.4))
    front = pareto_front([(row.cost, drawn(row.error)) for row in rows])
    axes.plot(
        *zip(*front, strict=True), color="0.85", linewidth=7, solid_capstyle="round", zorder=1, label="Pareto front"
    )
    for engine in dict.fromkeys(row.engine for row in rows):
        own = sorted((row for row in rows if row.engine == engine), key=lambda row: row.rate)
        marker, line, color = style(engine)
        x, y = [row.cost for row in own], [drawn(row.error) for row in own]
        spread = [[row.cost * (1 - row.us_low / row.us_per_step) for row in own],
                  [row.cost * (row.us_high / row.us_per_step - 1) for row in own]]  # fmt: skip
        axes.errorbar(
            x, y, xerr=spread, marker=marker, linestyle=line, color=color, markersize=5, linewidth=1.2, capsize=2,
            elinewidth=0.7, label=engine, zorder=3,
        )  # fmt: skip
        for row in own:
            if row.rate == defaults.get(engine):
                axes.plot(row.cost, drawn(row.error), "o", markersize=13, fillstyle="none", color=color, zorder=4)
        for row, place in ((own[0], (4, 5)), (own[-1], (4, -11))):
            axes.annotate(f"1/{row.rate}", (row.cost, drawn(row.error)), place, textcoords="offset points", fontsize=7)
    axes.set_xscale("log")
    axes.set_yscale("log")
    low, high = axes.get_ylim()
    axes.set_ylim(min(low, 0.3 * min(drawn(row.error) for row in rows)), high * 2)
    axes.axhline(max(case.passes_at, FLOOR), color="0.6", linewidth=0.8, linestyle=(0, (1, 3)))
    axes.set_xlabel("CPU seconds per simulated second, one core")
    axes.set_ylabel(f"error: {case.error} [{case.unit}]")
    axes.set_title(case.title, fontsize=10)
    axes.grid(True, which="major", color="0.92")
    axes.legend(fontsize=7, framealpha=0.9)
    figure.tight_layout()
    figure.savefig(path, dpi=90)
    plt.close(figure)
    return True


def profile(ratios: Sequence[float], shares: Mapping[str, Sequence[float]], path: Path) -> None:
    """Dolan-More profiles, as steps."""
    figure, axes = plt.subplots(figsize=(6.4, 4.0))
    for engine, values in shares.items():
        marker, line, color = style(engine)
        axes.step(ratios, values, where="post", linestyle=line, color=color, linewidth=1.6, label=engine)
        axes.plot(ratios[-1], values[-1], marker, color=color, markersize=6, clip_on=False)
    axes.set_xscale("log")
    axes.set_ylim(0.0, 1.05)
    axes.set_xlabel("ratio to the cheapest engine")
    axes.set_ylabel("share of problems solved")
    axes.grid(True, color="0.92")
    axes.legend(fontsize=8)
    figure.tight_layout()
    figure.savefig(path, dpi=90)
    plt.close(figure)


def bars(names: Sequence[str], with_it: Sequence[float], without: Sequence[float], path: Path) -> None:
    """Cost of a step with and without each feature."""
    figure, axes = plt.subplots(figsize=(6.4, 0.4 * len(names) + 1.0))
    places = range(len(names))
    axes.barh([p + 0.2 for p in places], with_it, 0.38, color="0.35", label="with")
    axes.barh([p - 0.2 for p in places], without, 0.38, color="white", edgecolor="black", hatch="///", label="without")
    axes.set_yticks(list(places), list(names))
    axes.invert_yaxis()
    axes.set_xlabel("CPU µs a step")
    axes.legend(fontsize=8)
    figure.tight_layout()
    figure.savefig(path, dpi=90)
    plt.close(figure)
