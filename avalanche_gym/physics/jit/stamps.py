"""The stamp of a compiled function: which source it was made from.

Numba's own cache asks only whether the file *of that function* has changed, so an edit to a file it calls into goes
unnoticed and the old machine code runs on. Here the stamp of a function is a hash over its file and every file of this
package that its file imports, directly or not. An edit invalidates what depends on it, and nothing else.
"""

from __future__ import annotations

import hashlib
import os
import re
from functools import cache
from pathlib import Path

PACKAGE_ROOT = Path(__file__).resolve().parent.parent.parent

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
def resolved(path: str) -> Path:
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
