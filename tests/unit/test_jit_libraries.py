"""What LLVM is told of the code that is run: who calls a kernel, and from where its indices count."""

import ast
from pathlib import Path

import llvmlite.binding as llvm
import numba
import numpy as np

from avalanche_gym.physics.jit import kernel, stamps
from avalanche_gym.physics.jit.passes import LeanCompiler


def compiled(function):
    """As an entry point is compiled, without a cache."""
    return numba.njit(error_model="numpy", no_cfunc_wrapper=True, pipeline_class=LeanCompiler)(function)


@kernel
def total_from(table, first):
    total = 0.0
    for index in range(first, len(table)):
        total += table[index] * table[index - first] + table[first] ** 0.3
    return total


def test_only_what_python_calls_is_open_to_others():
    """All kernels belong to the code that contains them: LLVM may change how they are called."""

    @compiled
    def run(table):
        return total_from(table, 1) + total_from(table, 2) * total_from(table, 3)

    table = np.arange(5.0)
    assert run(table) == sum(total_from(table, n) * f for n, f in ((1, 1.0), (2, total_from(table, 3))))
    (version,) = run.overloads.values()
    defined = [function for function in version.library._final_module.functions if not function.is_declaration]
    shared = [function.name for function in defined if function.linkage == llvm.Linkage.linkonce_odr]
    assert defined and shared == []


def test_indices_count_from_the_start():
    """One below 0 is what lies before a table, here the rest of a larger one; Numba would count from the end."""

    @compiled
    def read(table, index):
        return table[index]

    @compiled
    def write(table, row, column, value):
        table[row, column] = value

    numbers = np.arange(6.0)
    assert read(numbers[2:], 1) == 3.0 and read(numbers[2:], -1) == 1.0
    grid = np.zeros((4, 2))
    write(grid[2:], -1, 1, 7.0)
    assert grid[1, 1] == 7.0 and grid.sum() == 7.0


def test_no_kernel_counts_from_the_end():
    found = []
    for path in Path(stamps.PACKAGE_ROOT).rglob("*.py"):
        for function in ast.walk(ast.parse(path.read_text())):
            names = {ast.unparse(d) for d in getattr(function, "decorator_list", ())}
            if not names & {"kernel", "stage", "entry_point"}:
                continue
            for node in ast.walk(function):
                if isinstance(node, ast.Subscript) and any(
                    isinstance(part, ast.UnaryOp) and isinstance(part.op, ast.USub) for part in ast.walk(node.slice)
                ):
                    found.append(f"{path.name}:{node.lineno}: {ast.unparse(node)}")
    assert found == []
