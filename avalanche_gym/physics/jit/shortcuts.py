"""What Numba asks itself again and again while it compiles, answered once.

``compiling()`` surrounds a compilation:

* Which of a built-in function's versions suits a list of argument types: thirty thousand times for the engine, by
  trying candidates, nine failures for each success and every one with a message of its own.
* Colours in those messages, which nobody sees.
* Whether an implementation wants to know the line it is called from: by reading its signature, for every instruction.
* Garbage: the compiler makes millions of objects that live until it ends; looking through them took a seventh of the
  time.

Numba's own methods are put back afterwards. Its lock of compilation is held, so that they change for nobody else.
"""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any

from numba.core import base, errors
from numba.core.compiler_lock import global_compiler_lock
from numba.core.types import functions

_resolve = functions.BaseFunction.get_call_type
_resolved: dict[tuple[Any, Any], tuple[Any, Any]] = {}


def _get_call_type(self: Any, context: Any, args: Any, kws: Any) -> Any:
    """Signature of a built-in function for the types of its arguments; with it goes the key of the implementation."""
    if kws:
        return _resolve(self, context, args, kws)
    question = self, tuple(args)
    answer = _resolved.get(question)
    if answer is None:
        signature: Any = _resolve(self, context, args, kws)
        _resolved[question] = signature, self._impl_keys[signature.args]
        return signature
    signature, self._impl_keys[signature.args] = answer
    return signature


class _Plain:
    """What Numba colours its messages with: leaves them as they are."""

    def _same(self, msg: str) -> str:
        return msg

    code = errmsg = filename = indicate = highlight = reset = _same


# Owner, name of its attribute, what stands there during a compilation.
_REPLACED: list[tuple[Any, str, Any]] = [
    (functions.BaseFunction, "get_call_type", _get_call_type),
    (errors, "_termcolor_inst", _Plain()),
]
if hasattr(base, "_has_loc"):
    _REPLACED.append((base, "_has_loc", cache(base._has_loc)))


@contextmanager
def compiling() -> Iterator[None]:
    """Surrounds a compilation; may be nested."""
    with global_compiler_lock:
        collecting = gc.isenabled()
        gc.disable()
        before = [getattr(owner, name) for owner, name, _ in _REPLACED]
        for owner, name, value in _REPLACED:
            setattr(owner, name, value)
        try:
            yield
        finally:
            for (owner, name, _), value in zip(_REPLACED, before, strict=True):
                setattr(owner, name, value)
            if collecting:
                gc.enable()
