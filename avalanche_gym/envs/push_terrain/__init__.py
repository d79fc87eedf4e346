"""PushTerrain: push a box across concave terrain into a goal."""

from .env import PushTerrainEnv, PushTerrainTask, PushTerrainVectorEnv

__all__ = ["PushTerrainEnv", "PushTerrainTask", "PushTerrainVectorEnv"]
