"""Concave bodies dropped at random: they come to rest, and never dip into what they meet."""

import pytest

from benchmarks.drops import GROUNDS, RATE, SHAPES, Depths, drop, run

MIXED = ["rabbit", "torus", "gear", "nut"] * 2


def deepest_of_heap(on: str, seed: int, steps: int) -> tuple[float, float]:
    """[m] by the report and by all points, over these steps."""
    world = drop(MIXED, on, seed)
    depths = Depths(world, MIXED, on)
    reported = measured = 0.0
    for _ in range(steps):
        world.step(1)
        reported = max(reported, float(world.report().penetration[0]))
        measured = max(measured, depths.deepest()[0])
    return reported, measured


def test_a_heap_that_falls_on_a_plane_does_not_overlap() -> None:
    """Tubes on rims of holes, teeth in nuts, vertices that slide over concave bends."""
    reported, measured = deepest_of_heap("plane", 1, 160)
    assert max(reported, measured) < 1e-4


@pytest.mark.verify
@pytest.mark.parametrize("on", GROUNDS)
def test_heaps_do_not_overlap(on: str) -> None:
    for seed in range(2):
        assert max(deepest_of_heap(on, seed, round(1.6 * RATE))) < 3e-5


@pytest.mark.verify
@pytest.mark.parametrize("on", GROUNDS)
@pytest.mark.parametrize("name", SHAPES)
def test_drops_come_to_rest(name: str, on: str) -> None:
    """But for what spins on a single point: rolling friction does not stop that."""
    for seed in range(4):
        slept, _, _, braked, reported, _ = run([name], on, seed, 20.0, look=False)
        assert slept < 20.0 or braked < 1e-5
        assert reported < 1e-4
