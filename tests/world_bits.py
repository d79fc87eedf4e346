"""Worlds as bytes: two that are equal here are equal to the last bit."""

from __future__ import annotations

from avalanche_gym import physics

PUBLIC = ("position", "orientation", "linear_velocity", "angular_velocity")


def state_bits(world: physics.World, lane: int | None = None) -> list[bytes]:
    """The public arrays of a world, or of one of several."""
    lanes = slice(None) if lane is None else slice(lane, lane + 1)
    return [getattr(world, name)[lanes].tobytes() for name in PUBLIC]


def bits(world: physics.World, lane: int | None = None) -> list[bytes]:
    """These, and the contacts."""
    lanes = range(world.num_worlds) if lane is None else [lane]
    return state_bits(world, lane) + [world.contacts(world=number).tobytes() for number in lanes]
