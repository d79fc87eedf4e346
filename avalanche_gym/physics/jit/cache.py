"""Where compiled code is kept, and until when: a cache that is never stale (stamps.py).

A folder holds the machine code of what Python calls and of the stages, and beside it what their callers link of the
kernels (intermediate.py), so that an edit compiles no more than what depends on it.
"""

from __future__ import annotations

import hashlib
import os
import sys
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

from numba.core import caching

from .intermediate import IntermediateCodec
from .stamps import PACKAGE_ROOT, resolved, source_stamp


@cache
def cache_directory() -> Path:
    """Folder of the compiled code: the first of these that can be written.

    ``NUMBA_CACHE_DIR``, ``__pycache__`` beside the package, the user's cache folder, a temporary folder.
    """
    choices = [PACKAGE_ROOT / "__pycache__" / "kernels"]
    if os.environ.get("NUMBA_CACHE_DIR"):
        # Absolute: the process may change its folder while it compiles.
        choices.insert(0, Path(os.environ["NUMBA_CACHE_DIR"]).absolute())
    # A process may have no home: one of a container whose user has a number and no name.
    users = os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")
    if os.path.isabs(users):
        choices.append(Path(users) / "avalanche_gym")
    for choice in choices:
        try:
            choice.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryFile(dir=choice):
                return choice
        except OSError:
            continue
    return Path(tempfile.mkdtemp(prefix="avalanche_gym-"))


class _Locator(caching._CacheLocator):
    """Where a function's compiled code lies, and the stamp that decides whether it still holds."""

    def __init__(self, py_func: Any, py_file: str) -> None:
        self._path = Path(py_file)
        self._line = py_func.__code__.co_firstlineno

    def get_cache_path(self) -> str:
        return str(cache_directory())

    def get_source_stamp(self) -> str:
        return source_stamp(self._path)

    def get_disambiguator(self) -> str:
        return f"{hashlib.sha256(str(self._path).encode()).hexdigest()[:8]}-{self._line}"

    @classmethod
    def from_function(cls, py_func: Any, py_file: str) -> _Locator:
        return cls(py_func, str(resolved(py_file)))


class _MachineCodec(caching.CompileResultCacheImpl):
    _locator_classes = [_Locator]


class _LinkedCodec(IntermediateCodec):
    _locator_classes = [_Locator]

    def get_filename_base(self, fullname: str, abiflags: str) -> str:
        # A kernel that Python calls too, as tests do, has files of both kinds.
        return str(super().get_filename_base(fullname, abiflags)) + ".linked"


class MachineCache(caching.FunctionCache):
    """Of functions that are run."""

    _impl_class = _MachineCodec


class LinkedCache(caching.FunctionCache):
    """Of kernels, as their callers link them."""

    _impl_class = _LinkedCodec


class AnnouncedCache(MachineCache):
    """Says on stderr that compilation is under way, once a process and only if there is something to compile."""

    announced = False

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        overload = super().load_overload(sig, target_context)
        if overload is None and not AnnouncedCache.announced:
            AnnouncedCache.announced = True
            print(
                f"avalanche_gym: compiling the engine (once; kept in {cache_directory()}), up to a minute ...",
                file=sys.stderr,
                flush=True,
            )
        return overload


class LateCache:
    """A cache that is opened when it is first asked. Most kernels never are: they are part of what calls them, and that
    is loaded whole. Opening all of them took a third of a warm start.
    """

    def __init__(self, function: Callable[..., Any], kind: type[caching.FunctionCache]) -> None:
        self._function = function
        self._kind = kind
        # Of what is imported now, not of what an editor makes of it until then.
        source_stamp(resolved(function.__code__.co_filename))

    def __getattr__(self, name: str) -> Any:
        opened = self._kind(self._function)
        self.__dict__.update(load_overload=opened.load_overload, save_overload=opened.save_overload, opened=opened)
        return getattr(opened, name)
