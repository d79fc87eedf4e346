"""Compilation: the decorators of every compiled function, and a cache of their code that is never stale."""

from .cache import cache_directory
from .decorators import Stage, call_stage, entry_point, kernel, stage
from .stamps import source_stamp

__all__ = ["Stage", "cache_directory", "call_stage", "entry_point", "kernel", "source_stamp", "stage"]
