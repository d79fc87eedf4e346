"""Numba's compiler without what it does in vain for the functions of this engine.

They have no closures, no expressions of whole arrays, no constants that prune branches, nothing to be inlined or
unrolled before it is typed, no exceptions, no ``with``, and nobody prints their types or their passes. To look for all
that took a sixth of the time to compile.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar

from numba.core import compiler, typed_passes, untyped_passes
from numba.core.compiler_machinery import PassManager

from .libraries import RunLibrary
from .lowering import LeanLowering

# By name: not every version of Numba has all of them.
_IDLE = frozenset(
    {
        "AnnotateTypes",
        "DeadBranchPrune",
        "DumpParforDiagnostics",
        "FindLiterallyCalls",
        "InlineClosureLikes",
        "InlineInlinables",
        "InlineOverloads",
        "LiteralPropagationSubPipelinePass",
        "LiteralUnroll",
        "MakeFunctionToJitFunction",
        "NoPythonSupportedFeatureValidation",
        "NopythonRewrites",
        "RewriteDynamicRaises",
        "RewriteSemanticConstants",
        "WithLifting",
    }
)
_NUMBAS = (typed_passes.__name__, untyped_passes.__name__)


def _is_idle(kind: type) -> bool:
    return kind.__name__ in _IDLE and kind.__module__ in _NUMBAS


class _LeanManager(PassManager):
    """Runs passes one after the other; Numba's also describes each to whoever listens, and checks that it kept to the
    rules.
    """

    def _runPass(self, index: int, pss: Any, internal_state: Any) -> None:
        pss.analysis = self._analysis
        pss.run_initialization(internal_state)
        pss.run_pass(internal_state)
        pss.run_finalizer(internal_state)


class LeanCompiler(compiler.Compiler):
    """Numba's passes but for the idle ones, into a library of its own kind."""

    library: ClassVar[type[Any]] = RunLibrary

    def compile_extra(self, func: Callable[..., Any]) -> Any:
        self.state.library = self.library(self.state.targetctx.codegen(), func.__qualname__)
        self.state.library.enable_object_caching()
        return super().compile_extra(func)

    def define_pipelines(self) -> list[PassManager]:
        (standard,) = super().define_pipelines()
        lean = _LeanManager(standard.pipeline_name)
        lean.passes = [
            (LeanLowering if kind is typed_passes.NativeLowering else kind, text)
            for kind, text in standard.passes
            if not _is_idle(kind)
        ]
        lean.finalize()
        return [lean]


class SharedFlags(compiler.Flags):
    """Flags of a compilation, one object for all that are equal.

    Numba keeps what it made of a built-in function by the flags of its caller, and compares them, value by value, for
    every call that it types; an object is equal to itself at once.
    """

    __slots__ = ()
    _shared: ClassVar[dict[str, SharedFlags]] = {}
    _hash: ClassVar[int] = hash(compiler.Flags())  # of the names of all flags, whatever their values

    def __hash__(self) -> int:
        return self._hash

    def copy(self) -> SharedFlags:
        return self._shared.setdefault(self.summary(), super().copy())
