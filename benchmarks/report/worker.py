"""Measures points in a process of its own, so that an engine that hangs or crashes costs one point only."""

from __future__ import annotations

import multiprocessing
import time
from datetime import UTC, datetime
from multiprocessing.connection import Connection
from typing import Any

from avalanche_gym.physics.scenes import HARD_CASES

from ..peers import Engine, Unsupported, all_engines, our_engine
from ..peers.inputs import past_the_checks
from ..peers.recording import TooLong, record, time_steps, warm_up
from .plan import Budget, Point
from .table import FAILED, OK, REFUSED, TOO_LONG, UNSUPPORTED, Row

REFUSALS = (ValueError, TypeError, RuntimeError)  # what engines raise when they are built on what cannot be
GRACE = 8.0  # a point may take this many times its budget of CPU time on the clock before it counts as hung
START = 120.0  # [s] that importing and compiling may take on top


def engine_named(name: str, tolerance: float | None) -> Engine:
    """The engine of a point."""
    engines, _ = all_engines()
    if tolerance is not None:
        return our_engine(tolerance)
    return next(engine for engine in engines if engine.name == name)


def measure(point: Point, budget: Budget) -> Row:
    """One row, whatever happens."""
    case, engine = HARD_CASES[point.case], engine_named(point.engine, point.tolerance)
    if case.refusal == "required" and point.engine != our_engine().name:
        case = past_the_checks(case)
    command = f"python -m benchmarks.report --point {point.case} '{point.engine}' {point.rate}"
    if point.tolerance is not None:
        command += f" {point.tolerance:g}"
    date = datetime.now(UTC).strftime("%Y-%m-%d %H:%M")
    row = Row(point.case, point.engine, engine.version, point.rate, point.key[3], OK, date=date, command=command)
    step = 1.0 / point.rate
    try:
        steps, allowed = round(case.duration * point.rate), point.allowed(budget)
        cost = warm_up(case, engine, step)
        if not case.chaotic:  # the beginning of a pile says nothing about the cost of the rest
            cost = time_steps(case, engine, step, budget.timing, budget.repeats)
            expected = cost.per_step()[0] * 1e-6 * steps
            if expected > allowed:
                raise TooLong(f"needs about {expected:.0f} CPU s, allowed are {allowed:g}")
        row.errors, report, whole = record(case, engine, step, allowed)
        if cost.steps < steps:
            cost = whole
        row.us_per_step, row.us_low, row.us_high = cost.per_step()
        row.steps, row.repeats = cost.steps, len(cost.seconds)
        row.error, row.residual = row.errors[case.error], report.get("residual", row.residual)
    except TooLong as reason:
        row.status, row.note = TOO_LONG, str(reason)
    except Unsupported as reason:
        row.status, row.note = UNSUPPORTED, str(reason)
    except Exception as error:
        refused = case.refusal and isinstance(error, REFUSALS)
        row.status, row.note = (
            REFUSED if refused else FAILED,
            f"{type(error).__name__}: {error}".replace("\n", " ")[:300],
        )
    return row


def _serve(pipe: Connection) -> None:
    while True:
        task = pipe.recv()
        if task is None:
            return
        pipe.send(measure(*task))


class Worker:
    """A child process that is replaced when it does not answer."""

    def __init__(self) -> None:
        self._child: Any = None
        self._pipe: Any = None

    def measure(self, point: Point, budget: Budget) -> Row:
        if self._child is None:
            context = multiprocessing.get_context("spawn")
            self._pipe, theirs = context.Pipe()
            self._child = context.Process(target=_serve, args=(theirs,), daemon=True)
            self._child.start()
            theirs.close()
        started = time.monotonic()
        self._pipe.send((point, budget))
        limit = START + GRACE * (point.allowed(budget) + budget.timing * budget.repeats)
        try:
            if self._pipe.poll(limit):
                return self._pipe.recv()
            note = f"no answer in {time.monotonic() - started:.0f} s"
        except EOFError:
            note = "the process died"
        self.close()
        return Row(point.case, point.engine, "", point.rate, point.key[3], FAILED, note=note)

    def close(self) -> None:
        if self._child is not None:
            self._child.kill()
            self._child.join()
            self._child = None
