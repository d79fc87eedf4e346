"""PlanetLanding: from orbit, land upright and softly on a small planet."""

from .env import PlanetLandingEnv, PlanetLandingTask, PlanetLandingVectorEnv

__all__ = ["PlanetLandingEnv", "PlanetLandingTask", "PlanetLandingVectorEnv"]
