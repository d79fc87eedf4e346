"""What the tests of environments share: the ids, and a policy each that solves level easy."""

from __future__ import annotations

import gymnasium
import numpy as np

IDS = ("avalanche/PushTerrain-v0", "avalanche/PlanetLanding-v0")
LEVELS = ("easy", "medium", "hard")
LANES = 40  # of a vector environment in which policies are judged


def started(task, seed=0):
    """The task with its lanes seeded by seed, seed + 1 ..., and an episode begun in each."""
    task.generators = [np.random.default_rng(seed + lane) for lane in range(task.num_envs)]
    task.reset(task.every_lane)
    return task


def landing_policy(observation: np.ndarray) -> np.ndarray:
    """Actions (n, 4) that brake, come down and land: a PD controller on observations (n, 21) of PlanetLanding."""
    altitude, climb, horizontal = 5.0 * observation[:, 0], 4.0 * observation[:, 1], 4.0 * observation[:, 2]
    velocity, up, spin = 4.0 * observation[:, 3:6], observation[:, 6:9], observation[:, 9:12]
    radius = 20.5 + altitude
    # Acceleration asked for: against the horizontal velocity, and a descent that slows down towards the ground.
    sideways = climb[:, None] * up - velocity
    sideways *= np.minimum(1.0, 1.2 / np.maximum(np.linalg.norm(sideways, axis=1, keepdims=True), 1e-9))
    weight = 400.0 / radius**2 - horizontal**2 / radius
    lift = np.clip(weight + 1.5 * (-np.clip(0.35 * altitude, 0.25, 1.2) - climb), 0.25, 2.2)
    wanted = sideways + lift[:, None] * up
    axis = wanted / np.linalg.norm(wanted, axis=1, keepdims=True)
    push = np.where(axis[:, 2] > 0.7, np.clip(wanted[:, 2], 0.0, 2.5), 0.0)
    # Turn the body axis, z, towards the wanted one: along z x axis.
    turn = 2.0 * np.stack([-axis[:, 1], axis[:, 0], np.zeros(len(axis))], axis=1) - 1.5 * spin
    landed = observation[:, 17] > 0.5
    push[landed] = 0.0
    turn[landed] = 0.0
    return np.clip(np.concatenate([2.0 * push[:, None] / 2.5 - 1.0, turn], axis=1), -1.0, 1.0).astype(np.float32)


def pushing_policy(observation: np.ndarray) -> np.ndarray:
    """Actions (n, 2) that push the body to the goal: a PD controller on observations (n, 47) of PushTerrain."""
    pusher, velocity = observation[:, 0:2], observation[:, 3:5]
    to_goal, direction, body_velocity = observation[:, 6:8], observation[:, 8:10], observation[:, 10:12]
    distance = np.linalg.norm(to_goal, axis=1, keepdims=True)
    side = np.stack([-direction[:, 1], direction[:, 0]], axis=1)
    along = (pusher * direction).sum(axis=1, keepdims=True)
    off = (pusher * side).sum(axis=1, keepdims=True)
    # Behind the body and in line: push towards the goal; otherwise go round to the point behind it.
    pushing = (along < -0.2) & (np.abs(off) < 0.12)
    speed = np.clip(1.5 * distance, 0.2, 0.8)
    push = speed * direction - 4.0 * off * side
    around = np.where(along > -0.3, 0.5 * np.sign(off + 1e-9) - off, -off)
    walk = 2.0 * (-0.5 - along) * direction + 2.0 * np.where(along > -0.25, around, -off) * side
    wanted = np.where(pushing, push, walk)
    wanted = np.where(distance < 0.2, -direction, wanted)
    del body_velocity
    return np.clip(5.0 * (wanted - velocity), -1.0, 1.0).astype(np.float32)


def success_rate(env_id, policy, level="easy", seed=0):
    """Share of the first episodes of LANES lanes that succeed."""
    env = gymnasium.make_vec(env_id, num_envs=LANES, level=level)
    rows, _ = env.reset(seed=seed)
    running, won = np.ones(LANES, bool), np.zeros(LANES, bool)
    while running.any():
        rows, _, terminated, truncated, infos = env.step(policy(rows))
        won |= running & infos["is_success"]
        running &= ~(terminated | truncated)
    return won.mean()
