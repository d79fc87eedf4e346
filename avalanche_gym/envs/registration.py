"""The ids of the environments. Their code is imported when one is made."""

from __future__ import annotations

import gymnasium

# Name and steps of an episode, as in each environment's docstring.
ENVIRONMENTS = {"PushTerrain": ("push_terrain", 300), "PlanetLanding": ("planet_landing", 300)}


def register_all() -> None:
    """Register ``avalanche/<Name>-v0``; a second call changes nothing."""
    for name, (folder, steps) in ENVIRONMENTS.items():
        id = f"avalanche/{name}-v0"
        if id not in gymnasium.registry:
            gymnasium.register(
                id=id,
                entry_point=f"avalanche_gym.envs.{folder}:{name}Env",
                vector_entry_point=f"avalanche_gym.envs.{folder}:{name}VectorEnv",
                max_episode_steps=steps,
            )
