"""Numba's compiler without what it does in vain for the functions of this engine.

They have no closures, no expressions of whole arrays, no constants that prune branches, nothing to be inlined before it
is typed, and nobody prints their types. To look for all that took an eighth of the time to compile.
"""

from __future__ import annotations

from typing import ClassVar

from numba.core import compiler, typed_passes, untyped_passes
from numba.core.compiler_machinery import PassManager

_IDLE = (
    typed_passes.AnnotateTypes,
    typed_passes.InlineOverloads,
    typed_passes.NopythonRewrites,
    untyped_passes.DeadBranchPrune,
    untyped_passes.InlineClosureLikes,
    untyped_passes.InlineInlinables,
    untyped_passes.MakeFunctionToJitFunction,
)


class LeanCompiler(compiler.Compiler):
    """Numba's passes but for the idle ones."""

    def define_pipelines(self) -> list[PassManager]:
        (standard,) = super().define_pipelines()
        lean = PassManager(standard.pipeline_name)
        lean.passes = [(kind, text) for kind, text in standard.passes if kind not in _IDLE]
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
