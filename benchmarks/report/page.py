"""Writes the page: tables and plots from the rows of data, and from nothing else."""

from __future__ import annotations

import math
from dataclasses import asdict
from pathlib import Path

from . import plots, tables
from .analysis import ROUND_OFF, performance_profile
from .markdown import table
from .measured import Measured
from .plan import FINEST, TIGHT, VERDICT_RATE

RATIOS = tuple(10 ** (k / 8) for k in range(33))  # 1 to 1e4


def write_page(data: Measured, folder: Path, heading: dict[str, str]) -> None:
    """The page ``index.md`` and its plots, into a folder; ``heading``: what is said of the run."""
    pictures = folder / "plots"
    pictures.mkdir(parents=True, exist_ok=True)
    sections = []
    for case in data.cases():
        if data.has_curve(case):
            name = f"{case.name}.png"
            if plots.work_precision(case, data.by_case[case.name], data.defaults, pictures / name):
                about = f"Truth: {case.truth}. Hard case {case.number}, scene `{case.name}`."
                sections.append(
                    f"### {case.name.replace('_', '-')}\n\n{case.title}. {about}\n\n![{case.title}](plots/{name})\n"
                )
    problems = [(case, t) for case, t in data.problems() if any(map(math.isfinite, data.costs(case, t)))]
    costs = {n: [data.costs(case, t)[k] for case, t in problems] for k, n in enumerate(data.names)}
    if problems:
        plots.profile(RATIOS, performance_profile(costs, RATIOS), pictures / "profile.png")
    if data.features:
        values = [asdict(cost) for cost in data.features]
        columns = [[value[key] for value in values] for key in ("feature", "with_it", "without")]
        plots.bars(*columns, pictures / "features.png")  # type: ignore[arg-type]
    settings = table(
        ["engine", "version", "settings", "default step"],
        [[e.name, e.version, e.settings, f"1/{e.default_rate}"] for e in data.engines],
    )
    text = PAGE.format(
        machine=table(["", ""], [[key, value] for key, value in heading.items()]),
        settings=settings,
        conditions=tables.conditions(data),
        stand=tables.stand(data),
        verdicts=tables.verdicts(data),
        own_failures=tables.own_failures(data),
        statistics=tables.statistics(data),
        thresholds=tables.thresholds(data),
        orders=tables.orders(data),
        split=tables.split(data),
        tolerances=tables.tolerances(data),
        features=tables.feature_table(data),
        residuals=tables.residual_table(data),
        pushes=tables.push_table(data),
        failures=tables.failures(data),
        curves="\n".join(sections),
        rate=VERDICT_RATE,
        floor=ROUND_OFF,
        count=len(problems),
        finest=FINEST,
        tight=f"{TIGHT:g}",
    )
    (folder / "index.md").write_text(text)


PAGE = """# Speed against error

Written by `python -m benchmarks.report`; edit the program, not this page. Every figure is from `data.csv` beside it,
whose last column is the command that measures that row again. Costs are CPU seconds of one core for each simulated
second, the median of repeats with the smallest and largest as bars; building the scene, compiling and a first warm
run are not in them. Errors are against closed forms or independent integrations (`avalanche_gym/physics/scenes`).
Chaotic scenes are judged by invariants and statistics and have no order; their cost is that of the whole motion.
Ours has its default options, so what rests falls asleep after 60 still steps, which the peers do not do: costs of what
stays awake are printed by `python -m benchmarks.contact_costs`, beside MuJoCo in turns.

{machine}
{conditions}
{settings}
## Where we stand

Our default step against the most exact point of any peer that costs no more, and its cost against that of the cheapest
peer that stays within the same error ("none": no peer gets there at any step). The aim is ten times, both ways; bold is
what misses it. Errors below {floor:.0e} count as that, since they are round-off; if ours is, nothing can be ten times
smaller and the cost decides.

{stand}
## Verdicts on the hard cases

At a step of 1/{rate} s for every engine, ours with the default options. "Cannot" means that the engine, or its Python
binding, has no such shape or feature. Input that must be refused is put to the peers past the checks of our scene
description; an engine that takes it fails.

{verdicts}
What we do not survive:

{own_failures}
## Chaotic scenes

Invariants and statistics at 1/{rate} s. Overlaps of bodies [m] are measured for every engine by MuJoCo's
collision tests.

{statistics}
## Cost to stay within an error

CPU seconds per simulated second of the cheapest step from which on every finer one stays within the error, too.

{thresholds}
![Performance profile](plots/profile.png)

Share of the {count} problems above (a scene and an error to stay within) that an engine solves within a multiple of
the cheapest engine's cost (Dolan and Moré 2002).

## Orders of convergence

Slope of log error over log step; "exact" where round-off is all there is at every step.

{orders}
## Where our error comes from

At the default step; "solver" is what a tolerance of {tight} takes away, "time stepping" what a step of 1/{finest} s
then takes away. What remains is geometry (samples and facets in place of the smooth surface), a method that does not
converge to the truth, or the rest of an error of low order.

{split}
Error, and CPU µs a step, by the tolerance of the contact solver:

{tolerances}
## Where the solver does not reach its tolerance

Every step of every case at 1/{rate} s, the tolerance that of the default options, 1e-12: how many steps end above it,
and the last resort of the solver in any step. `python -m benchmarks.residuals` prints these lines, the data are in
`residuals.csv`.

{residuals}
## The small scene of learning

A box and a ball on hills, pushed every four steps of 5 ms, each engine through its Python binding:
`avalanche_gym/physics/scenes/push.py`. Batches and environments are on the page of [throughput](../throughput.md).

{pushes}
Ours has its default options; where it is not the fastest it pays for each facet that a sliding body enters, which is a
new contact and a new problem, and for landings located in time. Environments of the package ask for less
(`tolerance=1e-4, events=False`).

## What a scene needs

The same scene with and without one feature, timed in turns.

{features}
![Cost of features](plots/features.png)

## What failed, and what could not be run

{failures}
## Curves

Rings mark the step that an engine takes by default, the dotted line the error at which the case counts as survived,
the broad grey line the Pareto front. Errors of zero are drawn at 1e-17, motions that went to pieces at 1000.

{curves}"""
