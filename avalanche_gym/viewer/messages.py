"""What a page may ask for: small JSON objects, checked here and nowhere else."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from typing import Any

LONGEST_NAME = 80  # characters
FASTEST_KICK = 1000.0  # [m/s] change of velocity that a click may ask for
SPEEDS = (0.01, 16.0)  # slowest and fastest time lapse


class MalformedMessage(ValueError):
    """A message that means nothing; it is ignored and counted."""


def _number(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise MalformedMessage("not a number")
    try:
        number = float(value)
    except OverflowError:
        raise MalformedMessage("too large") from None
    if not math.isfinite(number):
        raise MalformedMessage("not finite")
    return number


def _boolean(value: Any) -> bool:
    if not isinstance(value, bool):
        raise MalformedMessage("not true or false")
    return value


def _name(value: Any) -> str:
    if not isinstance(value, str) or len(value) > LONGEST_NAME:
        raise MalformedMessage("not a short text")
    return value


def _handle(value: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value < 2**31:
        raise MalformedMessage("not a handle")
    return value


def _vector(value: Any) -> tuple[float, float, float]:
    if not isinstance(value, list) or len(value) != 3:
        raise MalformedMessage("not three numbers")
    x, y, z = map(_number, value)
    return x, y, z


def _kick(value: Any) -> tuple[float, float, float]:
    velocity = _vector(value)
    if math.hypot(*velocity) > FASTEST_KICK:
        raise MalformedMessage("too fast")
    return velocity


def _speed(value: Any) -> float:
    number = _number(value)
    if not SPEEDS[0] <= number <= SPEEDS[1]:
        raise MalformedMessage("outside the range of speeds")
    return number


# Fields of each kind of message, all of them required.
KINDS: dict[str, dict[str, Callable[[Any], Any]]] = {
    "open": {"show": _name, "level": _name},
    "pause": {"on": _boolean},
    "step": {},
    "reset": {},
    "speed": {"value": _speed},
    "driver": {"name": _name},
    "point_gravity": {"on": _boolean},
    # A kick: change of velocity [m/s] in the world frame as if all mass were at the point (body frame, [m]).
    "kick": {"body": _handle, "point": _vector, "velocity": _kick},
    "overlays": {"contacts": _boolean, "cells": _boolean},
}


def parse(message: str | bytes) -> dict[str, Any]:
    """The fields of a message, among them ``"type"``.

    Raises:
        MalformedMessage: it is not one of KINDS with all its fields and no others.
    """
    if not isinstance(message, str):
        raise MalformedMessage("not text")
    try:
        fields = json.loads(message)
    except (ValueError, RecursionError):
        raise MalformedMessage("not JSON") from None
    if not isinstance(fields, dict):
        raise MalformedMessage("not an object")
    kind = fields.pop("type", None)
    checks = KINDS.get(kind) if isinstance(kind, str) else None
    if checks is None or set(fields) != set(checks):
        raise MalformedMessage("not a known kind with its fields")
    return {"type": kind, **{name: check(fields[name]) for name, check in checks.items()}}
