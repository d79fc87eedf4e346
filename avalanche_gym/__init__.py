"""Reinforcement-learning environments on a fast and accurate rigid-body engine.

Importing this package registers the environments; ``avalanche_gym.physics`` is the engine by itself.
"""

from .envs.registration import register_all

__version__ = "0.1.0"

register_all()
