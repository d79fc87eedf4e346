"""Numba loaded without SciPy's linear algebra.

When it loads, Numba looks whether BLAS is there, by importing ``scipy.linalg``: a third of a second at every start, for
functions that no kernel here uses. The answer is put off: it is given from what is installed, and Numba itself imports
BLAS when a user's own function calls for it.
"""

from __future__ import annotations

import importlib.util
import sys

BLAS = "scipy.linalg.cython_blas"


def load_numba() -> None:
    """Import the part of Numba that asks for BLAS, unless that or SciPy's linear algebra is loaded already."""
    if "numba.np.arraymath" in sys.modules or "scipy.linalg" in sys.modules:
        return
    sys.modules[BLAS] = None  # type: ignore[assignment]  # imports of it fail at once, and are taken for an answer
    try:
        from numba.np import arraymath
    finally:
        del sys.modules[BLAS]
    if hasattr(arraymath, "_HAVE_BLAS"):
        arraymath._HAVE_BLAS = importlib.util.find_spec("scipy") is not None
