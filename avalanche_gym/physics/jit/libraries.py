"""The libraries that collect the code of a function while it is compiled, and what they have LLVM do with it.

Numba runs all of LLVM's passes on each function that it lowers, a cheap round of them on what is linked together, to
find references that cancel, and then all of them again on that. Only the last counts for what is run: no kernel owns
memory, and what runs is optimised as a whole.
"""

from __future__ import annotations

from typing import Any

import llvmlite.binding as llvm
from numba.core import codegen


class _Library(codegen.JITCodeLibrary):
    """Numba's library, with fewer passes; with Numba's own before 0.62, whose interface to LLVM was another."""

    def _optimize_functions(self, ll_module: Any) -> None:
        # Variables become values, and what nobody reads goes: so the code is half as long.
        if not hasattr(self._codegen, "_pass_builder"):
            super()._optimize_functions(ll_module)
            return
        ll_module.data_layout = self._codegen._data_layout
        builder = self._codegen._pass_builder()
        passes = llvm.create_new_function_pass_manager()
        passes.add_sroa_pass()
        passes.add_dead_code_elimination_pass()
        for function in ll_module.functions:
            if not function.is_declaration:
                passes.run(function, builder)


class RunLibrary(_Library):
    """The code of a function that is run, and of all that it calls."""

    def _optimize_final_module(self) -> None:
        if not hasattr(self._codegen, "_pass_builder"):
            super()._optimize_final_module()
            return
        passes, builder = self._codegen._module_pass_manager()
        passes.run(self._final_module, builder)


class LinkedLibrary(_Library):
    """The code of a kernel and of all that it calls, linked, neither optimised nor compiled."""

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
