"""Samples of a floor that is flat but for noise are put into its plane; all other ground keeps its samples."""

import numpy as np
import pytest

from avalanche_gym import physics
from avalanche_gym.physics.shapes.flatness import FLAT_HEIGHT, flattened

CELL, SAMPLES = 0.25, 65
EXTENT = (CELL * (SAMPLES - 1), CELL * (SAMPLES - 1))
LINE = CELL * (np.arange(SAMPLES) - SAMPLES // 2)
X, Y = np.meshgrid(LINE, LINE)
PLANE = 0.1 * X - 0.07 * Y + 3.0


def noise(seed=0):
    return 1e-9 * np.random.default_rng(seed).normal(size=X.shape)


def test_a_noisy_plane_is_a_plane():
    found = flattened(PLANE + noise(), EXTENT)
    for axis in (0, 1):
        assert np.abs(np.diff(found, 2, axis=axis)).max() < 1e-14
    assert np.abs(found - PLANE).max() < 3e-10  # least squares over 4,225 samples


@pytest.mark.parametrize(
    "heights",
    [
        PLANE,
        0.15 * np.sin(1.3 * X) * np.cos(1.1 * Y),
        np.random.default_rng(0).normal(size=X.shape),
        np.maximum(PLANE, 3.0),
        1e-6 * (X**2 + Y**2) / 64.0,  # less bent from sample to sample than noise could be
    ],
    ids=["plane", "hills", "white", "crease", "bowl"],
)
def test_other_ground_keeps_its_samples(heights):
    assert np.abs(flattened(heights, EXTENT) - heights).max() < 1e-3 * FLAT_HEIGHT * EXTENT[0]


def test_planes_that_meet_are_planes_each():
    """But for the samples where they meet, which lie in both."""
    found = flattened(np.maximum(PLANE, 3.0) + noise(), EXTENT)
    for inside in (PLANE > 3.05, PLANE < 2.95):
        bends = np.abs(np.diff(found, 2, axis=1)) * inside[:, 1:-1]
        assert bends.max() < 1e-14


def test_the_foot_of_a_hill_does_not_spoil_the_floor():
    hill = 0.5 * np.exp(-0.5 * (X**2 + Y**2))
    found = flattened(hill + noise(), EXTENT)
    far = hill < 1e-12
    for axis in (0, 1):
        bends = np.abs(np.gradient(np.gradient(found, axis=axis), axis=axis))
        assert bends[far].max() < 1e-14
    assert np.abs(found - hill)[far].max() < 1e-9
    assert np.abs(found - hill).max() < 2.0 * FLAT_HEIGHT * EXTENT[0]


def test_each_world_is_flattened_alone():
    both = np.stack([PLANE + noise(1), PLANE + noise(2)])
    found = flattened(both, EXTENT)
    for heights, alone in zip(found, both, strict=True):
        np.testing.assert_array_equal(heights, flattened(alone, EXTENT))


@pytest.mark.parametrize("surface", ["facets", "smooth"])
def test_heights_given_later_are_flattened_as_well(surface):
    scene = physics.Scene()
    ground = scene.add_body(physics.HeightField(PLANE + noise(), EXTENT, surface=surface), motion="static")
    scene.add_body(physics.Sphere(0.1), mass=1.0, position=(0.0, 0.0, 5.0))
    world = physics.World(scene)
    first = world.heights(ground).copy()
    world.set_heights(ground, PLANE + noise())
    np.testing.assert_array_equal(world.heights(ground), first)
    assert np.abs(first - PLANE).max() < 3e-10
