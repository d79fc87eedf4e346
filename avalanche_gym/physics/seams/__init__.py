"""Seams between pieces of ground: contacts that one static shape hides of another are left out."""

from .stage import cross_seams, hide_seams

__all__ = ["cross_seams", "hide_seams"]
