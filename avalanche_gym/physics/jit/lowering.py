"""Lowering, from typed code to that of LLVM, without what the kernels of this engine do not need.

Numba asks of every variable whether it owns memory, and takes tuples of numbers apart to find that none of their parts
does; it writes down the address of every function that is called, which nobody reads; it measures variables for a
debugger; and it tries three times whether an operand is a constant. Half of the code that it handed to LLVM was of that
kind. Here it is left out where it is known to be dead; the rest is Numba's own.

Numba counts a reference for every array that is an argument, and takes it back at the last use. The caller has one all
the time, so these two calls do nothing but spill the registers of every kernel that is given a table: they are left out
too.

Numba asks of every index whether it is negative, and then counts from the end. No kernel does (test_jit_libraries.py).
"""

from __future__ import annotations

from typing import Any, ClassVar

from numba.core import cgutils, ir, lowering, typed_passes, types
from numba.core.compiler_machinery import register_pass
from numba.core.types import containers


class _LeanLower(lowering.Lower):
    """Numba's lowering of one function."""

    _owners: ClassVar[dict[Any, bool]] = {}

    def _owns_memory(self, kind: Any) -> bool:
        """Whether values of a type hold references that are counted."""
        owns = self._owners.get(kind)
        if owns is None:
            owns = self._owners[kind] = bool(self.context.data_model_manager[kind].contains_nrt_meminfo())
        return owns

    def _is_borrowed(self, name: str) -> bool:
        """Whether a variable is an argument and nothing else ever: the caller holds what it refers to."""
        definitions = self.func_ir._definitions.get(name, ())
        return len(definitions) == 1 and isinstance(definitions[0], ir.Arg)

    def _counts(self, name: str, kind: Any) -> bool:
        """Whether references are counted for a variable."""
        return self._owns_memory(kind) and not self._is_borrowed(name)

    def incref(self, typ: Any, val: Any) -> None:
        if self._owns_memory(typ):
            super().incref(typ, val)

    def decref(self, typ: Any, val: Any) -> None:
        if self._owns_memory(typ):
            super().decref(typ, val)

    def delvar(self, name: str) -> None:
        # The end of a variable matters to what it owns.
        kind = self.typeof(name)
        if self._counts(name, kind) or self._disable_sroa_like_opt:
            super().delvar(name)
        else:
            if name not in self._blk_local_varmap:
                self._singly_assigned_vars.discard(name)
            self._alloca_var(name, kind)

    def storevar(self, value: Any, name: str, argidx: int | None = None) -> None:
        kind = self.typeof(name)
        if (
            self._counts(name, kind)
            or self._disable_sroa_like_opt
            or name in self._singly_assigned_vars
            or value.type != self.context.get_value_type(kind)
        ):
            super().storevar(value, name, argidx=argidx)
        else:
            self._alloca_var(name, kind)
            self.builder.store(value, self.getvar(name))

    def alloca_lltype(self, name: str, lltype: Any, datamodel: Any = None) -> Any:
        if self._disable_sroa_like_opt:
            return super().alloca_lltype(name, lltype, datamodel=datamodel)
        return cgutils.alloca_once(self.builder, lltype, name=name, zfill=False)

    def lower_assign(self, ty: Any, inst: Any) -> Any:
        # A function that is called is reached by its name.
        if isinstance(ty, types.Dispatcher) and isinstance(inst.value, (ir.Global, ir.FreeVar)):
            return self.context.get_dummy_value()
        if isinstance(inst.value, ir.Arg) and self._owns_memory(ty) and self._is_borrowed(inst.target.name):
            kind = self.typeof("arg." + inst.value.name)
            return self.context.cast(self.builder, self.fnargs[inst.value.index], kind, ty)
        return super().lower_assign(ty, inst)

    def lower_binop(self, resty: Any, expr: Any, op: Any) -> Any:
        if expr.static_lhs is not ir.UNDEFINED or expr.static_rhs is not ir.UNDEFINED:
            return super().lower_binop(resty, expr, op)
        context, builder = self.context, self.builder
        function = context.typing_context.resolve_value_type(op)
        signature = self.fndesc.calltypes[expr]
        operands = [
            context.cast(builder, self.loadvar(side.name), self.typeof(side.name), kind)
            for side, kind in zip((expr.lhs, expr.rhs), signature.args, strict=True)
        ]
        found = function.get_call_type(context.typing_context, signature.args, {})
        result = context.get_function(function, found)(builder, operands)
        return context.cast(builder, result, signature.return_type, resty)

    def lower_getitem(self, resty: Any, expr: Any, value: Any, index: Any, signature: Any) -> Any:
        return super().lower_getitem(resty, expr, value, index, _counted_from_start(signature))

    def lower_setitem(self, target_var: Any, index_var: Any, value_var: Any, signature: Any) -> Any:
        return super().lower_setitem(target_var, index_var, value_var, _counted_from_start(signature))


def _counted_from_start(signature: Any) -> Any:
    """The signature of an access to a table, with indices of a kind that cannot be negative."""
    table, index = signature.args[:2]
    parts = getattr(index, "types", (index,))
    if not isinstance(table, types.Array) or any(part != types.int64 for part in parts):
        return signature
    unsigned = types.uint64 if index == types.int64 else containers.UniTuple(types.uint64, len(parts))
    return signature.replace(args=(table, unsigned, *signature.args[2:]))


@register_pass(mutates_CFG=True, analysis_only=False)
class LeanLowering(typed_passes.NativeLowering):
    """Numba's pass with the lowering above."""

    _name = "lean_lowering"

    @property
    def lowering_class(self) -> type[lowering.Lower]:
        return _LeanLower
