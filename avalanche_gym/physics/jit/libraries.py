"""The libraries that collect code while it is compiled, and what they have LLVM do with it.

One kind is for kernels, which others link; the other for stages and entry points, which are run.
"""

from __future__ import annotations

from typing import Any

import llvmlite.binding as llvm
from numba.core import codegen


class LinkedLibrary(codegen.JITCodeLibrary):
    """The code of a kernel and of all that it calls, linked, neither optimised as a whole nor compiled."""

    def _optimize_functions(self, ll_module: Any) -> None:
        # Each function by itself, which halves it. Numba also runs the passes on what is only named here.
        if not hasattr(self._codegen, "_pass_builder"):  # before 0.62 the interface to LLVM was another
            super()._optimize_functions(ll_module)
            return
        ll_module.data_layout = self._codegen._data_layout
        for function in ll_module.functions:
            if not function.is_declaration:
                passes, builder = self._codegen._function_pass_manager()
                passes.run(function, builder)

    def finalize(self) -> None:
        for library in dict.fromkeys(self._linking_libraries):
            self._final_module.link_in(library._get_module_for_linking(), preserve=True)
        # As Numba does in a copy of the code when it is linked: each of several that link it may bring it along.
        for function in self._final_module.functions:
            if not function.is_declaration and function.linkage == llvm.Linkage.external:
                function.linkage = "linkonce_odr"
        self._finalize_dynamic_globals()
        self._finalized = True

    @classmethod
    def from_bitcode(cls, target: Any, name: str, bitcode: bytes) -> LinkedLibrary:
        library = cls(target, name)
        library._final_module = llvm.parse_bitcode(bitcode)
        library._finalized = True
        return library


class RunLibrary(codegen.JITCodeLibrary):
    """The machine code of a stage or an entry point, with all the kernels that it calls.

    Nobody else calls those kernels, and LLVM is told: it leaves out arguments that are not needed (a table is seven, of
    which a kernel reads one or two), errors that cannot be, and copies of what is called once. Numba leaves every
    function open to callers that LLVM does not see, and every call then moves all of that.
    """

    def _optimize_final_module(self) -> None:
        for function in self._final_module.functions:
            if not function.is_declaration and function.linkage == llvm.Linkage.linkonce_odr:
                function.linkage = "internal"
        super()._optimize_final_module()
