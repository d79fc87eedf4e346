"""Contacts with a rough smooth surface against the search of oracles/smooth_oracle.py."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from avalanche_gym.physics.model import CAPSULE, SPHERE
from tests.oracles import smooth_oracle as oracle
from tests.oracles.terrain_oracle import IDENTITY, rotation_matrix

EXTENT = (2.0, 1.6)
MARGIN = 0.05


@st.composite
def terrains(draw):
    """Random samples, a generator, and the spline through them."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    heights = draw(st.sampled_from([0.02, 0.1, 0.3])) * rng.normal(size=(7, 8))
    return heights, rng, oracle.smooth_terrain(heights, EXTENT)


def place_over(heights, rng, height):
    x, y = rng.uniform(-0.4, 0.4, 2) * EXTENT
    return np.array([x, y, oracle.spline_height(heights, EXTENT, x, y) + height])


@settings(max_examples=40, deadline=None)
@given(terrain=terrains(), radius=st.sampled_from([0.01, 0.1, 0.4]), height=st.floats(0.0, 0.4))
def test_smallest_gap_of_a_sphere_is_the_distance(terrain, radius, height):
    heights, rng, tables = terrain
    center = place_over(heights, rng, height)
    expected = oracle.nearest_distance(heights, EXTENT, center) - radius
    contacts = oracle.rounded_contacts(SPHERE, center, IDENTITY, (radius, 0.0, 0.0), tables, MARGIN)
    if expected <= MARGIN - 1e-6:
        assert contacts["gap"].min() == pytest.approx(expected, abs=1e-7)
    elif len(contacts):
        assert contacts["gap"].min() > MARGIN - 2e-6


@settings(max_examples=25, deadline=None)
@given(terrain=terrains(), tilt=st.floats(-0.5, 0.5), height=st.floats(0.0, 0.15))
def test_smallest_gap_of_a_capsule_is_that_of_the_nearest_ball_on_its_axis(terrain, tilt, height):
    heights, rng, tables = terrain
    center = place_over(heights, rng, 0.1 + height)
    rotation = rotation_matrix((0.0, np.pi / 2 + tilt, 0.0))
    contacts = oracle.rounded_contacts(CAPSULE, center, rotation, (0.1, 0.3, 0.0), tables, MARGIN)
    axis = np.reshape(rotation, (3, 3))[:, 2]
    balls = [
        oracle.rounded_contacts(SPHERE, center + t * axis, IDENTITY, (0.1, 0.0, 0.0), tables, MARGIN)["gap"]
        for t in np.linspace(-0.3, 0.3, 61)
    ]
    lowest = min((gaps.min() for gaps in balls if len(gaps)), default=np.inf)
    own = contacts["gap"].min() if len(contacts) else np.inf
    # Unless it has sunk in deep. What seeds half a cell apart can miss is below 3 % of the relief.
    if -0.02 < lowest < MARGIN - 1e-3:
        assert lowest - 0.01 <= own <= lowest + 0.03 * np.ptp(heights)


@settings(max_examples=40, deadline=None)
@given(terrain=terrains(), height=st.floats(-0.1, 0.3))
def test_contacts_of_a_box_are_sound(terrain, height):
    """The end of each gap on the box belongs to the box, the other one to the surface."""
    heights, rng, tables = terrain
    center = place_over(heights, rng, height) * (0.6, 0.6, 1.0)
    size = (0.25, 0.2, 0.12)
    rotation = rotation_matrix(rng.normal(size=3))
    for contact in oracle.box_contacts(center, rotation, size, tables, MARGIN):
        assert np.linalg.norm(contact["normal"]) == pytest.approx(1.0, abs=1e-12)
        assert contact["gap"] <= MARGIN
        on_box = contact["position"] - 0.5 * contact["gap"] * contact["normal"]
        local = (on_box - center) @ np.reshape(rotation, (3, 3))
        assert (np.abs(local) <= np.array(size) + 1e-9).all()
        foot = contact["position"] + 0.5 * contact["gap"] * contact["normal"]
        if contact["normal"][2] != 0.0:
            assert foot[2] == pytest.approx(float(oracle.spline_height(heights, EXTENT, *foot[:2])), abs=1e-8)
