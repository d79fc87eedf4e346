"""Small islands in a crowd: what strikes ends as near to the truth by the pile tier, what lasts stays exact."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from avalanche_gym import physics
from avalanche_gym.physics.scenes.piles import pile

TIME_STEP, SMALL = 1 / 60, 64
PAIRS, APART = 12, 3.0


def pairs(numbers: range, speed: float, slide: float) -> physics.Scene:
    """Boxes on a floor; over each another one, turned, that falls on it with ``speed`` and slides with ``slide``."""
    scene = physics.Scene()
    scene.add_field(physics.UniformGravity((0.0, 0.0, -9.81)))
    scene.add_body(physics.Plane(), motion="static")
    for number in numbers:
        generator = np.random.default_rng(number)
        place = np.array([APART * number, 0.0, 0.1])
        scene.add_body(physics.Box((0.1, 0.1, 0.1)), mass=1.0, position=place)
        turn = generator.normal(size=4)
        turn = np.array([1.0, 0.0, 0.0, 0.0]) if speed == 0.0 else turn / np.linalg.norm(turn)
        over = place + np.array([0.0, 0.0, 0.2 if speed == 0.0 else 0.1 + 0.1 * np.sqrt(3.0)])
        across = slide * np.array([np.cos(number), np.sin(number), 0.0])
        scene.add_body(
            physics.Box((0.1, 0.1, 0.1)),
            mass=generator.uniform(0.5, 2.0),
            position=over,
            orientation=turn,
            linear_velocity=across - np.array([0.0, 0.0, speed]),
        )
    return scene


def step(
    scene: physics.Scene, steps: int, substeps: int = 1, events: bool = True
) -> tuple[NDArray[np.float64], list[str]]:
    """Places after the same time, in so many times smaller steps, and the tiers of the steps."""
    world = physics.World(scene, options=physics.Options(time_step=TIME_STEP / substeps, events=events, sleeping=False))
    tiers = []
    for _ in range(steps * substeps):
        world.step(1)
        tiers.append(world.report().tier[0])
    return world.position[0, 1:].copy(), tiers


def test_what_strikes_in_a_crowd_ends_as_near_as_by_the_exact_tier() -> None:
    crowd, tiers = step(pairs(range(PAIRS), 0.5, 1.0), 4)
    assert "pile" in tiers
    alone, exact = [], []
    for number in range(PAIRS):
        scene = pairs(range(number, number + 1), 0.5, 1.0)
        alone.append(step(scene, 4, events=False)[0])
        exact.append(step(scene, 4, SMALL)[0])
    # Of order 1 in the step both, but the pile tier steps on from the substep in which something is stopped.
    errors = [np.linalg.norm(places - np.concatenate(exact), axis=1) for places in (crowd, np.concatenate(alone))]
    assert errors[0].mean() <= errors[1].mean()


def test_what_lasts_in_a_crowd_is_solved_exactly() -> None:
    # In the fourth step the first ones tip over the edge, and something closes.
    crowd, tiers = step(pairs(range(PAIRS), 0.0, 1.0), 3)
    assert "pile" not in tiers
    alone = [step(pairs(range(number, number + 1), 0.0, 1.0), 3)[0] for number in range(PAIRS)]
    assert np.abs(crowd - np.concatenate(alone)).max() < 1e-12


def test_a_heap_does_not_sink_into_itself() -> None:
    # Half sizes of 0.03 to 0.06 m. Loads of contacts that tremble apart were forgotten each step: 7 mm.
    world = physics.World(pile(300), options=physics.Options(time_step=TIME_STEP))
    world.step(120)
    for _ in range(48):
        world.step(5)
        depth = np.maximum(-world.contacts()["gap"], 0.0)
        assert np.percentile(depth, 99) <= 1e-3 and depth.max() <= 3e-3
