"""Measures points in a process of its own, so that an engine that hangs or crashes costs one point only."""

from __future__ import annotations

import multiprocessing
import time
from datetime import UTC, datetime
from multiprocessing.connection import Connection
from typing import Any

from avalanche_gym.physics.scenes import HARD_CASES, HardCase

from ..peers import Engine, Unsupported, all_engines, our_engine
from ..peers.inputs import past_the_checks
from ..peers.recording import Cost, TooLong, record, time_steps, warm_up
from ..residuals import Residuals
from ..residuals import measure as measure_residuals
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


def case_of(point: Point) -> tuple[HardCase, Engine]:
    """What a point is measured on; input that must be refused is put to the peers past the checks."""
    case, engine = HARD_CASES[point.case], engine_named(point.engine, point.tolerance)
    if case.refusal == "required" and point.engine != our_engine().name:
        case = past_the_checks(case)
    return case, engine


def now() -> str:
    return datetime.now(UTC).strftime("%Y-%m-%d %H:%M")


def set_cost(row: Row, cost: Cost) -> None:
    row.us_per_step, row.us_low, row.us_high = cost.per_step()
    row.steps, row.repeats = cost.steps, len(cost.seconds)


def measure(point: Point, budget: Budget) -> Row:
    """One row, whatever happens."""
    case, engine = case_of(point)
    command = f"python -m benchmarks.report --point {point.case} '{point.engine}' {point.rate}"
    if point.tolerance is not None:
        command += f" {point.tolerance:g}"
    row = Row(point.case, point.engine, engine.version, point.rate, point.key[3], OK, date=now(), command=command)
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
        set_cost(row, whole if cost.steps < steps else cost)
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


def time_again(row: Row, budget: Budget) -> Row:
    """The row with its cost measured anew: errors do not depend on what else a machine does, costs do."""
    point = Point(row.case, row.engine, row.rate, float(row.tolerance) if row.tolerance else None)
    case, engine = case_of(point)
    if row.status == OK and row.repeats > 1:
        set_cost(row, time_steps(case, engine, 1.0 / row.rate, budget.timing, budget.repeats, row.steps))
        row.date = now()
    return row


def residuals_of(name: str, rate: int, sleeping: bool) -> Residuals:
    return measure_residuals(HARD_CASES[name], rate, sleeping)


def _serve(pipe: Connection) -> None:
    while True:
        task = pipe.recv()
        if task is None:
            return
        work, *arguments = task
        pipe.send(work(*arguments))


class Worker:
    """A child process that is replaced when it does not answer."""

    def __init__(self) -> None:
        self._child: Any = None
        self._pipe: Any = None
        self._note = ""

    def measure(self, point: Point, budget: Budget) -> Row:
        """One row; a failure if the child hangs or dies."""
        row = self._ask(measure, point, budget, limit=point.allowed(budget) + budget.timing * budget.repeats)
        return row or Row(point.case, point.engine, "", point.rate, point.key[3], FAILED, note=self._note)

    def time_again(self, row: Row, budget: Budget) -> Row:
        return self._ask(time_again, row, budget, limit=budget.run) or row

    def residuals(self, name: str, rate: int, sleeping: bool, budget: Budget) -> Residuals:
        """Of one run of a case; a note if the child hangs or dies."""
        row = self._ask(residuals_of, name, rate, sleeping, limit=budget.verdict)
        return row or Residuals(name, rate, sleeping, note=self._note)

    def _ask(self, *task: Any, limit: float) -> Any:
        """What a function returns, called in the child; None if that takes too long [s] or kills it."""
        if self._child is None:
            context = multiprocessing.get_context("spawn")
            self._pipe, theirs = context.Pipe()
            self._child = context.Process(target=_serve, args=(theirs,), daemon=True)
            self._child.start()
            theirs.close()
        started = time.monotonic()
        self._pipe.send(task)
        try:
            if self._pipe.poll(START + GRACE * limit):
                return self._pipe.recv()
            self._note = f"no answer in {time.monotonic() - started:.0f} s"
        except EOFError:
            self._note = "the process died"
        self.close()
        return None

    def close(self) -> None:
        if self._child is not None:
            self._child.kill()
            self._child.join()
            self._child = None
