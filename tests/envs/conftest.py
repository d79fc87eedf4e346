"""Environments are registered by importing the package."""

import avalanche_gym  # noqa: F401
