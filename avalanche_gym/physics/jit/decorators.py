"""The decorators of every compiled function.

* ``kernel``: functions called from other compiled code.
* ``entry_point``: functions called from Python. The first compilation of a process that finds no cached code says so in
  one line on stderr.
* ``stage``: functions called from compiled code through their address, with integers as arguments. The caller does not
  contain them, so each is compiled once, and only if a scene needs it. (A kernel is optimised anew in each stage that
  contains it.)

None uses ``fastmath``: lanes of a batch must agree bit for bit, and NaN must stay visible to ``isnan``.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any, TypeVar, cast

import numba
from llvmlite import ir
from numba import types
from numba.core import ccallback, cgutils
from numba.extending import intrinsic

from .cache import AnnouncedCache, LateCache, LinkedCache, MachineCache
from .intermediate import LinkedKernel
from .passes import LeanCompiler
from .shortcuts import compiling

Function = TypeVar("Function", bound=Callable[..., Any])


def _compiled(function: Function, cache: type[MachineCache]) -> Function:
    dispatcher: Any = numba.njit(error_model="numpy", nogil=True, no_cfunc_wrapper=True, pipeline_class=LeanCompiler)(
        function
    )
    # Enabling a cache of our own is what ``cache=True`` does, with another locator.
    dispatcher._cache = LateCache(function, cache)
    dispatcher.compile = compiling()(dispatcher.compile)
    linked = LinkedKernel(function, LateCache(function, LinkedCache), dispatcher.targetoptions)

    # Numba compiles a function anew for every constant that is written in a call of it: f(x, 0) and f(x, 1) are two
    # functions, beside f(x, n). No kernel needs that, and it doubled the time to compile the engine.
    def get_call_template(arguments: Any, keywords: Any) -> Any:
        plain = {name: types.unliteral(kind) for name, kind in keywords.items()}
        return linked.get_call_template(tuple(types.unliteral(kind) for kind in arguments), plain)

    dispatcher.get_call_template = get_call_template
    dispatcher.get_overload = linked.get_overload
    return cast(Function, dispatcher)


def kernel(function: Function) -> Function:
    """Compile a function that other compiled functions call."""
    return _compiled(function, MachineCache)


class Stage:
    """A compiled function that other compiled code reaches by its address; compiled when that is first asked for."""

    def __init__(self, function: Callable[..., int]) -> None:
        self._function = function
        self.__doc__ = function.__doc__
        self.__wrapped__ = function

    @cached_property
    def address(self) -> int:
        """Of the machine code, for ``call_stage``."""
        arguments = self._function.__code__.co_argcount
        signature = types.int64(*[types.int64] * arguments)
        compiled: Any = ccallback.CFunc(
            self._function,
            (signature.args, signature.return_type),
            locals={},
            options={"error_model": "numpy"},
            pipeline_class=LeanCompiler,
        )
        compiled._cache = AnnouncedCache(self._function)
        with compiling():
            compiled.compile()
        self._compiled = compiled  # owns the machine code
        return int(compiled.address)


def stage(function: Callable[..., int]) -> Stage:
    """A function of int64 arguments and result that compiled code calls through its address."""
    return Stage(function)


@intrinsic
def call_stage(typing_context, address, *arguments):
    """Call the stage at an address [int64] with int64 arguments; returns its int64."""
    count = len(arguments[0]) if len(arguments) == 1 and isinstance(arguments[0], types.BaseTuple) else len(arguments)
    signature = types.int64(types.int64, types.StarArgTuple([types.int64] * count))

    def codegen(context, builder, signature, values):
        word = context.get_value_type(types.int64)
        function = builder.inttoptr(values[0], ir.FunctionType(word, [word] * count).as_pointer())
        return builder.call(function, cgutils.unpack_tuple(builder, values[1], count))

    return signature, codegen


def entry_point(function: Function) -> Function:
    """Compile a function that Python calls."""
    return _compiled(function, AnnouncedCache)
