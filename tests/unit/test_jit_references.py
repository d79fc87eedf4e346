"""Arrays in kernels: what the caller holds is not counted again, and what a kernel hands on is counted as ever."""

import sys

import numpy as np
from numba import from_dtype, types
from numba.core.caching import NullCache

from avalanche_gym.physics.jit import entry_point, kernel
from avalanche_gym.physics.jit.intermediate import LinkedKernel
from avalanche_gym.physics.solver.response import clear
from avalanche_gym.physics.solver.workspace import NODE


@kernel
def longer(first, second):
    """One of its arguments."""
    return first if first.shape[0] > second.shape[0] else second


@kernel
def tail(values, count):
    """An argument that is given another value."""
    while values.shape[0] > count:
        values = values[1:]
    return values


@entry_point
def choose(first, second):
    return longer(first, second)


@entry_point
def end_of(values, count):
    return tail(values, count)


def test_tables_that_are_handed_on_are_not_counted():
    signature = (types.Array(from_dtype(NODE), 1, "C"), types.int64)
    linked = LinkedKernel(clear.py_func, NullCache(), clear.targetoptions)
    linked.get_call_template(signature, {})
    (version,) = linked._versions.values()
    assert "NRT_" not in str(version.library._final_module)


def test_what_a_kernel_returns_belongs_to_its_caller():
    first, second = np.zeros(3), np.arange(4.0)
    before = sys.getrefcount(first), sys.getrefcount(second)
    for _ in range(100):
        chosen = choose(first, second)
        assert chosen[3] == 3.0
        del chosen
    assert (sys.getrefcount(first), sys.getrefcount(second)) == before
    chosen = choose(np.zeros(3), np.arange(4.0))
    _ = [np.full(4, 7.0) for _ in range(100)]  # where it lay, had it been given back
    assert chosen.tolist() == [0.0, 1.0, 2.0, 3.0]


def test_an_argument_that_is_given_another_value_is_counted():
    values = np.arange(6.0)
    before = sys.getrefcount(values)
    for _ in range(100):
        rest = end_of(values, 2)
        assert rest.tolist() == [4.0, 5.0]
        del rest
    assert sys.getrefcount(values) == before
    rest = end_of(np.arange(6.0), 2)
    _ = [np.full(6, 7.0) for _ in range(100)]
    assert rest.tolist() == [4.0, 5.0]
