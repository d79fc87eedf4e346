"""The two decorators of every compiled function, and a cache that is never stale.

Numba's own cache asks only whether the file *of that function* has changed, so an edit to a file it calls into goes
unnoticed and the old machine code runs on. Here the stamp of a function is a hash over its file and every file of this
package that its file imports, directly or not. An edit invalidates what depends on it, and nothing else.

* ``kernel``: functions called from other compiled code.
* ``entry_point``: functions called from Python. The first compilation of a process that finds no cached code says so in
  one line on stderr.
* ``stage``: functions called from compiled code through their address, with integers as arguments. The caller does not
  contain them, so each is compiled once, and only if a scene needs it. (A kernel is optimised anew in each caller: a
  chain of seven kernels around the box-box test compiled that test seven times.)

Neither uses ``fastmath``: lanes of a batch must agree bit for bit, and NaN must stay visible to ``isnan``.
"""

from __future__ import annotations

import hashlib
import os
import re
import sys
import tempfile
import time
from collections.abc import Callable
from functools import cache, cached_property
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
from llvmlite import ir
from numba import types
from numba.core import caching, ccallback, cgutils
from numba.extending import intrinsic

PACKAGE_ROOT = Path(__file__).resolve().parent.parent
PACKAGE = PACKAGE_ROOT.name

Function = TypeVar("Function", bound=Callable[..., Any])

_IMPORT = re.compile(
    r"^[ \t]*(?:from[ \t]+([.\w]+)[ \t]+import[ \t]+(\([^)]*\)|[^\n]*)|import[ \t]+([^\n]*))", re.MULTILINE
)


def _names(text: str) -> list[str]:
    """The names in the part of an import statement behind ``import``."""
    text = re.sub(r"#[^\n]*", "", text).strip("() \t\r")
    return [name.split(" as ")[0].strip() for name in text.split(",") if name.strip()]


@cache
def _python_files(root: Path) -> frozenset[str]:
    """Every Python file below a folder."""
    found = []
    for folder, folders, names in os.walk(root):
        folders[:] = [name for name in folders if name != "__pycache__"]
        found += [os.path.join(folder, name) for name in names if name.endswith(".py")]
    return frozenset(found)


@cache
def _scan(path: str) -> tuple[bytes, tuple[str, ...]]:
    """Hash of the file at ``path``, and the files of this package that its import statements name.

    In plain strings: it runs at every start, over every file.
    """
    parent = str(PACKAGE_ROOT.parent)
    found = []
    with open(path, "rb") as file:
        content = file.read()
    for source, names, plain in _IMPORT.findall(content.decode("utf-8")):
        module = source.lstrip(".")
        if plain:
            modules = [os.path.join(parent, *name.split(".")) for name in _names(plain)]
        else:
            base = parent
            if len(source) > len(module):
                base = path
                for _ in range(len(source) - len(module)):
                    base = os.path.dirname(base)
            if module:
                base = os.path.join(base, *module.split("."))
            modules = [base, *(os.path.join(base, name) for name in _names(names))]
        for candidate in modules:
            found += [candidate + ".py", os.path.join(candidate, "__init__.py")]
    files = _python_files(PACKAGE_ROOT)
    return hashlib.sha256(content).digest(), tuple(dict.fromkeys(file for file in found if file in files))


@cache
def _resolved(path: str) -> Path:
    return Path(path).resolve()


@cache
def source_stamp(path: Path) -> str:
    """Hash [hex] over the file at ``path`` and every file of the package it depends on."""
    seen: set[str] = set()
    waiting = [str(path)]
    while waiting:
        file = waiting.pop()
        if file not in seen:
            seen.add(file)
            waiting.extend(_scan(file)[1])
    digest = hashlib.sha256()
    for file in sorted(seen):
        digest.update(os.path.basename(file).encode())
        digest.update(_scan(file)[0])
    return digest.hexdigest()


@cache
def cache_directory() -> Path:
    """Folder of the compiled code: the first of these that can be written.

    ``NUMBA_CACHE_DIR``, ``__pycache__`` beside the package, the user's cache folder, a temporary folder.
    """
    choices = [PACKAGE_ROOT / "__pycache__" / "kernels"]
    if os.environ.get("NUMBA_CACHE_DIR"):
        choices.insert(0, Path(os.environ["NUMBA_CACHE_DIR"]))
    choices.append(Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "avalanche_gym")
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
        return cls(py_func, str(_resolved(py_file)))


