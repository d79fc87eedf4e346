"""Sleep."""

from __future__ import annotations


def forget(storage, mask):
    """Rest state of the selected worlds as in the beginning."""
    rest = storage.arrays["rest"]
    barred = rest["barred"][mask]
    rest[mask] = 0
    rest["barred"][mask] = barred
