"""Writes the page: tables and plots from the rows of data, and from nothing else."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

from avalanche_gym.physics.scenes import HARD_CASES, UNBUILT, HardCase

from ..peers import Engine
from ..residuals import Residuals, wanted
from . import plots
from .analysis import ROUND_OFF, cost_to_reach, error_split, fitted_order, performance_profile
from .features import FeatureCost
from .plan import FINEST, TIGHT, VERDICT_RATE, wants_split
from .push import PushCost
from .remarks import NOBODY, REMARKS
from .standing import standing
from .table import FAILED, OK, REFUSED, TOO_LONG, UNSUPPORTED, Row

THRESHOLDS = (1e-2, 1e-4, 1e-6, 1e-8)
RATIOS = tuple(10 ** (k / 8) for k in range(33))  # 1 to 1e4


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


class Report:
    """All rows, sorted by case and engine."""

    def __init__(
        self,
        rows: Sequence[Row],
        engines: Sequence[Engine],
        features: Sequence[FeatureCost],
        residuals: Sequence[Residuals] = (),
        pushes: Sequence[PushCost] = (),
    ) -> None:
        self.rows, self.engines, self.features = rows, engines, features
        self.residuals, self.pushes = residuals, pushes
        self.by_case: dict[str, list[Row]] = defaultdict(list)
        for row in rows:
            self.by_case[row.case].append(row)
        self.names = [engine.name for engine in engines]
        self.defaults = {engine.name: engine.default_rate for engine in engines}

    def curve(self, case: str, engine: str) -> list[Row]:
        """Points of one line, coarse first."""
        own = [row for row in self.by_case[case] if row.engine == engine and not row.tolerance and row.status == OK]
        return sorted(own, key=lambda row: row.rate)

    def at(self, case: str, engine: str, rate: int, tolerance: str = "") -> Row | None:
        key = (case, engine, rate, tolerance)
        return next((row for row in self.by_case[case] if row.key == key), None)

    def has_curve(self, case: HardCase) -> bool:
        return any(len(self.curve(case.name, name)) > 1 for name in self.names)

    def cases(self) -> list[HardCase]:
        return [case for name, case in HARD_CASES.items() if name in self.by_case]

    # --- Tables -------------------------------------------------------------------------------------------------------

    def verdicts(self) -> str:
        lines = []
        for case in self.cases():
            title = f"[{case.title}](#{case.name.replace('_', '-')})" if self.has_curve(case) else case.title
            line = [str(case.number), title, f"{number(case.passes_at)} {case.unit}"]
            for engine in self.engines:
                row = self.at(case.name, engine.name, VERDICT_RATE)
                line.append(verdict(case, row) if row or engine.suits(case) else "-")
            lines.append(line)
        blank = [""] * (len(self.names) - 1)
        lines += [[str(gap.number), gap.title, "", f"not built: {gap.lacking}", *blank] for gap in UNBUILT]
        return table(["#", "case", "passes at", *self.names], lines)

    def own_failures(self) -> str:
        """Cases that our default does not survive, and why."""
        lines = []
        for case in self.cases():
            row = self.at(case.name, self.names[0], VERDICT_RATE)
            text = verdict(case, row) if row else "not run"
            if not text.startswith("pass"):
                lines.append(f"- {case.title}: {text}. {REMARKS.get(case.name, '')}".rstrip())
        return "\n".join(lines) + "\n" if lines else "None.\n"

    def orders(self) -> str:
        lines = []
        for case in self.cases():
            if not case.order or case.chaotic:
                continue
            line = [case.title]
            for name in self.names:
                curve = self.curve(case.name, name)
                order = fitted_order([1.0 / row.rate for row in curve], [row.error for row in curve])
                exact = len(curve) >= 3 and all(row.error <= ROUND_OFF for row in curve)
                line.append("exact" if exact else number(order))
            if any(entry != "-" for entry in line[1:]):
                lines.append(line)
        return table(["case", *self.names], lines)

    def problems(self) -> list[tuple[HardCase, float]]:
        """A case and an error to stay within; as many as some engine reaches with a curve behind it."""
        curves = [case for case in self.cases() if max(len(self.curve(case.name, name)) for name in self.names) > 1]
        return [(case, threshold) for case in curves if not case.chaotic for threshold in THRESHOLDS]

    def costs(self, case: HardCase, threshold: float) -> list[float]:
        return [cost_to_reach([(r.cost, r.error) for r in self.curve(case.name, n)], threshold) for n in self.names]

    def thresholds(self) -> str:
        lines = []
        for case, threshold in self.problems():
            costs = self.costs(case, threshold)
            if not any(map(math.isfinite, costs)):
                continue
            best_peer = min(costs[1:], default=math.inf)
            gain = best_peer / costs[0] if math.isfinite(costs[0]) else 0.0
            lines.append([case.title, f"{threshold:.0e} {case.unit}", *map(number, costs), gain_text(gain)])
        return table(["case", "error within", *self.names, "best peer / ours"], lines)

    def split(self) -> str:
        ours, lines = self.names[0], []
        for case in self.cases():
            found = [
                self.at(case.name, ours, rate, tolerance)
                for rate, tolerance in ((VERDICT_RATE, ""), (VERDICT_RATE, f"{TIGHT:g}"), (FINEST, f"{TIGHT:g}"))
            ]
            if wants_split(case) and all(row is not None and row.status == OK for row in found):
                values = [row.error for row in found if row is not None]
                parts = error_split(*values)
                lines.append([case.title, number(values[0]), *map(number, parts.values()), number(found[0].residual)])  # type: ignore[union-attr]
        return table(["case", "error", "solver", "time stepping", "what remains", "worst residual"], lines)

    def tolerances(self) -> str:
        ours = self.names[0]
        loose = sorted({row.tolerance for row in self.rows if row.tolerance}, key=float, reverse=True)
        lines = []
        for case in self.cases():
            found = [self.at(case.name, ours, VERDICT_RATE, tolerance) for tolerance in ("", *loose)]
            if wants_split(case) and all(row is not None and row.status == OK for row in found[1:2]) and found[0]:
                lines.append(
                    [case.title, *(f"{number(row.error)} ({number(row.us_per_step)})" if row else "-" for row in found)]
                )
        return table(["case", "default", *loose], lines)

    def stand(self) -> str:
        """Where each scene stands against ten times better at equal cost, and ten times cheaper at equal error."""
        lines = []
        for case in self.cases():
            ours = self.curve(case.name, self.names[0])
            found = standing(
                ours, {name: self.curve(case.name, name) for name in self.names[1:]}, self.defaults[self.names[0]]
            )
            if found is None or len(ours) < 2 or case.chaotic:
                continue
            rival, default = found.rival, found.default
            text = f"{rival.engine} 1/{rival.rate}: {number(rival.error)}"
            if not found.affordable:
                text = f"none as cheap; {text} takes {number(rival.cost)}"
            goal = case.goal.get(default.rate)
            met = "-" if goal is None else "met" if default.error <= goal else f"missed ({number(goal)})"
            missed = not (found.better and found.cheaper) or met.startswith("missed")
            lines.append(
                [
                    case.title,
                    number(default.error),
                    number(default.cost),
                    text,
                    ratio_text(found.error_ratio, found.better),
                    ratio_text(found.cost_ratio, found.cheaper),
                    met,
                    REMARKS.get(case.name, NOBODY if rival.error <= ROUND_OFF else "") if missed else "",
                ]
            )
        head = [
            "case",
            "ours, default",
            "CPU s per s",
            "best peer at no more cost",
            "its error / ours",
            "cost of our error: peers / ours",
            "goal at the default",
            "why not ten times, and what it takes",
        ]
        return table(head, lines)

    def residual_table(self) -> str:
        """Of cases in which bodies touch; those that reach the tolerance everywhere in one line."""
        lines, reached = [], []
        for row in self.residuals:
            if row.contacts == 0 and not row.note:
                continue
            if row.above == 0 and not row.note:
                reached.append((row.case, row.sleeping))
                continue
            share = f"{row.above} of {row.steps}"
            note = row.note or f"{row.method}; {row.contacts} contacts"
            lines.append([row.case, str(row.sleeping), share, number(row.worst), number(row.overlap), note])
        both = [name for name, sleeping in reached if sleeping and (name, False) in reached]
        text = table(["case", "sleeping", "steps above", "worst residual", "overlap [m]", "last resort"], lines)
        text += f"\nIn every step, asleep or not: {', '.join(both)}.\n"
        seen = {(row.case, row.sleeping) for row in self.residuals}
        missing = [f"{c.name} (sleeping={s})" for c in wanted([]) for s in (True, False) if (c.name, s) not in seen]
        return text + (f"\nNot measured: {', '.join(missing)}.\n" if missing else "")

    def conditions(self) -> str:
        """When each engine's rows were measured: not all in one call where that was interrupted."""
        spans = []
        for name in self.names:
            dates = sorted(row.date for row in self.rows if row.engine == name and row.date)
            if dates:
                spans.append([name, str(len(dates)), dates[0], dates[-1]])
        return table(["engine", "rows", "first measured (UTC)", "last"], spans)

    def push_table(self) -> str:
        lines = [[r.engine, f"{r.per_second:.0f}", f"{r.low:.0f} to {r.high:.0f}"] for r in self.pushes]
        return table(["engine", "environment steps per CPU second", "spread"], lines)

    def statistics(self) -> str:
        """Everything that chaotic cases measure, at the verdict's step."""
        lines = []
        for case in self.cases():
            if case.chaotic:
                for name in self.names:
                    row = self.at(case.name, name, VERDICT_RATE)
                    if row and row.errors:
                        values = ", ".join(f"{key} {number(value)}" for key, value in row.errors.items())
                        lines.append([case.title, name, number(row.cost), values])
        return table(["case", "engine", "CPU s per s", "measured"], lines)

    def failures(self) -> str:
        seen: dict[tuple[str, str, str], list[str]] = defaultdict(list)
        for row in self.rows:
            if row.status in (FAILED, TOO_LONG, UNSUPPORTED, REFUSED):
                seen[(row.engine, row.status, row.note)].append(f"{row.case} 1/{row.rate}")
        lines = [
            [engine, status, note.replace("|", "/"), ", ".join(dict.fromkeys(where))]
            for (engine, status, note), where in sorted(seen.items())
        ]
        return table(["engine", "what", "note", "where"], lines)

    def feature_table(self) -> str:
        return table(
            ["feature", "with [µs a step]", "without", "ratio"],
            [[cost.feature, number(cost.with_it), number(cost.without), number(cost.ratio)] for cost in self.features],
        )

    # --- The page -----------------------------------------------------------------------------------------------------

    def write(self, folder: Path, heading: dict[str, str]) -> None:
        pictures = folder / "plots"
        pictures.mkdir(parents=True, exist_ok=True)
        sections = []
        for case in self.cases():
            if self.has_curve(case):
                name = f"{case.name}.png"
                if plots.work_precision(case, self.by_case[case.name], self.defaults, pictures / name):
                    about = f"Truth: {case.truth}. Hard case {case.number}, scene `{case.name}`."
                    sections.append(
                        f"### {case.name.replace('_', '-')}\n\n{case.title}. {about}\n\n![{case.title}](plots/{name})\n"
                    )
        problems = [(case, t) for case, t in self.problems() if any(map(math.isfinite, self.costs(case, t)))]
        costs = {n: [self.costs(case, t)[k] for case, t in problems] for k, n in enumerate(self.names)}
        if problems:
            plots.profile(RATIOS, performance_profile(costs, RATIOS), pictures / "profile.png")
        if self.features:
            values = [asdict(cost) for cost in self.features]
            columns = [[value[key] for value in values] for key in ("feature", "with_it", "without")]
            plots.bars(*columns, pictures / "features.png")  # type: ignore[arg-type]
        settings = table(
            ["engine", "version", "settings", "default step"],
            [[e.name, e.version, e.settings, f"1/{e.default_rate}"] for e in self.engines],
        )
        text = PAGE.format(
            machine=table(["", ""], [[key, value] for key, value in heading.items()]),
            settings=settings,
            conditions=self.conditions(),
            stand=self.stand(),
            verdicts=self.verdicts(),
            own_failures=self.own_failures(),
            statistics=self.statistics(),
            thresholds=self.thresholds(),
            orders=self.orders(),
            split=self.split(),
            tolerances=self.tolerances(),
            features=self.feature_table(),
            residuals=self.residual_table(),
            pushes=self.push_table(),
            failures=self.failures(),
            curves="\n".join(sections),
            rate=VERDICT_RATE,
            floor=ROUND_OFF,
            count=len(problems),
            finest=FINEST,
            tight=f"{TIGHT:g}",
        )
        (folder / "index.md").write_text(text)


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
(`tolerance=1e-6, events=False`).

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
