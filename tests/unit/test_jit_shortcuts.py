"""What surrounds a compilation: Numba is put back as it was, and an answer that is remembered is the one it gave."""

import gc
import operator

import pytest
from numba.core import errors, types
from numba.core.registry import cpu_target
from numba.core.types import functions

from avalanche_gym.physics.jit.shortcuts import compiling

ARGUMENTS = [
    (types.float64, types.float64),
    (types.int64, types.literal(1)),
    (types.Array(types.float64, 2, "C"), types.UniTuple(types.int64, 2)),
]


@compiling()
def _fail(before):
    with compiling():
        assert not gc.isenabled()
    assert not gc.isenabled()
    assert functions.BaseFunction.get_call_type is not before
    raise ValueError


def test_numba_is_put_back_also_after_a_failure():
    before = functions.BaseFunction.get_call_type, errors._termcolor_inst
    with pytest.raises(ValueError):
        _fail(before[0])
    assert gc.isenabled()
    assert (functions.BaseFunction.get_call_type, errors._termcolor_inst) == before


@pytest.mark.parametrize("operation", [operator.add, operator.getitem])
def test_a_question_asked_twice_has_one_answer(operation):
    context = cpu_target.typing_context
    context.refresh()
    function = context.resolve_value_type(operation)
    for arguments in ARGUMENTS[2:] if operation is operator.getitem else ARGUMENTS[:2]:
        given = function.get_call_type(context, arguments, {})
        key = function.get_impl_key(given)
        with compiling():
            for _ in range(2):
                answer = function.get_call_type(context, arguments, {})
                assert answer == given and function.get_impl_key(answer) == key