class _CacheImplementation(caching.CompileResultCacheImpl):
    _locator_classes = [_Locator]


class _Cache(caching.FunctionCache):
    _impl_class = _CacheImplementation


class _AnnouncedCache(_Cache):
    """Says on stderr that compilation is under way, once a process and only if there is something to compile."""

    announced = False

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        overload = super().load_overload(sig, target_context)
        if overload is None and not _AnnouncedCache.announced:
            _AnnouncedCache.announced = True
            print(
                f"avalanche_gym: compiling the engine (once; kept in {cache_directory()}), up to a minute ...",
                file=sys.stderr,
                flush=True,
            )
            self._started = time.perf_counter()
        return overload

    def save_overload(self, sig: Any, data: Any) -> None:
        super().save_overload(sig, data)
        if hasattr(self, "_started"):
            print(
                f"avalanche_gym: compiled in {time.perf_counter() - self._started:.0f} s", file=sys.stderr, flush=True
            )
            del self._started


class _LateCache:
    """A cache that is opened when it is first asked. Most kernels never are: they are part of what calls them, and that
    is loaded whole. Opening all of them took a third of a warm start.
    """

    def __init__(self, function: Function, kind: type[_Cache]) -> None:
        self._function = function
        self._kind = kind
        # Of what is imported now, not of what an editor makes of it until then.
        source_stamp(_resolved(function.__code__.co_filename))

    def __getattr__(self, name: str) -> Any:
        opened = self._kind(self._function)
        self.__dict__.update(load_overload=opened.load_overload, save_overload=opened.save_overload, opened=opened)
        return getattr(opened, name)


def _compiled(function: Function, cache: type[_Cache]) -> Function:
    dispatcher: Any = numba.njit(error_model="numpy", nogil=True, no_cfunc_wrapper=True)(function)
    # Enabling a cache of our own is what ``cache=True`` does, with another locator.
    dispatcher._cache = _LateCache(function, cache)
    # Numba compiles a function anew for every constant that is written in a call of it: f(x, 0) and f(x, 1) are two
    # functions, beside f(x, n). No kernel needs that, and it doubled the time to compile the engine.
    resolve = dispatcher.get_call_template

    def resolve_without_constants(arguments: Any, keywords: Any) -> Any:
        plain = {name: types.unliteral(kind) for name, kind in keywords.items()}
        return resolve(tuple(types.unliteral(kind) for kind in arguments), plain)

    dispatcher.get_call_template = resolve_without_constants
    return cast(Function, dispatcher)


def kernel(function: Function) -> Function:
    """Compile a function that other compiled functions call."""
    return _compiled(function, _Cache)


class Stage:
    """A compiled function that other compiled code reaches by its address; compiled when that is first asked for."""

    def __init__(self, function: Callable[..., int]) -> None:
        self._function = function
        self.__doc__ = function.__doc__
        self.__wrapped__ = function

    @cached_property
    def address(self) -> int:
        """Of the machine code, for ``call_stage``."""
        arguments = self._function.__code__.co_argcount
        signature = types.int64(*[types.int64] * arguments)
        compiled: Any = ccallback.CFunc(
            self._function, (signature.args, signature.return_type), locals={}, options={"error_model": "numpy"}
        )
        compiled._cache = _AnnouncedCache(self._function)
        compiled.compile()
        self._compiled = compiled  # owns the machine code
        return int(compiled.address)


def stage(function: Callable[..., int]) -> Stage:
    """A function of int64 arguments and result that compiled code calls through its address."""
    return Stage(function)


@intrinsic
def call_stage(typing_context, address, *arguments):
    """Call the stage at an address [int64] with int64 arguments; returns its int64."""
    count = len(arguments[0]) if len(arguments) == 1 and isinstance(arguments[0], types.BaseTuple) else len(arguments)
    signature = types.int64(types.int64, types.StarArgTuple([types.int64] * count))

    def codegen(context, builder, signature, values):
        word = context.get_value_type(types.int64)
        function = builder.inttoptr(values[0], ir.FunctionType(word, [word] * count).as_pointer())
        return builder.call(function, cgutils.unpack_tuple(builder, values[1], count))

    return signature, codegen


def entry_point(function: Function) -> Function:
    """Compile a function that Python calls."""
    return _compiled(function, _AnnouncedCache)
