"""Adapters: the same scenes in other engines, each set up as its experts would."""

from __future__ import annotations

from importlib import import_module

from .engine import Engine, Simulation, Unsupported
from .ours import engine as our_engine
from .recording import record

PEERS = ("mujoco_engine", "pybullet_engine", "rapier_engine")


def all_engines() -> tuple[list[Engine], dict[str, str]]:
    """Ours first, then every peer that is installed; and why the others are missing."""
    found, missing = [our_engine()], {}
    for name in PEERS:
        try:
            found += import_module(f"{__name__}.{name}").engines()
        except ImportError as error:
            missing[name.removesuffix("_engine")] = str(error)
    return found, missing


__all__ = ["Engine", "Simulation", "Unsupported", "all_engines", "our_engine", "record"]
