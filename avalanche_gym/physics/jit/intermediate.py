"""Kernels as their callers link them: intermediate code, optimised and compiled where it is linked in.

Numba optimises every function that it compiles, makes machine code of it, and a wrapper for calls from Python. A kernel
needs none of the three: what runs is the stage or the entry point that contains it, and that is optimised as a whole.
So a kernel that compiled code calls is typed and lowered, and left there. The engine compiles in two thirds of the
time, to code that is as fast and gives the same bits.

The classes here stand in for Numba's own at the seams of its compiler: the flags of a compilation, and what the cache
keeps of its result.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any

from numba.core import caching, compiler, sigutils, typing
from numba.core.compiler_lock import global_compiler_lock
from numba.core.dispatcher import _FunctionCompiler  # type: ignore[attr-defined]
from numba.core.registry import cpu_target

from .libraries import LinkedLibrary
from .passes import LeanCompiler, SharedFlags


class _Pipeline(LeanCompiler):
    """A compiler that writes into a library of the kind above."""

    library = LinkedLibrary


class _Compiler(_FunctionCompiler):
    """Numba's compiler of one function, without wrappers and machine code."""

    def _customize_flags(self, flags: Any) -> Any:
        flags = SharedFlags(flags)
        flags.no_cpython_wrapper = True
        flags.no_cfunc_wrapper = True
        flags.no_compile = True
        return flags


class IntermediateCodec(caching.CompileResultCacheImpl):
    """What the cache keeps of such a compilation, and what it makes of that."""

    def reduce(self, result: Any) -> Any:
        result.fndesc.typemap = result.fndesc.calltypes = None  # not needed, and large
        library = result.library
        return library.name, library._final_module.as_bitcode(), result.fndesc, result.signature

    def check_cachable(self, result: Any) -> bool:
        # Code that is to be run when a function is loaded is not kept here; no kernel has any.
        return not result.reload_init and bool(super().check_cachable(result))

    def rebuild(self, target_context: Any, payload: Any) -> Any:
        name, bitcode, fndesc, signature = payload
        return compiler.compile_result(
            typing_context=target_context.typing_context,
            target_context=target_context,
            library=LinkedLibrary.from_bitcode(target_context.codegen(), name, bitcode),
            fndesc=fndesc,
            signature=signature,
            typing_error=None,
            objectmode=False,
            lifted=(),
        )


class LinkedKernel:
    """One kernel as compiled code calls it: a version for each list of argument types."""

    def __init__(self, function: Callable[..., Any], cache: Any, options: dict[str, Any]) -> None:
        self._function = function
        self._cache = cache
        self._options = options
        self._versions: dict[tuple[Any, ...], Any] = {}

    @cached_property
    def _compiler(self) -> _Compiler:
        """Made when it is first asked: hundreds of them would be a tenth of a warm start."""
        return _Compiler(self._function, cpu_target, self._options, {}, _Pipeline)

    def get_call_template(self, arguments: tuple[Any, ...], keywords: dict[str, Any]) -> Any:
        """What Numba asks for when it types a call: the signatures there are, one for these arguments among them."""
        signature, arguments = self._compiler.fold_argument_types(arguments, keywords)
        self._ensure(arguments)
        name = self._function.__name__
        signatures = [version.signature for version in self._versions.values()]
        template = typing.make_concrete_template(f"CallTemplate({name})", name, signatures)
        return template, signature, arguments, {}

    def get_overload(self, signature: Any) -> object:
        """What Numba asks for when it lowers a call: the key of the version for a signature."""
        arguments, _ = sigutils.normalize_signature(signature)
        return self._versions[tuple(arguments)].entry_point

    @global_compiler_lock
    def _ensure(self, arguments: tuple[Any, ...]) -> None:
        if arguments in self._versions:
            return
        version = self._cache.load_overload(arguments, cpu_target.target_context)
        if version is None:
            version = self._compiler.compile(arguments, None)
            self._cache.save_overload(arguments, version)
        # Machine code would be the key; any object of its own will do.
        version = version._replace(entry_point=object())
        cpu_target.target_context.insert_user_function(version.entry_point, version.fndesc, [version.library])
        self._versions[arguments] = version
