"""Learning curves of one run or several, as a PNG.

    python -m training.plot runs/ppo/PlanetLanding-v0-easy_* --output curves.png

Solid: training episodes (mean of the last hundred). Dots: evaluations.
"""

from __future__ import annotations

import argparse
import csv
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

STEPS = "time/total_timesteps"


def read_progress(folder: Path) -> list[dict[str, str]]:
    """The rows that training logged, those of resumed runs included, in the order of their steps.

    Raises:
        FileNotFoundError: There are none.
    """
    files = sorted(folder.glob("progress-*.csv"))
    if not files:
        raise FileNotFoundError(f"{folder} holds no progress-*.csv; give the folder of a training run")
    rows: list[dict[str, str]] = []
    for file in files:
        with file.open(newline="", encoding="utf-8") as lines:
            rows += csv.DictReader(lines)
    return sorted((row for row in rows if row[STEPS]), key=lambda row: float(row[STEPS]))


def series(rows: list[dict[str, str]], key: str) -> tuple[np.ndarray, np.ndarray]:
    """Steps and values of one logged quantity, each of shape (rows that have it,)."""
    found = [(float(row[STEPS]), float(row[key])) for row in rows if row.get(key)]
    steps, values = np.array(found).reshape(-1, 2).T
    return steps, values


def plot(folders: list[Path], output: Path) -> Path:
    """Draw mean return, and success rate where the environment tells it, against steps; returns ``output``."""
    runs = {folder.name: read_progress(folder) for folder in folders}
    panels = {"mean return": ("rollout/ep_rew_mean", "eval/mean_reward")}
    if any(series(rows, "rollout/success_rate")[0].size for rows in runs.values()):
        panels = {"success rate": ("rollout/success_rate", "eval/success_rate")} | panels

    figure = Figure(figsize=(7.0, 3.2 * len(panels)), layout="constrained")
    axes = figure.subplots(len(panels), 1, sharex=True, squeeze=False)[:, 0]
    for axis, (title, keys) in zip(axes, panels.items(), strict=True):
        _draw(axis, runs, keys)
        axis.set_ylabel(title)
        if title == "success rate":
            axis.set_ylim(-0.03, 1.03)
    axes[0].legend(frameon=False, fontsize="small")
    axes[-1].set_xlabel("environment steps")
    output.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(output, dpi=150)
    return output


def _draw(axis: Axes, runs: dict[str, list[dict[str, str]]], keys: tuple[str, str]) -> None:
    training_key, evaluation_key = keys
    for number, (name, rows) in enumerate(runs.items()):
        color = f"C{number}"
        axis.plot(*series(rows, training_key), color=color, label=f"{name}, training")
        steps, values = series(rows, evaluation_key)
        if steps.size:
            axis.plot(steps, values, "o", color=color, markersize=4, label=f"{name}, evaluation")
    axis.grid(alpha=0.3)
    axis.spines[["top", "right"]].set_visible(False)


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="+", type=Path, help="folders of training runs")
    parser.add_argument("--output", type=Path, help="PNG; curve.png in the first folder unless given")
    args = parser.parse_args(arguments)
    print(plot(args.folders, args.output or args.folders[0] / "curve.png"))


if __name__ == "__main__":
    main()
