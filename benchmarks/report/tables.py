"""The tables of the page, each from the measured rows."""

from __future__ import annotations

import math
from collections import defaultdict

from avalanche_gym.physics.scenes import UNBUILT

from ..residuals import wanted
from .analysis import ROUND_OFF, error_split, fitted_order
from .markdown import gain_text, number, ratio_text, table, verdict
from .measured import Measured
from .plan import FINEST, TIGHT, VERDICT_RATE, wants_split
from .remarks import NOBODY, REMARKS
from .standing import standing
from .table import FAILED, OK, REFUSED, TOO_LONG, UNSUPPORTED


def verdicts(data: Measured) -> str:
    lines = []
    for case in data.cases():
        title = f"[{case.title}](#{case.name.replace('_', '-')})" if data.has_curve(case) else case.title
        line = [str(case.number), title, f"{number(case.passes_at)} {case.unit}"]
        for engine in data.engines:
            row = data.at(case.name, engine.name, VERDICT_RATE)
            line.append(verdict(case, row) if row or engine.suits(case) else "-")
        lines.append(line)
    blank = [""] * (len(data.names) - 1)
    lines += [[str(gap.number), gap.title, "", f"not built: {gap.lacking}", *blank] for gap in UNBUILT]
    return table(["#", "case", "passes at", *data.names], lines)


def own_failures(data: Measured) -> str:
    """Cases that our default does not survive, and why."""
    lines = []
    for case in data.cases():
        row = data.at(case.name, data.names[0], VERDICT_RATE)
        text = verdict(case, row) if row else "not run"
        if not text.startswith("pass"):
            lines.append(f"- {case.title}: {text}. {REMARKS.get(case.name, '')}".rstrip())
    return "\n".join(lines) + "\n" if lines else "None.\n"


def orders(data: Measured) -> str:
    lines = []
    for case in data.cases():
        if not case.order or case.chaotic:
            continue
        line = [case.title]
        for name in data.names:
            curve = data.curve(case.name, name)
            order = fitted_order([1.0 / row.rate for row in curve], [row.error for row in curve])
            exact = len(curve) >= 3 and all(row.error <= ROUND_OFF for row in curve)
            line.append("exact" if exact else number(order))
        if any(entry != "-" for entry in line[1:]):
            lines.append(line)
    return table(["case", *data.names], lines)


def thresholds(data: Measured) -> str:
    lines = []
    for case, threshold in data.problems():
        costs = data.costs(case, threshold)
        if not any(map(math.isfinite, costs)):
            continue
        best_peer = min(costs[1:], default=math.inf)
        gain = best_peer / costs[0] if math.isfinite(costs[0]) else 0.0
        lines.append([case.title, f"{threshold:.0e} {case.unit}", *map(number, costs), gain_text(gain)])
    return table(["case", "error within", *data.names, "best peer / ours"], lines)


def split(data: Measured) -> str:
    ours, lines = data.names[0], []
    for case in data.cases():
        found = [
            data.at(case.name, ours, rate, tolerance)
            for rate, tolerance in ((VERDICT_RATE, ""), (VERDICT_RATE, f"{TIGHT:g}"), (FINEST, f"{TIGHT:g}"))
        ]
        if wants_split(case) and all(row is not None and row.status == OK for row in found):
            values = [row.error for row in found if row is not None]
            parts = error_split(*values)
            lines.append([case.title, number(values[0]), *map(number, parts.values()), number(found[0].residual)])  # type: ignore[union-attr]
    return table(["case", "error", "solver", "time stepping", "what remains", "worst residual"], lines)


def tolerances(data: Measured) -> str:
    ours = data.names[0]
    loose = sorted({row.tolerance for row in data.rows if row.tolerance}, key=float, reverse=True)
    lines = []
    for case in data.cases():
        found = [data.at(case.name, ours, VERDICT_RATE, tolerance) for tolerance in ("", *loose)]
        if wants_split(case) and all(row is not None and row.status == OK for row in found[1:2]) and found[0]:
            lines.append(
                [case.title, *(f"{number(row.error)} ({number(row.us_per_step)})" if row else "-" for row in found)]
            )
    return table(["case", "default", *loose], lines)


def stand(data: Measured) -> str:
    """Where each scene stands against ten times better at equal cost, and ten times cheaper at equal error."""
    lines = []
    for case in data.cases():
        ours = data.curve(case.name, data.names[0])
        found = standing(
            ours, {name: data.curve(case.name, name) for name in data.names[1:]}, data.defaults[data.names[0]]
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


def residual_table(data: Measured) -> str:
    """Of cases in which bodies touch; those that reach the tolerance everywhere in one line."""
    lines, reached = [], []
    for row in data.residuals:
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
    seen = {(row.case, row.sleeping) for row in data.residuals}
    missing = [f"{c.name} (sleeping={s})" for c in wanted([]) for s in (True, False) if (c.name, s) not in seen]
    return text + (f"\nNot measured: {', '.join(missing)}.\n" if missing else "")


def conditions(data: Measured) -> str:
    """When each engine's rows were measured: not all in one call where that was interrupted."""
    spans = []
    for name in data.names:
        dates = sorted(row.date for row in data.rows if row.engine == name and row.date)
        if dates:
            spans.append([name, str(len(dates)), dates[0], dates[-1]])
    return table(["engine", "rows", "first measured (UTC)", "last"], spans)


def push_table(data: Measured) -> str:
    lines = [[r.engine, f"{r.per_second:.0f}", f"{r.low:.0f} to {r.high:.0f}"] for r in data.pushes]
    return table(["engine", "environment steps per CPU second", "spread"], lines)


def statistics(data: Measured) -> str:
    """Everything that chaotic cases measure, at the verdict's step."""
    lines = []
    for case in data.cases():
        if case.chaotic:
            for name in data.names:
                row = data.at(case.name, name, VERDICT_RATE)
                if row and row.errors:
                    values = ", ".join(f"{key} {number(value)}" for key, value in row.errors.items())
                    lines.append([case.title, name, number(row.cost), values])
    return table(["case", "engine", "CPU s per s", "measured"], lines)


def failures(data: Measured) -> str:
    seen: dict[tuple[str, str, str], list[str]] = defaultdict(list)
    for row in data.rows:
        if row.status in (FAILED, TOO_LONG, UNSUPPORTED, REFUSED):
            seen[(row.engine, row.status, row.note)].append(f"{row.case} 1/{row.rate}")
    lines = [
        [engine, status, note.replace("|", "/"), ", ".join(dict.fromkeys(where))]
        for (engine, status, note), where in sorted(seen.items())
    ]
    return table(["engine", "what", "note", "where"], lines)


def feature_table(data: Measured) -> str:
    return table(
        ["feature", "with [µs a step]", "without", "ratio"],
        [[cost.feature, number(cost.with_it), number(cost.without), number(cost.ratio)] for cost in data.features],
    )
